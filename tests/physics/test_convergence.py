"""Errors fall with the step as fast as the methods' orders say."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from example_plants import creep, muscle_plant, plant, release, schedule, spring_plant

from muscle_bayes.physics.effects import FirstCycleSet, SecondRelaxation
from muscle_bayes.physics.elements import Element


def slopes(errors, ratio):
    """Orders of convergence between successive refinements."""
    errors = np.asarray(errors)
    return np.log(errors[:-1] / errors[1:]) / np.log(ratio)


def test_fast_motion_is_fourth_order_through_reversals_and_sticking():
    def run(intervals):
        time = np.linspace(0.0, 3.0, intervals + 1)
        seen = release(spring_plant(), schedule(time, load=0.14), -0.25)
        every = intervals // 60
        return np.asarray(seen.sensed)[every - 1 :: every], np.asarray(seen.speed)

    exact, speed = run(3840)
    assert np.count_nonzero(np.diff(np.sign(speed[speed != 0.0]))) >= 3
    assert speed[-1] == 0.0
    errors = [np.sqrt(np.mean((run(n)[0] - exact) ** 2)) for n in (120, 240, 480)]
    assert errors[-1] < 1e-6
    assert slopes(errors, 2).min() > 3.5


class HeatedSpring(Element):
    """Generalised force -stiffness (q - drift T)."""

    stiffness: float
    drift: float

    def force(self, now, effects):
        return -self.stiffness * (now.q - self.drift * now.temperature)


def test_fast_motion_is_fourth_order_through_reversals_while_heat_moves_the_rest():
    made = plant(HeatedSpring(0.15, 0.002), inertia=0.002, stops=(-9.0, 9.0))

    # Short of the first stick: breaking away waits for a node, which is second order.
    def run(intervals):
        time = np.linspace(0.0, 1.2, intervals + 1)
        every = intervals // 60
        return np.asarray(release(made, schedule(time, lambda t: 100.0 * t), 0.4).sensed)[
            every - 1 :: every
        ]

    exact = run(3840)
    errors = [np.sqrt(np.mean((run(n) - exact) ** 2)) for n in (120, 240, 480)]
    assert np.count_nonzero(np.diff(np.sign(np.diff(exact)))) >= 2
    assert errors[-1] < 1e-7
    assert slopes(errors, 2).min() > 3.5


def test_slow_motion_is_second_order_through_heating_and_cooling():
    def heat(t):
        return 57.5 - 32.5 * np.cos(2 * np.pi * t / 240.0)

    def run(intervals):
        time = np.linspace(0.0, 360.0, intervals + 1)
        seen = creep(muscle_plant(), schedule(time, heat, 0.139), -0.2, 0.04)
        # Thirds of an interval keep its middle.
        every = intervals // 40
        return np.asarray(seen.sensed)[every // 2 :: every], np.asarray(seen.hyst)[
            every - 1 :: every, 0
        ]

    exact = run(40 * 243)
    runs = [run(n) for n in (120, 360, 1080)]
    for which, size in ((0, 1e-4), (1, 1e-5)):
        errors = [np.sqrt(np.mean((one[which] - exact[which]) ** 2)) for one in runs]
        assert errors[-1] < size
        assert slopes(errors, 3).min() > 1.7


REMEMBER = {
    "second-relaxation": SecondRelaxation(0.008, 10.0, 0.0),
    "first-cycle-set": FirstCycleSet(2e-4, 20.0, 0.01),
}


@pytest.mark.parametrize("effect", REMEMBER.values(), ids=REMEMBER)
@pytest.mark.parametrize("motion", [creep, release])
def test_memory_is_second_order_in_slow_and_in_fast_motion(effect, motion):
    slow = motion is creep
    end, ratio = (300.0, 3) if slow else (1.2, 2)
    made = muscle_plant(**({} if slow else {"K_modulus": 900.0})) + jax.tree.map(
        jnp.asarray, effect
    )

    def heat(t):
        return 57.5 - 32.5 * np.cos(2 * np.pi * t / (0.7 * end))

    def run(intervals):
        time = np.linspace(0.0, end, intervals + 1)
        seen = motion(made, schedule(time, heat, 0.139), -0.2, 0.04)
        every = intervals // 20
        shown = np.asarray(seen.sensed)[every // 2 if slow else every - 1 :: every]
        return shown, np.asarray(seen.hyst)[every - 1 :: every, 0]

    first = 20 * 3 if slow else 20 * 8
    exact, runs = run(first * 27), [run(first * ratio**n) for n in range(3)]
    for which in (0, 1):
        errors = [np.sqrt(np.mean((one[which] - exact[which]) ** 2)) for one in runs]
        assert slopes(errors, ratio).mean() > 1.8, errors
        assert errors[-1] < 1e-3 * np.ptp(exact[which])
