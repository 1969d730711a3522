"""What the model says of every lane under given values: the plant, its start, its simulation."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.conventions import STRAIN_EPSILON
from muscle_bayes.inference.model.lanes import Lanes
from muscle_bayes.inference.model.muscle_prior import (
    LEAST_SHARE,
    TRAINED,
    Frame,
    completed,
    first_hyst,
    muscle_parameters,
)
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.records.parts import HEATERS, PLACES
from muscle_bayes.inference.records.rig import filled, with_parameters
from muscle_bayes.inference.running.forward_jacobian import with_forward_jacobian
from muscle_bayes.inference.running.pruned import pruned
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.physics.elements import Muscle
from muscle_bayes.physics.friction import FRICTION_LAWS
from muscle_bayes.physics.heater import LoggedTemperature
from muscle_bayes.physics.imposed import imposed_response
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.outputs import Temperature
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.response import (
    Response,
    inertial_response,
    quasi_static_response,
    refined_response,
)
from muscle_bayes.physics.schedule import Schedule

Values = Mapping[str, Array]


def muscle_of(values: Values, data: Data) -> MuscleParameters | None:
    """Table 2's parameters, or None where the problem has no muscle."""
    if "F_modulus_min" not in values:
        return None
    return muscle_parameters(values, data.base_length, data.tension, frame_of(values, data))


def whole(values: Values, data: Data) -> Values:
    """The values with all of the muscle's, where parameters of Table 2 are sampled instead of some."""
    if "F_modulus_min" not in values:
        return values
    return completed(values, data.base_length, data.tension, frame_of(values, data))


def frame_of(values: Values, data: Data) -> Frame:
    """About what the sampled quantities describe the muscle: see `muscle_sites`."""
    for place in HEATERS:
        if (rate := values.get(f"{place}.heating_rate")) is not None:
            cooling = values.get(f"{place}.cooling_time", data.warmth.cooling_time)
            room = data.warmth.room
            return Frame(room, room + rate * cooling * data.warmth.power, data.first_strain)
    return TRAINED._replace(strain=data.first_strain)


class Physical(NamedTuple):
    """What the plant of every lane shares."""

    inertia: Array | None
    """J; None where metadata state it."""
    friction: Array | None
    """D; None where all motion is imposed."""
    muscle: MuscleParameters | None
    effects: tuple[dict[str, Array], ...]
    """Parameters of each effect, in the layout's order."""
    parts: dict[str, Array]
    """What metadata leave open of elements and drive, as "table.key"."""


def physical_of(values: Values, layout: Layout, data: Data) -> Physical:
    """The plant's parameters from the sampled values."""
    effects = tuple(
        {key: values[f"{name}.{key}"] for key in effect_type(name).parameters}
        for name in layout.effects
    )
    parts = {name: values[name] for name in part_names(layout)}
    return Physical(values.get("J"), values.get("D"), muscle_of(values, data), effects, parts)


def part_names(layout: Layout) -> tuple[str, ...]:
    """Sampled quantities that metadata leave open of elements and drive."""
    return tuple(name for name, _ in layout.shapes if name.split(".")[0] in PLACES)


def plant_of(rig: Plant, physical: Physical, layout: Layout) -> Plant:
    """A rig with its parameters filled in and the layout's effects added."""
    dry = jnp.zeros(()) if physical.friction is None else physical.friction
    friction = FRICTION_LAWS[layout.friction](dry)
    plant = with_parameters(rig, physical.inertia, friction, physical.muscle, physical.parts)
    for name, parameters in zip(layout.effects, physical.effects, strict=True):
        plant = plant + effect_type(name)(**parameters)
    return plant


class Origin(NamedTuple):
    """What a lane's own simulation starts from; None where it is not an unknown."""

    q: Float[Array, ""]
    """First coordinate that the sensor shows [rad or m]."""
    speed: Float[Array, ""]
    """First speed [rad/s or m/s]."""
    hyst: Float[Array, ""] | None
    """First sigma_hyst of both sides; None: no muscle, or a first tension says it."""
    tension: Float[Array, ""] | None = None
    """First tension of side A's muscle [N]."""


class Inputs(NamedTuple):
    """All that one lane's simulation depends on."""

    physical: Physical
    origin: Origin


def zeros_of(values: Values, lanes: Lanes, regime: str, cut: bool) -> Array:
    """Reading at q = 0 of every lane [log's unit]."""
    zero = values.get(f"{regime}.zero")
    return jnp.zeros(lanes.run.shape) if zero is None or cut else zero[lanes.run]


def origins(values: Values, lanes: Lanes, data: Data, regime: str, cut: bool) -> Origin:
    """Start of every lane, from the per-run unknowns (or the pivot of a segment)."""
    if cut:
        return Origin(lanes.scale * lanes.pivot[:, 0], lanes.scale * lanes.pivot[:, 1], None)
    nothing = jnp.zeros(lanes.run.shape)
    start = values.get(f"{regime}.start")
    start = nothing if start is None else start[lanes.run]
    first = start - zeros_of(values, lanes, regime, cut)
    slope = values.get(f"{regime}.speed")
    slope = nothing if slope is None else slope[lanes.run] * (1.0 - lanes.released)
    place = values.get(f"{regime}.place")
    place = nothing if place is None else place[lanes.run]
    q, speed = lanes.output.beginning(lanes.scale * first, lanes.scale * slope, place)
    lag, force = values.get(f"{regime}.hyst_lag"), values.get(f"{regime}.first_force")
    hyst = None if lag is None else first_hyst(lag[lanes.run], values, lanes.tension)
    tension = None if force is None else lanes.tension + force[lanes.run]
    return Origin(q, speed, hyst, tension)


def heated(lane: Lanes, parts: Mapping[str, Array]) -> Lanes:
    """The lane with its heaters' temperatures in its schedules."""
    heaters = [filled(f"heater_{s}", one, parts) for s, one in zip("ab", lane.heaters, strict=True)]

    def warmed(schedule: Schedule) -> Schedule:
        sides = [
            one.temperature(schedule.time, schedule.temperature[:, place])
            for place, one in enumerate(heaters)
        ]
        return replace(schedule, temperature=jnp.stack(sides, axis=1))

    if all(isinstance(one, LoggedTemperature) for one in heaters):
        return lane
    fine = lane.fine
    if fine is not None:
        fine = fine._replace(schedule=warmed(fine.schedule))
    return lane._replace(schedule=warmed(lane.schedule), fine=fine)


@lru_cache(maxsize=64)
def _simulator(layout: Layout, regime: str) -> Callable[[Inputs, Lanes], Response]:
    """Response of one lane. One function object per layout: JAX traces it once, wherever it is used."""

    @jax.jit
    @pruned
    def simulate(inputs: Inputs, lane: Lanes) -> Response:
        plant = plant_of(lane.plant, inputs.physical, layout)
        shown, speed, hyst, tension = inputs.origin
        lane = heated(lane, inputs.physical.parts)
        schedule = lane.schedule
        if tension is not None and isinstance(muscle := plant.side_a, Muscle):
            assert lane.imposed is not None, "where forces are measured"
            hyst = muscle.hyst_under(tension, lane.imposed[0, 0], schedule.temperature[0, 0])
            hyst = jnp.maximum(hyst, LEAST_SHARE * STRAIN_EPSILON)
        both = jnp.zeros(2) if hyst is None else jnp.repeat(hyst, 2)
        q = plant.located(shown, both, schedule.first)
        if isinstance(lane.output, Temperature):
            response = lane.output.response(schedule)
        elif lane.imposed is not None:
            response = imposed_response(plant, schedule, lane.imposed, both)
        elif lane.fine is not None:
            response = refined_response(plant, lane.fine, q, both)
        elif regime == "slow":
            response = quasi_static_response(plant, schedule, q, both)
        else:
            response = inertial_response(plant, schedule, q, speed, both)
        shown = lane.output.shown(response) / lane.scale
        return response._replace(averaged=shown + lane.swing)

    return simulate


def simulate_lane(inputs: Inputs, lane: Lanes, layout: Layout, regime: str) -> Response:
    """Response of one lane; `averaged` in readings above the reading at q = 0."""
    return _simulator(layout, regime)(inputs, lane)


def responses(values: Values, layout: Layout, data: Data) -> list[Response]:
    """Response of every lane, `averaged` in the log's unit, one entry a group, lanes leading."""
    result = []
    values = whole(values, data)
    physical = physical_of(values, layout, data)
    for lanes, regime, cut in zip(data.lanes, layout.regimes, layout.segmented, strict=True):

        def one(lane, origin, zero, regime=regime):
            response = simulate_lane(Inputs(physical, origin), lane, layout, regime)
            return response._replace(averaged=zero + response.averaged)

        begins = origins(values, lanes, data, regime, cut)
        result.append(jax.vmap(one)(lanes, begins, zeros_of(values, lanes, regime, cut)))
    return result


class LanePrediction(NamedTuple):
    """What a lane's model says of its readings."""

    reading: Float[Array, " interval"]
    """Readings above the reading at q = 0; of a segment, from its pivot."""
    reach: Float[Array, "interval 2"] | None
    """Change of the readings per prior standard deviation of a segment's start; None if not cut."""
    finite: Float[Array, ""]
    """1 if the solve succeeded, else 0."""


@lru_cache(maxsize=64)
def _run_predictor(layout: Layout, regime: str, structure: Any) -> Callable:
    """LanePrediction of one run from the leaves of its Inputs, differentiable in any mode.

    One function object per layout: JAX then traces a simulation once, however often it is used.
    """

    def predict(leaves: Array, lane: Lanes) -> LanePrediction:
        inputs = jax.tree.unflatten(structure, list(leaves))
        response = simulate_lane(inputs, lane, layout, regime)
        return LanePrediction(response.averaged, None, response.finite * 1.0)

    return jax.jit(with_forward_jacobian(predict))


START_SHARE = 0.05
"""Distance to either side at which the response to a segment's start is read, as a share of the
start's prior standard deviation: about as well as its readings tell a start."""


def of_segment(physical: Physical, lane: Lanes, layout: Layout, regime: str) -> LanePrediction:
    """LanePrediction of one segment.

    From four starts, one to either side in position and in speed: their mean, and their differences
    as the response to the start. The derivative at the pivot itself would jump, and the density
    with it, wherever a parameter makes the motion stick or reverse in another interval.
    """
    aside = START_SHARE * jnp.diag(lane.start_spread)

    def from_start(start: Float[Array, "2"]) -> Response:
        q, speed = lane.scale * start
        return simulate_lane(Inputs(physical, Origin(q, speed, None)), lane, layout, regime)

    starts = lane.pivot + jnp.stack([aside, -aside])
    sides = jax.vmap(jax.vmap(from_start))(starts)
    above, below = sides.averaged
    reach = (above - below).T / (2.0 * START_SHARE)
    return LanePrediction(sides.averaged.mean((0, 1)), reach, sides.finite.all() * 1.0)


@lru_cache(maxsize=64)
def _segment_predictor(layout: Layout, regime: str, structure: Any) -> Callable:
    """LanePrediction of one segment from the leaves of Physical, differentiable in any mode."""

    def predict(leaves: Array, lane: Lanes) -> LanePrediction:
        return of_segment(jax.tree.unflatten(structure, list(leaves)), lane, layout, regime)

    return jax.jit(with_forward_jacobian(predict))


def predictions(values: Values, layout: Layout, data: Data) -> list[LanePrediction]:
    """Predictions of every lane, one entry a group; they do not depend on the noise parameters."""
    result = []
    values = whole(values, data)
    physical = physical_of(values, layout, data)
    for lanes, regime, cut in zip(data.lanes, layout.regimes, layout.segmented, strict=True):
        if cut:
            leaves, structure = jax.tree.flatten(physical)
            of_segment = _segment_predictor(layout, regime, structure)
            result.append(jax.vmap(of_segment, (None, 0))(jnp.stack(leaves), lanes))
            continue

        def of_run(lane, origin, regime=regime):
            leaves, structure = jax.tree.flatten(Inputs(physical, origin))
            return _run_predictor(layout, regime, structure)(jnp.stack(leaves), lane)

        result.append(jax.vmap(of_run)(lanes, origins(values, lanes, data, regime, cut)))
    return result
