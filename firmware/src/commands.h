/* Framed commands: a frame's body in, effects on the bench and a reply out. */
#ifndef COMMANDS_H
#define COMMANDS_H

#include "bench.h"

#define STREAM_MIN_MS 5
#define STREAM_MAX_MS 10000

void command_run(struct bench *b, const char *body);

/* The fields that reply and stream have in common: MICROS ADC D0 D1 FAULTS. */
void command_sample(struct bench *b);

#endif
