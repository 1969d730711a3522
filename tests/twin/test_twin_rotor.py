"""Stick-slip against closed forms: decay per cycle, dead band, energy, stops, convergence."""

from math import pi, sqrt

import pytest

from muscle_bayes.conventions import GRAVITY, SPRING_INTERCEPT, SPRING_RATE
from muscle_bayes.twin.plant.linkage import Side
from muscle_bayes.twin.plant.rotor import Rotor
from muscle_bayes.twin.plant.springs import ReferenceSpring

J, D, K = 0.002, 0.005, 0.15


def rotor(sides=(), *, dry=D, viscous=0.0, stops=(-9.0, 9.0), step=5e-4, extra=()) -> Rotor:
    return Rotor(
        sides,
        inertia=J,
        dry_friction=dry,
        viscous_friction=viscous,
        disc_radius=0.0889,
        stops=stops,
        slip_step=step,
        extra_torques=extra,
    )


def linear_spring(angle: float, velocity: float) -> float:
    return -K * angle


def spring_side() -> Side:
    return Side(ReferenceSpring(), 0.030, 0.030, 0.050)


def spring_energy(angle: float) -> float:
    length = spring_side().length(angle)
    return 0.5 * SPRING_RATE * length**2 + SPRING_INTERCEPT * length


def turning_points(r: Rotor, tick: float = 0.001, limit: float = 20.0) -> list[float]:
    """Angles at which the rotor rests for an instant or for good, started at rest."""
    points, extreme, before = [], r.angle, 0.0
    for _ in range(round(limit / tick)):
        r.advance(tick)
        if before * r.velocity < 0.0 or (before != 0.0 and not r.slipping):
            points.append(extreme)
        extreme = r.angle
        before = r.velocity
        if not r.slipping:
            points[-1] = r.angle
            break
    return points


def test_coulomb_friction_takes_2d_over_k_from_every_half_cycle():
    r = rotor(extra=[linear_spring])
    r.angle = 0.8
    found = turning_points(r)
    amplitude, expected = 0.8, []
    while K * amplitude > D:
        amplitude -= 2 * D / K
        expected.append(amplitude * (-1) ** (len(expected) + 1))
    assert len(found) == len(expected)
    assert found == pytest.approx(expected, abs=3e-5)


def test_half_cycles_last_as_long_as_without_friction():
    r = rotor(extra=[linear_spring])
    r.angle = 0.8
    half = pi * sqrt(J / K)
    r.advance(3 * half)
    assert r.angle == pytest.approx(-(0.8 - 6 * D / K), abs=1e-6)
    assert abs(r.velocity) < 0.01


def test_rotor_stays_stuck_exactly_within_the_dead_band():
    edge = D / K
    for angle, slips in ((0.999 * edge, False), (1.001 * edge, True)):
        r = rotor(extra=[linear_spring])
        r.angle = angle
        r.advance(1.0)
        assert (r.angle != angle) is slips


def test_rests_only_where_the_torque_is_within_d():
    r = rotor([spring_side()])
    r.hang(0.12)
    for _ in range(2000):
        r.advance(0.005)
    assert not r.slipping
    assert r.velocity == 0.0
    assert abs(r.torque(r.angle)) <= D
    angle = r.angle
    r.advance(1000.0)
    assert r.angle == angle


def test_breaks_away_at_the_instant_the_torque_reaches_d():
    """A load ramp inside one long step: an element whose tension changes with time."""

    class Ramp(ReferenceSpring):
        time = 0.0
        before = 0.0

        def tension(self, length: float) -> float:
            return -0.1 * self.time

        def advance(self, step: float) -> None:
            self.before = self.time
            self.time += step

        def rewind(self, fraction: float) -> None:
            self.time = self.before + fraction * (self.time - self.before)

    ramp = Ramp()
    r = rotor([Side(ramp, 0.030, 0.030, 0.115)])
    rate = 0.1 * 0.030  # N m/s at the lever of theta = 0
    breakaway = D / rate
    r.advance(0.999 * breakaway)
    assert not r.slipping
    r.advance(0.101 * breakaway)
    slid = 0.1 * breakaway
    assert r.velocity == pytest.approx(0.5 * rate * slid**2 / J, rel=0.02)


def test_energy_balance_of_a_swing():
    r = rotor([spring_side()], step=2e-4)
    mass = 0.12
    r.hang(mass)
    load = mass * GRAVITY * 0.0889

    def energy() -> float:
        kinetic = 0.5 * r.total_inertia * r.velocity**2
        return kinetic + spring_energy(r.angle) - load * r.angle

    start, path, lost = energy(), 0.0, []
    for _ in range(25_000):
        before = r.angle
        r.advance(2e-4)
        path += abs(r.angle - before)
        lost.append(start - energy() - D * path)
    assert path > 0.8
    assert not r.slipping
    assert max(map(abs, lost)) < 2e-5 * load * path


def test_linear_friction_follows_the_damped_oscillator():
    c = 0.004
    r = rotor(dry=0.0, viscous=c, extra=[linear_spring])
    r.angle = 0.5
    decay = c / (2 * J)
    omega = sqrt(K / J - decay**2)
    periods = 3
    time = periods * 2 * pi / omega
    r.advance(time)
    assert r.angle == pytest.approx(0.5 * 2.718281828459045 ** (-decay * time), rel=1e-3)
    r.advance(60.0)
    assert abs(r.angle) < 1e-9
    assert r.slipping


def test_stops_are_inelastic_and_hold_only_outwards():
    r = rotor(stops=(-1.0, 0.3))
    r.hang(0.2)
    r.advance(1.0)
    assert (r.angle, r.velocity, r.slipping) == (0.3, 0.0, False)
    r.advance(1.0)
    assert r.angle == 0.3
    r.load_torque = -0.9 * D
    r.advance(1.0)
    assert r.angle == 0.3
    r.load_torque = -1.1 * D
    r.advance(0.05)
    assert r.angle < 0.3
    assert r.velocity < 0.0
    r.advance(10.0)
    assert r.angle == -1.0


def test_linear_friction_leaves_a_stop_at_any_inward_torque():
    r = rotor(dry=0.0, viscous=0.004, stops=(-1.0, 0.3))
    r.load_torque = 0.01
    r.advance(2.0)
    assert r.angle == 0.3
    r.load_torque = -1e-4
    r.advance(0.1)
    assert r.angle < 0.3


def test_error_falls_with_the_square_of_the_step():
    def angle(step: float) -> float:
        r = rotor([spring_side()], step=step)
        r.hang(0.12)
        for _ in range(30):
            r.advance(0.03)
        return r.angle

    exact = angle(2e-5)
    coarse, fine = abs(angle(1e-3) - exact), abs(angle(5e-4) - exact)
    assert coarse < 2e-5
    assert fine < 0.35 * coarse
