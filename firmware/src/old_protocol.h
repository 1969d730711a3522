/* The old sketch's protocol: `w` CR LF asks for a decimal number, which ends with a blank, CR or LF, or
 * with silence. 0 pin: low. 1 pin: high. 2 pin: digital read. 3 pin value: PWM. 4 pin: analog read.
 * 99: begin anew. No board calls: pins are named in the outcome.
 *
 * It has no checksum, but noise betrays itself: it holds other characters, or it does not wait to be
 * asked. After either everything is ignored until the line has been silent. */
#ifndef OLD_PROTOCOL_H
#define OLD_PROTOCOL_H

#include <stdbool.h>
#include <stdint.h>

#define OLD_SILENCE_MS 3        /* the old scripts send no terminator; one write's bytes come together */
#define OLD_NOISE_SILENCE_MS 100

enum old_action { OLD_NOTHING, OLD_PROMPT, OLD_WRITE, OLD_DIGITAL_READ, OLD_ANALOG_READ };

struct old_outcome {
    enum old_action action;     /* all but OLD_NOTHING are followed by the next `w` */
    uint8_t pin;
    uint8_t value;              /* OLD_WRITE: duty of 255 */
};

struct old_protocol {
    uint16_t number;
    uint8_t digits;
    uint8_t silence_ms;
    bool asked;                 /* a millisecond or so has passed since the `w` */
    bool noisy;
    uint8_t have;               /* numbers of the command that are there */
    uint8_t command;
    uint8_t pin;
};

void old_start(struct old_protocol *p);
struct old_outcome old_byte(struct old_protocol *p, uint8_t byte);
struct old_outcome old_tick(struct old_protocol *p);

#endif
