/* How warm a heater tube is by what it was given: one observer a channel. No board calls.
 *
 * rise' = gain duty/255 - rise/cooling, in whole numbers every THERMAL_STEP_MS, so that the host can
 * say the same to the last digit (src/muscle_bayes/bench/heat/heat_model.py). It answers two questions: how
 * hot may the tube be, whatever its sensor says (`most`); and how much has the sensor to show (`least`,
 * compared as the rise above a mean over the last THERMAL_MEAN_STEPS, and above what it showed of the
 * cold tube). */
#ifndef THERMAL_H
#define THERMAL_H

#include <stdbool.h>
#include <stdint.h>

#define THERMAL_STEP_MS 20
#define THERMAL_MEAN_STEPS 1500     /* 30 s */
#define THERMAL_TENTH 104858L       /* of the states below in 0.1 C: 2^20 a degree */

struct tube {
    uint16_t gain;                  /* rate at full duty, 0.01 C/s; 0: not calibrated */
    uint16_t cooling;               /* time constant, 0.1 s */
};

struct thermal {
    int32_t most;                   /* rise above the room that the tube has at most */
    int32_t least, least_mean;      /* rise that the tube has at least, and its mean */
    int32_t shown, shown_mean;      /* what its sensor shows [C], and its mean */
    int32_t cold;                   /* what it showed, or would have shown, of the cold tube */
    uint16_t dose;                  /* sum of the step's duties, one a millisecond */
    uint8_t ms;                     /* of the step */
    bool seen;                      /* a temperature was reported */
};

/* A tube that may be this much warmer than the room [0.1 C]. */
void thermal_start(struct thermal *t, int16_t rise);

/* The sensor shows a temperature [0.1 C] that is not absurd. It can only raise `most`. */
void thermal_report(struct thermal *t, int16_t temperature);

/* One millisecond at a duty; true where a step ended and the states are new. */
bool thermal_tick(struct thermal *t, const struct tube *tube, uint8_t duty);

/* Whether the tube may be warmer than the room by more than a rise [0.1 C]. */
bool thermal_above(const struct thermal *t, int16_t rise);

/* A fan blows: the tube may be as much colder than the model as its sensor shows. */
void thermal_cooled(struct thermal *t);

/* Whether the heat model says that the sensor had to show `rise` [0.1 C] more than of late, or more than
 * of the cold tube, and it has not shown a third of what it should. */
bool thermal_unseen(const struct thermal *t, int16_t rise);

/* Whether two numbers may describe a tube. */
bool thermal_plausible(const struct tube *tube);

#endif
