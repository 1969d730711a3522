"""The compiled firmware on a simulated ATmega328P: pins, clock, converter, watchdog, resets."""

import re
import subprocess

import numpy as np
import pytest

from muscle_bayes.bench.boards.messages import Fault, ResetCause, Role
from muscle_bayes.bench.boards.protocol import (
    Boot,
    Decoder,
    Error,
    FaultReport,
    Reply,
    Sample,
    encode,
    read_answer,
)
from muscle_bayes.bench.heat.heat_model import TubeModel
from muscle_bayes.bench.simulation.processor import Processor

PORTB, DDRB, PORTD, DDRD, TCCR0A, TCCR0B, OCR0A = 0x25, 0x24, 0x2B, 0x2A, 0x44, 0x45, 0x47
HEATER_PINS = 0b0110_0000
LAMP = 0b0010_0000
WATCHDOG_MS = 70


@pytest.fixture
def heater(firmware):
    with Processor(heater=True) as processor:
        processor.run(50)
        processor.receive()
        yield processor


def ask(processor, verb, *arguments, wait=12):
    processor.send(encode(1, verb, *arguments))
    processor.run(wait)
    return Decoder().feed(processor.receive())


def heat(processor, first=200, second=100):
    return ask(processor, "DUTY", first, second, 250, 250)


def boots(data):
    return [m.identity for m in Decoder().feed(data) if isinstance(m, Boot)]


@pytest.mark.parametrize("role", Role)
def test_a_strap_on_pin_4_makes_a_heater_board(firmware, role):
    with Processor(heater=role is Role.HEATER) as processor:
        processor.run(50)
        (identity,) = boots(processor.receive())
        assert identity.role is role
        assert heat(processor)[0] == (
            Reply(1, ("200", "100", "0")) if role is Role.HEATER else Error(1, "ROLE")
        )
        assert processor.duties == ((200, 100) if role is Role.HEATER else (0, 0))


def test_heaters_are_off_from_the_first_instruction_on(firmware):
    """The first code after the vectors sets both pins low, before the stack is there."""
    listing = subprocess.run(
        ["avr-objdump", "--disassemble", str(firmware / "muscle_bench.elf")],
        check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    target = re.search(r"^\s+0:\s.*\bjmp\s+(0x[0-9a-f]+)", listing, re.MULTILINE)
    assert target is not None
    start = int(target[1], 16)
    after = listing[listing.index(f"\n{start:8x} <") if f"\n{start:8x} <" in listing else 0 :]
    instructions = re.findall(
        rf"^\s+({start:x}|[0-9a-f]+):\s(?:[0-9a-f]{{2}} )+\s*(\w+)\s+(.*?)(?:;.*)?$",
        after,
        re.MULTILINE,
    )
    first = [
        (name, operands.replace(" ", "").strip())
        for at, name, operands in instructions
        if start <= int(at, 16) < start + 8
    ]
    assert first == [("cbi", "0x0b,6"), ("cbi", "0x0b,5"), ("sbi", "0x0a,6"), ("sbi", "0x0a,5")]


def test_no_pin_is_driven_high_while_booting(firmware):
    with Processor(heater=True) as processor:
        for _ in range(1000):
            processor.run_cycles(160)
            assert processor.duties == (0, 0)
        assert processor.peaks() == (0, 0)


@pytest.mark.parametrize("duty", [0, 1, 127, 254, 255])
def test_duty_reaches_the_pins(heater, duty):
    heat(heater, duty, 255 - duty)
    assert heater.duties == (duty, 255 - duty)
    assert heater.run(100) == pytest.approx((duty, 255 - duty))


def test_a_pin_that_is_off_is_cut_from_its_timer(heater):
    heat(heater, 200, 200)
    heat(heater, 0, 200)
    assert heater.peek(TCCR0A) == 0b0010_0001  # OC0B alone, phase-correct PWM
    assert heater.peek(PORTD) & HEATER_PINS == 0
    assert heater.peek(DDRD) & HEATER_PINS == HEATER_PINS


def test_the_lamp_shows_heat(heater):
    assert not heater.peek(PORTB) & LAMP
    heat(heater, 0, 1)
    assert heater.peek(PORTB) & LAMP
    heater.run(450)
    assert not heater.peek(PORTB) & LAMP


def test_every_count_of_the_converter_is_read(firmware):
    with Processor(heater=False) as processor:
        processor.run(50)
        read = []
        for counts in range(1024):
            processor.set_analog(counts)
            processor.run(9)
            processor.receive()
            (reply,) = ask(processor, "READ", wait=6)
            read.append(read_answer("READ", reply)[1])
        assert read == [8 * counts for counts in range(1024)]


def test_noise_makes_readings_finer_than_a_count(firmware):
    """A voltage between two counts, dithered by 0.4 counts of noise, shows to a tenth."""
    random = np.random.default_rng(0)
    with Processor(heater=False) as processor:
        processor.run(50)
        ask(processor, "STREAM", 8)
        decoder = Decoder()
        for true in (500.25, 500.5, 500.9):
            read = []
            for _ in range(1600):
                processor.set_analog(round(true + random.normal(0.0, 0.4)))
                processor.run(1)
                samples = [m for m in decoder.feed(processor.receive()) if isinstance(m, Sample)]
                read += [sample.angle / 8 for sample in samples]
            read = read[2:]
            assert np.mean(read) == pytest.approx(true, abs=0.05)
            assert np.std(read) < 0.25  # of single conversions: 0.5
            assert {8 * value % 1 for value in read} == {0.0}
            assert len(set(read)) > 3


def test_the_boards_clock_is_the_crystals(heater):
    first = read_answer("READ", ask(heater, "READ", wait=20)[0])
    heater.run(100_000)
    second = read_answer("READ", ask(heater, "READ", wait=20)[0])
    assert second[0] - first[0] == 100_020_000


def test_boots_are_counted_and_their_cause_told(heater):
    for number, cause in enumerate((ResetCause.EXTERNAL, ResetCause.POWER_ON), start=1):
        heater.reset(cause)
        heater.run(50)
        (identity,) = boots(heater.receive())
        assert (identity.boot, identity.cause) == (number, cause)


@pytest.mark.parametrize("interrupts", [True, False])
def test_an_endless_loop_ends_in_a_watchdog_reset_with_heaters_off(heater, interrupts):
    heat(heater)
    heater.hang(interrupts=interrupts)
    heater.run(WATCHDOG_MS)
    assert heater.duties == (0, 0)
    heater.run(50)
    (identity,) = boots(heater.receive())
    assert identity.cause is ResetCause.WATCHDOG
    assert read_answer("DUTY", heat(heater)[0]) == (0, 0, Fault.WATCHDOG)
    ask(heater, "CLEAR")
    heat(heater)
    assert heater.duties == (200, 100)


def test_a_loop_that_hangs_while_it_was_never_heating_is_reset_too(heater):
    heater.hang(interrupts=True)
    heater.run(WATCHDOG_MS + 50)
    assert boots(heater.receive())[0].cause is ResetCause.WATCHDOG


def test_the_watchdog_does_not_bite_a_healthy_board(heater):
    heater.run(60_000)
    assert heater.receive() == b""


def test_a_brown_out_latches(heater):
    heat(heater)
    heater.reset(ResetCause.BROWN_OUT)
    assert heater.duties == (0, 0)
    heater.run(50)
    assert boots(heater.receive())[0].cause is ResetCause.BROWN_OUT
    assert read_answer("DUTY", heat(heater)[0]) == (0, 0, Fault.BROWN_OUT)


def test_a_boot_loader_that_hides_a_reset_while_heating_does_not_hide_the_fault(heater):
    heat(heater)
    heater.reset(ResetCause(0))
    heater.run(50)
    assert boots(heater.receive())[0].cause == 0
    assert read_answer("DUTY", heat(heater)[0]) == (0, 0, Fault.WATCHDOG)


@pytest.mark.parametrize(
    "hits",
    [
        {OCR0A: 255},
        {TCCR0B: 0},
        {PORTD: HEATER_PINS},
        {DDRD: 0, PORTD: HEATER_PINS},
        {TCCR0A: 0b1111_0011},
    ],
    ids=str,
)
@pytest.mark.parametrize("duty", [0, 50])
def test_output_registers_that_change_by_themselves_are_put_right(heater, hits, duty):
    heat(heater, duty, 0)
    for address, value in hits.items():
        heater.poke(address, value)
    heater.run(2)
    assert heater.duties == (0, 0)
    heater.run(10)
    assert FaultReport(Fault.INTERNAL) in Decoder().feed(heater.receive())


def test_a_full_line_is_handled_without_loss(heater):
    """Commands without a pause, at line rate, for 2 s: each is answered."""
    count = 0
    decoder = Decoder()
    answered = []
    for _ in range(20):
        while heater.unsent < 1200:
            heater.send(encode(count, "DUTY", 10, 20, 250, 250))
            count += 1
        heater.run(100)
        answered += [m.sequence for m in decoder.feed(heater.receive())]
    heater.run(200)
    answered += [m.sequence for m in decoder.feed(heater.receive()) if isinstance(m, Reply)]
    assert answered == list(range(count))


@pytest.mark.parametrize("name", ["rx_head", "rx_tail"])
@pytest.mark.parametrize("value", [0x00, 0x7F, 0x80, 0xCC, 0xFF])
def test_a_damaged_index_repeats_no_command(firmware, heater, name, value):
    """A receive buffer that runs round would feed the dead-man with commands heard before."""
    symbols = subprocess.run(
        ["avr-nm", str(firmware / "muscle_bench.elf")], check=True, capture_output=True, text=True
    ).stdout
    match = re.search(rf"^0080(\w{{4}}) \w {name}\b", symbols, re.MULTILINE)
    assert match is not None
    for _ in range(6):
        heat(heater)
    heater.poke(int(match[1], 16), value)
    heater.run(500)
    assert heater.duties == (0, 0)


def warm(processor):
    """Full duty for 6 s on A, which then is 26 C above the room by the calibrated model."""
    for number in range(60):
        shown = 250 + 4 * number
        ask(processor, "DUTY", 255, 0, shown, 250, wait=100)


@pytest.fixture
def calibrated(firmware):
    with Processor(heater=True) as processor:
        processor.store_tubes((TubeModel(450, 480), TubeModel(300, 600)))
        processor.run(50)
        processor.receive()
        yield processor


def test_the_tubes_calibration_is_read_from_eeprom(calibrated):
    assert read_answer("TUBES", ask(calibrated, "TUBES")[0]) == (450, 480, 300, 600)


def test_a_calibration_is_kept_through_power_off(heater):
    assert read_answer("TUBES", ask(heater, "TUBES")[0]) == (0, 0, 0, 0)
    assert ask(heater, "TUBE", 0, 450, 480, wait=60)[0] == Reply(1, ("450", "480"))
    ask(heater, "TUBE", 1, 300, 600, wait=60)
    heater.reset(ResetCause.POWER_ON)
    heater.run(50)
    heater.receive()
    assert read_answer("TUBES", ask(heater, "TUBES")[0]) == (450, 480, 300, 600)


def test_a_calibration_that_has_suffered_is_none(firmware):
    with Processor(heater=True) as processor:
        processor.store_tubes((TubeModel(450, 480), TubeModel(300, 600)))
        processor.write_eeprom(9, b"\x00")
        processor.run(50)
        processor.receive()
        assert read_answer("TUBES", ask(processor, "TUBES")[0]) == (0, 0, 0, 0)


@pytest.mark.parametrize("cause", [ResetCause.EXTERNAL, ResetCause.WATCHDOG])
def test_warmth_is_remembered_through_a_reset(calibrated, cause):
    """26 C are there; 90 C are the limit: some 20 s more of full duty, not 26 s."""
    warm(calibrated)
    calibrated.reset(cause)
    calibrated.run(50)
    calibrated.receive()
    ask(calibrated, "CLEAR")
    assert heat_until_fault(calibrated) == pytest.approx(19.8, abs=0.5)


def test_after_a_loss_of_power_a_warm_tube_counts_as_hot(calibrated):
    warm(calibrated)
    calibrated.reset(ResetCause.POWER_ON)
    calibrated.run(50)
    calibrated.receive()
    assert heat_until_fault(calibrated) < 0.5


def test_a_tube_that_has_cooled_is_forgotten(calibrated):
    ask(calibrated, "DUTY", 255, 0, 250, 250, wait=300)
    for number in range(10):
        ask(calibrated, "DUTY", 255, 0, 250 + 3 * number, 250, wait=100)
    calibrated.run(60_000)
    calibrated.reset(ResetCause.POWER_ON)
    calibrated.run(50)
    calibrated.receive()
    assert heat_until_fault(calibrated, most=3.0) == 3.0


def heat_until_fault(processor, most=30.0):
    """s of full duty on A until a fault; its thermocouple shows half of the rise."""
    for number in range(round(10 * most)):
        told = ask(processor, "DUTY", 255, 0, 380 + 2 * number, 250, wait=100)
        if any(isinstance(m, FaultReport) and m.faults == Fault.HEAT for m in told):
            return number / 10
    return most


def test_bytes_lost_by_a_full_buffer_are_noticed(firmware, heater):
    heater.hang(interrupts=True)
    heater.send(b"0" * 200)
    heater.run(30)
    assert heater.peek(symbol(firmware, "rx_lost")) == 1


def test_what_follows_lost_bytes_joins_nothing_before_them(firmware, heater):
    """The first byte that has room again breaks its frame, or voids the old protocol's number."""
    heater.poke(symbol(firmware, "rx_lost"), 1)
    assert not any(isinstance(m, Reply) for m in heat(heater))
    assert heater.duties == (0, 0)
    assert isinstance(heat(heater)[0], Reply)
    assert heater.duties == (200, 100)


def symbol(firmware, name):
    """Address of a variable in data space."""
    symbols = subprocess.run(
        ["avr-nm", str(firmware / "muscle_bench.elf")], check=True, capture_output=True, text=True
    ).stdout
    match = re.search(rf"^0080(\w{{4}}) \w {name}\b", symbols, re.MULTILINE)
    assert match is not None
    return int(match[1], 16)


def test_a_programmer_makes_the_watchdog_unconditional(firmware):
    """Fuses: WDTON and EESAVE programmed (0), no boot loader, SPI programming on."""
    text = (firmware.parent / "Makefile").read_text()
    high = int(re.search(r"HIGH_FUSE := (0x\w\w)", text)[1], 16)
    reset_off, debug, spi, watchdog, eeprom, *_size, loader = (
        high >> bit & 1 for bit in range(7, -1, -1)
    )
    assert (reset_off, debug, spi, watchdog, eeprom, loader) == (1, 1, 0, 0, 0, 1)


def test_the_fan_s_pin_follows_its_command_and_is_off_after_a_reset(heater):
    fan = 0b1000_0000
    assert heater.peek(DDRD) & fan
    assert not heater.peek(PORTD) & fan
    assert ask(heater, "FAN", 1)[0] == Reply(1, ("1",))
    assert heater.peek(PORTD) & fan
    heat(heater)
    heater.run(1000)  # a fault of the heaters leaves it on: it cools
    assert heater.peek(PORTD) & fan
    heater.receive()
    assert ask(heater, "FAN", 0)[0] == Reply(1, ("0",))
    assert not heater.peek(PORTD) & fan
    ask(heater, "FAN", 1)
    heater.reset(ResetCause.EXTERNAL)
    heater.run(50)
    assert not heater.peek(PORTD) & fan
    with Processor(heater=False) as sensor:
        sensor.run(50)
        sensor.receive()
        assert ask(sensor, "FAN", 1)[0] == Error(1, "ROLE")
