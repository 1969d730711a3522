"""A schedule cut finely: what its temperature is between the nodes."""

import numpy as np

from muscle_bayes.physics.refinement import refined
from muscle_bayes.physics.schedule import Schedule


def parabola(time: np.ndarray) -> np.ndarray:
    return 80.0 - 0.5 * (time - 4.0) ** 2


def test_steps_follow_the_parabola_that_nodes_cut_off() -> None:
    nodes = np.array([0.0, 1.0, 3.0, 6.0, 8.0])
    heat = np.stack([parabola(nodes), np.full(nodes.size, 25.0)], 1)
    schedule = Schedule(nodes, heat, np.full(4, 0.1), np.zeros(4))
    slowing = np.stack([np.ones(nodes.size), np.zeros(nodes.size)], 1)
    fine = refined(schedule, np.full(4, 0.1), deceleration=slowing).schedule
    np.testing.assert_allclose(fine.temperature[:, 0], parabola(fine.time), atol=1e-9)
    np.testing.assert_allclose(fine.temperature[:, 1], 25.0)
    chords = refined(schedule, np.full(4, 0.1)).schedule
    np.testing.assert_allclose(chords.temperature[:, 0], np.interp(chords.time, nodes, heat[:, 0]))
