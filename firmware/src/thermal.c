#include "thermal.h"

#include "limits.h"

/* gain [0.01 C/s] times dose makes gain dose / 24.319 of 2^-20 C. */
#define DOSE_NUMERATOR 16u
#define DOSE_DENOMINATOR 389u
#define STEPS_PER_TENTH_SECOND (100 / THERMAL_STEP_MS)

static const struct tube uncalibrated_most = {TUBE_GAIN_MOST, TUBE_COOLING_MOST};
static const struct tube uncalibrated_least = {TUBE_GAIN_LEAST, TUBE_COOLING_LEAST};

void thermal_start(struct thermal *t, int16_t rise)
{
    t->most = rise * THERMAL_TENTH;
    t->least = 0;
    t->least_mean = 0;
    t->shown = 0;
    t->shown_mean = 0;
    t->cold = 0;
    t->dose = 0;
    t->ms = 0;
    t->seen = false;
}

void thermal_report(struct thermal *t, int16_t temperature)
{
    int32_t rise = (temperature - ROOM) * THERMAL_TENTH;
    t->shown = temperature * THERMAL_TENTH;
    if (!t->seen) {
        t->shown_mean = t->shown;
        t->seen = true;
    }
    if (rise > t->most) {
        t->most = rise;
    }
    if (t->least <= COLD * THERMAL_TENTH) {
        t->cold = t->shown - (t->most - t->least);
    }
}

void thermal_cooled(struct thermal *t)
{
    if (t->shown - t->least < t->cold) {
        t->cold = t->shown - t->least;
    }
}

static int32_t advanced(int32_t rise, const struct tube *tube, uint16_t dose)
{
    int32_t heat = (int32_t)((uint32_t)tube->gain * dose * DOSE_NUMERATOR / DOSE_DENOMINATOR);
    return rise + heat - rise / ((int32_t)tube->cooling * STEPS_PER_TENTH_SECOND);
}

bool thermal_tick(struct thermal *t, const struct tube *tube, uint8_t duty)
{
    t->dose = (uint16_t)(t->dose + duty);
    if (++t->ms < THERMAL_STEP_MS) {
        return false;
    }
    bool calibrated = tube->gain > 0;
    t->most = advanced(t->most, calibrated ? tube : &uncalibrated_most, t->dose);
    t->least = advanced(t->least, calibrated ? tube : &uncalibrated_least, t->dose);
    t->least_mean += (t->least - t->least_mean) / THERMAL_MEAN_STEPS;
    t->shown_mean += (t->shown - t->shown_mean) / THERMAL_MEAN_STEPS;
    t->dose = 0;
    t->ms = 0;
    return true;
}

bool thermal_above(const struct thermal *t, int16_t rise)
{
    return t->most > rise * THERMAL_TENTH;
}

bool thermal_unseen(const struct thermal *t, int16_t rise)
{
    int32_t expected = t->least - t->least_mean;
    bool of_late = expected > rise * THERMAL_TENTH && 3 * (t->shown - t->shown_mean) < expected;
    bool in_all = t->least > rise * THERMAL_TENTH && 3 * (t->shown - t->cold) < t->least;
    return t->seen && (of_late || in_all);
}

bool thermal_plausible(const struct tube *tube)
{
    return tube->gain >= TUBE_GAIN_LEAST && tube->gain <= TUBE_GAIN_MOST &&
           tube->cooling >= TUBE_COOLING_LEAST && tube->cooling <= TUBE_COOLING_MOST;
}
