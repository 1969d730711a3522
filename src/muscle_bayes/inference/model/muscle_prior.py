"""The muscle's unknowns: quantities that a person can judge, and the parameters of Table 2."""

from collections.abc import Collection, Mapping
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.conventions import STRAIN_EPSILON
from muscle_bayes.inference.model.site import Site
from muscle_bayes.physics.effect import Scales
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.springs import tensile_strain

MINIMUM_FORCES = ("F_modulus_min", "F_hyst_min")
"""The springs' minimum forces. Below the least tension of the records they change nothing, above it
nearly everything."""
LEAST_SHARE = 0.1
"""Least first strain of HYST, as a share of that over which its coils part."""
COLD, HOT = 25.0, 90.0
"""Temperatures between which the muscle was trained and thermal contraction is described, C."""


class Frame(NamedTuple):
    """About what the sampled quantities describe the muscle."""

    cold: Array | float = COLD
    """Temperature from which on [C]."""
    hot: Array | float = HOT
    """Temperature up to which [C]."""
    strain: Array | float = 0.0
    """That of `TAUT_FORCE` 0."""


TRAINED = Frame()
TAUT_FORCE = "taut_force"
"""What is sampled in place of `taut_strain` where only forces are measured."""

STIFFNESS = 5.0
"""Prior median of MODULUS' and HYST's force per strain, in typical tensions."""

MUSCLE_PARAMETERS = MuscleParameters.__annotations__
UNITS = {
    "A": "1/K^2",
    "B": "1/K",
    "C": "1",
    "F_hyst_min": "N",
    "K_hyst": "N/m",
    "F_modulus_min": "N",
    "K_modulus": "N/m",
    "H": "N s/(m K)",
    "T_hyst_offset": "C",
}
"""Of Table 2's parameters."""


def muscle_sites(
    size: Scales, first_strain: float, *, powered: bool = False, only_forces: bool = False
) -> dict[str, Site]:
    """The muscle in quantities that a person can judge; `muscle_parameters` maps them to Table 2's.

    Thermal strain is described by its fall from 25 to 90 C and its bend between them, springs by
    force per unit strain relative to the tension at hand, the damper by HYST's time constant. The
    data see C, F_modulus_min and F_hyst_min best in the strain to which they add up where the muscle
    works: so `taut_strain`, under the runs' typical tension, is sampled. Its prior is centred on
    `first_strain`, at which the runs start, and is wide enough for any temperature and load there.

    Where power heats the muscle at an unknown rate (`powered`), the room and the temperature at which its
    usual power would hold the muscle stand for 25 and 90 C: readings then tell these quantities whatever
    the rate, which without a thermometer nothing tells. Where `only_forces` are measured, a force says how
    far the muscle is from taut at `first_strain`: one that is held tells forces, and nothing of strains.
    """
    pull = size.tension
    cold, hot = ("room temperature", "usual power") if powered else (f"{COLD:g} C", f"{HOT:g} C")
    middle = "half of that" if powered else f"{0.5 * (COLD + HOT):g} C"
    taut, strains = f"at {cold} under typical tension, HYST at rest", 0.15
    sites = (
        {TAUT_FORCE: Site(dist.Normal(0.0, strains * STIFFNESS * pull), "N", f"what lacks {taut}")}
        if only_forces
        else {"taut_strain": Site(dist.Normal(first_strain, strains), "1", f"strain {taut}")}
    )
    return sites | {
        "contraction": Site(dist.HalfNormal(0.15), "1", f"contraction from {cold} to {hot}"),
        "bend": Site(
            dist.Normal(0.0, 0.2), "1", f"strain at {middle} off the chord, per unit contraction"
        ),
        "modulus": Site(
            dist.LogNormal(np.log(STIFFNESS * pull), 1.0), "N", "MODULUS, force per strain"
        ),
        "F_modulus_min": Site(dist.LogNormal(np.log(0.5 * pull), 0.7), "N", "force that opens it"),
        "stiffness_hyst": Site(
            dist.LogNormal(np.log(STIFFNESS * pull), 1.0), "N", "HYST, force per strain"
        ),
        "F_hyst_min": Site(dist.LogNormal(np.log(0.3 * pull), 0.7), "N", "force that opens it"),
        "time_constant": Site(dist.LogNormal(np.log(150.0), 1.0), "s", f"of HYST at {cold}"),
        "softening": Site(dist.Beta(2.0, 2.0), "1", f"damper at {hot} over damper at {cold}"),
    }


def strain_under(tension: Array | float, values: Mapping[str, Array]) -> Array:
    """Strain of MODULUS and HYST together, both at rest under `tension` [N]."""
    modulus = tensile_strain(tension, values["modulus"], values["F_modulus_min"])
    return modulus + resting_hyst(tension, values)


def muscle_parameters(
    values: Mapping[str, Array],
    base_length: Array | float,
    tension: Array | float,
    frame: Frame = TRAINED,
) -> MuscleParameters:
    """Table 2's nine parameters from the sampled quantities.

    With s(T) = A T^2 + B T + C: s(25) = taut_strain - strain_under(tension), s(90) = s(25) - contraction,
    s(57.5) = chord + bend contraction; K = stiffness / L_base; H (T + T_off) through time_constant
    K_hyst at 25 C and softening times that at 90 C. Or in another frame.
    """
    values = completed(values, base_length, tension, frame)
    span, middle = frame.hot - frame.cold, 0.5 * (frame.hot + frame.cold)
    bow = values["bend"] * values["contraction"]
    a = -4.0 * bow / span**2
    b = -values["contraction"] / span - 2.0 * a * middle
    cold_offset = values["taut_strain"] - strain_under(tension, values)
    c = cold_offset - a * frame.cold**2 - b * frame.cold
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
        T_hyst_offset=cold / h - frame.cold,
    )


def resting_hyst(tension: Array | float, values: Mapping[str, Array]) -> Array:
    """sigma_hyst at rest under `tension` [N] (eq. 13 inverted)."""
    return tensile_strain(tension, values["stiffness_hyst"], values["F_hyst_min"])


def first_hyst(
    lag: Array, values: Mapping[str, Array], tension: Array | float
) -> Float[Array, " lane"]:
    """sigma_hyst at each lane's first row, `lag` beyond its strain at rest under `tension` [N].

    A lag and not a strain is sampled: it is zero where the muscle has long hung, readings show it
    however stiff the spring is, and it stays the same when another minimum force shifts the strain.
    Below a tenth of the strain over which its coils part, HYST is shut.
    """
    return jnp.maximum(resting_hyst(tension, values) + lag, LEAST_SHARE * STRAIN_EPSILON)


def replaced_by(chosen: Collection[str]) -> dict[str, str]:
    """Which sampled quantity each of these parameters of Table 2 takes the place of."""
    places = {
        "A": "bend",
        "B": "contraction",
        "C": "taut_strain",
        "K_hyst": "stiffness_hyst",
        "K_modulus": "modulus",
        "H": "softening",
        "T_hyst_offset": "time_constant" if "H" in chosen else "softening",
    }
    return {name: places[name] for name in places if name in chosen}


def completed(
    values: Mapping[str, Array],
    base_length: Array | float,
    tension: Array | float,
    frame: Frame = TRAINED,
) -> dict[str, Array]:
    """The values with every quantity of `muscle_sites`, of which parameters of Table 2 took the place.

    The equations of `muscle_parameters`, solved for them.
    """
    known, (cold, hot, strain) = dict(values), frame
    span, middle = hot - cold, 0.5 * (hot + cold)
    if "K_modulus" in values and "modulus" not in values:
        known["modulus"] = values["K_modulus"] * base_length
    if "K_hyst" in values and "stiffness_hyst" not in values:
        known["stiffness_hyst"] = values["K_hyst"] * base_length
    if "contraction" not in values:
        if "bend" in values:
            share = 8.0 * values["bend"] * middle / span**2 - 1.0 / span
            known["contraction"] = values["B"] / share
        else:
            known["contraction"] = -(values["B"] + 2.0 * values["A"] * middle) * span
    if "bend" not in values:
        known["bend"] = -values["A"] * span**2 / (4.0 * known["contraction"])
    if "softening" not in values and "H" not in values:
        known["softening"] = 1.0 + span / (values["T_hyst_offset"] + cold)
    elif "softening" not in values:
        k_hyst = known["stiffness_hyst"] / base_length
        if "time_constant" not in values:
            known["time_constant"] = values["H"] * (values["T_hyst_offset"] + cold) / k_hyst
        known["softening"] = 1.0 + values["H"] * span / (known["time_constant"] * k_hyst)
    if TAUT_FORCE in values:
        known["taut_strain"] = strain + values[TAUT_FORCE] / known["modulus"]
    elif "taut_strain" not in values:
        a = -4.0 * known["bend"] * known["contraction"] / span**2
        b = -known["contraction"] / span - 2.0 * a * middle
        cold_offset = values["C"] + a * cold**2 + b * cold
        known["taut_strain"] = cold_offset + strain_under(tension, known)
    return known
