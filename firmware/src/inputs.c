#include "inputs.h"

#include <math.h>
#include <stddef.h>

#define CONVERSIONS 8
#define CONVERTER_TOP 1023u
#define END 8u                  /* counts from an end of the range within which a wire is broken or shorted */
#define KELVIN 273.15f
#define ROOM_KELVIN 298.15f     /* 25 C, for which a thermistor's resistance is stated */

/* MAX31855: 14 bits of temperature, then what is always 0, then faults and the chip's own temperature. */
#define MAX31855_ZEROS 0x00020008ul
#define MAX31855_FAULTS 0x00010007ul
/* MAX6675: a zero, 12 bits of temperature, open thermocouple, a zero, and a bit that floats. */
#define MAX6675_ZEROS 0x8002u
#define MAX6675_OPEN 0x0004u

void wiring_clear(struct wiring *w)
{
    *w = (struct wiring){{THERMOMETER_HOST, THERMOMETER_HOST}, ANGLE_POTENTIOMETER, 0, 0, 3950, 1000};
}

bool wiring_plausible(const struct wiring *w, bool heater)
{
    bool thermometers = w->thermometer[0] || w->thermometer[1];
    bool sensors = w->angle || w->second || w->load;
    return w->thermometer[0] <= THERMOMETER_THERMISTOR && w->thermometer[1] <= THERMOMETER_THERMISTOR &&
           w->angle <= ANGLE_ENCODER && w->second <= 1 && w->load <= 1 && w->beta >= 1000 &&
           w->beta <= 9999 && w->ratio >= 10 && !(heater ? sensors : thermometers);
}

uint8_t wiring_look_ms(const struct wiring *w)
{
    bool slow = w->thermometer[0] == THERMOMETER_MAX6675 || w->thermometer[1] == THERMOMETER_MAX6675;
    return slow ? LOOK_SLOW_MS : LOOK_MS;
}

uint8_t thermometer_bits(uint8_t kind)
{
    return kind == THERMOMETER_MAX31855 ? 32 : kind == THERMOMETER_MAX6675 ? 16 : 0;
}

/* Quarters of a degree to tenths, a half towards the even one: no bias. */
static int16_t tenths(int16_t quarters)
{
    int16_t doubled = (int16_t)(quarters * 5), half = (int16_t)(doubled / 2);
    return doubled % 2 && half % 2 ? (int16_t)(half + (doubled > 0 ? 1 : -1)) : half;
}

static int16_t thermistor(const struct wiring *w, uint32_t sum, bool *sense)
{
    const uint32_t top = CONVERSIONS * CONVERTER_TOP;
    *sense = sum <= top;
    if (sum < CONVERSIONS * END || sum > top - CONVERSIONS * END) {
        return NO_READING;
    }
    float resistance = (float)w->ratio * 0.001f * (float)sum / (float)(top - sum);
    float kelvin = 1.0f / (1.0f / ROOM_KELVIN + logf(resistance) / (float)w->beta);
    return (int16_t)lroundf(10.0f * (kelvin - KELVIN));
}

int16_t thermometer_read(const struct wiring *w, uint8_t kind, uint32_t word, bool *sense)
{
    if (kind == THERMOMETER_THERMISTOR) {
        return thermistor(w, word, sense);
    }
    if (kind == THERMOMETER_MAX31855) {
        bool fault = word & MAX31855_FAULTS;
        *sense = word != 0 && !(word & MAX31855_ZEROS);
        return fault ? NO_READING : tenths((int16_t)((int32_t)word >> 18));
    }
    *sense = word != 0 && !(word & MAX6675_ZEROS);
    return word & MAX6675_OPEN ? NO_READING : tenths((int16_t)(word >> 3));
}

bool channel_look(struct channel *c, const struct wiring *w, uint8_t kind, uint32_t word)
{
    bool sense = true;
    int16_t reading = thermometer_read(w, kind, word, &sense);
    if (sense && reading != NO_READING && c->reading != NO_READING && reading <= BELIEVED) {
        int16_t change = (int16_t)(reading - c->reading);
        sense = change <= JUMP && change >= -JUMP;
    }
    if (!sense && !c->doubted) {
        c->doubted = true;
        return false;
    }
    c->doubted = false;
    c->reading = sense ? reading : NO_READING;
    return true;
}

int32_t load_read(uint32_t word)
{
    return word & 0x800000ul ? (int32_t)(word | 0xFF000000ul) : (int32_t)word;
}
