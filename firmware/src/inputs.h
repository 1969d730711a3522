/* What a board's inputs are wired to besides potentiometer and meter: chosen by INPUT, kept in EEPROM.
 * Words of the chips become readings here. No board calls. */
#ifndef INPUTS_H
#define INPUTS_H

#include <stdbool.h>
#include <stdint.h>

#define THERMOMETERS 2
#define NO_READING INT16_MIN
#define NO_LOAD INT32_MIN

enum thermometer { THERMOMETER_HOST, THERMOMETER_MAX31855, THERMOMETER_MAX6675, THERMOMETER_THERMISTOR };
enum angle_sensor { ANGLE_POTENTIOMETER, ANGLE_ENCODER };

struct wiring {
    uint8_t thermometer[THERMOMETERS];  /* heater board: who measures a tube's temperature */
    uint8_t angle;                      /* sensor board */
    uint8_t second;                     /* sensor board: 1 = a potentiometer on A1 */
    uint8_t load;                       /* sensor board: 1 = an HX711 */
    uint16_t beta;                      /* of the thermistors, K */
    uint16_t ratio;                     /* of their series resistor to their resistance at 25 C, 0.001 */
};

/* A look at a chip cuts its conversion short, so looks wait for its longest: 0.22 s of a MAX6675, 0.1 s
 * of a MAX31855. Two looks fit into the half second within which heat has to be off. */
#define LOOK_MS 112
#define LOOK_SLOW_MS 224
#define JUMP 70                         /* no tube changes by more between two looks, 0.1 C */
#define BELIEVED 1100                   /* but a tube that seems too hot is one at once, 0.1 C */

struct channel {
    int16_t reading;                    /* newest that was sound, 0.1 C, or NO_READING */
    bool doubted;                       /* the look before gave nonsense: one alone is forgiven */
};

void wiring_clear(struct wiring *w);

/* Whether values may describe a wiring, on a heater board or a sensor board. */
bool wiring_plausible(const struct wiring *w, bool heater);

/* Time between two looks at a wiring's thermometers. */
uint8_t wiring_look_ms(const struct wiring *w);

/* Bits that a thermometer's chip sends, 0 where it is none. */
uint8_t thermometer_bits(uint8_t kind);

/* Temperature [0.1 C] in what a thermometer gave: a chip's word, or the sum of eight conversions of a
 * thermistor. NO_READING where it tells of a broken or absent thermocouple; `sense` is false where the
 * word is none that the chip sends. */
int16_t thermometer_read(const struct wiring *w, uint8_t kind, uint32_t word, bool *sense);

/* A look at a channel's thermometer: true where there is news, in `reading`. */
bool channel_look(struct channel *c, const struct wiring *w, uint8_t kind, uint32_t word);

/* Load in an HX711's 24 bits, counts. */
int32_t load_read(uint32_t word);

#endif
