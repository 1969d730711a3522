/* libsimavr behind a handful of functions, so that Python needs to know none of its structures.
 *
 * A board runs in virtual time: bridge_run goes to a cycle and returns. Bytes to the board arrive at
 * the line's speed; heater duty is read from the timer's and the port's registers. */
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_time.h>

#define QUEUE_SIZE 65536u           /* bytes under way in one direction */
#define CHANNELS 2
#define ADDRESS_SPACE 0x10100u      /* every address that 16 bits and an offset can name */
#define FLASH_SPACE 0x20000u
#define CONVERSIONS 4096u           /* not yet looked at */

/* ATmega328P, addresses in data space. */
enum {
    REG_DDRD = 0x2A,
    REG_PORTD = 0x2B,
    REG_TCCR0A = 0x44,
    REG_TCCR0B = 0x45,
    REG_OCR0A = 0x47,
    REG_OCR0B = 0x48,
    REG_MCUSR = 0x54,
    FLASH_END = 0x7FFF
};
static const uint8_t heater_pin[CHANNELS] = {6, 5};
static const uint8_t heater_compare[CHANNELS] = {REG_OCR0A, REG_OCR0B};
static const uint8_t heater_mode_bit[CHANNELS] = {7, 5};    /* COM0A1, COM0B1 */

struct queue {
    uint8_t bytes[QUEUE_SIZE];
    uint32_t head, tail;
};

/* Pins of port B: a clock, a data line that all chips share, and each thermometer's select. */
enum { PIN_CLOCK = 0, PIN_DATA = 1, PIN_SELECT = 2, PIN_ENCODER = 2, PIN_STRAP = 4, PIN_FAN = 7 };
#define LOAD_BITS 24
#define LOAD_PERIOD 1600000u        /* an HX711 converts ten times a second */
#define ENCODER_STEP 800u           /* cycles between two edges at most: 20,000 a second */

/* A thermometer's chip: its word goes out bit by bit, the first as it is selected. */
struct chip {
    uint32_t word, shifted;
    int bits;                       /* 0: there is none */
    bool selected;
    uint32_t reads;                 /* times that it was let go after having been selected */
};

struct load_cell {
    uint32_t word;
    bool there, ready;
    int pulses;                     /* since the conversion was ready */
    uint64_t next;                  /* cycle at which it will be */
};

struct bridge {
    avr_t *avr;
    struct chip chip[CHANNELS];
    struct load_cell load;
    int64_t encoder, encoder_wanted;
    uint64_t encoder_next;
    bool began;                     /* the firmware has set its ports up */
    uint8_t outside_mask[2], outside[2];    /* levels put on pins of ports B and D */
    elf_firmware_t firmware;
    avr_irq_t *uart_input;
    struct queue to_board, from_board;
    uint32_t cycles_per_byte;
    uint64_t conversions[CONVERSIONS];  /* cycles at which the converter was started */
    uint32_t conversion_head, conversion_tail;
    double duty_cycles[CHANNELS];       /* sum of duty (0-255) times cycles */
    int peak[CHANNELS];                 /* highest duty since the last look */
};

static bool put(struct queue *q, uint8_t byte)
{
    if (q->head - q->tail == QUEUE_SIZE) {
        return false;
    }
    q->bytes[q->head++ % QUEUE_SIZE] = byte;
    return true;
}

static void silent(avr_t *avr, const int level, const char *format, va_list arguments)
{
    (void)avr, (void)level, (void)format, (void)arguments;
}

static void no_sleep(avr_t *avr, avr_cycle_count_t cycles)
{
    (void)avr, (void)cycles;            /* virtual time does not wait */
}

static void byte_from_board(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    put(&((struct bridge *)param)->from_board, (uint8_t)value);
}

static void conversion_starts(avr_irq_t *irq, uint32_t value, void *param)
{
    struct bridge *b = param;
    (void)irq, (void)value;
    if (b->conversion_head - b->conversion_tail < CONVERSIONS) {
        b->conversions[b->conversion_head++ % CONVERSIONS] = b->avr->cycle;
    }
}

static avr_cycle_count_t feed(avr_t *avr, avr_cycle_count_t when, void *param)
{
    struct bridge *b = param;
    (void)avr;
    if (b->to_board.head == b->to_board.tail) {
        return 0;
    }
    avr_raise_irq(b->uart_input, b->to_board.bytes[b->to_board.tail++ % QUEUE_SIZE]);
    return when + b->cycles_per_byte;
}

static avr_cycle_count_t stop_here(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr, (void)when, (void)param;
    return 0;
}

/* A program gone wild reads and writes anywhere: simavr tells of a crash, but goes on to do it. */
static bool make_room(avr_t *avr)
{
    uint8_t *data = realloc(avr->data, ADDRESS_SPACE);
    if (data != NULL) {
        memset(data + avr->ramend + 1, 0, ADDRESS_SPACE - avr->ramend - 1);
        avr->data = data;
    }
    uint8_t *flash = realloc(avr->flash, FLASH_SPACE);
    if (flash != NULL) {
        memset(flash + avr->flashend + 4, 0xFF, FLASH_SPACE - avr->flashend - 4);
        avr->flash = flash;
    }
    return data != NULL && flash != NULL;
}

/* Put a level on a pin of port B (0) or D (1), against its pull-up. */
static void level(struct bridge *b, int port, int pin, int value)
{
    char name = "BD"[port];
    b->outside_mask[port] |= (uint8_t)(1u << pin);
    b->outside[port] = (uint8_t)((b->outside[port] & ~(1u << pin)) | (unsigned)value << pin);
    avr_ioport_external_t outside = {
        .name = (unsigned char)name, .mask = b->outside_mask[port], .value = b->outside[port]};
    avr_ioctl(b->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(name), &outside);
    avr_raise_irq(avr_io_getirq(b->avr, AVR_IOCTL_IOPORT_GETIRQ(name), pin), (uint32_t)value);
}

static void put_data(struct bridge *b)
{
    int data = 1;                       /* nobody drives it: the pull-up does */
    for (int i = 0; i < CHANNELS; i++) {
        struct chip *chip = &b->chip[i];
        if (chip->selected && chip->bits) {
            data &= (int)(chip->shifted >> 31);
        }
    }
    if (b->load.there && b->load.ready) {
        int left = LOAD_BITS - b->load.pulses;
        data &= b->load.pulses == 0 ? 0 : left >= 0 ? (int)(b->load.word >> left & 1u) : 1;
    }
    level(b, 0, PIN_DATA, data);
}

static void clock_moves(avr_irq_t *irq, uint32_t value, void *param)
{
    struct bridge *b = param;
    (void)irq;
    for (int i = 0; i < CHANNELS; i++) {
        if (b->chip[i].selected && !value) {
            b->chip[i].shifted <<= 1;
        }
    }
    if (b->load.ready && value && ++b->load.pulses > LOAD_BITS) {
        b->load.ready = false;
        b->load.next = b->avr->cycle + LOAD_PERIOD;
    }
    put_data(b);
}

static void select_moves(avr_irq_t *irq, uint32_t value, void *param)
{
    struct bridge *b = param;
    for (int i = 0; i < CHANNELS; i++) {
        struct chip *chip = &b->chip[i];
        if (irq == avr_io_getirq(b->avr, AVR_IOCTL_IOPORT_GETIRQ('B'), PIN_SELECT + i)) {
            chip->reads += chip->selected && value;
            chip->selected = !value;
            chip->shifted = chip->bits ? chip->word << (32 - chip->bits) : 0;
        }
    }
    put_data(b);
}

/* After a reset simavr remembers the pins' levels, but the registers in which they are read do not. */
static void level_again(struct bridge *b)
{
    for (int port = 0; port < 2; port++) {
        avr_irq_t *pins = avr_io_getirq(b->avr, AVR_IOCTL_IOPORT_GETIRQ("BD"[port]), 0);
        for (int pin = 0; pin < 8; pin++) {
            pins[pin].value = 0;
            if (b->outside_mask[port] >> pin & 1) {
                avr_raise_irq(pins + pin, b->outside[port] >> pin & 1);
            }
        }
    }
}

/* What happens at the chips by itself. */
static void pass(struct bridge *b)
{
    uint64_t now = b->avr->cycle;
    bool began = b->avr->data[REG_PORTD] >> PIN_STRAP & 1;
    if (b->began && !began) {
        level_again(b);
    }
    b->began = began;
    if (b->load.there && !b->load.ready && now >= b->load.next) {
        b->load.ready = true;
        b->load.pulses = 0;
        put_data(b);
    }
    if (b->encoder != b->encoder_wanted && now >= b->encoder_next) {
        b->encoder += b->encoder < b->encoder_wanted ? 1 : -1;
        b->encoder_next = now + ENCODER_STEP;
        int phase = (int)(b->encoder & 3);
        level(b, 1, PIN_ENCODER, phase == 1 || phase == 2);
        level(b, 1, PIN_ENCODER + 1, phase >= 2);
    }
}

/* A channel's thermometer chip sends this word of so many bits from now on; 0 bits: it is gone. */
void bridge_chip(struct bridge *b, int channel, uint32_t word, int bits)
{
    b->chip[channel].word = word;
    b->chip[channel].bits = bits;
}

/* How often a channel's chip has been read. */
uint32_t bridge_chip_reads(struct bridge *b, int channel)
{
    return b->chip[channel].reads;
}

/* The load cell's converter gives these 24 bits from its next conversion on; or it is gone. */
void bridge_load(struct bridge *b, uint32_t word, int there)
{
    b->load.word = word;
    b->load.there = there;
    if (!there) {
        b->load.ready = false;
        put_data(b);
    }
}

/* Turn the encoder there, edge by edge. */
void bridge_encoder(struct bridge *b, int64_t count)
{
    b->encoder_wanted = count;
}

/* Whether the fan's pin is high. */
int bridge_fan(struct bridge *b)
{
    return b->avr->data[REG_DDRD] & b->avr->data[REG_PORTD] & (1u << PIN_FAN) ? 1 : 0;
}

void bridge_close(struct bridge *b)
{
    avr_terminate(b->avr);
    free(b->avr);
    free(b->firmware.flash);
    free(b->firmware.eeprom);
    free(b);
}

struct bridge *bridge_open(const char *elf, uint32_t frequency, uint32_t baud)
{
    avr_global_logger_set(silent);
    struct bridge *b = calloc(1, sizeof *b);
    if (b == NULL || elf_read_firmware(elf, &b->firmware) != 0) {
        free(b);
        return NULL;
    }
    b->avr = avr_make_mcu_by_name("atmega328p");
    if (b->avr == NULL) {
        free(b);
        return NULL;
    }
    avr_init(b->avr);
    if (!make_room(b->avr)) {
        bridge_close(b);
        return NULL;
    }
    b->firmware.frequency = frequency;
    b->firmware.vcc = b->firmware.avcc = b->firmware.aref = 5000;
    avr_load_firmware(b->avr, &b->firmware);
    b->avr->sleep = no_sleep;
    b->avr->log = LOG_NONE;
    /* simavr's receiver takes 11 bit times a byte; what came faster would pile up and be lost there. */
    b->cycles_per_byte = 11u * frequency / baud;
    avr_extint_set_strict_lvl_trig(b->avr, 0, 0);
    avr_extint_set_strict_lvl_trig(b->avr, 1, 0);
    uint32_t flags = 0;                 /* neither echo on stdout nor real waiting */
    avr_ioctl(b->avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    b->uart_input = avr_io_getirq(b->avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(
        avr_io_getirq(b->avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), byte_from_board, b);
    avr_irq_register_notify(avr_io_getirq(b->avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER),
                            conversion_starts, b);
    avr_irq_t *port = avr_io_getirq(b->avr, AVR_IOCTL_IOPORT_GETIRQ('B'), 0);
    avr_irq_register_notify(port + PIN_CLOCK, clock_moves, b);
    for (int i = 0; i < CHANNELS; i++) {
        avr_irq_register_notify(port + PIN_SELECT + i, select_moves, b);
    }
    return b;
}

/* Duty (0-255) that a channel's driver sees. A floating pin is off: its pull-down holds it. A pull-up,
 * or a timer that stands still while it has the pin, counts as fully on. */
int bridge_duty(struct bridge *b, int channel)
{
    const uint8_t *data = b->avr->data;
    uint8_t pin = (uint8_t)(1u << heater_pin[channel]);
    if (!(data[REG_DDRD] & pin)) {
        return data[REG_PORTD] & pin ? 255 : 0;
    }
    if (data[REG_TCCR0A] >> heater_mode_bit[channel] & 1u) {
        return data[REG_TCCR0B] & 7u ? data[heater_compare[channel]] : 255;
    }
    return data[REG_PORTD] & pin ? 255 : 0;
}

/* Run to a cycle. A processor that sleeps for good or has crashed stands still while its watchdog runs. */
void bridge_run(struct bridge *b, uint64_t until)
{
    avr_t *avr = b->avr;
    if (until <= avr->cycle) {
        return;
    }
    avr_cycle_timer_register(avr, until - avr->cycle, stop_here, b);
    /* A reset forgets all timers, this one too. */
    if (b->to_board.head != b->to_board.tail && avr_cycle_timer_status(avr, feed, b) == 0) {
        avr_cycle_timer_register(avr, b->cycles_per_byte, feed, b);
    }
    while (avr->cycle < until) {
        uint64_t before = avr->cycle;
        int duty[CHANNELS];
        for (int i = 0; i < CHANNELS; i++) {
            duty[i] = bridge_duty(b, i);
            if (duty[i] > b->peak[i]) {
                b->peak[i] = duty[i];
            }
        }
        pass(b);
        if (avr->state != cpu_Running && avr->state != cpu_Sleeping) {
            avr->cycle += 100;
        }
        avr_run(avr);
        for (int i = 0; i < CHANNELS; i++) {
            b->duty_cycles[i] += duty[i] * (double)(avr->cycle - before);
        }
    }
    avr_cycle_timer_cancel(avr, stop_here, b);
}

uint64_t bridge_cycle(struct bridge *b)
{
    return b->avr->cycle;
}

double bridge_duty_cycles(struct bridge *b, int channel)
{
    return b->duty_cycles[channel];
}

/* Highest duty of a channel since the last call. */
int bridge_peak(struct bridge *b, int channel)
{
    int peak = b->peak[channel];
    b->peak[channel] = bridge_duty(b, channel);
    return peak;
}

/* Bytes for the board; tells how many were taken. */
uint32_t bridge_send(struct bridge *b, const uint8_t *bytes, uint32_t count)
{
    uint32_t taken = 0;
    while (taken < count && put(&b->to_board, bytes[taken])) {
        taken++;
    }
    return taken;
}

/* Bytes that have not reached the board yet. */
uint32_t bridge_unsent(struct bridge *b)
{
    return b->to_board.head - b->to_board.tail;
}

uint32_t bridge_receive(struct bridge *b, uint8_t *bytes, uint32_t room)
{
    uint32_t count = 0;
    while (count < room && b->from_board.tail != b->from_board.head) {
        bytes[count++] = b->from_board.bytes[b->from_board.tail++ % QUEUE_SIZE];
    }
    return count;
}

/* Cycle at which the next conversion that nobody asked for yet was started; 0 where there is none. */
uint64_t bridge_next_conversion(struct bridge *b)
{
    if (b->conversion_tail == b->conversion_head) {
        return 0;
    }
    return b->conversions[b->conversion_tail++ % CONVERSIONS];
}

void bridge_drop_unsent(struct bridge *b)
{
    b->to_board.tail = b->to_board.head;
}

void bridge_analog(struct bridge *b, int input, uint32_t millivolts)
{
    avr_raise_irq(avr_io_getirq(b->avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + input), millivolts);
}

/* Wire a pin of port D to ground. */
void bridge_ground_pin_d(struct bridge *b, int pin)
{
    level(b, 1, pin, 0);
}

/* Reset with a cause as MCUSR tells it; `forget` loses RAM as power-on does. */
void bridge_reset(struct bridge *b, uint8_t cause, int forget)
{
    avr_t *avr = b->avr;
    avr_reset(avr);
    avr->data[REG_MCUSR] = cause;
    if (forget) {
        for (int address = avr->ioend + 1; address <= avr->ramend; address++) {
            avr->data[address] = (uint8_t)(address * 73 + 41);
        }
    }
}

/* Send the processor into an endless loop at the end of flash, with interrupts on or off. */
void bridge_hang(struct bridge *b, int interrupts)
{
    b->avr->flash[FLASH_END - 1] = 0xFF;        /* rjmp .-2 */
    b->avr->flash[FLASH_END] = 0xCF;
    b->avr->pc = FLASH_END - 1;
    b->avr->sreg[S_I] = (uint8_t)interrupts;
    b->avr->state = cpu_Running;
}

/* Let the processor go on at another place, as after a hit on the program counter. */
void bridge_jump(struct bridge *b, uint32_t address)
{
    b->avr->pc = address & ~1u;
    b->avr->state = cpu_Running;
}

void bridge_poke(struct bridge *b, uint16_t address, uint8_t value)
{
    b->avr->data[address] = value;
}

uint8_t bridge_peek(struct bridge *b, uint16_t address)
{
    return b->avr->data[address];
}

/* Put bytes into EEPROM, as an earlier life of the board has left them. */
void bridge_eeprom(struct bridge *b, uint16_t address, uint8_t *bytes, uint32_t count)
{
    avr_eeprom_desc_t cells = {.ee = bytes, .offset = address, .size = count};
    avr_ioctl(b->avr, AVR_IOCTL_EEPROM_SET, &cells);
}

uint32_t bridge_program_size(struct bridge *b)
{
    return b->firmware.flashsize;
}
