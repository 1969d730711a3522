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
    bench_start(b, start);
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
    bench_sample(b, (struct sample){micros, adc});
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

uint16_t host_crc(const uint8_t *bytes, size_t count)
{
    uint16_t crc = CRC16_INITIAL;
    for (size_t i = 0; i < count; i++) {
        crc = crc16_update(crc, bytes[i]);
    }
    return crc;
}
