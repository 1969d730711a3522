"""What is asked, what is within reach, and how laws are compared."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from muscle_bayes.control.judging.feasible import feasible
from muscle_bayes.control.judging.judge import Judgement, standard_error
from muscle_bayes.control.judging.metrics import RUNAWAY, Metrics
from muscle_bayes.control.judging.specification import Specification, cvar, wanted, within_reach
from muscle_bayes.control.plant.design import Design
from muscle_bayes.control.plant.draws import JointDraws
from muscle_bayes.control.scenarios.scenario import Scenario
from muscle_bayes.control.scenarios.thesis import load_sine, load_step, setpoint_sine, square, step
from muscle_bayes.report.control_page import _page

SCRIPT = Path(__file__).parents[2] / "scripts" / "control_results.py"
NOTHING = dict.fromkeys(Metrics._fields, np.nan)


def found(**values):
    return Metrics(**{**NOTHING, "runaway": 0.0, "peak_temperature": 60.0, **values})


def test_what_is_wanted_depends_on_what_moves():
    assert "recovery_time" in wanted(load_step(0.03)).limits
    assert "recovery_time" not in wanted(square(0.03)).limits
    assert wanted(setpoint_sine(0.03, 0.1)).limits["tracking"] == pytest.approx(np.sqrt(0.5))
    assert wanted(load_sine(0.03, 0.1)).limits["tracking"] == 0.3
    assert (
        wanted(step(0.03), {"settling_time": 12.0, "tracking": 0.1}).limits["settling_time"] == 12.0
    )


def test_limits_are_no_stricter_than_the_best_input_allows():
    asked = wanted(step(0.03))
    best = found(settling_time=40.0, overshoot=0.0, steady_error=0.001)
    reached = within_reach(asked, best)
    assert reached.limits["settling_time"] == pytest.approx(60.0)
    assert reached.limits["steady_error"] == asked.limits["steady_error"]
    assert not reached.infeasible


def test_what_no_input_reaches_is_infeasible_and_must_do_no_harm():
    never = within_reach(
        wanted(step(0.03)), found(settling_time=np.inf, overshoot=0.0, steady_error=0.1)
    )
    assert "settling time is infinite" in never.infeasible
    beyond = within_reach(wanted(setpoint_sine(0.03, 1.0)), found(tracking=0.9))
    assert "0.90" in beyond.infeasible
    assert beyond.limits["tracking"] == RUNAWAY


def test_what_the_best_input_reaches_is_told_of_most_joints():
    settling = np.r_[np.linspace(10.0, 40.0, 18), np.inf, np.inf]
    zero = np.zeros(20)
    best = found(
        settling_time=settling, overshoot=zero, steady_error=zero, peak_temperature=zero + 80.0,
        runaway=zero,
    )  # fmt: skip
    reached = within_reach(wanted(step(0.03)), best)
    assert reached.limits["settling_time"] == pytest.approx(60.0)
    assert reached.attainable == pytest.approx(0.9)


def test_excess_is_relative_and_cut_off():
    spec = Specification({"settling_time": 30.0, "peak_temperature": 100.0})
    values = found(
        settling_time=np.array([15.0, 45.0, np.inf]),
        peak_temperature=np.array([90.0, 100.0, 105.0]),
        runaway=np.zeros(3),
    )
    np.testing.assert_allclose(spec.excess(values)["settling_time"], [-0.5, 0.5, 3.0])
    np.testing.assert_allclose(spec.excess(values)["peak_temperature"], [-1.0, 0.0, 0.5])
    np.testing.assert_array_equal(spec.met(values), [True, False, False])


def test_cvar_is_the_mean_of_the_worst():
    values = np.arange(100.0)
    assert cvar(values, 0.95) == pytest.approx(97.0)
    assert cvar(values, 0.995) == pytest.approx(99.0)


def test_monte_carlo_errors_are_never_nothing():
    assert standard_error(0.0, 100) > 0.005
    assert standard_error(0.5, 400) == pytest.approx(0.025, rel=0.02)


def test_ties_are_ties():
    generator = np.random.default_rng(0)
    own = 30.0 * np.exp(0.2 * generator.standard_normal(300))
    times = {"a": own, "b": own * (1 + 1e-4 * generator.standard_normal(300)), "c": 1.5 * own}
    spec = {"s": Specification({"settling_time": 30.0})}
    outcomes = {
        law: {"s": SimpleNamespace(metrics=found(settling_time=value, runaway=np.zeros(300)))}
        for law, value in times.items()
    }
    gains = {law: SimpleNamespace(sentence=lambda: "some") for law in times}
    result = Judgement(gains, (Scenario("s", "", step(0.03)),), spec, outcomes, 300)
    assert result.compared("a", "b") == {"s": "tied"}
    assert result.compared("a", "c") == {"s": "lower"}
    assert result.compared("c", "a") == {"s": "higher"}
    assert result.recommended in ("a", "b")
    assert "to a in s" not in result.sentence()


def test_of_the_joints_that_some_input_can_serve():
    times = np.array([20.0, 40.0, 20.0, 50.0, 20.0, 60.0])
    outcomes = {
        "a": {"s": SimpleNamespace(metrics=found(settling_time=times, runaway=np.zeros(6)))}
    }
    gains = {"a": SimpleNamespace(sentence=lambda: "some")}
    spec = {"s": Specification({"settling_time": 30.0})}
    scenarios = (Scenario("s", "", step(0.03)),)
    can = np.array([True, True, True, False])
    result = Judgement(gains, scenarios, spec, outcomes, 6, possible={"s": can})
    assert result.probability("a", "s")[0] == pytest.approx(0.5)
    share, error, count = result.where_possible("a", "s")
    assert (share, count) == (pytest.approx(2 / 3), 3)
    assert error == standard_error(share, 3)
    assert "Weak spot: s 50% (67% ±" in result.sentence()
    assert "of the 3 joints on which some input can" in result.sentence()
    assert "Its gains are some." in result.sentence()
    title, *_, first, _ = _page(result, {}, {}, "tune").split("\n\n")[:4]
    assert title == "# Laws on new joints: results (simulated)"
    assert first.startswith("**Use a: 50% (±")
    assert "of new joints meet every specification.** Its gains" in first


def test_the_best_input_keeps_its_bounds_and_knows_what_is_out_of_reach(joints):
    far = Scenario("far", "", step(0.03, size=0.5))
    near = Scenario("near", "", step(0.03, size=0.05))
    best = feasible(joints, [near, far], knots=40, rounds=12, joints=4)
    assert (best["near"].settling_time < 20.0).all()
    assert (best["near"].peak_temperature < 101.0).all()
    assert (best["far"].settling_time == np.inf).all()
    assert (best["far"].peak_temperature < 104.0).all()


SLACK = {
    "A": (-1.373e-5, -1.025e-5), "B": (1.001e-4, -1.871e-5), "C": (0.07193, 0.06673),
    "F_hyst_min": (4.215, 0.8583), "K_hyst": (441.3, 480.4), "F_modulus_min": (3.039, 5.752),
    "K_modulus": (221.5, 215.8), "H": (-544.6, -635.6), "T_hyst_offset": (-243.5, -271.2),
    "heater.gain": (4.69, 4.70), "heater.cooling": (0.0199, 0.0192), "heater.lag": (0.24, 0.24),
    "J": 1.24e-3, "D": 5.46e-3, "room": 26.8, "meter_lag": 2.0,
}  # fmt: skip
"""A drawn joint whose muscles are all but slack, so that the torque's slope vanishes in places."""


def test_the_best_input_keeps_a_nearly_slack_joint_off_its_stops():
    values = {key: np.asarray([value]) for key, value in SLACK.items()}
    joint = JointDraws(Design(), "coulomb", (), values)
    best = feasible(joint, [Scenario("step", "", step(0.03))], rounds=5)["step"]
    assert best.tracking[0] < 0.5


def test_ties_that_no_law_can_break_are_named():
    """Out of reach for every input, or cut off under the best input, too."""
    forced = runpy.run_path(str(SCRIPT))["forced_ties"]
    limit = {"settling_time": 1.0}
    specs = {name: Specification(limit) for name in ("easy", "some", "hard")}
    specs["never"] = Specification(limit, infeasible="too fast")
    hard, never = forced(specs, {"some": 2.9, "hard": 3.0})
    assert hard.startswith("hard: the best input's CVaR is 3")
    assert never.startswith("never: out of any input's reach")


def test_the_best_input_may_be_a_kelvin_too_hot():
    spec = Specification({"settling_time": 10.0, "peak_temperature": 100.0})
    best = found(
        settling_time=np.array([5.0, 5.0, 20.0]), peak_temperature=np.array([100.9, 103, 90])
    )
    assert spec.met_by_best(best).tolist() == [True, False, False]
    assert spec.worst_of_best(best)[2] == pytest.approx(1.0)
