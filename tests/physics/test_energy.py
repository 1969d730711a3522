"""What springs and load give up, dry friction has taken: force times path."""

import numpy as np
import pytest
from example_plants import DISC, SPRING_PINS, D, J, plant, release, schedule, spring_plant

from muscle_bayes.physics.elements import Arm

G, LOAD, START = 9.80665, 0.14, -0.25


def energy(q, speed, arm):
    """Kinetic, elastic and potential energy, J."""
    r, x, y = SPRING_PINS
    length = np.hypot(x - r * np.cos(q), y + r * np.sin(q))
    inertia = J + LOAD * DISC**2 + arm * 0.05 * 0.1**2
    elastic = 0.5 * 145.71 * length**2 - 5.2097 * length
    hanging = -LOAD * G * DISC * q - arm * 0.05 * G * 0.1 * np.cos(q - 0.2)
    return 0.5 * inertia * speed**2 + elastic + hanging


@pytest.mark.parametrize("arm", [False, True])
def test_energy_falls_by_friction_times_path(arm):
    spring = spring_plant()
    made = plant(spring.side_a, Arm.of_mass(0.05, 0.1, 0.2)) if arm else spring
    time = np.linspace(0.0, 5.0, 5001)
    seen = release(made, schedule(time, load=LOAD), START)
    q = np.concatenate([[START], seen.sensed])
    speed = np.concatenate([[0.0], seen.speed])
    lost = -np.diff(energy(q, speed, arm))
    one_way = speed[1:] * speed[:-1] > 0.0
    assert one_way.sum() > 1000
    np.testing.assert_allclose(lost[one_way], D * np.abs(np.diff(q))[one_way], atol=1e-12)
    # Within a step that holds a reversal the path is longer than the step's ends are apart.
    short = lost[~one_way] - D * np.abs(np.diff(q))[~one_way]
    assert short.min() > -1e-12
    assert lost.sum() == pytest.approx(D * np.abs(np.diff(q)).sum(), rel=1e-5)
    assert speed[-1] == 0.0


def test_frictionless_motion_keeps_its_energy():
    time = np.linspace(0.0, 5.0, 5001)
    seen = release(spring_plant(dry=0.0), schedule(time, load=LOAD), START)
    kept = energy(np.asarray(seen.sensed), np.asarray(seen.speed), False)
    assert np.ptp(seen.sensed) > 0.1
    assert np.ptp(kept) < 1e-9
