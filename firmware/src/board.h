/* The thin layer over the ATmega328P: pins, timers, UART, converter, watchdog, EEPROM. */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "bench.h"

/* Everything ready, heaters off, watchdog running, interrupts on; tells how the board came up, and
 * what it knows of the tubes. */
struct start board_start(struct memory *memory);

/* Keep what is known of the tubes through a reset, and that one is hot through a loss of power. */
void board_remember(const struct safety *safety);

/* Keep the tubes' calibration for good; takes 40 ms at most. */
void board_store_tubes(const struct tube tube[CHANNELS]);

/* Keep what the inputs are wired to; takes 40 ms at most. */
void board_store_wiring(const struct wiring *wiring);

/* Milliseconds that have passed since the last call. */
uint8_t board_take_ticks(void);

/* The watchdog's 64 ms start anew. */
void board_alive(void);

/* The next sample, one a millisecond; false where there is no new one. */
bool board_take_sample(struct sample *sample);

/* A received byte, or -1. */
int16_t board_receive(void);

/* Send all of a text or, where the buffer is full, none of it. Never waits. */
void board_send(const char *data, uint8_t length);

/* Heater duty of channel 0 (pin 6) or 1 (pin 5). */
void board_heat(uint8_t channel, uint8_t duty);

/* The fan's pin, 7. */
void board_fan(bool on);

/* Both heaters off, every register concerned written anew. */
void board_heaters_off(void);

/* Whether the output registers hold what board_heat put there. */
bool board_heats_as_told(void);

/* One conversion of analog input 0-5. */
uint16_t board_analog(uint8_t input);

/* Level of digital pin 0-13. */
bool board_digital(uint8_t pin);

/* Sleep until the next interrupt, unless there is work. */
void board_idle(void);

#endif
