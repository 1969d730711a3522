"""The sampler's bent coordinates: an exact change of variables."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference.bend import Bend, bent, unbent
from muscle_bayes.inference.bend_friction import FrictionScale
from muscle_bayes.inference.bend_hyst import starts
from muscle_bayes.inference.bend_sizes import POWERS, Sizes, sizes_of_draws
from muscle_bayes.inference.bend_stiffness import bent_stiffness, unbent_stiffness
from muscle_bayes.inference.bend_walls import bent_walls, unbent_walls
from muscle_bayes.inference.bent_rows import bent_rows, turn_at, unbent_rows, unscaled_rows
from muscle_bayes.inference.density import constrain, unconstrain
from muscle_bayes.inference.prior_draws import prior_draws
from muscle_bayes.inference.problem import Problem, pose


def bend_of(error: float, creep: float, known: float = 1.0) -> Bend:
    friction = FrictionScale(np.float64(error), np.float64(creep))
    sizes = Sizes(np.array([3e-4, 1e-2, 1e-3, 1e-2]), np.log(0.1), np.float64(known))
    return Bend(friction, sizes)


BEND = bend_of(3e-3, 1.0)
DATA = Path(__file__).parents[2] / "data"


@pytest.fixture(scope="module")
def staircases() -> Problem:
    with jax.enable_x64(True):
        runs = read_runs([DATA])
        return pose([run for run in runs if run.metadata.protocol == "staircase"])


def draw(problem: Problem, seed: int):
    layout, data = problem.layout, problem.data
    values = prior_draws(jax.random.key(seed), 1, layout, data)
    return unconstrain({name: value[0] for name, value in values.items()}, layout, data)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("bend", [BEND, bend_of(1e-5, 0.0, known=0.0), bend_of(10.0, 1.0)])
def test_bending_is_undone_and_its_volume_is_that_of_the_jacobian(staircases, seed, bend):
    layout, data = staircases.layout, staircases.data
    vector = draw(staircases, seed)
    there = bent(vector, bend, layout, data)
    back = unbent(there, bend, layout, data)
    np.testing.assert_allclose(back.vector, vector, rtol=1e-9, atol=1e-9)
    jacobian = jax.jacfwd(lambda b: unbent(b, bend, layout, data).vector)(there)
    sign, log_volume = np.linalg.slogdet(jacobian)
    assert sign == 1.0
    np.testing.assert_allclose(back.log_volume, log_volume, rtol=1e-9, atol=1e-9)


def test_many_points_are_bent_as_one_is(staircases):
    layout, data = staircases.layout, staircases.data
    vectors = np.stack([draw(staircases, seed) for seed in range(3)])
    points = bent_rows(vectors, BEND, layout, data)
    for point, vector in zip(points, vectors, strict=True):
        one = bent(jnp.asarray(vector), BEND, layout, data)
        np.testing.assert_allclose(point, one, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(unbent_rows(points, BEND, layout, data), vectors, rtol=1e-9)
    turn = jax.jacfwd(lambda point: unbent(point, BEND, layout, data).vector)(
        jnp.asarray(points[0])
    )
    np.testing.assert_allclose(turn_at(points[0], BEND, layout, data), turn, rtol=1e-9, atol=1e-9)


def test_scales_are_told_where_sizes_are_logarithms(staircases):
    """Where sizes are far below their errors, bent coordinates are these logarithms."""
    layout, data = staircases.layout, staircases.data
    vector = draw(staircases, 1)
    coarse = BEND._replace(sizes=Sizes.blank(layout))
    there = bent(vector, coarse, layout, data)
    found = unscaled_rows(vector[None], layout, data)
    for name, power in POWERS.items():
        at = starts(layout)[name]
        log_size = there[at] + np.log(coarse.sizes.error[0])
        np.testing.assert_allclose(power * found.logs[0, at], log_size, atol=1e-6)
    # D = error reference log(1 + exp(x))
    x = there[starts(layout)["D"]]
    log_d = np.log(BEND.friction.error) + found.log_reference[0] + np.log(np.logaddexp(0.0, x))
    np.testing.assert_allclose(log_d, vector[starts(layout)["D"]], rtol=1e-9)


def test_the_ridge_of_a_slow_hyst_is_straight(staircases):
    """Creep and first strain held, the time constant alone moves: the record cannot tell."""
    layout, data = staircases.layout, staircases.data
    there = bent(draw(staircases, 1), BEND, layout, data)
    start = int(
        np.cumsum([0, *(int(np.prod(s)) for _, s in layout.shapes)])[
            [name for name, _ in layout.shapes].index("time_constant")
        ]
    )
    names = np.repeat([n for n, _ in layout.shapes], [int(np.prod(s)) for _, s in layout.shapes])
    seen = []
    for log_time in (12.0, 13.0):
        vector = unbent(there.at[start].set(log_time), BEND, layout, data).vector
        stretch = vector[np.flatnonzero(names == "slow.hyst_stretch")]
        seen.append((vector[np.flatnonzero(names == "taut_strain")] + stretch.mean(), stretch))
    np.testing.assert_allclose(seen[0][0], seen[1][0], rtol=1e-9)
    # Much slower than the record, creep goes as stretch / time constant.
    np.testing.assert_allclose(seen[1][1] / seen[0][1], np.exp(1.0), rtol=0.01)
    assert jnp.isfinite(seen[1][1]).all()


@pytest.mark.parametrize(("name", "power"), [("D", 1), ("J", 1), ("modulus", -1)])
def test_a_size_is_linear_where_it_shows_and_logarithmic_below(staircases, name, power):
    layout, data = staircases.layout, staircases.data
    there = bent(draw(staircases, 1), BEND, layout, data)
    at = starts(layout)[name]

    def size(x):
        return np.exp(power * unbent(there.at[at].set(x), BEND, layout, data).vector[at])

    np.testing.assert_allclose(size(40.0) / size(20.0), 2.0, rtol=1e-6)
    np.testing.assert_allclose(size(-40.0) / size(-41.0), np.e, rtol=1e-6)


def test_thermal_strain_is_linear_in_its_two_coordinates(staircases):
    """Fall to the hottest temperature and bow: the strain at every temperature is linear in both.

    So far as the hottest temperature logged is the 90 C to which `contraction` refers.
    """
    layout, data = staircases.layout, staircases.data
    there = bent(draw(staircases, 2), BEND, layout, data)
    at = starts(layout)
    there = there.at[at["contraction"]].set(8.0).at[at["bend"]].set(0.1)

    def strain(fall, bow, warm):
        moved = there.at[at["contraction"]].add(fall).at[at["bend"]].add(bow)
        values = constrain(unbent(moved, BEND, layout, data).vector, layout, data)
        return values["contraction"] * (warm - 4.0 * values["bend"] * warm * (1.0 - warm))

    for warm in (0.2, 0.5, 0.9):
        middle, mixed = strain(0.0, 0.0, warm), strain(0.5, 0.05, warm)
        linear = strain(0.5, 0.0, warm) + strain(0.0, 0.05, warm) - middle
        apart = abs(strain(0.5, 0.05, warm) - middle)
        assert abs(mixed - linear) < 0.02 * apart


def test_sizes_are_told_by_draws(staircases):
    layout = staircases.layout
    at = starts(layout)
    rng = np.random.default_rng(0)
    logs = np.zeros((4000, sum(int(np.prod(shape)) for _, shape in layout.shapes)))
    logs[:, at["modulus"]] = -np.log(2.0 + 0.01 * rng.standard_normal(4000))
    logs[:, at["contraction"]] = np.log(0.1) + 0.05 * rng.standard_normal(4000)
    sizes = sizes_of_draws(logs, layout)
    np.testing.assert_allclose(sizes.error, [0.0, 0.005, 0.01, 0.0], rtol=0.05, atol=1e-12)
    np.testing.assert_allclose(sizes.contraction, np.log(0.1), atol=5e-3)
    assert sizes.known == 1.0


def test_walls_stand_still_while_friction_and_first_strain_move(staircases):
    """F_modulus_min stays as far above tension + D / lever as it was; F_hyst_min a share of its wall."""
    layout, data = staircases.layout, staircases.data
    at = starts(layout)
    tension, lever = float(data.tension), float(data.lever)
    first = slice(at["slow.hyst_stretch"], at["slow.hyst_stretch"] + 3)
    vector = draw(staircases, 2).at[at["F_modulus_min"]].set(np.log(1.2 * tension))
    vector = vector.at[at["stiffness_hyst"]].set(np.log(5.0 * tension))
    vector = vector.at[at["D"]].set(np.log(1e-3)).at[first].set(jnp.array([-0.02, 0.1, 0.0]))
    still = bent_walls(vector, layout, data)
    moved = still.at[at["D"]].set(np.log(5e-2)).at[first].set(jnp.array([-0.08, 0.1, 0.0]))
    after = unbent_walls(moved, layout, data).vector
    lift = [np.log1p(d / (tension * lever)) for d in (1e-3, 5e-2)]
    rise = after[at["F_modulus_min"]] - vector[at["F_modulus_min"]]
    np.testing.assert_allclose(rise, lift[1] - lift[0], rtol=1e-9)
    fall = np.exp(after[at["F_hyst_min"]] - vector[at["F_hyst_min"]])
    np.testing.assert_allclose(fall, (1.0 - 5.0 * 0.08) / (1.0 - 5.0 * 0.02), rtol=1e-9)


def test_stiffness_keeps_below_its_bound(staircases):
    """HYST shorter by `a` per tension than its rest: K a < 1."""
    layout, data = staircases.layout, staircases.data
    at = starts(layout)
    first = slice(at["slow.hyst_stretch"], at["slow.hyst_stretch"] + 3)
    vector = draw(staircases, 3).at[first].set(jnp.array([-0.05, -0.01, 0.02]))
    bound = np.log(data.tension / 0.05)
    known = [vector.at[at["stiffness_hyst"]].set(bound - x) for x in (12.0, 0.5, 1e-3)]
    x = [float(bent_stiffness(v, layout, data)[at["stiffness_hyst"]]) for v in known]
    assert np.all(np.diff(x) > 0.5)
    np.testing.assert_allclose(x[0], bound - 12.0, atol=1e-4)
    far = vector.at[at["stiffness_hyst"]].set(bound + 50.0)
    assert float(unbent_stiffness(far, layout, data).vector[at["stiffness_hyst"]]) <= bound
