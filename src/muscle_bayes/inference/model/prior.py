"""Weakly informative, physical priors; none is centred on a published answer."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from numpyro import distributions as dist

from muscle_bayes.conventions import GRAVITY, Friction
from muscle_bayes.data.run import Run
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.site import Site
from muscle_bayes.inference.model.standardised_normal import standardised
from muscle_bayes.inference.records.course import course_of
from muscle_bayes.inference.records.heat import heating
from muscle_bayes.inference.records.parts import HEATERS, parts_of
from muscle_bayes.inference.records.record import Record
from muscle_bayes.inference.records.rig import (
    driving_force,
    restores,
    stated_inertia,
    strains,
    tension_lever,
)
from muscle_bayes.physics.effect import Scales
from muscle_bayes.physics.effects import effect_type

EXACT = 1e-3
"""Spread of an exact zero that is not 0, or stands beside others, as a share of the readings' noise."""
HAND_SIZED = 3e-3
"""Inertia of a rotor that a hand holds [kg m^2], or mass of a carriage [kg]."""
UNSTATED_TENSION = 3.0
"""Tension of a muscle under no stated load [N]: about that under which muscles are coiled."""
FRICTION_SHARE = 0.05
"""Prior median of friction at typical speed, as a share of what drives the rotor."""
FIRST_FORCE = 0.1
"""Prior standard deviation of the first tension about its reading, as a share of the readings' range."""
TAUT = 0.05
"""Least tension to which the taut strain refers, in typical ones."""
FIRST_LAG = (0.005, 0.15)
"""Least and largest prior standard deviation of how far HYST is from rest at the first row, in strain."""


def scales(runs: Sequence[Run], records: Sequence[Record]) -> Scales:
    """Characteristic magnitudes of the runs: driving force, speed, tension, range of motion."""
    courses = [course_of(run, record) for run, record in zip(runs, records, strict=True)]
    speed = max(*(float(np.quantile(np.abs(one.speed), 0.95)) for one in courses), 1e-9)
    span = max(*(float(np.ptp(one.q)) for one in courses), 1e-9)
    forces = [driving_force(run) for run in runs]
    levers = [max(tension_lever(run), 1e-6) for run in runs]
    force, tension = max(forces), max(f / lever for f, lever in zip(forces, levers, strict=True))
    if force == 0.0 and any(run.has_muscle for run in runs):
        force, tension = UNSTATED_TENSION * max(levers), UNSTATED_TENSION
    elif force == 0.0:
        # Nothing that drives is stated: what moves the stated inertia, or a hand-sized one, as read.
        inertia = max(stated_inertia(run) for run in runs) or HAND_SIZED
        force = inertia * speed**2 / span
        tension = force / max(levers)
    rest = float(np.mean([0.5 * (one.q.max() + one.q.min()) for one in courses]))
    duration = max(float(np.ptp(run.table["time"])) for run in runs)
    signals = [float((run.table["applied"] ** 2).mean() ** 0.5) for run in runs]
    return Scales(force, speed, tension, span, rest, duration, _power(runs), max(signals) or 1.0)


def _power(runs: Sequence[Run]) -> float:
    """RMS of what heats the runs' muscles; 1 where that is their logged temperature."""
    powers = [heating(run, side) for run in runs for side in "ab"]
    sizes = [float(np.sqrt(np.mean(power**2))) for power in powers if power is not None]
    return max(sizes, default=0.0) or 1.0


def fixture_sites(runs: Sequence[Run], friction: Friction, size: Scales) -> dict[str, Site]:
    """J and D; no J where the metadata of all runs state it, neither where all motion is imposed.

    J spans four decades around a hand-sized rotor, or around the mass whose weight would drive a
    carriage; dry friction is some share of what drives the rotor, or linear friction some share of
    that per unit of speed. Quasi-static runs say nothing of J.
    """
    linear = any(run.metadata.fixture.motion == "linear" for run in runs)
    unit, middle = ("kg", size.force / GRAVITY) if linear else ("kg m^2", 3e-3)
    sites: dict[str, Site] = {}
    if all(run.imposed is not None for run in runs):
        return sites
    if any(run.metadata.fixture.inertia is None for run in runs):
        sites["J"] = Site(dist.LogNormal(np.log(middle), 2.0), unit, "inertia of the rotor")
    if friction == "coulomb":
        unit, most = ("N" if linear else "N m"), size.force
        meaning = "dry friction"
    else:
        unit, most = ("N s/m" if linear else "N m s"), size.force / size.speed
        meaning = "friction per unit speed"
    sites["D"] = Site(dist.HalfCauchy(FRICTION_SHARE * most), unit, meaning)
    return sites


def part_sites(runs: Sequence[Run], size: Scales) -> dict[str, Site]:
    """What metadata leave open of elements and drive, as `table.key` of the metadata.

    Runs that are fitted together share it. Raises MuscleBayesError where it means different things.
    """
    sites: dict[str, Site] = {}
    kinds: dict[str, type] = {}
    for run in runs:
        for place, part in parts_of(run.metadata).items():
            for key in part.estimated():
                name, known = f"{place}.{key}", part.unknowns[key]
                if kinds.setdefault(name, type(part)) is not type(part):
                    raise MuscleBayesError(
                        f"{name} is to be estimated, but [{place}] is something else in another run. "
                        "Fix: fit these runs apart, or state it"
                    )
                sites[name] = Site(standardised(known.prior(size)), known.unit, known.meaning)
    return sites


def is_powered(runs: Sequence[Run]) -> bool:
    """Whether power heats the muscles at a rate that is unknown."""
    heaters = [parts_of(run.metadata)[place] for run in runs for place in HEATERS]
    return any("heating_rate" in heater.estimated() for heater in heaters)


def mean_first_strain(runs: Sequence[Run]) -> float:
    """Strain of the muscle at the first reading, mean over the runs that have one."""
    return float(np.mean([strains(run)[0] for run in runs if run.has_muscle]))


def first_tension(run: Run) -> float:
    """Tension of the first row [N] where it was measured; else 0."""
    return max(float(run.output[0]), 0.0) if run.measured == "force" else 0.0


def reference_tension(runs: Sequence[Run], size: Scales) -> float:
    """Tension to which the taut strain refers [N].

    Where forces are measured, that of their first rows: the first strain is taut under it, however stiff
    the muscle is, of which one that is held tells nothing.
    """
    first = [first_tension(run) for run in runs if run.measured == "force"]
    return max(float(np.mean(first)), TAUT * size.tension) if first else size.tension


def _first_lag_spread(runs: Sequence[Run]) -> float:
    """How far HYST may be from rest at the first row: about as far as the muscles move."""
    widest = max(float(np.ptp(strains(run))) for run in runs if run.has_muscle)
    return float(np.clip(widest, *FIRST_LAG))


def effect_sites(names: Sequence[str], size: Scales) -> dict[str, Site]:
    """The parameters of the named effects, as `effect-name.parameter`."""
    return {
        f"{name}.{key}": Site(
            standardised(parameter.prior(size)), parameter.unit, parameter.meaning
        )
        for name in names
        for key, parameter in effect_type(name).parameters.items()
    }


def reading_noise(run: Run) -> float:
    """White noise of one reading [log's unit], at least 0.3 quanta, from third differences."""
    reading = run.table["reading"].to_numpy()
    third = np.diff(reading, 3)
    spread = 1.4826 * float(np.median(np.abs(third))) / np.sqrt(20.0)
    floor = 0.3 * run.output_sensor.resolution
    return max(spread, floor, 1e-9 * float(np.ptp(reading)) + 1e-12)


def noise_sites(runs: Sequence[Run], regime: str, typical_time: float) -> dict[str, Site]:
    """White noise and discrepancy of the runs of one regime, in the log's unit.

    Both are centred on the noise of a single reading; the discrepancy may be far larger.
    """
    level = float(np.median([reading_noise(run) for run in runs]))
    unit = runs[0].unit
    return {
        f"{regime}.noise": Site(dist.LogNormal(np.log(level), 0.7), unit, "noise of one reading"),
        f"{regime}.discrepancy": Site(
            dist.LogNormal(np.log(level), 1.5), unit, "misfit that lasts, standard deviation"
        ),
        f"{regime}.correlation_time": Site(
            dist.LogNormal(np.log(typical_time), 1.0), "s", "how long misfit lasts"
        ),
    }


def run_sites(
    runs: Sequence[Run], records: Sequence[Record], regime: str, size: Scales
) -> dict[str, Site]:
    """Unknowns of each run: zero of the sensor, first reading, first speed if inertial, first HYST.

    A rotor that friction holds from the first row on keeps what its start is off by: taken for
    discrepancy, it would widen the muscle's posterior by a third.
    """
    names = [run.name for run in runs]
    quantum = np.array([run.output_sensor.resolution for run in runs])
    level = np.array([reading_noise(run) for run in runs])
    sites = {}
    uncertain = np.array([run.output_sensor.zero_uncertainty for run in runs])
    nominal = np.array([run.output_sensor.zero for run in runs])
    if uncertain.any() or nominal.any():  # else all readings are of q itself
        spread = np.maximum(uncertain, EXACT * level)
        sites["zero"] = Site(dist.Normal(nominal, spread), runs[0].unit, "reading at q = 0")
    if regime in ("fast", "slow"):
        first = np.array([record.start_reading for record in records])
        spread = np.sqrt(level**2 + quantum**2 / 12.0)
        sites["start"] = Site(dist.Normal(first, spread), runs[0].unit, "reading at the first row")
    if runs[0].measured == "velocity":
        if any(restores(run) for run in runs):
            sites["place"] = _unmeasured_place(runs, records)
    elif regime == "fast" and any(run.metadata.protocol != "spring" for run in runs):
        slope = np.array([record.start_speed for record in records])
        loose = np.abs(slope) + 10.0 * spread
        sites["speed"] = Site(
            dist.Normal(slope, loose), f"{runs[0].unit}/s", "speed at the first row"
        )
    if regime == "imposed" and all(run.metadata.element_a.kind == "muscle" for run in runs):
        spread = np.array([FIRST_FORCE * float(np.ptp(run.output)) for run in runs])
        meaning = "tension at the first row, less that read there: by it HYST begins"
        sites["first_force"] = Site(dist.Normal(np.zeros(len(names)), spread), "N", meaning)
    elif regime != "heated" and any(run.has_muscle for run in runs):
        sites["hyst_lag"] = Site(
            dist.Normal(jnp.zeros(len(names)), _first_lag_spread(runs)),
            "1",
            "HYST's strain at the first row, less that at rest under typical tension",
        )
    return sites


def _unmeasured_place(runs: Sequence[Run], records: Sequence[Record]) -> Site:
    """First coordinate of runs whose rate is measured: such that they move about zero."""
    courses = [course_of(run, record).q for run, record in zip(runs, records, strict=True)]
    centre = np.array([-0.5 * (q.max() + q.min()) for q in courses])
    spread = np.array([0.5 * np.ptp(q) + 1e-9 for q in courses])
    unit = "m" if runs[0].metadata.fixture.motion == "linear" else "rad"
    return Site(standardised(dist.Normal(centre, spread)), unit, "coordinate at the first row")
