/* Angle controller of an antagonistic joint: PI in integers, output split by sign (gains.h). */
#ifndef CONTROL_H
#define CONTROL_H

#include <stdbool.h>
#include <stdint.h>

#include "safety.h"

struct control {
    bool active;
    bool begun;                 /* the setpoint filter has a state */
    int16_t setpoint;           /* counts */
    int32_t reference;          /* filtered setpoint, 2^-16 counts */
    int32_t sum;                /* of the errors, one a period, 2^-8 counts */
    uint16_t wait_ms;           /* until the next period */
};

void control_stop(struct control *c);

/* Hold a setpoint; false where no gains are compiled in. A controller at work keeps its state. */
bool control_hold(struct control *c, int16_t setpoint);

/* One millisecond has passed, the angle reads `reading` and the muscles `temperature` [0.1 C]; true
 * where `duty` has been set anew. */
bool control_tick(struct control *c, int16_t reading, const int16_t temperature[CHANNELS],
                  uint8_t duty[CHANNELS]);

#endif
