"""Weakly informative, physical priors; none is centred on a published answer."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.conventions import GRAVITY, Friction
from muscle_bayes.data.run import Run
from muscle_bayes.inference.record import Record
from muscle_bayes.inference.rig import driving_force, first_strain, has_muscle, tension_lever
from muscle_bayes.inference.standardised_normal import standardised
from muscle_bayes.physics.effect import Scales
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.springs import tensile_strain

COLD, HOT = 25.0, 90.0
"""Temperatures between which the muscle was trained and thermal contraction is described, C."""

EXACT = 1e-3
"""Spread of an exact zero that is not 0, or stands beside others, as a share of the readings' noise."""
FIRST_FORCE_SPREAD = 0.7
"""Prior standard deviation of the log of HYST's force at the first row, about the typical tension."""

MUSCLE_PARAMETERS = MuscleParameters.__annotations__


class Site(NamedTuple):
    """One sampled quantity."""

    prior: dist.Distribution
    unit: str
    meaning: str


def scales(runs: Sequence[Run], records: Sequence[Record]) -> Scales:
    """Characteristic magnitudes of the runs: driving force, speed, tension, range of motion."""
    force = max(driving_force(run) for run in runs)
    speeds, ranges = [], []
    for run, record in zip(runs, records, strict=True):
        seen = record.weight > 0
        q = run.sensor.coordinate(record.reading[seen])
        ranges.append(float(np.ptp(q)))
        speeds.append(np.quantile(np.abs(np.diff(q) / np.diff(record.time[seen])), 0.95))
    tension = max(driving_force(run) / max(tension_lever(run), 1e-6) for run in runs)
    return Scales(force, max(float(max(speeds)), 1e-9), tension, max(*ranges, 1e-9))


def fixture_sites(runs: Sequence[Run], friction: Friction, size: Scales) -> dict[str, Site]:
    """J and D.

    J spans four decades around a hand-sized rotor, or around the mass whose weight would drive a
    carriage; dry friction is some share of what drives the rotor, or linear friction some share of
    that per unit of speed. Slow runs show J only by how far the rotor overshoots its rest.
    """
    linear = any(run.metadata.fixture.motion == "linear" for run in runs)
    unit, middle = ("kg", size.force / GRAVITY) if linear else ("kg m^2", 3e-3)
    sites = {"J": Site(dist.LogNormal(np.log(middle), 2.0), unit, "inertia of the rotor")}
    if friction == "coulomb":
        unit, middle = ("N" if linear else "N m"), 0.05 * size.force
        meaning = "dry friction"
    else:
        unit, middle = ("N s/m" if linear else "N m s"), 0.05 * size.force / size.speed
        meaning = "friction per unit speed"
    sites["D"] = Site(dist.LogNormal(np.log(middle), 2.0), unit, meaning)
    return sites


def muscle_sites(size: Scales, first_strain: float) -> dict[str, Site]:
    """The muscle in quantities that a person can judge; `muscle_parameters` maps them to Table 2's.

    Thermal strain is described by its fall from 25 to 90 C and its bend between them, springs by
    force per unit strain relative to the tension at hand, the damper by HYST's time constant. The
    data see C, F_modulus_min and F_hyst_min best in the strain to which they add up where the muscle
    works: so `taut_strain`, under the runs' typical tension, is sampled. Its prior is centred on
    `first_strain`, at which the runs start, and is wide enough for any temperature and load there.
    """
    pull = size.tension
    return {
        "taut_strain": Site(
            dist.Normal(first_strain, 0.15),
            "1",
            "strain at 25 C under typical tension, HYST at rest",
        ),
        "contraction": Site(dist.HalfNormal(0.15), "1", "contraction from 25 to 90 C"),
        "bend": Site(
            dist.Normal(0.0, 0.2), "1", "strain at 57.5 C off the chord, per unit contraction"
        ),
        "modulus": Site(dist.LogNormal(np.log(5 * pull), 1.0), "N", "MODULUS, force per strain"),
        "F_modulus_min": Site(dist.LogNormal(np.log(0.5 * pull), 0.7), "N", "force that opens it"),
        "stiffness_hyst": Site(
            dist.LogNormal(np.log(5 * pull), 1.0), "N", "HYST, force per strain"
        ),
        "F_hyst_min": Site(dist.LogNormal(np.log(0.3 * pull), 0.7), "N", "force that opens it"),
        "time_constant": Site(dist.LogNormal(np.log(150.0), 1.0), "s", "of HYST at 25 C"),
        "softening": Site(dist.Beta(2.0, 2.0), "1", "damper at 90 C over damper at 25 C"),
    }


def strain_under(tension: Array | float, values: Mapping[str, Array]) -> Array:
    """Strain of MODULUS and HYST together, both at rest under `tension` [N]."""
    modulus = tensile_strain(tension, values["modulus"], values["F_modulus_min"])
    return modulus + resting_hyst(tension, values)


def muscle_parameters(
    values: Mapping[str, Array], base_length: Array | float, tension: Array | float
) -> MuscleParameters:
    """Table 2's nine parameters from the sampled quantities.

    With s(T) = A T^2 + B T + C: s(25) = taut_strain - strain_under(tension), s(90) = s(25) - contraction,
    s(57.5) = chord + bend contraction; K = stiffness / L_base; H (T + T_off) through time_constant
    K_hyst at 25 C and softening times that at 90 C.
    """
    span, middle = HOT - COLD, 0.5 * (HOT + COLD)
    bow = values["bend"] * values["contraction"]
    a = -4.0 * bow / span**2
    b = -values["contraction"] / span - 2.0 * a * middle
    cold_offset = values["taut_strain"] - strain_under(tension, values)
    c = cold_offset - a * COLD**2 - b * COLD
    k_hyst = values["stiffness_hyst"] / base_length
    cold = values["time_constant"] * k_hyst
    h = -cold * (1.0 - values["softening"]) / span
    return MuscleParameters(
        A=a,
        B=b,
        C=c,
        F_hyst_min=values["F_hyst_min"],
        K_hyst=k_hyst,
        F_modulus_min=values["F_modulus_min"],
        K_modulus=values["modulus"] / base_length,
        H=h,
        T_hyst_offset=cold / h - COLD,
    )


def resting_hyst(tension: Array | float, values: Mapping[str, Array]) -> Array:
    """sigma_hyst at rest under `tension` [N] (eq. 13 inverted)."""
    return tensile_strain(tension, values["stiffness_hyst"], values["F_hyst_min"])


def first_hyst(force: Array, values: Mapping[str, Array]) -> Float[Array, " run"]:
    """sigma_hyst at each run's first row, where HYST's spring pulls with `force` [N].

    A force and not a strain is sampled: it is positive, it is the tension where the muscle has long
    hung, and it stays the same when another minimum force shifts the strain.
    """
    return resting_hyst(force, values)


def mean_first_strain(runs: Sequence[Run]) -> float:
    """Strain of the muscle at the first reading, mean over the runs that have one."""
    return float(np.mean([first_strain(run) for run in runs if has_muscle(run)]))


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
    floor = 0.3 * run.sensor.resolution
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
    """Unknowns of each run: zero of the sensor, first reading and speed if inertial, first HYST.

    A rotor in slow motion begins at its first readings, moved into its dead band: what that is off by
    is discrepancy.
    """
    names = [run.name for run in runs]
    quantum = np.array([run.sensor.resolution for run in runs])
    level = np.array([reading_noise(run) for run in runs])
    sites = {}
    uncertain = np.array([run.sensor.zero_uncertainty for run in runs])
    nominal = np.array([run.sensor.zero for run in runs])
    if uncertain.any() or nominal.any():  # else all readings are of q itself
        spread = np.maximum(uncertain, EXACT * level)
        sites["zero"] = Site(dist.Normal(nominal, spread), runs[0].unit, "reading at q = 0")
    if regime == "fast":
        first = np.array([record.start_reading for record in records])
        spread = np.sqrt(level**2 + quantum**2 / 12.0)
        sites["start"] = Site(dist.Normal(first, spread), runs[0].unit, "reading at the first row")
    if regime == "fast" and any(run.metadata.protocol != "spring" for run in runs):
        slope = np.array([record.start_speed for record in records])
        loose = np.abs(slope) + 10.0 * spread
        sites["speed"] = Site(
            dist.Normal(slope, loose), f"{runs[0].unit}/s", "speed at the first row"
        )
    if any(has_muscle(run) for run in runs):
        sites["hyst_force"] = Site(
            dist.LogNormal(jnp.full(len(names), np.log(size.tension)), FIRST_FORCE_SPREAD),
            "N",
            "force of HYST's spring at the first row",
        )
    return sites
