#include "board.h"

#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <string.h>
#include <util/atomic.h>

#include "crc16.h"
#include "inputs_avr.h"
#include "limits.h"

#define HEATER_A PORTD6             /* Arduino pin 6, OC0A */
#define HEATER_B PORTD5             /* Arduino pin 5, OC0B */
#define HEATERS (_BV(HEATER_A) | _BV(HEATER_B))
#define STRAP PORTD4                /* Arduino pin 4 to GND makes a heater board */
#define FAN PORTD7                  /* Arduino pin 7 */
#define LAMP PORTB5                 /* the board's own lamp, pin 13: a heater is on */

#define BAUD_DIVISOR 16             /* 115200 (+2.1 %) with U2X at 16 MHz, as on every Uno */
#define MAIN_INPUT _BV(REFS0)       /* AVCC; input 0 */
#define INPUT_MASK 0x0F
#define TICK_COUNTS 2000            /* 1 ms of timer 1 at 0.5 us */

#define RX_SIZE 128                 /* powers of two */
#define TX_SIZE 256
#define DAMAGED 0x15                /* breaks a frame's checksum, and is noise to the old protocol */
#define SAMPLES 8                   /* one a millisecond: the main loop may be that much behind */
#define HEATING_MARK 0x48454154ul

#define REMEMBER_TICKS 16           /* ms between two looks at what is to be remembered */

/* Places in EEPROM; cell 0 is known to suffer in brown-outs. */
static uint8_t *const BOOT_CELLS = (uint8_t *)2;
static uint8_t *const HOT_CELL = (uint8_t *)4;      /* 1 while a tube may be hot */
static uint8_t *const TUBE_CELLS = (uint8_t *)8;
static uint8_t *const WIRING_CELLS = (uint8_t *)32;

/* Survive a reset: they tell whether a heater was on when it came, and how warm the tubes were. */
static uint32_t heating_mark __attribute__((section(".noinit")));
static struct thermal kept[CHANNELS] __attribute__((section(".noinit")));
static uint16_t kept_crc __attribute__((section(".noinit")));
static uint8_t reset_flags __attribute__((section(".noinit")));

/* Indices count freely and are masked where they are used: whatever value one has, none points outside. */
static volatile uint8_t rx[RX_SIZE], tx[TX_SIZE];
static volatile uint8_t rx_head, rx_tail, tx_head, tx_tail;
static volatile bool rx_lost;
static volatile uint8_t ticks;
static volatile uint32_t millis;
static volatile struct sample samples[SAMPLES];
static volatile uint8_t sample_head, sample_tail;
static uint8_t told[CHANNELS];
static bool hot_marked;
static uint8_t remembered;          /* ms since the last look */

/* Heaters off before anything else: before the stack, before the C runtime. */
void heaters_off_at_reset(void) __attribute__((naked, used, section(".init0")));
void heaters_off_at_reset(void)
{
    __asm__ volatile("cbi %0, %2\n\tcbi %0, %3\n\tsbi %1, %2\n\tsbi %1, %3\n\t"
                     :
                     : "I"(_SFR_IO_ADDR(PORTD)), "I"(_SFR_IO_ADDR(DDRD)), "I"(HEATER_A), "I"(HEATER_B));
}

/* The watchdog that caused a reset keeps running with 16 ms: give it its full time before RAM is set up. */
void keep_reset_flags(void) __attribute__((naked, used, section(".init3")));
void keep_reset_flags(void)
{
    reset_flags = MCUSR;
    MCUSR = 0;
    wdt_enable(WDTO_60MS);
}

/* Phase-correct PWM: 0 and 255 are steady levels. 490 Hz. board_heat connects the pins. */
void board_heaters_off(void)
{
    TCCR0A = _BV(WGM00);
    PORTD &= (uint8_t)~HEATERS;
    DDRD |= HEATERS;
    OCR0A = 0;
    OCR0B = 0;
    TCCR0B = _BV(CS01) | _BV(CS00);
    told[0] = 0;
    told[1] = 0;
    heating_mark = 0;
    PORTB &= (uint8_t)~_BV(LAMP);
}

static void start_clock(void)
{
    OCR1A = TICK_COUNTS - 1;
    TCCR1A = 0;
    TCCR1B = _BV(WGM12) | _BV(CS11);
    TIMSK1 = _BV(OCIE1A);
}

static void start_uart(void)
{
    UCSR0A = _BV(U2X0);
    UBRR0 = BAUD_DIVISOR;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

static void start_converter(void)
{
    ADMUX = MAIN_INPUT;
    DIDR0 = _BV(ADC0D);
    ADCSRA = _BV(ADEN) | _BV(ADIE) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);
}

static uint16_t count_boot(void)
{
    uint16_t boot = (uint16_t)(eeprom_read_byte(BOOT_CELLS) | eeprom_read_byte(BOOT_CELLS + 1) << 8);
    boot++;
    eeprom_update_byte(BOOT_CELLS, (uint8_t)boot);
    eeprom_update_byte(BOOT_CELLS + 1, (uint8_t)(boot >> 8));
    return boot;
}

static uint16_t crc_of(const void *data, uint8_t length)
{
    const uint8_t *byte = data;
    uint16_t crc = CRC16_INITIAL;
    while (length--) {
        crc = crc16_update(crc, *byte++);
    }
    return crc;
}

/* Read what `keep` wrote; whether it is whole. */
static bool fetch(void *data, uint8_t length, const uint8_t *cells)
{
    eeprom_read_block(data, cells, length);
    return eeprom_read_word((const uint16_t *)(cells + length)) == crc_of(data, length);
}

/* Write with a checksum behind. */
static void keep(const void *data, uint8_t length, uint8_t *cells)
{
    const uint8_t *byte = data;
    uint16_t crc = crc_of(data, length);
    for (uint8_t i = 0; i < length + 2; i++) {
        wdt_reset();
        uint8_t check = (uint8_t)(i == length ? crc : crc >> 8);
        eeprom_update_byte(cells + i, i < length ? byte[i] : check);
    }
}

static void recall(struct memory *memory, uint8_t cause, enum role role)
{
    bool sound = fetch(memory->tube, sizeof memory->tube, TUBE_CELLS);
    if (!fetch(&memory->wiring, sizeof memory->wiring, WIRING_CELLS) ||
        !wiring_plausible(&memory->wiring, role == ROLE_HEATER)) {
        wiring_clear(&memory->wiring);
    }
    for (uint8_t i = 0; i < CHANNELS; i++) {
        if (!sound || !thermal_plausible(&memory->tube[i])) {
            memory->tube[i] = (struct tube){0, 0};
        }
        memory->thermal[i] = kept[i];
    }
    hot_marked = eeprom_read_byte(HOT_CELL) == 1;
    memory->hot = hot_marked;
    memory->known = !(cause & _BV(PORF)) && kept_crc == crc_of(kept, sizeof kept);
}

void board_remember(const struct safety *safety)
{
    if (++remembered < REMEMBER_TICKS) {
        return;
    }
    remembered = 0;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        kept[i] = safety->thermal[i];
    }
    kept_crc = crc_of(kept, sizeof kept);
    bool hot = safety_any_warm(safety, hot_marked ? HOT_MARK / 2 : HOT_MARK);
    if (hot != hot_marked && eeprom_is_ready()) {
        hot_marked = hot;
        eeprom_update_byte(HOT_CELL, hot);  /* goes on by itself; nothing waits */
    }
}

void board_store_tubes(const struct tube tube[CHANNELS])
{
    keep(tube, CHANNELS * sizeof *tube, TUBE_CELLS);
}

void board_store_wiring(const struct wiring *wiring)
{
    keep(wiring, sizeof *wiring, WIRING_CELLS);
}

struct start board_start(struct memory *memory)
{
    struct start start;
    start.cause = reset_flags & (_BV(PORF) | _BV(EXTRF) | _BV(BORF) | _BV(WDRF));
    start.was_heating = heating_mark == HEATING_MARK;
    board_heaters_off();
    DDRB |= _BV(LAMP);
    board_fan(false);
    DDRD |= _BV(FAN);
    PORTD |= _BV(STRAP);
    start.boot = count_boot();
    start.role = PIND & _BV(STRAP) ? ROLE_SENSOR : ROLE_HEATER;
    recall(memory, start.cause, start.role);
    start_clock();
    start_uart();
    start_converter();
    SMCR = 0;                           /* idle: everything but the core goes on */
    wdt_reset();
    sei();
    return start;
}

ISR(TIMER1_COMPA_vect)
{
    ADCSRA |= _BV(ADSC);
    millis++;
    ticks++;
}

ISR(ADC_vect)
{
    if (ADMUX != MAIN_INPUT) {
        inputs_converted(ADMUX & INPUT_MASK, ADC);
        ADMUX = MAIN_INPUT;
        return;
    }
    /* The conversion began with the millisecond; the interrupt's own delay is no part of the stamp. */
    volatile struct sample *sample = &samples[sample_head & (SAMPLES - 1)];
    sample->micros = millis * 1000ul;
    sample->angle = inputs_angle(ADC);
    sample->second = inputs_second();
    sample_head++;
    uint8_t other = inputs_next();
    if (other) {                        /* it is over long before the next millisecond */
        ADMUX = MAIN_INPUT | other;
        ADCSRA |= _BV(ADSC);
    }
}

ISR(USART_RX_vect)
{
    uint8_t damaged = UCSR0A & (_BV(FE0) | _BV(DOR0));
    uint8_t byte = UDR0;
    if (damaged) {
        byte = DAMAGED;
    }
    if ((uint8_t)(rx_head - rx_tail) >= RX_SIZE) {
        rx_lost = true;
        return;
    }
    if (rx_lost) {
        rx_lost = false;
        byte = DAMAGED;                 /* what follows a loss is joined to nothing before it */
    }
    rx[rx_head & (RX_SIZE - 1)] = byte;
    rx_head++;
}

ISR(USART_UDRE_vect)
{
    if (tx_tail == tx_head) {
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
        return;
    }
    UDR0 = tx[tx_tail];
    tx_tail = (uint8_t)(tx_tail + 1);
}

uint8_t board_take_ticks(void)
{
    uint8_t taken;
    ATOMIC_BLOCK(ATOMIC_FORCEON)
    {
        taken = ticks;
        ticks = 0;
    }
    return taken;
}

void board_alive(void)
{
    wdt_reset();
}

bool board_take_sample(struct sample *sample)
{
    uint8_t behind = (uint8_t)(sample_head - sample_tail);
    if (behind == 0) {
        return false;
    }
    if (behind > SAMPLES) {             /* the oldest have been written over */
        sample_tail = (uint8_t)(sample_head - SAMPLES);
    }
    sample->micros = samples[sample_tail & (SAMPLES - 1)].micros;
    sample->angle = samples[sample_tail & (SAMPLES - 1)].angle;
    sample->second = samples[sample_tail & (SAMPLES - 1)].second;
    sample_tail++;
    return true;
}

int16_t board_receive(void)
{
    if (rx_tail == rx_head) {
        return -1;
    }
    volatile uint8_t *cell = &rx[rx_tail & (RX_SIZE - 1)];
    uint8_t byte = *cell;
    *cell = 0;                          /* were an index damaged, no command would be heard twice */
    rx_tail++;
    return byte;
}

void board_send(const char *data, uint8_t length)
{
    uint8_t free = (uint8_t)(tx_tail - tx_head - 1);
    if (length > free) {
        return;
    }
    while (length--) {
        tx[tx_head] = (uint8_t)*data++;
        tx_head = (uint8_t)(tx_head + 1);
    }
    UCSR0B |= _BV(UDRIE0);
}

/* A pin that is off is cut from the timer and held low; the mark for the next boot is kept. */
void board_heat(uint8_t channel, uint8_t duty)
{
    if (told[channel] == duty) {
        return;
    }
    told[channel] = duty;
    if (told[0] || told[1]) {
        heating_mark = HEATING_MARK;
        PORTB |= _BV(LAMP);
    } else {
        heating_mark = 0;
        PORTB &= (uint8_t)~_BV(LAMP);
    }
    if (channel == 0) {
        OCR0A = duty;
        TCCR0A = duty ? TCCR0A | _BV(COM0A1) : TCCR0A & (uint8_t)~_BV(COM0A1);
    } else {
        OCR0B = duty;
        TCCR0A = duty ? TCCR0A | _BV(COM0B1) : TCCR0A & (uint8_t)~_BV(COM0B1);
    }
}

bool board_heats_as_told(void)
{
    uint8_t mode = _BV(WGM00);
    if (told[0]) {
        mode |= _BV(COM0A1);
    }
    if (told[1]) {
        mode |= _BV(COM0B1);
    }
    return OCR0A == told[0] && OCR0B == told[1] && TCCR0A == mode &&
           TCCR0B == (_BV(CS01) | _BV(CS00)) && (PORTD & HEATERS) == 0 && (DDRD & HEATERS) == HEATERS;
}

uint16_t board_analog(uint8_t input)
{
    uint16_t value;
    if (input >= 14) {
        input = (uint8_t)(input - 14);  /* A0 is also called pin 14 */
    }
    if (input > 5) {
        return 0;
    }
    ATOMIC_BLOCK(ATOMIC_FORCEON)
    {
        uint8_t control = ADCSRA & (uint8_t)~(_BV(ADIE) | _BV(ADSC));
        ADCSRA = control;               /* this conversion is no sample of the angle */
        while (ADCSRA & _BV(ADSC)) {
        }
        ADMUX = MAIN_INPUT | input;
        ADCSRA = control | _BV(ADSC);
        while (ADCSRA & _BV(ADSC)) {
        }
        value = ADC;
        ADMUX = MAIN_INPUT;
        ADCSRA = control | _BV(ADIF) | _BV(ADIE);
    }
    return value;
}

bool board_digital(uint8_t pin)
{
    if (pin < 8) {
        return PIND & _BV(pin);
    }
    if (pin < 14) {
        return PINB & _BV(pin - 8);
    }
    return PINC & _BV(pin - 14);
}

void board_idle(void)
{
    cli();
    if (ticks == 0 && rx_tail == rx_head && sample_tail == sample_head) {
        SMCR = _BV(SE);
        sei();                          /* takes effect after the next instruction: no wake-up is lost */
        sleep_cpu();
        SMCR = 0;
    }
    sei();
}

void board_fan(bool on)
{
    if (on) {
        PORTD |= _BV(FAN);
    } else {
        PORTD &= (uint8_t)~_BV(FAN);
    }
}
