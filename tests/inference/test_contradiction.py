"""Readings that move faster than what is stated can move them."""

from pathlib import Path

import numpy as np
import pytest

from muscle_bayes.data import Run
from muscle_bayes.data.reader import run_from_bytes
from muscle_bayes.inference.posteriors.contradiction import contradiction

TIME = np.arange(0.0, 4.0, 0.005)

SPRING = '[element_b]\nkind = "spring"\nlinkage = "torsion"\n'


def swing(mass: float, extra: str = "", shake: float = 0.0) -> Run:
    """A swing of 0.1 kg at 0.2 m by its closed form, with noise and a shake of 16 Hz."""
    angle = 0.2 * np.cos(np.sqrt(9.80665 / 0.2) * TIME) + shake * np.sin(100.0 * TIME)
    angle += 1e-3 * np.random.default_rng(0).standard_normal(TIME.size)
    log = "t,q\n" + "".join(f"{t:.3f},{q:.5f}\n" for t, q in zip(TIME, angle, strict=True))
    about = 'format = 1\nprotocol = "free"\norigin = "synthetic"\n[columns]\ntime = "t"\n'
    about += f'position = "q"\nposition_unit = "rad"\n[element_a]\nkind = "arm"\nmass = {mass}\n'
    about += f"centre_distance = 0.2\n{extra}"
    return run_from_bytes(log.encode(), about.encode(), Path("swing.csv"), Path("swing.toml"))


@pytest.mark.parametrize("mass", [0.05, 0.1, 0.3])
def test_a_swing_is_no_contradiction(mass: float) -> None:
    assert contradiction(swing(mass)) is None


def test_a_shake_that_no_stated_force_makes_is_one() -> None:
    told = contradiction(swing(0.1, shake=0.05))
    assert told is not None
    assert "pulls with 0.0486 N m" in told  # m g d sin(0.25)
    inertia, acceleration = 0.1 * 0.2**2, 0.05 * 100.0**2
    demand = float(told.split("which takes ")[1].split()[0])
    assert demand == pytest.approx(inertia * acceleration, rel=0.5)


def test_an_unknown_force_may_do_it() -> None:
    assert contradiction(swing(0.1, SPRING, 0.05)) is None
