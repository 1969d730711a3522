"""The next experiment: the regime of the bench, or the release, that best separates two explanations."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from muscle_bayes.bench.sequences import regimes
from muscle_bayes.bench.sequences.sequence import Repeat, Stage
from muscle_bayes.bench.sequences.sequence import Sequence as BenchSequence
from muscle_bayes.bench.sequences.sequence_file import to_toml
from muscle_bayes.discovery.fitted import Fitted, noise_names
from muscle_bayes.discovery.result import NextExperiment
from muscle_bayes.inference.model.lanes import Lanes
from muscle_bayes.inference.model.problem import Data
from muscle_bayes.inference.search.factored import FactoredPrecision
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.nested_programs import explained_at, look_at
from muscle_bayes.physics.outputs.position import Position
from muscle_bayes.physics.schedule import Schedule

FRESH = ("zero", "start", "speed", "hyst_lag")
"""What is a new run's own, and known from its prior alone."""


@dataclass(frozen=True)
class Plan:
    """A regime at some loads."""

    protocol: str
    loads: tuple[float, ...]
    """kg"""
    sequence: BenchSequence


@dataclass(frozen=True)
class Thermal:
    """How fast the heater was seen to heat and to cool."""

    room: float
    """C"""
    heating: float
    """C/s"""
    cooling: float
    """1/s, of the difference to the room."""


def thermal_of(nested: Nested) -> Thermal | None:
    """From the temperatures of the runs: fastest heating, and the median rate of free cooling.

    None where no run is heated and cools again.
    """
    room, heating, cooling = [], [], []
    for run in nested.problem.runs:
        time = run.table["time"].to_numpy()
        temperature = run.table["temperature_a"].to_numpy()
        if np.ptp(temperature) < 5.0:
            continue
        seconds = np.arange(time[0], time[-1], 2.0)
        level = np.interp(seconds, time, temperature)
        rate, place = np.diff(level) / 2.0, 0.5 * (level[1:] + level[:-1])
        own = run.metadata.fixture.room_temperature
        room.append(own)
        heating.append(np.quantile(rate, 0.98))
        free = (rate < -0.2) & (place > own + 10.0)
        if free.any():
            cooling.append(np.median(-rate[free] / (place[free] - own)))
    if not heating or not cooling:
        return None
    return Thermal(float(np.median(room)), float(np.median(heating)), float(np.median(cooling)))


def plans(
    room: float, loads: Sequence[float], factors: Sequence[float] = (0.6, 1.0, 1.5)
) -> Iterator[Plan]:
    """Staircases and sawtooths, at lighter and heavier loads than those of the runs."""
    for factor in factors:
        for load in loads:
            mass = round(factor * load, 3)
            yield Plan("staircase", (mass,), regimes.staircase(room, (mass,), cycles=2))
            yield Plan("sawtooth", (mass,), regimes.sawtooth(room, (mass,)))


def course(
    plan: Plan,
    thermal: Thermal,
    size: int,
    *,
    held: float = 12.0,
    near: float = 1.0,
    overshot: tuple[float, float] = (0.5, 4.5),
    swinging: float = 10.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and temperatures [C] at `size` + 1 even nodes over the logged part of a plan.

    A setpoint is held for `held` s before the next, and counts as reached within `near` C. The bench's
    law heats too far by a share of the climb and so many C at most, and then swings for some seconds.
    """
    times, levels = [0.0], [thermal.room]
    for stage in _logged(plan.sequence.run[0].stage):
        goal = thermal.room if stage.setpoint_a is None else max(stage.setpoint_a, thermal.room)
        here, hold = levels[-1], stage.duration
        climbs = goal > here + near
        if hold is None:
            hold = held + stage.wait + (swinging if climbs else 0.0)
        if climbs:
            here = goal + min(overshot[0] * (goal - here), overshot[1])
            times.append(times[-1] + (here - levels[-1]) / thermal.heating)
            levels.append(here)
        if here > goal + near:
            gap = max(goal + near - thermal.room, near)
            duration = np.log((here - thermal.room) / gap) / thermal.cooling
            steps = np.linspace(0.0, duration, 12)[1:]
            times += list(times[-1] + steps)
            fall = np.exp(-thermal.cooling * steps)
            levels += list(thermal.room + (here - thermal.room) * fall)
        times.append(times[-1] + hold)
        levels.append(levels[-1])
    nodes = np.linspace(0.0, times[-1], size + 1)
    return nodes, np.interp(nodes, times, levels)


def _logged(blocks: Sequence[Stage | Repeat]) -> Iterator[Stage]:
    for block in blocks:
        for _ in range(block.repeat if isinstance(block, Repeat) else 1):
            stages = block.stages if isinstance(block, Repeat) else (block,)
            yield from (stage for stage in stages if stage.logged)


def propose(nested: Nested, first: Fitted, second: Fitted) -> NextExperiment | None:
    """The plan for which the readings that two fitted models expect differ most, for what is known.

    Heated muscles go through staircases and sawtooths, free rotors are released from elsewhere. None
    where runs are of neither kind.
    """
    options = [*_heated(nested, first, second), *_released(nested, first, second)]
    return max(options, key=lambda one: one.information, default=None)


def _separated(first: Fitted, second: Fitted) -> tuple[str, ...]:
    return (first.effects[-1:] or ("none",)) + (second.effects[-1:] or ("none",))


def _heated(nested: Nested, first: Fitted, second: Fitted) -> Iterator[NextExperiment]:
    every_group = zip(nested.layout.regimes, nested.data.lanes, strict=True)
    slow = [k for k, (kind, one) in enumerate(every_group) if kind == "slow" and one.fine is None]
    thermal = thermal_of(nested)
    if not slow or thermal is None:
        return
    group, lanes = slow[0], nested.data.lanes[slow[0]]
    loads = sorted({float(np.asarray(load)[0]) for load in lanes.schedule.load})
    every = list(plans(thermal.room, loads))
    per_pass = int(lanes.time.shape[0])
    names = _separated(first, second)
    for begin in range(0, len(every), per_pass):
        part = every[begin : begin + per_pass]
        lanes_of_all = list(nested.data.lanes)
        lanes_of_all[group] = _imagined(lanes, part, thermal)
        data = nested.data._replace(lanes=tuple(lanes_of_all))
        told = _information(nested, group, data, first, second)
        for plan, score in zip(part, told, strict=False):
            if np.isfinite(score):
                head = f"To tell {names[0]} from {names[1]}: expected log odds {score:.1f} nat."
                shown = ", ".join(f"{1000 * load:g} g" for load in plan.loads)
                sequence = to_toml(plan.sequence, head)
                yield NextExperiment(f"{plan.protocol}, {shown}", names, float(score), sequence)


def _released(
    nested: Nested, first: Fitted, second: Fitted, factors: Sequence[float] = (0.5, 1.5, 2.0)
) -> Iterator[NextExperiment]:
    """Free runs begun `factors` times as far from the mean of their readings, and as fast.

    None beyond a stop.
    """
    names, layout = nested.shared_names(), nested.layout
    for group, (regime, lanes) in enumerate(zip(layout.regimes, nested.data.lanes, strict=True)):
        places = [names.index(one) for one in names if one.startswith(f"{regime}.start[")]
        if regime != "fast" or layout.segmented[group] or not isinstance(lanes.output, Position):
            continue
        weight = np.asarray(lanes.weight)
        middle = np.average(np.asarray(lanes.reading), axis=1, weights=weight)
        runs = [nested.problem.runs[k] for k in nested.problem.lane_runs[group]]
        own = np.asarray(lanes.run)
        for factor in factors:
            moved = []
            for one in (first, second):
                point = one.point.copy()
                for lane, k in enumerate(own):
                    entry = places[k]
                    point[entry] = middle[lane] + factor * (first.point[entry] - middle[lane])
                    if (speed := f"{regime}.speed[{k}]") in names:
                        point[names.index(speed)] *= factor
                moved.append(replace(one, point=point))
            told = _information(nested, group, nested.data, *moved)
            for lane, score in enumerate(told):
                begun = moved[0].point[places[own[lane]]]
                zero = f"{regime}.zero[{own[lane]}]"
                shown = begun - (first.point[names.index(zero)] if zero in names else 0.0)
                low, high = runs[lane].metadata.fixture.stops or (-np.inf, np.inf)
                if np.isfinite(score) and low < float(lanes.scale[lane]) * shown < high:
                    plan = (
                        f"{runs[lane].name} again, but begun at {begun:.4g} {runs[lane].unit} "
                        f"({factor:g} times as far from the mean of its readings)"
                    )
                    yield NextExperiment(plan, _separated(first, second), float(score))


def _information(
    nested: Nested, group: int, data: Data, first: Fitted, second: Fitted
) -> Float[np.ndarray, " lane"]:
    """What every lane of a group would tell: expected log odds of the first model if it is true.

    d' (V + S C S')^-1 d / 2, with d the difference of readings, V their noise, S the first model's slopes
    and C its posterior covariance: what present parameters could still absorb does not count.
    """
    layout, weight = nested.layout, data.lanes[group].weight
    names = nested.shared_names()
    rival = second.point.copy()
    for index in [names.index(name) for name in noise_names(nested)]:
        rival[index] = first.point[index]
    one, two = (
        np.asarray(explained_at(jnp.asarray(point), x.choice, layout, data).errors)
        for point, x in ((first.point, first), (rival, second))
    )
    begin = sum(one.weight.size for one in data.lanes[:group])
    of_group = slice(begin, begin + weight.size)
    difference = (one - two)[of_group].reshape(weight.shape)
    seen = look_at(jnp.asarray(first.point), first.choice, layout, data)
    slopes = np.asarray(seen.jacobian)[:, of_group].reshape(-1, *weight.shape)
    known = first.precision.inverse()
    for index, name in enumerate(names):
        site, _, run = name.rstrip("]").partition("[")
        if site.rpartition(".")[2] in FRESH:
            known[index, index] += np.ravel(data.priors[site].variance)[int(run)]
    precision = FactoredPrecision(known).inverse()
    found = []
    for lane in range(len(weight)):
        d, s = difference[lane], slopes[: first.used, lane].T
        absorbed = np.linalg.solve(precision + s.T @ s, s.T @ d)
        found.append(0.5 * float(d @ d - d @ s @ absorbed))
    return np.array(found)


def _imagined(lanes: Lanes, part: Sequence[Plan], thermal: Thermal) -> Lanes:
    """The lanes with the plans' courses in place of their own, readings as dense as theirs."""
    count, size = lanes.time.shape
    per_second = float(jnp.median(lanes.weight.sum(axis=1) / lanes.schedule.time[:, -1]))
    imagined = [part[min(lane, len(part) - 1)] for lane in range(count)]
    courses = np.array([course(plan, thermal, size) for plan in imagined])
    nodes, level = courses[:, 0], courses[:, 1]
    schedule = Schedule(
        time=jnp.asarray(nodes),
        temperature=jnp.asarray(np.stack([level, np.full_like(level, thermal.room)], 2)),
        load=jnp.asarray(np.repeat([[plan.loads[0]] for plan in imagined], size, 1)),
        applied=jnp.zeros_like(lanes.schedule.applied),
    )
    weight = jnp.asarray(per_second * np.diff(nodes, axis=1))
    return lanes._replace(
        schedule=schedule,
        time=jnp.asarray(0.5 * (nodes[:, 1:] + nodes[:, :-1])),
        weight=weight,
        coarse=jnp.full_like(lanes.coarse, 1.0 / 12.0) / jnp.maximum(weight, 1.0),
        jolted=jnp.zeros_like(lanes.jolted),
        swing=jnp.zeros_like(lanes.swing),
    )
