/* Limits that are compiled in. The host can tighten the first three (LIMIT), never loosen them. */
#ifndef LIMITS_H
#define LIMITS_H

#define LIMIT_DUTY 255               /* highest duty, of 255 */
#define LIMIT_ON_MS 60000            /* balance of time above half power, ms */
#define LIMIT_TEMPERATURE 1100       /* highest reported temperature, 0.1 C */

/* With the watchdog's 64 ms (+ 10 %) this stays under 0.5 s even if the firmware hangs just before. */
#define DEADMAN_MS 400

#define HALF_DUTY 127                /* above this a channel counts as on at high power */
#define COOL_MARGIN 50               /* over-temperature ends this far below the limit, 0.1 C */
#define ABSURD_LOW (-200)            /* no bench is colder, 0.1 C */
#define ABSURD_HIGH 2000             /* no heater tube is hotter, 0.1 C */

/* A meter is stuck when it moves less than STUCK_CHANGE in STUCK_MS above half power. */
#define STUCK_MS 8000
#define STUCK_CHANGE 5               /* 0.1 C */

#endif
