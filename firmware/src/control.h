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
    int16_t reading;            /* of the angle, the newest that can be */
    uint8_t doubted_ms;         /* since it */
};

void control_stop(struct control *c);

/* Hold a setpoint; false where no gains are compiled in. A controller at work keeps its state. */
bool control_hold(struct control *c, int16_t setpoint);

/* Whether a potentiometer with both its wires and its wiper can read so. */
bool control_plausible(int16_t reading);

/* The angle reads so, one millisecond later; false where it has been what it cannot be for too long:
 * open, shorted, or far from where it was. */
bool control_sees(struct control *c, int16_t reading);

/* One millisecond has passed and the muscles have `temperature` [0.1 C]; true where `duty` has been set
 * anew. */
bool control_tick(struct control *c, const int16_t temperature[CHANNELS], uint8_t duty[CHANNELS]);

#endif
