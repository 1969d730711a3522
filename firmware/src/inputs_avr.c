#include "inputs_avr.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>
#include <util/delay_basic.h>

/* Arduino pins 8 to 11. A chip's data pin has a pull-up: where none answers, all bits are 1. */
#define CLOCK PORTB0
#define DATA PORTB1
static const uint8_t selects[THERMOMETERS] = {_BV(PORTB2), _BV(PORTB3)};
/* An encoder on Arduino pins 2 and 3. */
#define ENCODER_A PORTD2
#define ENCODER_B PORTD3
#define ENCODER_MIDDLE 0x8000u
#define SECOND_INPUT 1                  /* A1 */
#define THERMISTOR_INPUT 2              /* A2, A3 */
#define CONVERSIONS 8
#define SPREAD 40                       /* counts by which conversions of one thermistor may differ */
#define NONSENSE UINT16_MAX
#define LOAD_BITS 24

static bool encoder, second, thermistor[THERMOMETERS];
/* Survive a reset: where an encoder is. */
#define MARK 0x5A
static volatile uint16_t count __attribute__((section(".noinit")));
static volatile uint16_t not_count __attribute__((section(".noinit")));
static volatile uint8_t phase __attribute__((section(".noinit")));
static uint8_t mark __attribute__((section(".noinit")));
static volatile uint16_t second_adc;
static volatile uint16_t gathering[THERMOMETERS], sums[THERMOMETERS];
static volatile uint16_t lowest[THERMOMETERS], highest[THERMOMETERS];
static volatile uint8_t gathered[THERMOMETERS];
static volatile uint8_t turn;

static uint8_t encoder_phase(void)
{
    /* Gray code to 0, 1, 2, 3. */
    uint8_t a = PIND & _BV(ENCODER_A) ? 1 : 0, b = PIND & _BV(ENCODER_B) ? 1 : 0;
    return (uint8_t)(b << 1 | (a ^ b));
}

/* Four counts a period; a step of two is a lost edge: it counts as none, and the zero is lost. */
static void encoder_turned(void)
{
    uint8_t now = encoder_phase();
    uint8_t step = (uint8_t)(now - phase) & 3u;
    phase = now;
    if (step == 1) {
        count++;
    } else if (step == 3) {
        count--;
    } else if (step == 2) {
        mark = 0;
    }
    not_count = (uint16_t)~count;
}

void inputs_mark(void)
{
    mark = MARK;
}

bool inputs_marked(void)
{
    return encoder && mark == MARK;
}

void inputs_begin(const struct wiring *wiring, bool kept)
{
    bool chips = wiring->thermometer[0] || wiring->thermometer[1] || wiring->load;
    encoder = wiring->angle == ANGLE_ENCODER;
    second = wiring->second;
    for (uint8_t i = 0; i < THERMOMETERS; i++) {
        thermistor[i] = wiring->thermometer[i] == THERMOMETER_THERMISTOR;
        sums[i] = gathering[i] = gathered[i] = 0;
        if (thermometer_bits(wiring->thermometer[i])) {
            PORTB |= selects[i];
            DDRB |= selects[i];
        }
    }
    if (chips) {
        PORTB = (uint8_t)((PORTB & ~_BV(CLOCK)) | _BV(DATA));
        DDRB = (uint8_t)((DDRB | _BV(CLOCK)) & ~_BV(DATA));
    }
    DIDR0 = (uint8_t)(_BV(ADC0D) | second << ADC1D | thermistor[0] << ADC2D | thermistor[1] << ADC3D);
    EIMSK = 0;
    if (encoder) {
        DDRD &= (uint8_t)~(_BV(ENCODER_A) | _BV(ENCODER_B));
        PORTD |= _BV(ENCODER_A) | _BV(ENCODER_B);
        if (!kept || not_count != (uint16_t)~count) {
            count = ENCODER_MIDDLE;
            phase = encoder_phase();
            mark = 0;
        }
        encoder_turned();
        EICRA = _BV(ISC00) | _BV(ISC10);        /* every edge of both */
        EIFR = _BV(INTF0) | _BV(INTF1);
        EIMSK = _BV(INT0) | _BV(INT1);
    }
}

ISR(INT0_vect)
{
    encoder_turned();
}

ISR(INT1_vect)
{
    encoder_turned();
}

static uint32_t shifted_in(uint8_t bits)
{
    uint32_t word = 0;
    while (bits--) {
        word = word << 1 | (PINB & _BV(DATA) ? 1u : 0u);
        PORTB |= _BV(CLOCK);
        _delay_loop_1(3);
        PORTB &= (uint8_t)~_BV(CLOCK);
        _delay_loop_1(3);
    }
    return word;
}

uint32_t inputs_thermometer(uint8_t channel, uint8_t kind)
{
    if (kind == THERMOMETER_THERMISTOR) {
        uint16_t sum;
        ATOMIC_BLOCK(ATOMIC_FORCEON)
        {
            sum = sums[channel];
        }
        return sum;
    }
    PORTB &= (uint8_t)~selects[channel];
    _delay_loop_1(3);
    uint32_t word = shifted_in(thermometer_bits(kind));
    PORTB |= selects[channel];
    return word;
}

/* Data low: a conversion is ready. The clock's high time stays below the 50 us that switch the chip off,
 * and a 25th pulse asks for the next conversion, input A with gain 128. */
bool inputs_take_load(uint32_t *word)
{
    if (PINB & _BV(DATA)) {
        return false;
    }
    uint32_t bits = 0;
    for (uint8_t i = 0; i <= LOAD_BITS; i++) {
        ATOMIC_BLOCK(ATOMIC_FORCEON)
        {
            PORTB |= _BV(CLOCK);
            _delay_loop_1(3);
            if (i < LOAD_BITS) {
                bits = bits << 1 | (PINB & _BV(DATA) ? 1u : 0u);
            }
            PORTB &= (uint8_t)~_BV(CLOCK);
        }
        _delay_loop_1(3);
    }
    *word = bits;
    return true;
}

uint16_t inputs_angle(uint16_t adc)
{
    return encoder ? count : adc;
}

uint16_t inputs_second(void)
{
    return second_adc;
}

/* One more input a millisecond, by turns. */
uint8_t inputs_next(void)
{
    if (second) {
        return SECOND_INPUT;
    }
    for (uint8_t i = 0; i < THERMOMETERS; i++) {
        turn ^= 1;
        if (thermistor[turn]) {
            return (uint8_t)(THERMISTOR_INPUT + turn);
        }
    }
    return 0;
}

void inputs_converted(uint8_t input, uint16_t adc)
{
    if (input == SECOND_INPUT) {
        second_adc = adc;
        return;
    }
    uint8_t i = (input - THERMISTOR_INPUT) & 1u;
    gathering[i] = (uint16_t)(gathering[i] + adc);
    if (gathered[i] == 0 || adc < lowest[i]) {
        lowest[i] = adc;
    }
    if (gathered[i] == 0 || adc > highest[i]) {
        highest[i] = adc;
    }
    if (++gathered[i] == CONVERSIONS) {
        sums[i] = highest[i] - lowest[i] > SPREAD ? NONSENSE : gathering[i];
        gathering[i] = gathered[i] = 0;
    }
}
