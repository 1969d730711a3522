"""The statistical problem that a set of runs poses: arrays for a solver, and a prior for each unknown."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.conventions import Friction
from muscle_bayes.data.run import Run, refuse_unread
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model import prior
from muscle_bayes.inference.model.chosen_priors import with_priors
from muscle_bayes.inference.model.lanes import Lanes, stacked_lanes
from muscle_bayes.inference.model.muscle_prior import muscle_sites
from muscle_bayes.inference.model.priors import Priors
from muscle_bayes.inference.model.site import Site
from muscle_bayes.inference.records.by_regime import record_of
from muscle_bayes.inference.records.fast import segments
from muscle_bayes.inference.records.open_delay import delay_prior
from muscle_bayes.inference.records.parts import heaters_of
from muscle_bayes.inference.records.record import Record
from muscle_bayes.inference.records.regime import REGIMES, Regime, regime_of
from muscle_bayes.inference.records.release import moves_at_release
from muscle_bayes.inference.records.rig import output_of, outputs_of, rig
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.physics.effect import MUSCLE_PORTS, Scales
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.physics.effects.own import AnyEffectType, effect_names
from muscle_bayes.physics.friction import friction_law
from muscle_bayes.physics.heater import HeatedBody

TYPICAL_MISFIT_TIME: dict[Regime, float] = {
    "fast": 0.1,
    "slow": 20.0,
    "imposed": 1.0,
    "heated": 5.0,
}
"""Prior median of how long misfit lasts, s."""

LONGEST: dict[Regime, float] = {"fast": 1e4, "slow": 1e6, "imposed": 1e6, "heated": 1e6}
"""Longest run that is fitted, s: gaps are solved as finely as readings."""
FEWEST_READINGS = 5
"""Mean readings of the shortest run that is fitted."""


class Warmth(NamedTuple):
    """How warm usual power holds a muscle: room + heating_rate cooling_time power."""

    room: Float[Array, ""]
    """[C]"""
    power: Float[Array, ""]
    """RMS of what heats [W, A^2, V^2 or duty]."""
    cooling_time: Float[Array, ""]
    """[s]; NaN where it is estimated."""


class Data(NamedTuple):
    """Everything that changes from one data set to another of the same layout."""

    lanes: tuple[Lanes, ...]
    priors: Priors
    base_length: Float[Array, ""]
    """L_base to which stiffnesses in N/m refer, m (of the first muscle)."""
    tension: Float[Array, ""]
    """Tension to which `taut_strain` refers, N: the first that was measured, else a typical one."""
    lever: Float[Array, ""]
    """Generalised force per unit of tension."""
    warmth: Warmth
    first_strain: Float[Array, ""]
    """Of the muscle at the first readings, about which a `taut_force` is."""


@dataclass(frozen=True)
class Layout:
    """Everything that shapes the computation: two data sets with one layout share compiled code."""

    friction: Friction
    effects: tuple[str, ...]
    regimes: tuple[Regime, ...]
    """Of each group of lanes."""
    segmented: tuple[bool, ...]
    """Whether a group's lanes are segments whose starts are integrated out."""
    shapes: tuple[tuple[str, tuple[int, ...]], ...]
    """Sampled quantities in the order of the unconstrained vector, with their shapes."""


@dataclass(frozen=True)
class Problem:
    """Runs, their layout and data, and what is known of each sampled quantity."""

    runs: tuple[Run, ...]
    records: tuple[Record, ...]
    layout: Layout
    data: Data
    sites: dict[str, Site]
    scales: Scales
    lane_runs: tuple[tuple[int, ...], ...]
    """For each group, the index in `runs` of each lane."""
    site_runs: dict[str, tuple[str, ...]]
    """For each regime, the names of the runs along the axis of its per-run quantities."""
    reduction: Mapping[str, Any] = field(default_factory=dict)
    """For each slow run that was compared, a ReductionError: what inertia changes at the mode."""


def _recorded(run: Run) -> Record:
    """The run on its grid, which must be neither empty nor endless."""
    if run.duration > LONGEST[regime_of(run)]:
        gap = max((end - begin for begin, end in run.gaps), default=0.0)
        raise MuscleBayesError(
            f"{run.name}: lasts {run.duration:.3g} s, the longest gap {gap:.3g} s; too long to be "
            "solved. Fix: correct the time column, or make a run of each part"
        )
    record = record_of(run)
    told = int(np.sum(record.weight > 0))
    if told < FEWEST_READINGS:
        raise MuscleBayesError(
            f"{run.name}: {run.duration:.3g} s give {told} mean readings, too few for a fit, which "
            f"needs {FEWEST_READINGS}. Fix: give a longer log"
        )
    return record


def _check(runs: Sequence[Run], effects: Sequence[str]) -> None:
    for regime in REGIMES:
        units = {run.unit for run in runs if regime_of(run) == regime}
        if len(units) > 1:
            raise MuscleBayesError(
                f"runs that are fitted together log their position in different units "
                f"({', '.join(sorted(units))}). Fix: fit them one unit at a time."
            )
    if len({run.metadata.fixture.motion for run in runs}) > 1:
        raise MuscleBayesError(
            "rotary and linear rigs cannot be fitted together. Fix: fit them apart."
        )
    for run in runs:
        position = run.measured == "position"
        if run.metadata.protocol == "spring" and position and moves_at_release(run):
            raise MuscleBayesError(
                f'{run.name}: protocol = "spring" starts at rest, but the first rows already move. '
                'Fix: set protocol = "free", or cut the rows before the release'
            )
        if run.has_muscle and run.measured == "velocity":
            raise MuscleBayesError(
                f"{run.name}: a muscle's run measures a velocity, which shows nothing of its length. "
                "Fix: log the position"
            )
    for name in effects:
        effect_type(name)
    if len(set(effects)) < len(effects):
        raise MuscleBayesError("an effect was named twice. Fix: name each effect once.")
    if not any(run.has_muscle for run in runs):
        for name in effects:
            if effect_type(name).port in MUSCLE_PORTS:
                raise MuscleBayesError(
                    f"effect '{name}' acts on a muscle, but no run has one. Fix: leave it out or add runs."
                )


def _warmth(runs: Sequence[Run], size: Scales) -> Warmth:
    heaters = [heater for run in runs for heater in heaters_of(run.metadata)]
    stated = [float(np.asarray(one.cooling_time)) for one in heaters if isinstance(one, HeatedBody)]
    room = float(np.mean([run.metadata.fixture.room_temperature for run in runs]))
    return Warmth(*map(np.asarray, (room, size.power, stated[0] if stated else np.nan)))


@double_precision
def pose(
    runs: Sequence[Run],
    friction: Friction = "coulomb",
    effects: Sequence[str | AnyEffectType] = (),
    priors: Mapping[str, dist.Distribution] | None = None,
) -> Problem:
    """The problem of estimating what these runs can tell.

    Which parameters are unknown follows from the runs: J (unless it is stated) and D, the muscle's
    nine if any run has a muscle, what metadata leave open of the other parts, each effect's own, each
    run's own, each regime's noise. `priors` replaces default
    ones, by the name of a sampled quantity or of a parameter of Table 2, which then takes the place
    of one (`muscle_prior.replaced_by`). Metadata may give that of `clock-offset`.
    Raises MuscleBayesError for runs that cannot be fitted together, unknown friction, effects
    and priors.
    """
    refuse_unread(runs)
    effects = effect_names(effects)
    friction_law(friction)
    runs = [output for run in runs for output in outputs_of(run)]
    _check(runs, effects)
    records = [_recorded(run) for run in runs]
    size = prior.scales(runs, records)
    sites, first = prior.fixture_sites(runs, friction, size), 0.0
    if any(run.has_muscle for run in runs):
        first = prior.mean_first_strain(runs)
        forces = all(run.imposed is not None for run in runs if run.has_muscle)
        powered = prior.is_powered(runs)
        sites |= muscle_sites(size, first, powered=powered, only_forces=forces)
    sites |= prior.part_sites(runs, size)
    sites |= prior.effect_sites(effects, size)
    for name, known in delay_prior(runs).items():
        if name in sites:
            sites[name] = sites[name]._replace(prior=known)

    lanes, regimes, segmented, lane_runs, site_runs = [], [], [], [], {}
    for regime in REGIMES:
        members = [i for i, run in enumerate(runs) if regime_of(run) == regime]
        if not members:
            continue
        pieces = {i: segments(runs[i], records[i]) for i in members}
        own = [i for i in members if len(pieces[i]) == 1]
        chosen = [runs[i] for i in members]
        sites |= prior.noise_sites(chosen, regime, TYPICAL_MISFIT_TIME[regime])
        if own:
            own_runs, own_records = [runs[i] for i in own], [records[i] for i in own]
            per_run = prior.run_sites(own_runs, own_records, regime, size)
            sites |= {f"{regime}.{key}": site for key, site in per_run.items()}
            site_runs[regime] = tuple(run.name for run in own_runs)
        groups: dict[tuple, list[int]] = {}
        for i in members:
            about = runs[i].metadata
            structure = jax.tree.structure((rig(about), heaters_of(about), output_of(runs[i])))
            groups.setdefault((structure, len(pieces[i]) > 1), []).append(i)
        for (_, cut), group in groups.items():
            flat = [(i, piece) for i in group for piece in pieces[i]]
            index = [0 if cut else own.index(i) for i, _ in flat]
            owners, cuts = [runs[i] for i, _ in flat], [piece for _, piece in flat]
            lanes.append(stacked_lanes(owners, cuts, index, size.tension))
            regimes.append(regime)
            segmented.append(cut)
            lane_runs.append(tuple(i for i, _ in flat))
    lengths = [
        element.base_length
        for run in runs
        for element in (run.metadata.element_a, run.metadata.element_b)
        if element.kind == "muscle"
    ]
    sites = with_priors(sites, priors or {})
    shapes = tuple((name, tuple(site.prior.shape())) for name, site in sites.items())
    layout = Layout(friction, tuple(effects), tuple(regimes), tuple(segmented), shapes)
    chosen_priors = Priors({name: site.prior for name, site in sites.items()})
    base_length = np.asarray(lengths[0] if lengths else 1.0)
    lever = np.asarray(size.force / size.tension)
    warmth = _warmth(runs, size)
    reference = np.asarray(prior.reference_tension(runs, size))
    told = reference, lever, warmth, np.asarray(first)
    arrays = Data(tuple(lanes), chosen_priors, base_length, *told)
    data = jax.tree.map(jnp.asarray, arrays)
    return Problem(
        tuple(runs), tuple(records), layout, data, sites, size, tuple(lane_runs), site_runs
    )
