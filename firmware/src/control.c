#include "control.h"

#include "limits.h"

#ifndef GAINS_HEADER
#define GAINS_HEADER "gains.h"
#endif
#include GAINS_HEADER

#define FULL_DUTY 255
#define SUM_LIMIT 1024000000        /* more than ever makes a difference, less than overflows */
#define FEEDS 9

_Static_assert(GAINS_PERIOD_MS >= 1 && GAINS_PERIOD_MS <= 1000, "GAINS_PERIOD_MS is out of range");
_Static_assert(GAINS_KP >= -131071L && GAINS_KP <= 131071L, "GAINS_KP is out of range");
_Static_assert(GAINS_KI >= -131071L && GAINS_KI <= 131071L, "GAINS_KI is out of range");
_Static_assert(GAINS_FILTER >= 1 && GAINS_FILTER <= 65536, "GAINS_FILTER is out of range");
_Static_assert(GAINS_BIAS >= 0 && GAINS_BIAS <= FULL_DUTY, "GAINS_BIAS is out of range");
_Static_assert(GAINS_FADE_LOW < GAINS_FADE_HIGH, "GAINS_FADE_LOW is not below GAINS_FADE_HIGH");
_Static_assert(GAINS_FEED_STEP >= 1, "GAINS_FEED_STEP is out of range");

static const int16_t feeds[FEEDS] = GAINS_FEED;

void control_stop(struct control *c)
{
    c->active = false;
    c->begun = false;
    c->sum = 0;
    c->wait_ms = 0;
    c->doubted_ms = 0;
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

bool control_plausible(int16_t reading)
{
    return reading >= ANGLE_END && reading <= ANGLE_TOP - ANGLE_END;
}

bool control_sees(struct control *c, int16_t reading)
{
    int16_t jump = (int16_t)(reading - c->reading);
    if (!c->active || (control_plausible(reading) && jump <= ANGLE_JUMP && jump >= -ANGLE_JUMP)) {
        c->reading = reading;
        c->doubted_ms = 0;
        return true;
    }
    return ++c->doubted_ms < ANGLE_DOUBTED_MS;
}

static int32_t clamped(int64_t value, int32_t low, int32_t high)
{
    return value < low ? low : value > high ? high : (int32_t)value;
}

/* Straight between the entries, constant beyond them. */
static int32_t feed(int32_t setpoint)
{
    int32_t along = clamped(setpoint - GAINS_FEED_FIRST, 0, (FEEDS - 1) * (int32_t)GAINS_FEED_STEP);
    int32_t i = along / GAINS_FEED_STEP;
    i = i < FEEDS - 1 ? i : FEEDS - 2;
    int32_t rise = (int32_t)feeds[i + 1] - feeds[i];
    return feeds[i] + rise * (along - i * GAINS_FEED_STEP) / GAINS_FEED_STEP;
}

/* What one side's share of the output asks of its heater. */
static int32_t heat(int32_t share, int16_t temperature)
{
#if GAINS_CASCADE
    int32_t above = (int32_t)GAINS_HOLD * (share - GAINS_ROOM);
    return clamped((above + (int64_t)GAINS_HEAT * (share - temperature)) / 256, 0, FULL_DUTY);
#else
    (void)temperature;
    return share;
#endif
}

/* The most that a heater may have at a temperature. */
static int32_t allowed(int16_t temperature)
{
    const int32_t span = GAINS_FADE_HIGH - GAINS_FADE_LOW;
    return FULL_DUTY * clamped(GAINS_FADE_HIGH - (int32_t)temperature, 0, span) / span;
}

bool control_tick(struct control *c, const int16_t temperature[CHANNELS], uint8_t duty[CHANNELS])
{
    if (!c->active) {
        return false;
    }
    if (c->wait_ms > 0) {
        c->wait_ms--;
        return false;
    }
    c->wait_ms = GAINS_PERIOD_MS - 1;
    if (!c->begun) {
        c->reference = (int32_t)c->reading * 65536;
        c->begun = true;
    }
    int64_t gap = (int64_t)c->setpoint * 65536 - c->reference;
    c->reference += (int32_t)(gap * GAINS_FILTER / 65536);
    int32_t error = c->reference / 256 - (int32_t)c->reading * 256;
    int64_t pi = ((int64_t)GAINS_KP * 256 * error + (int64_t)GAINS_KI * c->sum) / 16777216;
    int32_t wanted = clamped(pi, -32000, 32000) + feed(c->reference / 65536);

    const int32_t base = GAINS_BIAS + (GAINS_CASCADE ? GAINS_ROOM : 0);
    const int32_t most = GAINS_CASCADE ? GAINS_HOTTEST : FULL_DUTY;
    int32_t share[CHANNELS] = {clamped(base + wanted, base, most), clamped(base - wanted, base, most)};
    for (uint8_t i = 0; i < CHANNELS; i++) {
        int32_t most_now = allowed(temperature[i]), asked = heat(share[i], temperature[i]);
        duty[i] = (uint8_t)(asked < most_now ? asked : most_now);
    }
    int32_t became = GAINS_CASCADE ? share[0] - share[1] : (int32_t)duty[0] - duty[1];
    int64_t sum = (int64_t)c->sum + error + (int64_t)GAINS_BACK * (became - wanted);
    c->sum = clamped(sum, -SUM_LIMIT, SUM_LIMIT);
    return true;
}
