/* The optional inputs' pins: thermometer chips, thermistors, load cell, encoder, second potentiometer. */
#ifndef INPUTS_AVR_H
#define INPUTS_AVR_H

#include <stdbool.h>
#include <stdint.h>

#include "inputs.h"

/* Take up a wiring: pins as it needs them. An encoder's count goes on through a reset (`kept`: RAM has
 * survived it), else it begins at its middle. */
void inputs_begin(const struct wiring *wiring, bool kept);

/* The host has found an encoder's zero, and whether its count has gone on since. */
void inputs_mark(void);
bool inputs_marked(void);

/* What a channel's thermometer says: its chip's word, or the sum of eight conversions. Up to 0.2 ms. */
uint32_t inputs_thermometer(uint8_t channel, uint8_t kind);

/* The load cell's 24 bits; false where there are no new ones. */
bool inputs_take_load(uint32_t *word);

/* For the converter's interrupt: the angle where input 0 gave `adc`, the second potentiometer, the
 * analog input that is to be converted besides in this millisecond (0: none), and what one gave. */
uint16_t inputs_angle(uint16_t adc);
uint16_t inputs_second(void);
uint8_t inputs_next(void);
void inputs_converted(uint8_t input, uint16_t adc);

#endif
