#include "old_protocol.h"

#define DIGITS_MAX 4

void old_start(struct old_protocol *p)
{
    p->number = 0;
    p->digits = 0;
    p->silence_ms = 0;
    p->asked = false;
    p->noisy = false;
    p->have = 0;
    p->command = 0;
    p->pin = 0;
}

static struct old_outcome ask(enum old_action action, uint8_t pin, uint8_t value)
{
    return (struct old_outcome){action, pin, value};
}

/* The command is complete: tell what to do and wait for the next. */
static struct old_outcome finish(struct old_protocol *p, uint16_t value)
{
    p->have = 0;
    switch (p->command) {
    case 0:
        return ask(OLD_WRITE, p->pin, 0);
    case 1:
        return ask(OLD_WRITE, p->pin, 255);
    case 2:
        return ask(OLD_DIGITAL_READ, p->pin, 0);
    case 3:
        return ask(OLD_WRITE, p->pin, (uint8_t)value);
    default:
        return ask(OLD_ANALOG_READ, p->pin, 0);
    }
}

static struct old_outcome number_done(struct old_protocol *p)
{
    uint16_t number = p->number;
    p->number = 0;
    p->digits = 0;
    p->asked = false;
    if (p->have == 0) {
        if (number <= 4) {
            p->command = (uint8_t)number;
            p->have = 1;
        }
        return ask(OLD_PROMPT, 0, 0);
    }
    if (p->have == 1) {
        if (number > 19) {      /* no such pin; 99 among them */
            p->have = 0;
            return ask(OLD_PROMPT, 0, 0);
        }
        p->pin = (uint8_t)number;
        if (p->command != 3) {
            return finish(p, 0);
        }
        p->have = 2;
        return ask(OLD_PROMPT, 0, 0);
    }
    if (number > 255) {
        p->have = 0;
        return ask(OLD_PROMPT, 0, 0);
    }
    return finish(p, number);
}

struct old_outcome old_byte(struct old_protocol *p, uint8_t byte)
{
    bool digit = byte >= '0' && byte <= '9';
    bool blank = byte == ' ' || byte == '\r' || byte == '\n';
    p->silence_ms = 0;
    if (!p->noisy && ((digit && !p->asked) || (!digit && !blank))) {
        old_start(p);
        p->noisy = true;
    }
    if (p->noisy) {
        return ask(OLD_NOTHING, 0, 0);
    }
    if (blank) {
        return p->digits ? number_done(p) : ask(OLD_NOTHING, 0, 0);
    }
    if (p->digits < DIGITS_MAX) {
        p->number = (uint16_t)(10u * p->number + (byte - '0'));
        p->digits++;
    } else {
        p->number = UINT16_MAX;         /* too long for anything: no command, no pin, no value */
    }
    return ask(OLD_NOTHING, 0, 0);
}

struct old_outcome old_tick(struct old_protocol *p)
{
    if (p->digits == 0 && !p->noisy) {
        p->asked = true;
        return ask(OLD_NOTHING, 0, 0);
    }
    p->silence_ms++;
    if (p->noisy && p->silence_ms >= OLD_NOISE_SILENCE_MS) {
        old_start(p);
        return ask(OLD_PROMPT, 0, 0);
    }
    if (!p->noisy && p->silence_ms >= OLD_SILENCE_MS) {
        return number_done(p);
    }
    return ask(OLD_NOTHING, 0, 0);
}
