/* The logic without a board, as a library for unit tests: a bench in, text and duties out. */
#include <stddef.h>
#include <string.h>

#include "../src/bench.h"
#include "../src/crc16.h"

size_t host_size(void)
{
    return sizeof(struct bench);
}

void host_start(struct bench *b, uint8_t cause, bool was_heating, uint8_t role, uint16_t boot)
{
    struct start start = {cause, was_heating, (enum role)role, boot};
    memset(b, 0xA5, sizeof *b);         /* nothing may rely on memory that is zero */
    struct memory memory;
    memset(&memory, 0, sizeof memory);
    wiring_clear(&memory.wiring);
    bench_start(b, start, &memory);
}

/* A tube that is calibrated, or not (gain 0). */
void host_tube(struct bench *b, uint8_t channel, uint16_t gain, uint16_t cooling)
{
    b->safety.tube[channel] = (struct tube){gain, cooling};
}

/* What is known of a tube: most, least, least_mean, shown, shown_mean, cold, dose, ms. */
void host_thermal(const struct bench *b, uint8_t channel, int32_t states[8])
{
    const struct thermal *t = &b->safety.thermal[channel];
    const int32_t all[8] = {t->most,       t->least, t->least_mean, t->shown,
                            t->shown_mean, t->cold,  t->dose,       t->ms};
    memcpy(states, all, sizeof all);
}

/* Temperature [0.1 C] in what a thermometer gives, and whether it makes sense. */
int16_t host_thermometer(const struct bench *b, uint8_t kind, uint32_t word, bool *sense)
{
    return thermometer_read(&b->wiring, kind, word, sense);
}

/* Bits of the channels whose thermometers are to be looked at. */
uint8_t host_looks(const struct bench *b)
{
    return b->look;
}

void host_looked(struct bench *b, uint8_t channel, uint32_t word)
{
    bench_looked(b, channel, word);
}

bool host_stores(struct bench *b)
{
    bool store = b->store;
    b->store = false;
    return store;
}

/* Starts anew with what a board remembers of one tube's warmth [0.1 C], or that one was hot. */
void host_restart(struct bench *b, bool known, bool hot, int16_t rise)
{
    struct start start = b->start;
    struct memory memory;
    memset(&memory, 0, sizeof memory);
    memory.wiring = b->wiring;
    memory.known = known;
    memory.hot = hot;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        memory.tube[i] = b->safety.tube[i];
        thermal_start(&memory.thermal[i], rise);
    }
    bench_start(b, start, &memory);
}

/* Moves what is to be sent into `text`; tells its length. */
uint8_t host_take(struct bench *b, char *text)
{
    uint8_t length = b->out.length;
    memcpy(text, b->out.data, length);
    text_clear(&b->out);
    return length;
}

void host_byte(struct bench *b, uint8_t byte)
{
    bench_byte(b, byte);
}

void host_tick(struct bench *b)
{
    bench_tick(b);
}

void host_sample(struct bench *b, uint32_t micros, uint16_t adc)
{
    bench_sample(b, (struct sample){micros, adc, 0});
}

uint8_t host_duty(const struct bench *b, uint8_t channel)
{
    return b->safety.duty[channel];
}

uint8_t host_faults(const struct bench *b)
{
    return b->safety.faults;
}

/* What the old protocol asks of the board: action and pin. */
uint8_t host_pin_action(const struct bench *b)
{
    return (uint8_t)b->pin.action;
}

uint8_t host_pin(const struct bench *b)
{
    return b->pin.pin;
}

void host_pin_value(struct bench *b, uint16_t value)
{
    bench_pin_value(b, value);
}

void host_internal_fault(struct bench *b)
{
    bench_internal_fault(b);
}

bool host_fan(const struct bench *b)
{
    return b->fan;
}

uint16_t host_crc(const uint8_t *bytes, size_t count)
{
    uint16_t crc = CRC16_INITIAL;
    for (size_t i = 0; i < count; i++) {
        crc = crc16_update(crc, bytes[i]);
    }
    return crc;
}
