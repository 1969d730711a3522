/* Limits that are compiled in. The host can tighten the first three (LIMIT), never loosen them. */
#ifndef LIMITS_H
#define LIMITS_H

#define LIMIT_DUTY 255               /* highest duty, of 255 */
#define LIMIT_RISE 900               /* highest rise above the room by the heat model, 0.1 C */
#define LIMIT_TEMPERATURE 1100       /* highest reported temperature, 0.1 C */

/* With the watchdog's 64 ms (+ 10 %) this stays under 0.5 s even if the firmware hangs just before. */
#define DEADMAN_MS 400

#define COOL_MARGIN 50               /* over-temperature, shown or modelled, ends this far below, 0.1 C */
#define ABSURD_LOW (-200)            /* no bench is colder, 0.1 C */
#define ABSURD_HIGH 2000             /* no heater tube is hotter, 0.1 C */

/* By so much the model's rise has to exceed its mean of late before the sensor must have shown a third. */
#define MUST_SHOW 150                /* 0.1 C */
#define COLD 20                      /* a tube that is warmer by no more than this is cold, 0.1 C */
#define ROOM 250                     /* a reported temperature above this is a rise, 0.1 C */

/* What a tube may be calibrated to. Before it is, heat counts by the largest two and has to show by the
 * smallest. */
#define TUBE_GAIN_LEAST 100          /* 0.01 C/s at full duty */
#define TUBE_GAIN_MOST 1000
#define TUBE_COOLING_LEAST 100       /* 0.1 s */
#define TUBE_COOLING_MOST 1000

/* That a tube was heated is remembered through a loss of power until it is this cold by the model. */
#define HOT_MARK 5                  /* rise, 0.1 C */
#define HOTTEST_ROOM 400            /* 0.1 C */

/* A board's own thermometer that has told nothing for so long while its tube is heated is lost. */
#define SENSED_WITHIN_MS 480

/* While the board holds an angle its potentiometer must not read what a broken or shorted wire makes of
 * it, nor jump: no rotor turns so far in a millisecond. What lasts is a fault. Counts. */
#define ANGLE_TOP 1023
#define ANGLE_END 8                 /* counts from an end within which a wire is broken or shorted */
#define ANGLE_JUMP 60
#define ANGLE_DOUBTED_MS 20

#endif
