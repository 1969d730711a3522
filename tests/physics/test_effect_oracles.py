"""One thing known about each effect."""

from math import sqrt
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from example_plants import (
    BASE,
    ROOM,
    TABLE_2,
    D,
    LinearSpring,
    creep,
    muscle_plant,
    plant,
    release,
    schedule,
)
from reference_solver import muscle_tension_and_rate, opening_spring
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from muscle_bayes.physics.effects import (
    Backlash,
    BiasTorque,
    ClockOffset,
    Cogging,
    CoilContact,
    DamperLaw,
    FirstCycleSet,
    ForceScale,
    HysteresisYield,
    LoadDependentFriction,
    ModulusTemperature,
    PartialHeating,
    PositionDependentFriction,
    PotentiometerNonlinearity,
    QuadraticDrag,
    SecondRelaxation,
    Slack,
    StribeckFriction,
    ThermalLag,
    ViscousFriction,
    ZeroDrift,
)
from muscle_bayes.physics.elements import Instant, NoElement
from muscle_bayes.physics.friction import CoulombFriction
from muscle_bayes.physics.memory import rested
from muscle_bayes.physics.schedule import filtered
from muscle_bayes.physics.state import Drive

EXACT = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13, "dense_output": True}
STIFFNESS, INERTIA = 0.15, 0.002


def oscillator():
    frictionless = CoulombFriction(jnp.asarray(0.0))
    return plant(LinearSpring(STIFFNESS), inertia=INERTIA, friction=frictionless)


def test_viscous_friction_decays_exponentially():
    made = oscillator() + ViscousFriction(jnp.asarray(0.003))
    decay = 0.003 / (2 * INERTIA)
    rate = sqrt(STIFFNESS / INERTIA - decay**2)
    time = np.linspace(0.0, 6.0, 1201)
    t = time[1:]
    exact = 0.4 * np.exp(-decay * t) * (np.cos(rate * t) + decay / rate * np.sin(rate * t))
    np.testing.assert_allclose(release(made, schedule(time), 0.4).sensed, exact, atol=1e-7)


@pytest.mark.parametrize("torque", [0.02, -0.05])
def test_bias_torque_shifts_equilibrium_by_itself_over_stiffness(torque):
    made = oscillator() + BiasTorque(jnp.asarray(torque))
    seen = creep(made, schedule(np.linspace(0.0, 1.0, 3)), 0.3)
    np.testing.assert_allclose(seen.sensed, torque / STIFFNESS, rtol=1e-12)


@pytest.mark.parametrize("onset", [0.0, 0.03])
def test_coil_contact_adds_its_force_below_its_onset_only(onset):
    plain = muscle_plant()
    touching = plain + CoilContact(jnp.asarray(200.0), jnp.asarray(onset), jnp.asarray(0.0))
    none = jnp.asarray(0.0)
    drive = Drive(jnp.full(2, 60.0), jnp.asarray(0.1), none)
    element = plain.side_a
    for q in (-0.9, -0.55, -0.5, -0.45, 0.1):
        at = jnp.asarray(q), none, jnp.full(2, 0.02), drive
        strain = float(element.linkage.length(jnp.asarray(q))) / BASE - 1.0
        added = -float(touching.force(*at) - plain.force(*at)) / float(element.linkage.lever(at[0]))
        exact = 200.0 * (strain - onset) if strain < onset else 0.0
        assert added == pytest.approx(exact, abs=1e-12)
        # The coils stand beside the three elements in series: HYST does not feel them.
        np.testing.assert_array_equal(touching.hyst_rate(*at), plain.hyst_rate(*at))


def ramp(t):
    return 25.0 + 3.0 * np.minimum(t, 20.0)


def lagged(t, tau):
    """First-order lag of the ramp above, in closed form."""
    rising = 25.0 + 3.0 * (t - tau * (1.0 - np.exp(-t / tau)))
    top = 25.0 + 3.0 * (20.0 - tau * (1.0 - np.exp(-20.0 / tau)))
    held = 85.0 + (top - 85.0) * np.exp(-(t - 20.0) / tau)
    return np.where(t <= 20.0, rising, held)


@pytest.mark.parametrize("tau", [0.5, 7.0, 100.0])
def test_thermal_lag_is_exact_however_time_is_cut(tau):
    for time in (np.linspace(0.0, 60.0, 61), np.r_[0.0, 0.1, 13.7, 20.0, 20.0, 59.0, 60.0]):
        seen = filtered(schedule(time, ramp), (ThermalLag(jnp.asarray(tau)),))
        both_sides = np.stack([lagged(time, tau)] * 2, axis=1)
        np.testing.assert_allclose(seen.temperature, both_sides, rtol=1e-12)


def test_thermal_lag_of_no_time_is_exactly_the_thermometer():
    heat = schedule(np.linspace(0.0, 60.0, 601), lambda t: 50.0 + 20.0 * np.sin(t**1.5))
    seen = filtered(heat, (ThermalLag(jnp.asarray(0.0)),))
    np.testing.assert_array_equal(seen.temperature, heat.temperature)


def test_thermal_lag_is_what_the_muscle_feels():
    time = np.linspace(0.0, 60.0, 121)
    late = creep(muscle_plant() + ThermalLag(jnp.asarray(7.0)), schedule(time, ramp, 0.139), -0.2)
    felt = creep(muscle_plant(), schedule(time, lambda t: lagged(t, 7.0), 0.139), -0.2)
    np.testing.assert_allclose(late.sensed, felt.sensed, rtol=1e-9)
    assert np.ptp(late.sensed) > 0.05


def test_quadratic_drag_slows_a_free_rotor_hyperbolically():
    frictionless, drag = CoulombFriction(jnp.asarray(0.0)), 0.004
    free = plant(NoElement(), inertia=INERTIA, friction=frictionless, stops=(-9.0, 9.0))
    time = np.linspace(0.0, 2.0, 401)
    for start in (3.0, -3.0):
        seen = release(free + QuadraticDrag(jnp.asarray(drag)), schedule(time), speed=start)
        lost = 1.0 + drag * abs(start) * time[1:] / INERTIA
        np.testing.assert_allclose(seen.speed, start / lost, rtol=1e-7)
        np.testing.assert_allclose(
            seen.sensed, np.sign(start) * INERTIA / drag * np.log(lost), rtol=1e-6
        )


BREAKAWAY, STRIBECK = 0.006, 0.4
"""Friction at rest above D, and the speed at which that is lost."""


class HeatedSpring(LinearSpring):
    """Pushes with STIFFNESS per degree as well."""

    def force(self, now, effects):
        return super().force(now, effects) + STIFFNESS * (now.temperature - ROOM)


def with_breakaway(speed):
    """A rotor on a spring that slides at D and rests up to D + BREAKAWAY."""
    static = CoulombFriction(jnp.asarray(D + BREAKAWAY))
    made = plant(HeatedSpring(STIFFNESS), inertia=INERTIA, friction=static)
    return made + StribeckFriction(jnp.asarray(BREAKAWAY / (D + BREAKAWAY)), jnp.asarray(speed))


def test_stribeck_friction_swings_and_sticks_like_a_general_solvers():
    """Slip by slip: a slip ends where speed passes zero, and there the rotor sticks or turns back."""
    made = with_breakaway(STRIBECK)
    time = np.linspace(0.0, 3.0, 3001)
    seen = release(made, schedule(time), 0.4)
    exact, begun, q = np.full(time.size, np.nan), 0.0, 0.4
    while abs(STIFFNESS * q) > D + BREAKAWAY:
        sign = -np.sign(q)

        def slope(t, y, sign=sign):
            dry = D + BREAKAWAY * np.exp(-((y[1] / STRIBECK) ** 2))
            return [y[1], (-STIFFNESS * y[0] - sign * dry) / INERTIA]

        def stops(t, y, sign=sign, begun=begun):
            return sign * y[1] + (t == begun)

        stops.terminal, stops.direction = True, -1.0
        part = solve_ivp(slope, (begun, 9.0), [q, 0.0], events=stops, **EXACT)
        inside = (time >= begun) & (time <= part.t[-1])
        exact[inside] = part.sol(time[inside])[0]
        begun, q = part.t[-1], part.y[0, -1]
    exact[np.isnan(exact)] = q
    assert begun < 2.5
    without = release(plant(LinearSpring(STIFFNESS), inertia=INERTIA), schedule(time), 0.4)
    assert abs(float(without.sensed[-1]) - q) > 0.01
    np.testing.assert_allclose(seen.sensed, exact[1:], atol=1e-7)
    assert seen.speed[-1] == 0.0


def test_stribeck_friction_in_slow_motion_breaks_away_and_slides_to_the_lower_level():
    """What a spring takes until the rotor breaks away is D + b; a jump's speed is far above v_s."""
    made = with_breakaway(1e-3)
    time = np.linspace(0.0, 100.0, 401)
    push = 3e-4 * 0.5 * (time[1:] + time[:-1])
    seen = creep(made, schedule(time, applied=lambda t: 3e-4 * t))
    exact, q = [], 0.0
    for force in push:
        if force - STIFFNESS * q > D + BREAKAWAY:
            q = (force - D) / STIFFNESS
        exact.append(q)
    assert len(set(exact)) == 5
    np.testing.assert_allclose(seen.sensed, exact, atol=1e-12)


def test_load_dependent_friction_swings_less_far_each_way():
    """From rest at q to rest at -r: K (1 - s) q^2 / 2 - D q = K (1 + s) r^2 / 2 + D r."""
    share = 0.1
    friction = CoulombFriction(jnp.asarray(D))
    made = plant(LinearSpring(STIFFNESS), inertia=INERTIA, friction=friction)
    made += LoadDependentFriction(jnp.asarray(share))
    seen = np.asarray(release(made, schedule(np.linspace(0.0, 3.0, 3001)), 0.4).sensed)
    q, turns = 0.4, []
    while STIFFNESS * q > D + share * STIFFNESS * q:
        left = 0.5 * STIFFNESS * (1.0 - share) * q**2 - D * q
        stiff = STIFFNESS * (1.0 + share)
        q = (np.sqrt(D**2 + 2.0 * stiff * left) - D) / stiff
        turns.append(q)
    assert len(turns) > 3
    peaks = np.flatnonzero(np.diff(np.sign(np.diff(seen))))[: len(turns) - 1] + 1
    np.testing.assert_allclose(np.abs(seen[peaks]), turns[:-1], atol=2e-5)
    assert abs(seen[-1]) == pytest.approx(turns[-1], abs=1e-6)


def test_load_dependent_friction_in_slow_motion_holds_back_a_share_of_the_push():
    """P - K q = D + s (P + K q)"""
    share, rate = 0.1, 3e-4
    friction = CoulombFriction(jnp.asarray(D))
    made = plant(LinearSpring(STIFFNESS), inertia=0.0, friction=friction)
    made += LoadDependentFriction(jnp.asarray(share))
    time = np.linspace(0.0, 200.0, 801)
    seen = creep(made, schedule(time, applied=lambda t: rate * t))
    push = rate * 0.5 * (time[1:] + time[:-1])
    exact = np.maximum(push * (1.0 - share) - D, 0.0) / (STIFFNESS * (1.0 + share))
    np.testing.assert_allclose(seen.sensed, exact, atol=share * rate * 0.25 / STIFFNESS)
    assert exact[-1] > 0.2


@pytest.mark.parametrize("slope", [-2.0, 2.0])
def test_position_dependent_friction_swings_as_energy_says(slope):
    """From rest at q to rest at -r: K (q^2 - r^2) / 2 is the integral of D exp(s x) from -r to q."""
    friction = CoulombFriction(jnp.asarray(D))
    made = plant(LinearSpring(STIFFNESS), inertia=INERTIA, friction=friction)
    made += PositionDependentFriction(jnp.asarray(slope))
    seen = np.asarray(release(made, schedule(np.linspace(0.0, 1.0, 2001)), 0.4).sensed)

    def missing(r):
        rubbed = D * (np.exp(slope * 0.4) - np.exp(-slope * r)) / slope
        return 0.5 * STIFFNESS * (0.4**2 - r**2) - rubbed

    assert seen.min() == pytest.approx(-brentq(missing, 0.0, 0.4), abs=2e-5)


def test_force_scale_moves_equilibrium_by_its_share_of_what_drives():
    made = oscillator() + ForceScale(jnp.asarray(0.07))
    time = np.linspace(0.0, 1.0, 3)
    seen = creep(made, schedule(time, applied=lambda t: 0.02 + 0.0 * t), 0.0)
    np.testing.assert_allclose(seen.sensed, 1.07 * 0.02 / STIFFNESS, rtol=1e-12)


@pytest.mark.parametrize("share", [0.1, 0.18, 0.3, 0.6])
def test_stribeck_friction_in_slow_motion_glides_or_jumps_as_with_full_inertia(share):
    """c = x' b / (p v_s^2): below 0.23 the rotor glides under friction at rest, above it jumps."""
    pace, p = 2e-3, np.sqrt(STIFFNESS * INERTIA)
    speed, force = np.sqrt(pace * BREAKAWAY / (share * p)), STIFFNESS * pace
    assert BREAKAWAY / (p * speed) > 4.0
    time = np.linspace(0.0, 100.0, 401)
    seen = creep(with_breakaway(speed), schedule(time, lambda t: ROOM + pace * t))

    q, begun, path = 0.0, 0.0, np.zeros(time.size)
    while (begun := max(begun, (STIFFNESS * q + D + BREAKAWAY) / force)) < time[-1]:

        def slope(t, y):
            dry = D + BREAKAWAY * np.exp(-((y[1] / speed) ** 2))
            return [y[1], (force * t - STIFFNESS * y[0] - dry) / INERTIA]

        def stops(t, y):
            return y[1]

        stops.terminal, stops.direction = True, -1.0
        options = EXACT | {"rtol": 1e-8, "atol": 1e-11}
        # A thousandth of the pace, for nothing moves a rotor that is just balanced.
        part = solve_ivp(slope, (begun, time[-1]), [q, 1e-3 * pace], events=stops, **options)
        inside = (time >= begun) & (time <= part.t[-1])
        path[inside] = part.sol(time[inside])[0]
        q, begun = part.y[0, -1], part.t[-1]
        path[time > begun] = q
    lag = STIFFNESS * pace * time[1:] - STIFFNESS * path[1:]
    ours = STIFFNESS * pace * 0.5 * (time[1:] + time[:-1]) - STIFFNESS * np.asarray(seen.sensed)
    moving = time[1:] > 40.0
    glides = np.ptp(lag[moving]) < 0.3 * BREAKAWAY
    assert glides == (share < 0.23)
    # Where it jumps, inertia carries it past the level to which slow motion slides.
    assert (np.ptp(ours[moving]) < 0.3 * BREAKAWAY) == glides
    assert ours[moving].max() == pytest.approx(lag[moving].max(), abs=0.1 * BREAKAWAY)
    if glides:
        assert ours[moving].mean() == pytest.approx(lag[moving].mean(), abs=0.1 * BREAKAWAY)


def test_partial_heating_is_a_shorter_heater():
    time = np.linspace(0.0, 60.0, 121)
    heat = schedule(time, ramp, 0.139)
    part = creep(muscle_plant() + PartialHeating(jnp.asarray(0.3)), heat, -0.2)
    short = creep(muscle_plant(heated_fraction=0.7), heat, -0.2)
    np.testing.assert_allclose(part.sensed, short.sensed, rtol=1e-12)
    assert np.ptp(part.sensed) < 0.9 * np.ptp(creep(muscle_plant(), heat, -0.2).sensed)


AT = jnp.asarray(0.0), jnp.asarray(0.0)


def heated(temperature):
    return Drive(jnp.full(2, temperature), jnp.asarray(0.139), jnp.asarray(0.0))


@pytest.mark.parametrize("temperature", [25.0, 60.0, 90.0])
def test_softening_multiplies_the_modulus_and_leaves_the_force_that_opens_it(temperature):
    softer = TABLE_2["K_modulus"] * np.exp(-0.008 * (temperature - 25.0))
    made = muscle_plant() + ModulusTemperature(jnp.asarray(0.008))
    state = *AT, jnp.full(2, 0.02), heated(temperature)
    for method in ("force", "hyst_rate"):
        seen, same = (
            getattr(one, method)(*state) for one in (made, muscle_plant(K_modulus=softer))
        )
        np.testing.assert_allclose(seen, same, rtol=1e-12)


@pytest.mark.parametrize("temperature", [25.0, 60.0, 90.0])
def test_damper_law_is_arrhenius_where_eq_17_is_level(temperature):
    level = {"H": 1e-6, "T_hyst_offset": 1e12}
    made = muscle_plant(**level) + DamperLaw(jnp.asarray(3000.0), jnp.asarray(0.0))
    rates = [
        one.hyst_rate(*AT, jnp.full(2, 0.02), heated(temperature))[0]
        for one in (made, muscle_plant(**level))
    ]
    # ln B is straight in 1/T, and B is eq. 17's at 25 C.
    slower = np.log(float(rates[1] / rates[0]))
    assert slower == pytest.approx(3000.0 * (1 / (temperature + 273.15) - 1 / 298.15), rel=1e-9)


def test_damper_law_has_the_slope_and_curvature_of_other_laws():
    """Of an exponential of T, and of Williams, Landel and Ferry's law: what is left is of third order."""

    def log_factor(theta: float, kappa: float, celsius: float) -> float:
        effect = DamperLaw(jnp.asarray(theta), jnp.asarray(kappa))
        return float(jnp.log(effect(jnp.asarray(1.0), SimpleNamespace(temperature=celsius))))

    def exponential(above: float) -> float:
        return -0.03 * above

    def wlf(above: float) -> float:
        return -2.0 * above / (101.6 + above)

    slope = 0.03 * 298.15**2
    steep = 2.0 * 298.15**2 / 101.6
    for law, theta, kappa in (
        (exponential, slope, slope),
        (wlf, steep, steep * (1.0 - 298.15 / 101.6)),
    ):
        assert log_factor(theta, kappa, 25.0) == 0.0
        left = [abs(law(above) - log_factor(theta, kappa, 25.0 + above)) for above in (2.0, 4.0)]
        assert left[1] / left[0] == pytest.approx(8.0, rel=0.1)


def test_cogging_holds_an_oscillator_where_its_torque_balances_the_spring():
    made = oscillator() + Cogging(jnp.asarray(-0.02), jnp.asarray(0.01), jnp.asarray(7.0))
    balance = brentq(
        lambda q: -STIFFNESS * q - 0.02 * np.sin(7.0 * q) + 0.01 * np.cos(7.0 * q), -0.1, 0.2
    )
    seen = creep(made, schedule(np.linspace(0.0, 1.0, 3)), 0.05)
    np.testing.assert_allclose(seen.sensed, balance, rtol=1e-9)


@pytest.mark.parametrize("hyst", [0.0, 0.02, 0.05, 0.08])
def test_hysteresis_yield_takes_its_force_from_the_damper(hyst):
    resisted = 1.2
    plain, made = muscle_plant(), muscle_plant() + HysteresisYield(jnp.asarray(resisted))
    state = *AT, jnp.full(2, hyst), heated(60.0)
    force, left = (
        float(one.hyst_rate(*state)[0]) * BASE * float(one.side_a.parameters.damper(60.0))
        for one in (plain, made)
    )
    assert left == pytest.approx(np.sign(force) * max(abs(force) - resisted, 0.0), abs=1e-12)


def test_hysteresis_yield_leaves_a_muscle_stretched():
    made = muscle_plant(dry=9.0) + HysteresisYield(jnp.asarray(0.8))
    seen = creep(made, schedule(np.linspace(0.0, 20000.0, 2001)), 0.1, 0.0)
    strain = float(made.side_a.strain(jnp.asarray(0.1)))
    hyst = float(seen.hyst[-1, 0])
    pull, _ = muscle_tension_and_rate(strain, hyst, 25.0, TABLE_2, BASE)
    held = opening_spring(hyst, BASE * TABLE_2["K_hyst"], TABLE_2["F_hyst_min"])
    assert pull - held == pytest.approx(0.8, rel=1e-6)


@pytest.mark.parametrize("stretch", [-0.01, 0.004, 0.02, 0.05])
def test_slack_is_the_mean_of_parts_that_go_taut_one_after_the_other(stretch):
    span = 0.03
    parts = np.maximum(stretch - span * (np.arange(100000) + 0.5) / 100000, 0.0).mean()
    hyst = float(muscle_plant().side_a.strain(AT[0])) - stretch
    seen = muscle_plant().side_a.signals(Instant(*AT, hyst, 25.0, 0.1, {}), ())
    offset = Slack(jnp.asarray(span))(jnp.asarray(0.0), seen._replace(hyst=jnp.asarray(hyst)))
    left = float(seen.strain) - float(offset) - hyst
    assert max(left, 0.0) == pytest.approx(parts, abs=1e-9)


def test_soft_contact_takes_contraction_gradually_below_five_percent():
    """T1: at a constant load, less of each further degree's contraction is left, never none at once."""
    soft = CoilContact(jnp.asarray(100.0), jnp.asarray(0.05), jnp.asarray(0.05))
    made, temperatures, lengths = muscle_plant(dry=0.0) + soft, np.linspace(25.0, 90.0, 27), []
    for temperature in temperatures:
        now = schedule([0.0, 1e-9], temperature, 0.139)
        lengths.append(made.side_a.strain(creep(made, now, 0.0, 0.05).sensed[-1]))
    offset = made.side_a.parameters.offset(temperatures)
    strain, share = np.array(lengths[1:]), np.diff(lengths) / np.diff(offset)
    assert share[strain > 0.05].min() > 0.7  # the lever takes the rest
    assert share[strain < 0.03].max() < 0.3
    assert -0.1 < np.diff(share).min() < np.diff(share).max() < 0.0


def test_potentiometer_shows_a_parabola_and_is_read_backwards():
    bent = muscle_plant() + PotentiometerNonlinearity(jnp.asarray(0.05), jnp.asarray(-0.1))
    hyst = jnp.zeros(2)
    for q in (-0.8, 0.0, 0.7):
        shown = bent.sensed(jnp.asarray(q), hyst, heated(25.0))
        assert float(shown) == pytest.approx(1.05 * q - 0.1 * q**2, abs=1e-14)
        assert float(bent.located(shown, hyst, heated(25.0))) == pytest.approx(q, abs=1e-12)


def test_zero_drift_adds_a_ramp_to_what_is_shown_and_to_nothing_else():
    rate, time = 2e-3, np.linspace(0.0, 5.0, 501)
    plain, middle = muscle_plant(), 0.5 * (time[1:] + time[:-1])
    drifting = plain + ZeroDrift(jnp.asarray(rate))
    for motion, at in ((release, time[1:]), (creep, middle)):
        seen, true = (motion(one, schedule(time, ramp), -0.2, 0.04) for one in (drifting, plain))
        np.testing.assert_allclose(seen.sensed - true.sensed, rate * at, atol=1e-13)
        np.testing.assert_array_equal(seen.hyst, true.hyst)


def test_backlash_shows_half_its_gap_less_and_stands_while_it_is_crossed():
    gap, time = 0.03, np.linspace(0.0, 40.0, 401)
    pushed = schedule(time, applied=lambda t: STIFFNESS * 0.1 * (1.0 - np.abs(t - 20.0) / 20.0))
    q = np.asarray(creep(oscillator(), pushed).sensed)
    seen = creep(oscillator() + Backlash(jnp.asarray(gap)), pushed, q[0])
    rising = np.arange(q.size) < q.size // 2
    exact = np.where(
        rising, np.maximum(q - 0.5 * gap, q[0]), np.minimum(q + 0.5 * gap, q.max() - 0.5 * gap)
    )
    np.testing.assert_allclose(seen.sensed, exact, atol=1e-12)
    assert np.ptp(q) == pytest.approx(0.1, rel=0.01)


@pytest.mark.parametrize("delay", [1.3, -0.4])
def test_clock_offset_shifts_a_course(delay):
    def course(t):
        return 50.0 + 0.2 * t - 0.03 * t**2

    uneven = np.sort(np.r_[0.0, np.random.default_rng(1).uniform(0.0, 20.0, 60), 20.0, 20.0, 20.0])
    seen = ClockOffset(jnp.asarray(delay))(jnp.asarray(uneven), jnp.asarray(course(uneven)))
    inner = (uneven + delay > uneven[1]) & (uneven + delay < uneven[-4])
    np.testing.assert_allclose(seen[inner], course(uneven + delay)[inner], rtol=1e-12)
    assert np.isfinite(seen).all()


def held(effect, state_rate, heat, hyst):
    """The plant with the effect at a fixed angle, and a general solver's answer: HYST and strain."""
    made = muscle_plant(dry=99.0) + effect
    strain = float(made.side_a.strain(jnp.asarray(0.1)))

    def slope(t, y):
        pull, rate = muscle_tension_and_rate(strain - y[1], y[0], heat(t), TABLE_2, BASE)
        return [rate, state_rate(pull, heat(t), y[1])]

    time = np.linspace(0.0, 60.0, 121)
    seen = creep(made, schedule(time, heat), 0.1, hyst)
    return seen.hyst[:, 0], slope, time


@pytest.mark.parametrize("lacking", [0.0, 0.4])
def test_second_relaxation_is_a_voigt_element_in_series(lacking):
    compliance, tau = 0.006, 8.0
    effect = SecondRelaxation(jnp.asarray(compliance), jnp.asarray(tau), jnp.asarray(lacking))
    seen, slope, time = held(effect, lambda f, heat, s: (compliance * f - s) / tau, ramp, 0.05)
    # At rest under the first tension, HYST held.
    rest = brentq(lambda s: slope(0.0, [0.05, s])[1], 0.0, 0.2)
    exact = solve_ivp(slope, (0.0, 60.0), [0.05, (1.0 - lacking) * rest], t_eval=time, **EXACT).y[0]
    np.testing.assert_allclose(seen, exact[1:], atol=2e-6)
    assert np.ptp(exact) > 1e-3


@pytest.mark.parametrize("hyst", [0.09, 0.14, 0.17, 0.2])
def test_rest_is_found_through_the_kink_at_which_a_muscle_shuts(hyst):
    compliance, both = 0.006, jnp.full(2, hyst)

    def remembered(compliance):
        effect = SecondRelaxation(compliance, jnp.asarray(8.0), jnp.asarray(0.0))
        plant = rested(muscle_plant() + effect, jnp.asarray(0.1), both, heated(25.0))
        return plant.memory["second-relaxation"][0]

    strain = float(muscle_plant().side_a.strain(jnp.asarray(0.1)))

    def missing(s, compliance=compliance):
        pull, _ = muscle_tension_and_rate(strain - s, hyst, 25.0, TABLE_2, BASE)
        return compliance * pull - s

    def exact(compliance):
        return brentq(lambda s: missing(s, compliance), 0.0, 0.2, xtol=1e-15)

    found, slope = jax.jvp(remembered, (jnp.asarray(compliance),), (jnp.ones(()),))
    assert float(found) == pytest.approx(exact(compliance), abs=1e-12)
    finite = (exact(compliance + 1e-6) - exact(compliance - 1e-6)) / 2e-6
    assert float(slope) == pytest.approx(finite, rel=1e-5)


@pytest.mark.parametrize("trained", [0.0, 0.012])
def test_first_cycle_set_grows_with_heat_and_stays(trained):
    gain, tau = 1e-4, 6.0

    def heat(t):
        return 25.0 + 60.0 * np.sin(np.pi * np.minimum(t, 40.0) / 40.0)

    def rate(tension, temperature, moved):
        return max(gain * tension * (temperature - 25.0) - moved - trained, 0.0) / tau

    effect = FirstCycleSet(jnp.asarray(gain), jnp.asarray(tau), jnp.asarray(trained))
    seen, slope, time = held(effect, rate, heat, 0.05)
    exact = solve_ivp(slope, (0.0, 60.0), [0.05, 0.0], t_eval=time, max_step=0.1, **EXACT).y
    np.testing.assert_allclose(seen, exact[0, 1:], atol=2e-6)
    assert exact[1, -1] > 0.005
    assert np.diff(exact[1]).min() >= 0.0
