#include "safety.h"

#include "limits.h"

void safety_start(struct safety *s, uint8_t faults, const struct memory *memory)
{
    s->limits = (struct limits){LIMIT_DUTY, LIMIT_RISE, LIMIT_TEMPERATURE};
    s->faults = faults;
    s->silence_ms = 0;
    s->fan = false;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        s->duty[i] = 0;
        safety_own(s, i, false);
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

/* The duty that a channel may have: none before its own thermometer has told something. */
static uint8_t within(const struct safety *s, uint8_t channel, uint8_t duty)
{
    if (s->own[channel] && !s->sensed[channel]) {
        return 0;
    }
    return duty < s->limits.duty ? duty : s->limits.duty;
}

/* What a temperature means for a channel that is heated or not: a fault, or 0. */
static uint8_t fault_of(const struct safety *s, int16_t t, bool heated)
{
    if (absurd(t) || (t == NO_READING && heated)) {
        return FAULT_SENSOR;
    }
    return t > s->limits.temperature ? FAULT_TEMPERATURE : 0;
}

static void take(struct safety *s, uint8_t channel, int16_t t)
{
    s->temperature[channel] = t;
    if (t != NO_READING && !absurd(t)) {
        thermal_report(&s->thermal[channel], t);
    }
}

void safety_own(struct safety *s, uint8_t channel, bool own)
{
    s->own[channel] = own;
    s->sensed[channel] = false;
    s->sensed_ms[channel] = 0;
    s->temperature[channel] = NO_READING;
}

void safety_sensed(struct safety *s, uint8_t channel, int16_t temperature)
{
    s->sensed[channel] = true;
    s->sensed_ms[channel] = 0;
    take(s, channel, temperature);
    uint8_t fault = fault_of(s, temperature, s->duty[channel] > 0);
    if (fault) {
        safety_fault(s, fault);
    }
}

static void check(struct safety *s, const bool heated[CHANNELS], const int16_t temperature[CHANNELS])
{
    uint8_t fault = 0;
    s->silence_ms = 0;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        if (!s->own[i]) {
            take(s, i, temperature[i]);
        } else if (s->sensed[i]) {
            fault |= fault_of(s, s->temperature[i], heated[i]);
        }
        fault |= fault_of(s, temperature[i], heated[i] && !s->own[i]);
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
        s->duty[i] = within(s, i, duty[i]);
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
        s->duty[channel] = within(s, channel, duty);
    }
}

void safety_tick(struct safety *s)
{
    uint8_t fault = 0;
    bool heating = false;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        heating = heating || s->duty[i] > 0;
        bool heated = s->thermal[i].dose > 0 || s->duty[i] > 0;
        if (s->own[i] && ++s->sensed_ms[i] > SENSED_WITHIN_MS) {
            s->sensed_ms[i] = SENSED_WITHIN_MS;
            fault = (uint8_t)(fault | (s->duty[i] > 0 ? FAULT_SENSOR : 0));
        }
        if (s->fan) {
            thermal_cooled(&s->thermal[i]);
        }
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
        s->duty[i] = within(s, i, s->duty[i]);
    }
}

bool safety_any_warm(const struct safety *s, int16_t rise)
{
    for (uint8_t i = 0; i < CHANNELS; i++) {
        int16_t t = s->temperature[i];
        int16_t room = t > ROOM && t < HOTTEST_ROOM ? (int16_t)(t - ROOM) : 0;
        if (thermal_above(&s->thermal[i], (int16_t)(room + rise))) {
            return true;
        }
    }
    return false;
}
