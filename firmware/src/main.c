#include "bench.h"
#include "board.h"
#include "inputs_avr.h"

static struct bench bench;

/* Carry out what the last event asked for: heaters first. */
static void apply(void)
{
    for (uint8_t i = 0; i < CHANNELS; i++) {
        board_heat(i, bench.safety.duty[i]);
    }
    if (bench.pin.action == OLD_ANALOG_READ) {
        bench_pin_value(&bench, board_analog(bench.pin.pin));
    } else if (bench.pin.action == OLD_DIGITAL_READ) {
        bench_pin_value(&bench, board_digital(bench.pin.pin));
    }
    board_fan(bench.fan);
    if (bench.mark) {
        bench.mark = false;
        inputs_mark();
    }
    bench.marked = inputs_marked();
    if (bench.store) {
        bench.store = false;
        board_store_tubes(bench.safety.tube);
    }
    if (bench.rewired) {
        bench.rewired = false;
        board_store_wiring(&bench.wiring);
        inputs_begin(&bench.wiring, false);
    }
    if (bench.out.length > 0) {
        board_send(bench.out.data, bench.out.length);
        text_clear(&bench.out);
    }
}

/* What the inputs have to say, outside of interrupts. */
static void look(void)
{
    uint32_t word;
    for (uint8_t i = 0; i < CHANNELS; i++) {
        if (bench.look & (1u << i)) {
            bench_looked(&bench, i, inputs_thermometer(i, bench.wiring.thermometer[i]));
            apply();
        }
    }
    if (bench.wiring.load && inputs_take_load(&word)) {
        bench_load(&bench, word);
    }
}

/* The watchdog is fed here alone: both the timer's interrupt and this loop must be alive. */
static void pass_time(void)
{
    uint8_t ticks = board_take_ticks();
    if (ticks == 0) {
        return;
    }
    if (!board_heats_as_told()) {
        board_heaters_off();
        bench_internal_fault(&bench);
        apply();
    }
    while (ticks--) {
        bench_tick(&bench);
        apply();
    }
    look();
    board_remember(&bench.safety);
    board_alive();
}

int main(void)
{
    struct memory memory;
    struct start start = board_start(&memory);
    bench_start(&bench, start, &memory);
    inputs_begin(&bench.wiring, !(start.cause & RESET_POWER_ON));
    apply();
    for (;;) {
        struct sample sample;
        pass_time();
        int16_t byte = board_receive();
        if (byte >= 0) {
            bench_byte(&bench, (uint8_t)byte);
            apply();
        }
        if (board_take_sample(&sample)) {
            bench_sample(&bench, sample);
            apply();
        }
        board_idle();
    }
}
