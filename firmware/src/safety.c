#include "safety.h"

#include "limits.h"

void safety_start(struct safety *s, uint8_t faults)
{
    s->limits = (struct limits){LIMIT_DUTY, LIMIT_ON_MS, LIMIT_TEMPERATURE};
    s->faults = faults;
    s->silence_ms = 0;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        s->duty[i] = 0;
        s->on_ms[i] = 0;
        s->temperature[i] = NO_READING;
        s->stuck_at[i] = NO_READING;
        s->stuck_ms[i] = 0;
    }
}

void safety_off(struct safety *s)
{
    for (uint8_t i = 0; i < CHANNELS; i++) {
        s->duty[i] = 0;
    }
}

void safety_fault(struct safety *s, uint8_t fault)
{
    s->faults |= fault;
    safety_off(s);
}

static bool absurd(int16_t temperature)
{
    return temperature != NO_READING && (temperature < ABSURD_LOW || temperature > ABSURD_HIGH);
}

static uint8_t within(const struct safety *s, uint8_t duty)
{
    return duty < s->limits.duty ? duty : s->limits.duty;
}

static void follow_meter(struct safety *s, uint8_t i, int16_t temperature)
{
    int16_t from = s->stuck_at[i];
    s->temperature[i] = temperature;
    if (from == NO_READING || temperature == NO_READING ||
        temperature - from >= STUCK_CHANGE || from - temperature >= STUCK_CHANGE) {
        s->stuck_at[i] = temperature;
        s->stuck_ms[i] = 0;
    }
}

static void check(struct safety *s, const bool heated[CHANNELS], const int16_t temperature[CHANNELS])
{
    uint8_t fault = 0;
    s->silence_ms = 0;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        int16_t t = temperature[i];
        if (absurd(t) || (t == NO_READING && heated[i])) {
            fault |= FAULT_SENSOR;
        } else if (t > s->limits.temperature) {
            fault |= FAULT_TEMPERATURE;
        }
        follow_meter(s, i, t);
    }
    if (fault) {
        safety_fault(s, fault);
    }
}

void safety_report(struct safety *s, const int16_t temperature[CHANNELS])
{
    const bool heated[CHANNELS] = {true, true};
    check(s, heated, temperature);
}

void safety_drive(struct safety *s, const uint8_t duty[CHANNELS])
{
    if (s->faults) {
        return;
    }
    for (uint8_t i = 0; i < CHANNELS; i++) {
        s->duty[i] = within(s, duty[i]);
    }
}

void safety_command(struct safety *s, const uint8_t duty[CHANNELS], const int16_t temperature[CHANNELS])
{
    const bool heated[CHANNELS] = {duty[0] > 0, duty[1] > 0};
    check(s, heated, temperature);
    safety_drive(s, duty);
}

void safety_command_old(struct safety *s, uint8_t channel, uint8_t duty)
{
    s->silence_ms = 0;
    if (!s->faults) {
        s->duty[channel] = within(s, duty);
    }
}

void safety_tick(struct safety *s)
{
    uint8_t fault = 0;
    bool heating = false;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        heating = heating || s->duty[i] > 0;
        if (s->duty[i] > HALF_DUTY) {
            s->on_ms[i]++;
            if (s->on_ms[i] >= s->limits.on_ms) {
                fault |= FAULT_ON_TIME;
            }
            if (s->stuck_at[i] != NO_READING && ++s->stuck_ms[i] >= STUCK_MS) {
                fault |= FAULT_SENSOR;
            }
        } else {
            s->stuck_at[i] = s->temperature[i];
            s->stuck_ms[i] = 0;
            if (s->on_ms[i] > 0) {
                s->on_ms[i]--;
            }
        }
    }
    if (s->silence_ms < UINT16_MAX) {
        s->silence_ms++;
    }
    if (heating && s->silence_ms >= DEADMAN_MS) {
        fault |= FAULT_DEADMAN;
    }
    if (fault) {
        safety_fault(s, fault);
    }
}

static bool cause_lasts(const struct safety *s)
{
    for (uint8_t i = 0; i < CHANNELS; i++) {
        int16_t t = s->temperature[i];
        if ((s->faults & FAULT_TEMPERATURE) && t > s->limits.temperature - COOL_MARGIN) {
            return true;
        }
        if ((s->faults & FAULT_SENSOR) && absurd(t)) {
            return true;
        }
        if ((s->faults & FAULT_ON_TIME) && s->on_ms[i] > s->limits.on_ms / 2) {
            return true;
        }
    }
    return false;
}

bool safety_clear(struct safety *s)
{
    if (cause_lasts(s)) {
        return false;
    }
    s->faults = 0;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        s->stuck_at[i] = NO_READING;
        s->stuck_ms[i] = 0;
    }
    return true;
}

void safety_tighten(struct safety *s, const struct limits *limits)
{
    if (limits->duty < s->limits.duty) {
        s->limits.duty = limits->duty;
    }
    if (limits->on_ms < s->limits.on_ms) {
        s->limits.on_ms = limits->on_ms;
    }
    if (limits->temperature < s->limits.temperature) {
        s->limits.temperature = limits->temperature;
    }
    for (uint8_t i = 0; i < CHANNELS; i++) {
        s->duty[i] = within(s, s->duty[i]);
    }
}
