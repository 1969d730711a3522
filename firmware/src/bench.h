/* The bench board's mind: bytes, milliseconds and samples in, text and duties out. No board calls. */
#ifndef BENCH_H
#define BENCH_H

#include <stdbool.h>
#include <stdint.h>

#include "control.h"
#include "frame.h"
#include "inputs.h"
#include "old_protocol.h"
#include "safety.h"
#include "text.h"

#define PROTOCOL_VERSION 3
#define FIRMWARE_VERSION 3

/* Reset causes as the ATmega328P's MCUSR tells them; 0 where a boot loader has hidden it. */
enum reset_cause { RESET_POWER_ON = 1, RESET_EXTERNAL = 2, RESET_BROWN_OUT = 4, RESET_WATCHDOG = 8 };

enum role { ROLE_SENSOR, ROLE_HEATER };

struct start {
    uint8_t cause;              /* of the reset */
    bool was_heating;           /* a heater was on when it came */
    enum role role;
    uint16_t boot;              /* number of this boot */
};

struct sample {
    uint32_t micros;            /* device clock at the start of the conversion */
    uint16_t angle;             /* a conversion, or an encoder's count */
    uint16_t second;            /* a conversion of the second potentiometer */
};

#define AVERAGED 8                  /* conversions, one a millisecond, whose sum is told */
#define AVERAGED_SPAN_US 7000ul

/* Mean of late of one input, as a sum. */
struct average {
    uint16_t recent[AVERAGED];  /* the oldest at `oldest` */
    uint8_t oldest;
    uint32_t sum;
};

enum dialect { DIALECT_OPEN, DIALECT_OLD, DIALECT_FRAMED };

struct bench {
    struct safety safety;
    struct control control;
    struct start start;
    struct frame frame;
    struct old_protocol old;
    enum dialect dialect;       /* the first valid frame shuts the old protocol out until reset */
    struct sample latest;
    bool sampled;
    struct average angle;       /* to an eighth of a count, where noise dithers it */
    struct average second;
    int32_t load;               /* newest of the load cell, counts, or NO_LOAD */
    uint16_t load_ms;           /* since then */
    struct wiring wiring;
    struct channel channel[CHANNELS];
    uint8_t look_ms;            /* since the board last looked at the first channel's thermometer */
    uint8_t look;               /* bit of each channel whose thermometer is to be looked at now */
    uint16_t stream_period_ms;  /* 0: no stream */
    uint16_t stream_wait_ms;
    uint16_t stream_number;
    uint16_t garbled;           /* frames with a wrong checksum */
    uint8_t told_faults;
    uint16_t notice_ms;         /* until an old script is told again of latched faults */
    bool fan;                   /* on, by FAN */
    bool store;                 /* the tubes' calibration is to be stored, then clear this */
    bool mark;                  /* the zero of an encoder is known, then clear this */
    bool marked;                /* and has not been lost since */
    bool rewired;               /* the wiring is to be stored and taken up, then clear this */
    struct text out;            /* to be sent, then cleared, after every call */
    struct old_outcome pin;     /* board access that the old protocol asks for */
};

void bench_start(struct bench *b, struct start start, const struct memory *memory);
/* What the inputs are wired to, from now on. */
void bench_wire(struct bench *b, const struct wiring *wiring);
/* What a channel's own thermometer gave upon a look: its chip's word, or the sum of eight conversions. */
void bench_looked(struct bench *b, uint8_t channel, uint32_t word);
/* The load cell has 24 bits. */
void bench_load(struct bench *b, uint32_t word);
void bench_byte(struct bench *b, uint8_t byte);
void bench_tick(struct bench *b);
void bench_sample(struct bench *b, struct sample sample);
/* Answer to `pin` where it is a read. */
void bench_pin_value(struct bench *b, uint16_t value);
/* The board found its output registers wrong. */
void bench_internal_fault(struct bench *b);

#endif
