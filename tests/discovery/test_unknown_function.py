"""A torque that no catalogue has, hidden in spring runs: found, and shown as it is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.text import Text

from benchmarks.trial.outside import Detent
from muscle_bayes.data import read_runs
from muscle_bayes.data.writer import write_run
from muscle_bayes.discovery.discover import discover
from muscle_bayes.report.discovery_figures import unknown_figure
from muscle_bayes.report.discovery_summary import summary
from muscle_bayes.twin import Rig, simulate, spring_rig
from muscle_bayes.twin.protocols import spring


@pytest.mark.slow
def test_a_detent_is_found_as_a_torque_of_the_angle(tmp_path: Path) -> None:
    rig, hidden = spring_rig(Rig()), Detent()
    rig = replace(rig, truth=replace(rig.truth, effects=(hidden,)))
    for number, mass in enumerate((0.100, 0.110, 0.118, 0.126), 1):
        run = simulate(rig, spring(mass), number)
        write_run(tmp_path, f"spring-{number}", run.log, run.metadata)
    found = discover(read_runs([tmp_path]), candidates=("viscous-friction",))
    (step,) = found.steps
    assert (found.verdict, step.port, step.signals) == ("unknown", "torque", ("q",))
    curve = step.curve
    assert curve is not None
    assert found.as_dict()["steps"][0]["curve"]["median"] == curve.median.tolist()
    # Where the rotor was; a constant is none of the function, the sensor's zero takes it.
    seen = (curve.signal > 0.0) & (curve.signal < 1.1)
    half = 0.5 * (curve.high - curve.low)[seen]
    truth = np.array([hidden.extra_torque(angle, 0.0) for angle in curve.signal[seen]])
    error = curve.median[seen] - truth
    error -= np.average(error, weights=half**-2)
    # The runs tell the curve well in its middle; at its ends the band is wide.
    well = half < 0.2 * hidden.depth
    assert well.mean() > 0.4
    assert np.sqrt(np.mean(error[well] ** 2)) < 0.15 * hidden.depth
    assert np.mean(np.abs(error) < half) > 0.7
    told = summary(found, {"spring-1": "synthetic"})
    assert "The torque changes by -" in told
    first, last = (f"{end:.3g}" for end in curve.signal[[0, -1]])
    assert f"the angle or position being from {first} to {last}" in told
    assert -0.3 < curve.signal[0] < 0.1 < 0.9 < curve.signal[-1] < 1.3
    assert "c1 " not in told
    figure = unknown_figure(step, curve, {"spring-1": "synthetic"})
    axis, marks = figure.axes[0], [one.get_text() for one in figure.findobj(Text)]
    assert any("Synthetic data" in mark for mark in marks)
    assert axis.lines[1].get_ydata() == pytest.approx(curve.median)
