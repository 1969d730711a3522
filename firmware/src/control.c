#include "control.h"

#ifndef GAINS_HEADER
#define GAINS_HEADER "gains.h"
#endif
#include GAINS_HEADER

#define FULL_DUTY 255
#define SUM_LIMIT 4000000           /* more than ever makes a difference, less than overflows */

_Static_assert(GAINS_PERIOD_MS >= 1 && GAINS_PERIOD_MS <= 1000, "GAINS_PERIOD_MS is out of range");
_Static_assert(GAINS_KP >= INT16_MIN && GAINS_KP <= INT16_MAX, "GAINS_KP is out of range");
_Static_assert(GAINS_KI >= INT16_MIN && GAINS_KI <= INT16_MAX, "GAINS_KI is out of range");
_Static_assert(GAINS_BIAS >= 0 && GAINS_BIAS <= FULL_DUTY, "GAINS_BIAS is out of range");

void control_stop(struct control *c)
{
    c->active = false;
    c->sum = 0;
    c->wait_ms = 0;
}

bool control_hold(struct control *c, int16_t setpoint)
{
    if (GAINS_KP == 0 && GAINS_KI == 0) {
        return false;
    }
    c->active = true;
    c->setpoint = setpoint;
    return true;
}

static int32_t output(int32_t error, int32_t sum)
{
    int64_t u = ((int64_t)GAINS_KP * 256 * error + (int64_t)GAINS_KI * sum) / 65536;
    return u > FULL_DUTY ? FULL_DUTY : u < -FULL_DUTY ? -FULL_DUTY : (int32_t)u;
}

static uint8_t biased(int32_t more)
{
    int32_t duty = GAINS_BIAS + (more > 0 ? more : 0);
    return duty > FULL_DUTY ? FULL_DUTY : (uint8_t)duty;
}

bool control_tick(struct control *c, int16_t reading, uint8_t duty[CHANNELS])
{
    if (!c->active) {
        return false;
    }
    if (c->wait_ms > 0) {
        c->wait_ms--;
        return false;
    }
    c->wait_ms = GAINS_PERIOD_MS - 1;
    int32_t error = c->setpoint - reading;
    int32_t sum = c->sum + error;
    int32_t before = output(error, c->sum);
    int32_t u = output(error, sum);
    /* Anti-windup: at full output the sum may only shrink it. */
    bool winds = (before == FULL_DUTY && u >= before) || (before == -FULL_DUTY && u <= before);
    if (!winds && sum <= SUM_LIMIT && sum >= -SUM_LIMIT) {
        c->sum = sum;
    }
    u = output(error, c->sum);
    duty[0] = biased(u);
    duty[1] = biased(-u);
    return true;
}
