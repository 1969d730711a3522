"""Many draws at once; results as objects and figures; tuning."""

import numpy as np
import pytest
from loops import loop

from muscle_bayes.control.batch import Bank, run
from muscle_bayes.control.cost import Cost
from muscle_bayes.control.criteria import MeanCost
from muscle_bayes.control.design import Design, read_design
from muscle_bayes.control.draws import joint_draws
from muscle_bayes.control.gains import Gains
from muscle_bayes.control.laws.build import Numbers, build_law
from muscle_bayes.control.scenario import Scenario
from muscle_bayes.control.scenario_file import read_scenario
from muscle_bayes.control.scenarios import course_of
from muscle_bayes.control.sensitivity import judged_values
from muscle_bayes.control.study import robustness
from muscle_bayes.control.tune import Effort, tune
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.report.control_figures import scenario_figure

GAINS = Gains(proportional=3000.0, integral=100.0)


@pytest.fixture(scope="module")
def nudge():
    time = 0.03 * np.arange(400)
    return Scenario(
        "nudge", "a nudge", course_of(np.where(time > 1, 0.04, 0.0), 0.005 * (time > 8))
    )


def test_a_draw_of_the_batch_is_that_draw_alone(joints, nudge):
    bank = Bank(joints)
    together = run(bank, build_law(GAINS, joints.design), nudge)
    for draw in (0, 3):
        alone = loop(joints.one(draw), GAINS, nudge.course)
        assert together.angle[draw] == pytest.approx(alone.angle[::10], abs=1e-9)


def test_result_is_a_table_and_a_figure(joints, nudge):
    result = robustness(Bank(joints), GAINS, [nudge], notes=["simulated"])
    table = result.table()
    assert table.loc[("nudge", "tracking_error"), "unit"] == "rad"
    cost = result.outcomes["nudge"].cost
    assert table.loc[("nudge", "cost"), "cvar95"] == pytest.approx(cost.max())
    assert "simulated" in result._repr_html_()
    figure = scenario_figure(result, nudge)
    assert [axis.get_ylabel() for axis in figure.axes][-1] == "load [g]"


def test_tuning_finds_better_gains_than_its_best_start(joints, nudge):
    bank, blank = Bank(joints), Gains(proportional=1.0, integral=1.0)
    effort = Effort(starts=8, scout_draws=4, refined=1, steps=6)
    found = tune(bank, [nudge], MeanCost(), blank, effort=effort)
    numbers = Numbers(found.gains.proportional, found.gains.integral, found.gains.bias)
    values, _ = judged_values(bank, blank, numbers, nudge, Cost(), derivatives=False)
    assert values["cost"].mean() == pytest.approx(found.value, rel=1e-6)
    assert found.value <= found.history[0]
    assert found.value < 0.98 * found.history[0] or len(found.history) > 1


def test_effects_of_the_posterior_come_along_and_can_be_left_out(touching, heater, nudge):
    joints = joint_draws(touching, heater, 3)
    assert joints.effects == ("coil-contact",)
    assert [effect.name for effect in joints.one().plant.effects] == ["coil-contact"]
    without = joints.without("coil-contact")
    assert without.one().plant.effects == ()
    law = build_law(GAINS, joints.design)
    first, second = (run(Bank(one), law, nudge).angle for one in (joints, without))
    assert np.abs(first - second).max() > 1e-3
    with pytest.raises(MuscleBayesError, match="no effect"):
        without.without("coil-contact")


def test_draws_kept_apart_are_others(posterior, heater):
    tuned_on, kept = joint_draws(posterior, heater, 30).split(12)
    assert (len(tuned_on), len(kept)) == (12, 18)
    assert not set(tuned_on.values["A"]) & set(kept.values["A"])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('name = "x"\nlength = 9.0\n', "setpoint"),
        ('name = "x"\nlength = 9.0\n[setpoint]\ntime=[1.0]\nangle=[1.0]\n', "begin at 0"),
        (
            'name = "x"\nlength = 9.0\n[setpoint]\ntime=[0.0, 1.0]\nangle=[1.0]\n',
            "one value a time",
        ),
        ('name = "x"\nlength = 9.0\n[setpoint]\ntime=[0.0]\nangle=[0.0]\n', "zero throughout"),
        ('name = "../x"\nlength = 9.0\n[setpoint]\ntime=[0.0]\nangle=[1.0]\n', "name"),
        ('name = "x"\nlength = -1.0\n[setpoint]\ntime=[0.0]\nangle=[1.0]\n', "length"),
    ],
)
def test_scenario_files_with_nonsense_are_refused(text, told, tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(text)
    with pytest.raises(MuscleBayesError) as raised:
        read_scenario(path, 0.03)
    assert told in str(raised.value)
    assert "s.toml" in str(raised.value)


def test_a_scenario_of_ones_own(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(
        'name = "ramp"\nlength = 3.0\n[setpoint]\ntime = [0.0, 2.0]\nangle = [0.0, 0.1]\n'
        'between = "straight"\n[load]\ntime = [0.0, 1.5]\nmass = [0.0, 0.01]\n'
    )
    course = read_scenario(path, 0.5).course
    assert course.setpoint == pytest.approx([0.0, 0.025, 0.05, 0.075, 0.1, 0.1])
    assert course.load == pytest.approx([0.0, 0.0, 0.0, 0.01, 0.01, 0.01])


def test_a_joint_needs_two_muscles(tmp_path):
    path = tmp_path / "j.toml"
    path.write_text('[element_b]\nkind = "none"\n')
    with pytest.raises(MuscleBayesError, match="element_b"):
        read_design(path)
    path.write_text("[fixture]\nmotion = 'linear'\n")
    with pytest.raises(MuscleBayesError, match="Fix"):
        read_design(path)
    path.write_text("[potentiometer]\nzero_reading = 500.0\nradians_per_count = -0.004\n")
    assert read_design(path).potentiometer.radians_per_count == -0.004
    assert Design().plant().side_b.relaxes
