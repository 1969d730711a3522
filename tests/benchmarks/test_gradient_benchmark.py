"""The benchmark compares like with like; nothing here is timed."""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.competitors.c_floor import CFloor, compiler
from benchmarks.competitors.generic_diffrax import GenericDiffrax
from benchmarks.competitors.lsoda import Floats, Lsoda
from benchmarks.competitors.ours import Ours
from benchmarks.density import inputs_of, log_posterior, value_and_gradient
from benchmarks.ode import Inputs, damping_for, rates
from benchmarks.problem import INPUTS, count_of, lanes_of, posed, reference_point
from benchmarks.reference import error, refined
from muscle_bayes.inference.model.density import constrain
from muscle_bayes.inference.model.lane_model import physical_of, plant_of
from muscle_bayes.inference.model.problem import Problem
from muscle_bayes.inference.running.programs import potential_at
from muscle_bayes.physics.state import Drive

pytestmark = pytest.mark.slow
needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")


@pytest.fixture(scope="module")
def problem() -> Iterator[Problem]:
    with jax.enable_x64(True):
        yield posed(("staircase-139g",))


@pytest.fixture(scope="module")
def points(problem: Problem) -> list[jnp.ndarray]:
    """The reference point, and one far away where the rotor slides far in single intervals."""
    first = reference_point(problem)
    away = np.random.default_rng(1).standard_normal(first.size)
    return [first, first + 0.2 * away]


def test_outer_density_is_the_posterior_of_our_own_coordinates(problem, points) -> None:
    ours = Ours(problem)
    for point in points:
        mine = log_posterior(point, ours.coordinates(point), problem.layout, problem.data)
        whole = -potential_at(point, problem.layout, problem.data)
        np.testing.assert_allclose(mine, whole, rtol=1e-10)


@pytest.mark.slow
@needs_compiler
def test_floor_and_outer_density_give_our_coordinates_and_gradient(problem, points) -> None:
    ours, floor = Ours(problem), CFloor(problem)
    for point in points:
        np.testing.assert_allclose(floor.coordinates(point), ours.coordinates(point), atol=1e-10)
        value, gradient = ours(point)
        other = floor(point)
        np.testing.assert_allclose(other[0], value, rtol=1e-9)
        np.testing.assert_allclose(
            other[1], gradient, rtol=1e-6, atol=1e-7 * np.abs(gradient).max()
        )


def test_runs_of_different_length_are_given_alike() -> None:
    """The longest decides; what is added has no reading, and the density is ours all the same."""
    with jax.enable_x64(True):
        several = posed(("staircase-139g", "staircase-166g"))
        lanes, point = lanes_of(several), reference_point(several)
        alone = [lanes_of(posed((run.name,)))[0].intervals for run in several.runs]
        assert alone[0] != alone[1]
        assert [lane.intervals for lane in lanes] == [max(alone)] * 2
        shortest = int(np.argmin(alone))
        assert not np.any(several.data.lanes[0].weight[shortest, alone[shortest] :])
        assert all(np.all(np.diff(lane.course.time) > 0.0) for lane in lanes)
        ours = Ours(several)
        q = ours.coordinates(point)
        assert q.shape == (2, max(alone))
        assert log_posterior(point, q, several.layout, several.data) == pytest.approx(
            ours(point)[0], rel=1e-10
        )
        beyond = q.copy()
        beyond[shortest, alone[shortest] :] += 1.0
        assert error(beyond, q, several) == 0.0


def test_outer_gradient_is_that_of_its_value(problem, points) -> None:
    point, q = points[0], Ours(problem).coordinates(points[0])
    jacobian = np.zeros((*q.shape, len(INPUTS)))
    args = problem.layout, problem.data
    _, gradient = value_and_gradient(point, q, jacobian, *args)
    step = 1e-6
    for place in range(point.size):
        ahead, behind = (
            log_posterior(point.at[place].add(sign * step), q, *args) for sign in (1, -1)
        )
        np.testing.assert_allclose(
            gradient[place], (ahead - behind) / (2 * step), rtol=1e-4, atol=1e-3
        )


def test_ode_has_the_plants_forces_and_rates(problem, points) -> None:
    lane, damping = lanes_of(problem)[0], 1e-3
    values = constrain(points[0], problem.layout, problem.data)
    rig = jax.tree.map(lambda leaf: leaf[0], problem.data.lanes[0])
    physical = physical_of(values, problem.layout, problem.data)
    plant = plant_of(rig.plant, physical, problem.layout)
    p = Inputs(*np.asarray(inputs_of(points[0], problem.layout, problem.data))[0].tolist())
    for q, hyst, heat in (
        (-0.4, 0.01, 25.0),
        (0.3, 0.03, 80.0),
        (0.5, 0.3, 60.0),
        (-0.1, 0.02, 40.0),
    ):
        speed, rate = rates(Floats, lane, p, q, hyst, heat, damping)
        drive = Drive(jnp.full(2, heat), rig.schedule.load[0], rig.schedule.applied[0])
        state = jnp.asarray(q), jnp.asarray(0.0), jnp.full(2, hyst), drive
        force = float(plant.force(*state))
        dry = np.sign(force) * min(abs(force), p.D)
        np.testing.assert_allclose(speed, (force - dry) / damping, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(rate, plant.hyst_rates(*state)[0], rtol=1e-9)


def test_the_overdamped_ode_runs_where_our_steps_do(problem, points) -> None:
    strict = Lsoda(problem, damping_for(0.01), 1e-8)
    apart = strict.coordinates(points[0]) - Ours(problem).coordinates(points[0])
    assert np.sqrt(np.mean(apart**2)) < 0.02 * count_of(problem)


def test_generic_diffrax_solves_the_plants_own_terms(problem, points) -> None:
    generic = GenericDiffrax(problem, damping_for(0.01), 1e-6)
    apart = generic.coordinates(points[0]) - Ours(problem).coordinates(points[0])
    assert np.sqrt(np.mean(apart**2)) < 0.02 * count_of(problem)


def test_refining_keeps_the_course(problem) -> None:
    course = lanes_of(problem)[0].course
    fine = refined(course, 3)
    np.testing.assert_allclose(fine.time[::6], course.time[::2])
    np.testing.assert_allclose(np.interp(course.time, fine.time, fine.heat), course.heat, atol=1e-9)
