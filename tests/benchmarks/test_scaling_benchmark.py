"""Powers are those of the timings, and growth beyond linear is told."""

import pytest

from benchmarks.scaling_table import TITLES, exponent, section


def rows(power: float) -> list[dict[str, float]]:
    return [{"size": size, "seconds": 2e-3 * size**power} for size in (1.0, 2.0, 5.0)]


@pytest.mark.parametrize("power", [-0.5, 0.0, 1.0, 1.7])
def test_the_exponent_is_that_of_a_power(power: float) -> None:
    assert exponent(rows(power)) == pytest.approx(power, abs=1e-12)


def test_the_section_tells_what_grows_too_fast() -> None:
    found = {key: rows(1.0) for key in TITLES}
    found["runs"] = rows(1.5)
    text = section({"machine": {"cores": "2"}, "scaling": found})
    assert text.count("no faster than linear: holds") == 1
    assert "Time grows as the 1.50th power; no faster than linear: **missed**." in text
    assert "| 5 | 10.00 ms |" in text
