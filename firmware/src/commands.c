#include "commands.h"

#include "limits.h"
#include "words.h"

/* One command being carried out. Handlers write the reply's fields behind `OK`, or name an error. */
struct call {
    struct bench *b;
    struct words args;
    bool ok;            /* arguments are there and numbers */
    bool inside;        /* numbers are in range */
    const char *error;
};

static int32_t number(struct call *c, int32_t low, int32_t high)
{
    return words_number(&c->args, low, high, &c->ok, &c->inside);
}

/* Whether all arguments were there, in range, and no more of them; names the error if not. */
static bool sound(struct call *c)
{
    if (!c->ok || !words_end(&c->args)) {
        c->error = "ARGS";
    } else if (!c->inside) {
        c->error = "RANGE";
    }
    return c->error == 0;
}

static void duties_and_faults(struct bench *b)
{
    text_number(&b->out, b->safety.duty[0]);
    text_number(&b->out, b->safety.duty[1]);
    text_number(&b->out, b->safety.faults);
}

void command_sample(struct bench *b)
{
    text_number(&b->out, (uint32_t)(b->latest.micros - AVERAGED_SPAN_US / 2));
    text_number(&b->out, b->angle.sum);
    duties_and_faults(b);
    if (b->wiring.second) {
        text_number(&b->out, b->second.sum);
    } else {
        text_dash(&b->out);
    }
    if (b->load != NO_LOAD) {
        text_signed(&b->out, b->load);
    } else {
        text_dash(&b->out);
    }
}

static void run_id(struct call *c)
{
    struct bench *b = c->b;
    if (!sound(c)) {
        return;
    }
    text_number(&b->out, PROTOCOL_VERSION);
    text_number(&b->out, FIRMWARE_VERSION);
    text_number(&b->out, b->start.boot);
    text_number(&b->out, b->start.cause);
    text_word(&b->out, b->start.role == ROLE_HEATER ? " HEATER" : " SENSOR");
}

static int16_t reading(struct call *c)
{
    if (c->args.next != 0 && c->args.next[0] == '-' &&
        (c->args.next[1] == ' ' || c->args.next[1] == '\0')) {
        c->args.next = c->args.next[1] == ' ' ? c->args.next + 2 : 0;
        return NO_READING;
    }
    return (int16_t)number(c, INT16_MIN + 1, INT16_MAX);
}

static void run_duty(struct call *c)
{
    struct bench *b = c->b;
    uint8_t duty[CHANNELS];
    int16_t temperature[CHANNELS];
    for (uint8_t i = 0; i < CHANNELS; i++) {
        duty[i] = (uint8_t)number(c, 0, 255);
    }
    for (uint8_t i = 0; i < CHANNELS; i++) {
        temperature[i] = reading(c);
    }
    if (!sound(c)) {
        return;
    }
    if (b->start.role != ROLE_HEATER && (duty[0] || duty[1])) {
        c->error = "ROLE";
        return;
    }
    control_stop(&b->control);
    safety_command(&b->safety, duty, temperature);
    duties_and_faults(b);
}

static void run_hold(struct call *c)
{
    struct bench *b = c->b;
    int16_t temperature[CHANNELS];
    int16_t setpoint = (int16_t)number(c, 0, 1023);
    for (uint8_t i = 0; i < CHANNELS; i++) {
        temperature[i] = reading(c);
    }
    if (!sound(c)) {
        return;
    }
    if (b->start.role != ROLE_HEATER) {
        c->error = "ROLE";
        return;
    }
    if (!b->sampled) {
        c->error = "BUSY";
        return;
    }
    if (!control_plausible(b->control.reading)) {
        c->error = "ANGLE";
        return;
    }
    if (!control_hold(&b->control, setpoint)) {
        c->error = "GAINS";
        return;
    }
    safety_report(&b->safety, temperature);
    duties_and_faults(b);
}

static void run_stream(struct call *c)
{
    struct bench *b = c->b;
    int32_t period = number(c, 0, STREAM_MAX_MS);
    if (period > 0 && period < STREAM_MIN_MS) {
        c->inside = false;
    }
    if (!sound(c)) {
        return;
    }
    b->stream_period_ms = (uint16_t)period;
    b->stream_wait_ms = 0;
    text_number(&b->out, (uint32_t)period);
}

static void run_read(struct call *c)
{
    if (!sound(c)) {
        return;
    }
    if (!c->b->sampled) {
        c->error = "BUSY";
        return;
    }
    command_sample(c->b);
}

static void run_limit(struct call *c)
{
    struct bench *b = c->b;
    struct limits limits;
    limits.duty = (uint8_t)number(c, 0, UINT8_MAX);
    limits.rise = (int16_t)number(c, 0, INT16_MAX);
    limits.temperature = (int16_t)number(c, 0, INT16_MAX);
    if (!sound(c)) {
        return;
    }
    safety_tighten(&b->safety, &limits);
    text_number(&b->out, b->safety.limits.duty);
    text_number(&b->out, (uint16_t)b->safety.limits.rise);
    text_number(&b->out, (uint16_t)b->safety.limits.temperature);
}

static void run_tubes(struct call *c)
{
    struct bench *b = c->b;
    if (!sound(c)) {
        return;
    }
    for (uint8_t i = 0; i < CHANNELS; i++) {
        text_number(&b->out, b->safety.tube[i].gain);
        text_number(&b->out, b->safety.tube[i].cooling);
    }
}

/* Kept in EEPROM, which takes some ms: not while a heater is on. */
static void run_tube(struct call *c)
{
    struct bench *b = c->b;
    uint8_t channel = (uint8_t)number(c, 0, CHANNELS - 1);
    struct tube tube;
    tube.gain = (uint16_t)number(c, TUBE_GAIN_LEAST, TUBE_GAIN_MOST);
    tube.cooling = (uint16_t)number(c, TUBE_COOLING_LEAST, TUBE_COOLING_MOST);
    if (!sound(c)) {
        return;
    }
    if (b->start.role != ROLE_HEATER) {
        c->error = "ROLE";
        return;
    }
    if (b->safety.duty[0] || b->safety.duty[1]) {
        c->error = "HEAT";
        return;
    }
    b->safety.tube[channel] = tube;
    b->store = true;
    text_number(&b->out, tube.gain);
    text_number(&b->out, tube.cooling);
}

static void run_fan(struct call *c)
{
    struct bench *b = c->b;
    bool on = number(c, 0, 1) == 1;
    if (!sound(c)) {
        return;
    }
    if (b->start.role != ROLE_HEATER) {
        c->error = "ROLE";
        return;
    }
    b->fan = on;
    b->safety.fan = on;
    text_number(&b->out, on);
}

static void wiring(struct bench *b)
{
    const struct wiring *w = &b->wiring;
    text_number(&b->out, w->thermometer[0]);
    text_number(&b->out, w->thermometer[1]);
    text_number(&b->out, w->angle);
    text_number(&b->out, w->second);
    text_number(&b->out, w->load);
    text_number(&b->out, w->beta);
    text_number(&b->out, w->ratio);
}

static void run_inputs(struct call *c)
{
    if (sound(c)) {
        wiring(c->b);
    }
}

/* Kept in EEPROM, which takes some ms: not while a heater is on. */
static void run_input(struct call *c)
{
    struct bench *b = c->b;
    struct wiring w;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        w.thermometer[i] = (uint8_t)number(c, 0, THERMOMETER_THERMISTOR);
    }
    w.angle = (uint8_t)number(c, 0, ANGLE_ENCODER);
    w.second = (uint8_t)number(c, 0, 1);
    w.load = (uint8_t)number(c, 0, 1);
    w.beta = (uint16_t)number(c, 1000, 9999);
    w.ratio = (uint16_t)number(c, 10, UINT16_MAX);
    if (!sound(c)) {
        return;
    }
    if (!wiring_plausible(&w, b->start.role == ROLE_HEATER)) {
        c->error = "ROLE";
        return;
    }
    if (b->safety.duty[0] || b->safety.duty[1]) {
        c->error = "HEAT";
        return;
    }
    b->rewired = true;
    bench_wire(b, &w);
    wiring(b);
}

/* Tells whether an encoder's zero is known, as of the last mark. */
static void run_encoder(struct call *c)
{
    struct bench *b = c->b;
    bool mark = number(c, 0, 1) == 1;
    if (!sound(c)) {
        return;
    }
    if (b->wiring.angle != ANGLE_ENCODER) {
        c->error = "ROLE";
        return;
    }
    b->mark = mark;
    text_number(&b->out, mark || b->marked);
}

static void run_temps(struct call *c)
{
    struct bench *b = c->b;
    if (!sound(c)) {
        return;
    }
    for (uint8_t i = 0; i < CHANNELS; i++) {
        if (b->safety.own[i] && b->safety.temperature[i] != NO_READING) {
            text_signed(&b->out, b->safety.temperature[i]);
        } else {
            text_dash(&b->out);
        }
    }
}

static void run_clear(struct call *c)
{
    struct bench *b = c->b;
    if (!sound(c)) {
        return;
    }
    if (!safety_clear(&b->safety)) {
        c->error = "FAULT";
        return;
    }
    b->told_faults = 0;
    text_number(&b->out, b->safety.faults);
}

static void run_off(struct call *c)
{
    if (sound(c)) {
        control_stop(&c->b->control);
        safety_off(&c->b->safety);
    }
}

static const struct {
    char verb[8];
    void (*run)(struct call *c);
} verbs[] = {
    {"ID", run_id},         {"DUTY", run_duty},   {"STREAM", run_stream}, {"READ", run_read},
    {"LIMIT", run_limit},   {"CLEAR", run_clear}, {"OFF", run_off},
    {"HOLD", run_hold},     {"TUBE", run_tube},   {"TUBES", run_tubes},
    {"FAN", run_fan},       {"INPUT", run_input}, {"INPUTS", run_inputs}, {"TEMPS", run_temps},
    {"ENCODER", run_encoder},
};

static void run(struct call *c, const char *verb, uint8_t length)
{
    for (uint8_t i = 0; i < sizeof verbs / sizeof *verbs; i++) {
        if (words_equal(verb, length, verbs[i].verb)) {
            verbs[i].run(c);
            return;
        }
    }
    c->error = "VERB";
}

static void reply(struct bench *b, uint32_t sequence, const char *word)
{
    text_begin(&b->out, '<');
    text_digits(&b->out, sequence);
    text_word(&b->out, word);
}

void command_run(struct bench *b, const char *body)
{
    struct call c = {b, {body}, true, true, 0};
    const char *verb = "";
    uint8_t length = 0;
    uint8_t before = b->out.length;
    uint32_t sequence = (uint32_t)number(&c, 0, UINT16_MAX);
    bool numbered = c.ok && c.inside;
    reply(b, numbered ? sequence : 0, " OK");
    if (!numbered) {
        c.error = "SEQ";
    } else if (!words_take(&c.args, &verb, &length)) {
        c.error = "VERB";
    } else {
        run(&c, verb, length);
    }
    if (c.error != 0) {
        b->out.length = before;
        reply(b, numbered ? sequence : 0, " ERR ");
        text_word(&b->out, c.error);
    }
    text_end(&b->out);
}
