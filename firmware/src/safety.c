#include "safety.h"

#include "limits.h"

void safety_start(struct safety *s, uint8_t faults, const struct memory *memory)
{
    s->limits = (struct limits){LIMIT_DUTY, LIMIT_RISE, LIMIT_TEMPERATURE};
    s->faults = faults;
    s->silence_ms = 0;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        s->duty[i] = 0;
        s->temperature[i] = NO_READING;
        s->tube[i] = memory->tube[i];
        if (memory->known) {
            s->thermal[i] = memory->thermal[i];
        } else {
            thermal_start(&s->thermal[i], memory->hot ? LIMIT_RISE : 0);
        }
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
        s->temperature[i] = t;
        if (t != NO_READING && !absurd(t)) {
            thermal_report(&s->thermal[i], t);
        }
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
        bool heated = s->thermal[i].dose > 0 || s->duty[i] > 0;
        /* Warm tubes that cool are no fault: only a channel that is heated is judged. */
        if (!thermal_tick(&s->thermal[i], &s->tube[i], s->duty[i]) || !heated) {
            continue;
        }
        if (thermal_above(&s->thermal[i], s->limits.rise)) {
            fault |= FAULT_HEAT;
        }
        if (thermal_unseen(&s->thermal[i], MUST_SHOW)) {
            fault |= FAULT_SENSOR;
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
        if ((s->faults & FAULT_SENSOR) &&
            (absurd(t) || thermal_unseen(&s->thermal[i], MUST_SHOW / 2))) {
            return true;
        }
        if ((s->faults & FAULT_HEAT) &&
            thermal_above(&s->thermal[i], (int16_t)(s->limits.rise - COOL_MARGIN))) {
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
    return true;
}

void safety_tighten(struct safety *s, const struct limits *limits)
{
    if (limits->duty < s->limits.duty) {
        s->limits.duty = limits->duty;
    }
    if (limits->rise < s->limits.rise) {
        s->limits.rise = limits->rise;
    }
    if (limits->temperature < s->limits.temperature) {
        s->limits.temperature = limits->temperature;
    }
    for (uint8_t i = 0; i < CHANNELS; i++) {
        s->duty[i] = within(s, s->duty[i]);
    }
}

bool safety_any_above(const struct safety *s, int16_t rise)
{
    for (uint8_t i = 0; i < CHANNELS; i++) {
        if (thermal_above(&s->thermal[i], rise)) {
            return true;
        }
    }
    return false;
}
