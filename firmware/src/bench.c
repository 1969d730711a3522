#include "bench.h"

#include "commands.h"

/* Old pins: 6 and 5 drive the heaters, channel A and B. */
#define PIN_HEATER_A 6
#define PIN_HEATER_B 5

#define NOTICE_MS 1000
#define LOAD_WITHIN_MS 500      /* an HX711 tells ten times a second */

/* Ask an old script on. With a fault latched it is not asked but told, every second: it stops, and
 * either shows the line or stumbles over a line that is no number. No `w` stands in it. */
static void prompt(struct bench *b)
{
    if (b->dialect != DIALECT_OLD || b->safety.faults == 0) {
        text_word(&b->out, "w\r\n");
        return;
    }
    text_word(&b->out, "heaters off, fault");
    text_number(&b->out, b->safety.faults);
    text_word(&b->out, "; open the port again\r\n");
    b->notice_ms = NOTICE_MS;
}

void bench_wire(struct bench *b, const struct wiring *wiring)
{
    b->wiring = *wiring;
    b->look = 0;
    b->look_ms = 0;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        b->channel[i] = (struct channel){NO_READING, false};
        safety_own(&b->safety, i, wiring->thermometer[i] != THERMOMETER_HOST);
    }
}

void bench_looked(struct bench *b, uint8_t channel, uint32_t word)
{
    struct channel *c = &b->channel[channel];
    b->look &= (uint8_t)~(1u << channel);
    if (channel_look(c, &b->wiring, b->wiring.thermometer[channel], word)) {
        safety_sensed(&b->safety, channel, c->reading);
    }
}

void bench_load(struct bench *b, uint32_t word)
{
    b->load = load_read(word);
    b->load_ms = 0;
}

/* The channels' thermometers are looked at by turns. */
static void look(struct bench *b)
{
    uint8_t period = wiring_look_ms(&b->wiring);
    if (++b->look_ms >= period) {
        b->look_ms = 0;
    }
    for (uint8_t i = 0; i < CHANNELS; i++) {
        if (b->wiring.thermometer[i] != THERMOMETER_HOST && b->look_ms == i * (period / CHANNELS)) {
            b->look = (uint8_t)(b->look | 1u << i);
        }
    }
    if (b->load != NO_LOAD && ++b->load_ms >= LOAD_WITHIN_MS) {
        b->load = NO_LOAD;
    }
}

static uint8_t faults_of(struct start start)
{
    uint8_t faults = 0;
    /* A boot loader may hide the cause, or leave by the watchdog after an external reset: then only
     * a reset while heating counts. */
    bool certain = (start.cause & RESET_WATCHDOG) && !(start.cause & RESET_EXTERNAL);
    bool possible = (start.cause & RESET_WATCHDOG) || start.cause == 0;
    if (certain || (possible && start.was_heating)) {
        faults |= FAULT_WATCHDOG;
    }
    /* A supply that rises slowly raises both flags at power-on: no heater was on then. */
    if ((start.cause & RESET_BROWN_OUT) && !(start.cause & RESET_POWER_ON)) {
        faults |= FAULT_BROWN_OUT;
    }
    return faults;
}

void bench_start(struct bench *b, struct start start, const struct memory *memory)
{
    safety_start(&b->safety, faults_of(start), memory);
    control_stop(&b->control);
    frame_start(&b->frame);
    old_start(&b->old);
    text_clear(&b->out);
    b->start = start;
    b->dialect = DIALECT_OPEN;
    b->sampled = false;
    b->load = NO_LOAD;
    b->load_ms = 0;
    b->rewired = false;
    b->mark = false;
    b->marked = false;
    bench_wire(b, &memory->wiring);
    b->stream_period_ms = 0;
    b->stream_wait_ms = 0;
    b->stream_number = 0;
    b->garbled = 0;
    b->told_faults = b->safety.faults;
    b->notice_ms = 0;
    b->store = false;
    b->fan = false;
    b->pin = (struct old_outcome){OLD_NOTHING, 0, 0};
    text_begin(&b->out, '!');
    text_word(&b->out, "BOOT");
    text_number(&b->out, PROTOCOL_VERSION);
    text_number(&b->out, FIRMWARE_VERSION);
    text_number(&b->out, start.boot);
    text_number(&b->out, start.cause);
    text_word(&b->out, start.role == ROLE_HEATER ? " HEATER" : " SENSOR");
    text_end(&b->out);
    prompt(b);
}

/* Tell of new faults; an old script by the line that stands in for its next question. */
static void tell_faults(struct bench *b)
{
    if (b->safety.faults == b->told_faults) {
        return;
    }
    b->told_faults = b->safety.faults;
    if (b->dialect == DIALECT_OLD) {
        prompt(b);
        return;
    }
    text_begin(&b->out, '!');
    text_word(&b->out, "FAULT");
    text_number(&b->out, b->safety.faults);
    text_end(&b->out);
}

static void old_write(struct bench *b, uint8_t pin, uint8_t duty)
{
    if (b->start.role == ROLE_HEATER && (pin == PIN_HEATER_A || pin == PIN_HEATER_B)) {
        safety_command_old(&b->safety, pin == PIN_HEATER_A ? 0 : 1, duty);
    }
}

static void old_act(struct bench *b, struct old_outcome outcome)
{
    if (outcome.action == OLD_NOTHING) {
        return;
    }
    if (outcome.action != OLD_PROMPT) {
        b->dialect = DIALECT_OLD;
    }
    if (outcome.action == OLD_ANALOG_READ || outcome.action == OLD_DIGITAL_READ) {
        b->pin = outcome;
        return;
    }
    if (outcome.action == OLD_WRITE) {
        old_write(b, outcome.pin, outcome.value);
    }
    prompt(b);
}

void bench_pin_value(struct bench *b, uint16_t value)
{
    b->pin.action = OLD_NOTHING;
    text_digits(&b->out, value);
    text_word(&b->out, "\r\n");
    prompt(b);
}

void bench_byte(struct bench *b, uint8_t byte)
{
    switch (frame_byte(&b->frame, byte)) {
    case FRAME_OUTSIDE:
        if (b->dialect != DIALECT_FRAMED) {
            old_act(b, old_byte(&b->old, byte));
        }
        break;
    case FRAME_COMPLETE:
        b->dialect = DIALECT_FRAMED;
        command_run(b, b->frame.body);
        break;
    case FRAME_GARBLED:
        b->garbled++;
        text_begin(&b->out, '!');
        text_word(&b->out, "CRC");
        text_number(&b->out, b->garbled);
        text_end(&b->out);
        break;
    case FRAME_PENDING:
        break;
    }
    tell_faults(b);
}

/* A controller that was switched off by a fault starts anew when it is told to. */
static void control(struct bench *b)
{
    uint8_t duty[CHANNELS];
    if (b->safety.faults) {
        control_stop(&b->control);
    } else if (b->sampled && control_tick(&b->control, b->safety.temperature, duty)) {
        safety_drive(&b->safety, duty);
    }
}

void bench_tick(struct bench *b)
{
    safety_tick(&b->safety);
    look(b);
    control(b);
    if (b->dialect != DIALECT_FRAMED) {
        old_act(b, old_tick(&b->old));
    }
    if (b->notice_ms > 0 && --b->notice_ms == 0) {
        prompt(b);
    }
    tell_faults(b);
}

static void average(struct average *a, uint16_t value, bool begins)
{
    if (begins) {
        for (uint8_t i = 0; i < AVERAGED; i++) {
            a->recent[i] = value;
        }
        a->oldest = 0;
        a->sum = (uint32_t)AVERAGED * value;
    }
    a->sum = a->sum - a->recent[a->oldest] + value;
    a->recent[a->oldest] = value;
    a->oldest = (uint8_t)((a->oldest + 1) % AVERAGED);
}

void bench_sample(struct bench *b, struct sample sample)
{
    average(&b->angle, sample.angle, !b->sampled);
    average(&b->second, sample.second, !b->sampled);
    b->latest = sample;
    b->sampled = true;
    if (!control_sees(&b->control, (int16_t)sample.angle)) {
        control_stop(&b->control);
        safety_fault(&b->safety, FAULT_ANGLE);
        tell_faults(b);
    }
    if (b->stream_period_ms == 0) {
        return;
    }
    if (++b->stream_wait_ms < b->stream_period_ms) {
        return;
    }
    b->stream_wait_ms = 0;
    text_begin(&b->out, '=');
    text_digits(&b->out, b->stream_number++);
    command_sample(b);
    text_end(&b->out);
}

void bench_internal_fault(struct bench *b)
{
    safety_fault(&b->safety, FAULT_INTERNAL);
    tell_faults(b);
}
