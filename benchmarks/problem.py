"""What every competitor is given: a point in parameter space, and what one staircase's ODE needs."""

import tomllib
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.data import read_runs
from muscle_bayes.inference.model.density import unconstrain
from muscle_bayes.inference.model.lanes import Lanes
from muscle_bayes.inference.model.muscle_prior import COLD, HOT, resting_hyst, strain_under
from muscle_bayes.inference.model.problem import Problem, pose
from muscle_bayes.physics.elements import Muscle
from muscle_bayes.physics.linkage import Pins
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.schedule import Schedule

DATA = Path(__file__).parents[1] / "data" / "plain"
STAIRCASES = ("staircase-139g", "staircase-166g", "staircase-212g")
MUSCLE = tuple(MuscleParameters.__annotations__)
INPUTS = ("D", *MUSCLE, "q", "hyst")
"""What a lane's ODE depends on: dry friction [N m], Table 2, the first coordinate at rest [rad] and the
first sigma_hyst."""

MODERATE_NOISE = {"noise": 0.5, "discrepancy": 1.0, "correlation_time": 20.0}
"""Noise parameters of the reference point [counts, counts, s]: with smaller ones the log density
would turn errors of hundredths of a count into large differences."""


class Course(NamedTuple):
    """Temperature of one lane, linear between nodes and middles of intervals."""

    time: Float[np.ndarray, " instant"]
    """Nodes and middles by turns, 2 intervals + 1 of them [s]."""
    heat: Float[np.ndarray, " instant"]
    """Heater temperature [C]."""


class Lane(NamedTuple):
    """One staircase: a muscle on side A against a constant load."""

    radius: float
    anchor_x: float
    anchor_y: float
    base_length: float
    heated_fraction: float
    room_temperature: float
    torque: float
    """Of the load [N m]."""
    stops: tuple[float, float]
    """[rad]."""
    course: Course

    @property
    def intervals(self) -> int:
        """Number of intervals over which readings are averaged."""
        return self.course.time.size // 2


def posed(names: tuple[str, ...] = STAIRCASES) -> Problem:
    """The problem that staircases pose, with dry friction and no effects."""
    return pose(read_runs([DATA / f"{name}.csv" for name in names]), "coulomb")


def _course(schedule: Schedule) -> Course:
    """The course at the schedule's nodes and in the middles of its intervals, without padding."""
    real = np.flatnonzero(np.diff(schedule.time) > 0.0)
    nodes = np.r_[real, real[-1] + 1]
    time = np.asarray(schedule.time)[nodes]
    heat = np.asarray(schedule.temperature)[nodes, 0]

    def woven(values: np.ndarray) -> np.ndarray:
        result = np.empty(2 * values.size - 1)
        result[::2] = values
        result[1::2] = 0.5 * (values[1:] + values[:-1])
        return result

    return Course(woven(time), woven(heat))


def _lane(lanes: Lanes, index: int) -> Lane:
    one: Lanes = jax.tree.map(lambda leaf: leaf[index], lanes)
    muscle = one.plant.side_a
    if not isinstance(muscle, Muscle) or not isinstance(muscle.linkage, Pins):
        raise TypeError("competitors know a muscle between pins on side A only")
    linkage = muscle.linkage
    torque = one.schedule.load[0] * GRAVITY * one.plant.load_lever + one.schedule.applied[0]
    if np.ptp(one.schedule.load) or np.ptp(one.schedule.applied):
        raise ValueError("competitors know lanes under one constant load only")
    return Lane(
        float(linkage.radius),
        float(linkage.anchor_x),
        float(linkage.anchor_y),
        float(muscle.base_length),
        float(muscle.heated_fraction),
        float(muscle.room_temperature),
        float(torque),
        (float(one.plant.stops[0]), float(one.plant.stops[1])),
        _course(one.schedule),
    )


def count_of(problem: Problem) -> float:
    """Coordinate per count of the potentiometer [rad], the same for all lanes."""
    return float(abs(problem.data.lanes[0].scale[0]))


def lanes_of(problem: Problem) -> list[Lane]:
    """The staircases as competitors see them, all of the longest one's number of intervals."""
    (lanes,) = problem.data.lanes
    found = [_lane(lanes, index) for index in range(lanes.run.size)]
    longest = max(lane.intervals for lane in found)
    return [lane._replace(course=_prolonged(lane.course, longest)) for lane in found]


def _prolonged(course: Course, intervals: int) -> Course:
    """The course up to so many intervals: as the last one, but that nothing changes. Nobody reads there."""
    missing = 2 * intervals + 1 - course.time.size
    step = course.time[-1] - course.time[-2]
    time = np.append(course.time, course.time[-1] + step * np.arange(1, missing + 1))
    return Course(time, np.pad(course.heat, (0, missing), mode="edge"))


def _prior_side(table: dict[str, float], data) -> dict[str, Array]:
    """The sampled quantities that give Table 2's parameters: `prior.muscle_parameters` inverted."""
    a, b, c = table["A"], table["B"], table["C"]
    length = float(data.base_length)
    at = {t: (a * t + b) * t + c for t in (COLD, 0.5 * (COLD + HOT), HOT)}
    chord = 0.5 * (at[COLD] + at[HOT])
    contraction = at[COLD] - at[HOT]
    cold = table["H"] * (COLD + table["T_hyst_offset"])
    values = {
        "contraction": contraction,
        "bend": (at[0.5 * (COLD + HOT)] - chord) / contraction,
        "modulus": table["K_modulus"] * length,
        "F_modulus_min": table["F_modulus_min"],
        "stiffness_hyst": table["K_hyst"] * length,
        "F_hyst_min": table["F_hyst_min"],
        "time_constant": cold / table["K_hyst"],
        "softening": table["H"] * (HOT + table["T_hyst_offset"]) / cold,
    }
    arrays = {name: jnp.asarray(value) for name, value in values.items()}
    return arrays | {"taut_strain": at[COLD] + strain_under(data.tension, arrays)}


def reference_point(problem: Problem) -> Float[Array, " n"]:
    """The unconstrained vector of the simulator's true parameters, with moderate noise."""
    truth = tomllib.loads((DATA / "truth.toml").read_text(encoding="utf-8"))
    values = _prior_side(truth["muscle_a"], problem.data)
    values |= {name: jnp.asarray(truth["rotor"][name]) for name in ("J", "D")}
    values |= {f"slow.{name}": jnp.asarray(value) for name, value in MODERATE_NOISE.items()}
    runs = [truth["runs"][run.name] for run in problem.runs]
    zero = np.array([run["zero_reading"] for run in runs])
    angle = np.array([run["initial_angle"] for run in runs])
    hyst = np.array([run["initial_hyst_a"] for run in runs])
    scale = np.asarray(problem.data.lanes[0].scale)
    values["slow.zero"] = jnp.asarray(zero)
    values["slow.start"] = jnp.asarray(zero + angle / scale)
    values["slow.hyst_lag"] = jnp.asarray(hyst) - resting_hyst(problem.data.tension, values)
    return unconstrain(values, problem.layout, problem.data)
