"""The predictive controller against Riccati's recursion, a tube in closed form, and the plant."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

casadi = pytest.importorskip("casadi")

from benchmarks.predictive_control.controller import Horizon, Predictive, Price  # noqa: E402
from benchmarks.predictive_control.model import (  # noqa: E402
    SOFTENED,
    STATE,
    numbers_of,
    stage_function,
    torque_function,
)
from benchmarks.predictive_control.observer import Observer  # noqa: E402
from benchmarks.predictive_control.page import Comparison, page  # noqa: E402
from muscle_bayes.control.judging.metrics import Metrics  # noqa: E402
from muscle_bayes.control.judging.specification import Specification  # noqa: E402
from muscle_bayes.control.plant.design import Design  # noqa: E402
from muscle_bayes.control.plant.draws import JointDraws  # noqa: E402
from muscle_bayes.physics.effects.muscle.coil_contact import CoilContact  # noqa: E402
from muscle_bayes.physics.effects.muscle.damper_law import DamperLaw  # noqa: E402
from muscle_bayes.physics.state import Drive  # noqa: E402

GAIN, COOLING = 4.5, 0.02
"""K/s at full power, and 1/s."""
TABLE = {
    "A": -1.19e-5, "B": 3.34e-5, "C": -0.0867, "F_hyst_min": 1.21, "K_hyst": 410.0,
    "F_modulus_min": 2.19, "K_modulus": 185.0, "H": -530.0, "T_hyst_offset": -248.0,
}  # fmt: skip
"""Muscle parameters near the shipped data's, in the units of `MuscleParameters`."""
STILL = jnp.zeros(())


def tube():
    """T' = gain u - cooling T, solved exactly over a step."""
    x, u, d, h = (casadi.SX.sym(name) for name in "xudh")
    cools = casadi.exp(-COOLING * h)
    after = cools * x + (1.0 - cools) / COOLING * (GAIN * u + d)
    return casadi.Function("stage", [x, u, d, h], [after])


def controller(steps, price):
    return Predictive(tube(), Horizon(steps), 0, np.ones((1, 1)), 1, price)


def test_a_free_plan_is_that_of_riccatis_recursion():
    """min sum h (x / e)^2 + p h u^2 without limits in the way: u = -K x, K from the recursion."""
    step, count, error, duty = 1.0, 12, 2.0, 3.0
    price = Price(error=error, duty=duty, change=0.0, last=1.0)
    a = np.exp(-COOLING * step)
    b = GAIN * (1.0 - a) / COOLING
    cost = step / error**2
    p = cost
    for _ in range(count):
        gain = a * b * p / (duty * step + b * b * p)
        p = cost + a * a * p - a * b * p * gain
    plans = controller((step,) * count, price)
    x = -1.3  # below what is wanted, so that heating helps
    plan = plans.plan(
        np.array([x]), np.zeros(1), np.zeros(count), 1e3, np.zeros((count, 1)), np.zeros(1)
    )
    assert 0.0 < plan.max() < 1.0
    assert plan[0, 0] == pytest.approx(-gain * x, rel=1e-6)


def driven(wanted: float, ceiling: float, seconds: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Temperature above the room and duty under the plan renewed every second."""
    plans = controller((1.0,) * 30, Price(error=1.0, duty=1e-6, change=1e-6))
    x, plan, before = np.zeros(1), np.zeros((30, 1)), np.zeros(1)
    states, duties = [], []
    for _ in range(seconds):
        guess = plans.horizon.shifted(plan, 1.0)
        plan = plans.plan(x, np.zeros(1), np.full(30, wanted), ceiling, guess, before)
        before = plan[0]
        x = np.asarray(plans.stage(x, before, 0.0, 1.0))[:, 0]
        states.append(x[0])
        duties.append(before[0])
    return np.array(states), np.array(duties)


def test_a_tube_heats_fully_until_it_is_there_and_then_holds():
    """Nothing is quicker than full power: T(t) = gain / cooling (1 - e^(-cooling t))."""
    wanted = 50.0
    states, duties = driven(wanted, 1e3)
    quickest = -np.log1p(-wanted * COOLING / GAIN) / COOLING
    first = int(quickest)  # whole seconds of full power
    assert duties[:first] == pytest.approx(1.0, abs=1e-3)
    assert states[first] == pytest.approx(wanted, abs=0.05)
    assert duties[-1] == pytest.approx(COOLING * wanted / GAIN, abs=1e-3)


def test_the_ceiling_is_held_where_more_is_wanted():
    states, duties = driven(80.0, 60.0)
    assert states.max() == pytest.approx(60.0, abs=0.02)
    assert duties[-1] == pytest.approx(COOLING * 60.0 / GAIN, abs=1e-3)


def test_a_plan_made_earlier_moves_up():
    horizon = Horizon((1.0, 1.0, 2.0))
    plan = np.array([[1.0], [2.0], [3.0]])
    assert horizon.shifted(plan, 1.0)[:, 0].tolist() == [2.0, 3.0, 3.0]


@pytest.fixture(scope="module")
def joint():
    """A joint of two muscles alike with dry friction."""
    values = TABLE | {"heater.gain": GAIN, "heater.cooling": COOLING, "heater.lag": 0.3}
    both = {name: np.full((1, 2), value) for name, value in values.items()}
    single = {"J": 1.24e-3, "D": 5.5e-3, "room": 25.0, "meter_lag": 1.0}
    rows = both | {name: np.full(1, value) for name, value in single.items()}
    with jax.enable_x64(True):
        yield JointDraws(Design(), "coulomb", (), rows).one()


@pytest.mark.parametrize("angle", [-0.1, 0.0, 0.07])
@pytest.mark.parametrize(
    ("effect", "values"),
    [
        (None, ()),
        (CoilContact, (300.0, 0.12, 0.02)),
        (CoilContact, (300.0, 0.12, 0.3)),
        (DamperLaw, (3000.0, -1800.0)),
    ],
)
def test_torque_and_relaxation_are_the_plants(joint, angle, effect, values):
    """Two codes of eq. 7 to 18."""
    if effect is not None:
        joint = dataclasses.replace(joint, plant=joint.plant + effect(*map(jnp.asarray, values)))
    hyst, warm = np.array([0.09, 0.07]), np.array([40.0, 85.0])
    torque, rates = torque_function(numbers_of(joint))(angle, hyst, warm)
    drive = Drive(jnp.asarray(warm), STILL, STILL)
    q = jnp.asarray(angle)
    ours = joint.plant.force(q, STILL, jnp.asarray(hyst), drive)
    assert float(torque) == pytest.approx(float(ours), rel=1e-9)
    relax = joint.plant.hyst_rate(q, STILL, jnp.asarray(hyst), drive)
    assert np.asarray(rates)[:, 0] == pytest.approx(np.asarray(relax), rel=1e-9)


def test_a_stage_heats_as_the_plants_tube_and_slides_to_where_friction_holds(joint):
    from muscle_bayes.control.plant.heater import HeaterState

    numbers = numbers_of(joint)
    stage, torque = stage_function(numbers), torque_function(numbers)
    x, duty = np.array([0.2, 0.1, 5.0, 40.0, 0.08, 0.08, 0.0]), np.array([0.3, 0.9])
    after = np.asarray(stage(x, duty, np.zeros(3), 0.5))[:, 0]
    start = HeaterState(jnp.asarray(x[:2]), jnp.asarray(x[2:4]))
    heat = joint.heater.step(0.5)(start, jnp.asarray(255.0 * duty))
    assert after[:2] == pytest.approx(np.asarray(heat.power), rel=1e-9)
    assert after[2:4] == pytest.approx(np.asarray(heat.excess), rel=1e-9)
    left = float(torque(after[6], after[4:6], numbers.room + after[2:4])[0])
    assert after[6] > 0.01
    # It slides, and stops where what is left is friction's.
    assert left == pytest.approx(numbers.friction, rel=0.02)
    held = np.asarray(stage(np.r_[after[:6], after[6] - 1e-3], np.zeros(2), np.zeros(3), 1e-3))
    assert held[6, 0] > after[6] - 1e-3  # further back it slides on
    rests = np.asarray(stage(np.r_[after[:6], after[6] + 5e-3], np.zeros(2), np.zeros(3), 1e-3))
    assert rests[6, 0] == pytest.approx(after[6] + 5e-3, abs=1e-5)


def test_a_joint_that_sticks_short_of_the_setpoint_is_pushed_on(joint):
    """By the slopes of rounded friction: of true friction a small push does nothing."""
    numbers = numbers_of(joint)
    sticks = stage_function(numbers)
    bounded = np.zeros((2, STATE))
    bounded[0, 2] = bounded[1, 3] = 1.0
    sloped = stage_function(numbers, SOFTENED)
    plans = Predictive(sticks, Horizon((0.5,) * 20), STATE - 1, bounded, rounds=6, sloped=sloped)
    rest = np.r_[np.zeros(4), 0.093, 0.093, 0.0]
    plan = plans.plan(rest, np.zeros(3), np.full(20, 0.01), 70.0, np.zeros((20, 2)), np.zeros(2))
    assert plans.predicted(rest, np.zeros((20, 2)), np.zeros(3))[-1, 6] == pytest.approx(
        0.0, abs=2e-3
    )
    assert plans.predicted(rest, plan, np.zeros(3))[-1, 6] == pytest.approx(0.01, abs=2e-3)


def test_the_observer_finds_a_heater_that_differs_and_a_load(joint):
    """What it lacks is found without an offset: readings agree with the model's in the end."""
    numbers = numbers_of(joint)
    observer = Observer(numbers, 1.0, 0.0058, 0.5)
    hyst = np.array([0.09, 0.09])
    belief, duties, warm = observer.at_rest(0.0, hyst), np.array([0.0, 0.3]), np.zeros(2)
    gain = 1.1 * GAIN
    for _ in range(400):
        cools = np.exp(-COOLING * 0.5)
        warm = cools * warm + (1.0 - cools) / COOLING * gain * duties
        belief = observer.updated(belief, 0.05, numbers.room + warm, duties)
    assert belief.heat[:, 1] == pytest.approx(warm, abs=0.05)
    assert belief.heat[1, 3] == pytest.approx((gain - GAIN) * 0.3, abs=0.01)
    value = observer._torque(0.05, belief.hyst, numbers.room + belief.heat[:, 1])[0]
    assert abs(value + belief.torque) <= numbers.friction + 1e-5


def test_what_the_model_lacks_is_refused(joint):
    class Effects:
        effects = ("viscous-friction",)

    class Odd:
        plant = Effects

    with pytest.raises(ValueError, match="coil contact and damper law only"):
        numbers_of(Odd)


def judged(settling: float, tracking: float, joints: int = 40) -> dict[str, Metrics]:
    """Metrics of a step and a sine, the same of all joints."""
    nothing = Metrics(*np.full((len(Metrics._fields), joints), np.nan))
    fine = nothing._replace(peak_temperature=np.full(joints, 80.0), runaway=np.zeros(joints))
    step = fine._replace(settling_time=np.full(joints, settling))
    return {"step": step, "sine": fine._replace(tracking=np.full(joints, tracking))}


def test_the_page_says_where_planning_is_better_and_where_it_is_not():
    specs = {
        "step": Specification({"settling_time": 30.0, "peak_temperature": 100.0}),
        "sine": Specification({"tracking": 0.5, "peak_temperature": 100.0}),
    }
    columns = {"predictive": judged(20.0, 0.4), "pi": judged(25.0, 0.6)}
    seconds = np.array([0.003, 0.004])
    found = Comparison(columns, judged(10.0, 0.2), specs, "pi", 40, ("simulated",), seconds)
    text = page(found, "a command")
    assert "Predictive control is better than pi in sine." in text
    assert "Predictive control is not better than pi in step." in text
    assert "It meets all on 40 joints on which pi does not; the reverse holds on 0." in text
    assert "| sine | 0.4 (0.4 to 0.4) | 0.6 (0.6 to 0.6) | 0.2 (0.2 to 0.2) |" in text
    assert "Left on the table by pi, against an input that knows joint and future: 100%" in text
