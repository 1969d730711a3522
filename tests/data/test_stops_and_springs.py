"""Endstops as stated, springs as described, and slower sensors in a run."""

from math import inf

import numpy as np
import pytest
from swing_log import HEAT, SWING, TIME, csv, toml

from muscle_bayes.data import RunError, SpringElement
from muscle_bayes.data.describing.metadata import parse_metadata
from muscle_bayes.data.writer import to_toml

ARM = '"arm"\nmass = 0.3\ncentre_distance = 0.2'


def with_stops(lower, upper):
    return toml().replace("[element_a]", f"[fixture]\nstops = [{lower}, {upper}]\n[element_a]")


def test_no_stops_are_none(read):
    assert read(content=csv().encode(), toml=toml()).stops == (-inf, inf)


def test_stated_stops_hold_the_readings(read):
    run = read(content=csv().encode(), toml=with_stops(-0.8, 0.8))
    assert run.stops == (-0.8, 0.8)


@pytest.mark.parametrize("stops", [(-0.5, 0.8), (-0.8, 0.5), (1.0, 2.0)])
def test_readings_beyond_them_are_an_error(read, stops):
    with pytest.raises(RunError, match=r"column 'x', key fixture\.stops: .*beyond.*Fix: correct"):
        read(content=csv().encode(), toml=with_stops(*stops))


def test_counts_that_are_stated_as_degrees_are_told_so(read):
    counts = np.rint(511 + 100 * np.cos(7 * TIME)).astype(int)
    metadata = with_stops(-0.75, 0.75).replace('"rad"', '"deg"')
    with pytest.raises(RunError, match=r"Fix: is position_unit right \(readings of 611 look like"):
        read(content=csv(positions=counts).encode(), toml=metadata)


def test_stops_allow_for_the_zero_of_a_potentiometer(read):
    counts = np.rint(512 + SWING / 0.005).astype(int).astype(str)
    metadata = with_stops(-0.75, 0.75).replace('"rad"', '"counts"')
    metadata += "[potentiometer]\nzero_reading = 512.0\nradians_per_count = 0.005\n"
    assert read(content=csv(positions=counts).encode(), toml=metadata).stops == (-0.75, 0.75)
    with pytest.raises(RunError, match="beyond the endstops"):
        read(content=csv(positions=counts).encode(), toml=metadata + "zero_uncertainty = 0.0\n")


def spring(words: str) -> SpringElement:
    text = toml().replace(ARM, f'"spring"\nlinkage = "drum"\ndrum_radius = 0.01\n{words}')
    element = parse_metadata(text.encode(), "a.toml").element_a
    assert isinstance(element, SpringElement)
    return element


def test_what_a_spring_does_not_say_is_to_be_estimated():
    element = spring("length_at_zero = 0.1")
    assert element.rate is None
    assert element.free_length is None
    assert element.tension_at_zero is None
    assert element.damping is None
    assert element.closed_length is None


def test_a_spring_as_described():
    told = "length_at_zero = 0.1\nrate = 356.0\nfree_length = 0.08\nclosed_length = 0.05\ndamping = 8.4"
    element = spring(told)
    assert (element.rate, element.free_length, element.damping) == (356.0, 0.08, 8.4)


def test_a_torsion_spring_needs_no_length():
    told = '"spring"\nlinkage = "torsion"\nrate = 0.02\ntension_at_zero = 0.0'
    metadata = parse_metadata(toml().replace(ARM, told).encode(), "a.toml")
    assert metadata.element_a.linkage == "torsion"
    assert parse_metadata(to_toml(metadata).encode(), "a.toml") == metadata


def test_a_straight_spring_needs_a_length_only_with_another():
    linear = toml().replace('"rad"', '"mm"').replace(
        "[element_a]", '[fixture]\nmotion = "linear"\n[element_a]'
    )  # fmt: skip
    bare = linear.replace(ARM, '"spring"\nlinkage = "straight"')
    assert parse_metadata(bare.encode(), "a.toml").element_a.length_at_zero is None
    with pytest.raises(RunError, match=r"element_a\.length_at_zero: missing, free_length needs it"):
        parse_metadata((bare + "free_length = 0.1\n").encode(), "a.toml")
    with pytest.raises(RunError, match=r"linkage: 'torsion' does not fit"):
        parse_metadata(bare.replace("straight", "torsion").encode(), "a.toml")


SLOW = [f"{heat:.2f}" if row % 10 == 0 else "" for row, heat in enumerate(HEAT)]


def test_a_slower_thermometer_lies_on_straight_lines(read):
    run = read(content=csv("t,x,T", TIME, SWING, SLOW).encode(), toml=toml('temperature_a = "T"'))
    assert run.own_times["temperature_a"] == pytest.approx(TIME[::10])
    wanted = np.interp(TIME, TIME[::10], HEAT[::10])
    assert run.table["temperature_a"].to_numpy() == pytest.approx(wanted)
    assert "180 of 200 rows" in str(run.repairs[0])


def test_a_failed_reading_of_a_slower_thermometer_is_left_out(read):
    failed = [*SLOW]
    failed[100] = "0.0"
    run = read(content=csv("t,x,T", TIME, SWING, failed).encode(), toml=toml('temperature_a = "T"'))
    assert {repair.rule for repair in run.repairs} == {"impossible jump", "slower sensor"}
    assert run.table["temperature_a"].min() == 25.0
    assert 2.0 not in run.own_times["temperature_a"]


def test_a_slower_force_keeps_its_last_value(read):
    force = [f"{row // 10}" if row % 10 == 0 else "" for row in range(TIME.size)]
    run = read(content=csv("t,x,f", TIME, SWING, force).encode(), toml=toml('applied = "f"'))
    assert run.table["applied"].tolist() == [row // 10 for row in range(TIME.size)]


def test_rows_of_other_sensors_are_no_positions(read):
    swing = [f"{x:.5f}" if row % 2 == 0 else "" for row, x in enumerate(SWING)]
    heat = [f"{h:.2f}" if row % 2 == 1 else "" for row, h in enumerate(HEAT)]
    run = read(content=csv("t,x,T", TIME, swing, heat).encode(), toml=toml('temperature_a = "T"'))
    assert run.coordinate == pytest.approx(SWING[::2])
    assert run.table["temperature_a"].to_numpy()[1:] == pytest.approx(HEAT[2::2], abs=0.02)
