"""Sampled quantities that stand for given parameters of Table 1 and 2."""

import jax.numpy as jnp

from muscle_bayes.inference.model.muscle_prior import COLD, HOT, strain_under
from muscle_bayes.inference.model.problem import Problem
from muscle_bayes.inference.posteriors.starts import resting_starts
from muscle_bayes.study.published import TABLE_1, TABLE_2


def sampled(problem: Problem) -> dict[str, jnp.ndarray]:
    """The thesis' values; each run's own unknowns at rest, noise at its prior's median."""
    table, length = TABLE_2, float(problem.data.base_length)

    def offset(temperature: float) -> float:
        return table["A"] * temperature**2 + table["B"] * temperature + table["C"]

    contraction = offset(COLD) - offset(HOT)
    damper = {t: table["H"] * (t + table["T_hyst_offset"]) for t in (COLD, HOT)}
    values = {
        **TABLE_1["coulomb"],
        "F_hyst_min": table["F_hyst_min"],
        "F_modulus_min": table["F_modulus_min"],
        "contraction": contraction,
        "bend": -0.25 * table["A"] * (HOT - COLD) ** 2 / contraction,
        "modulus": table["K_modulus"] * length,
        "stiffness_hyst": table["K_hyst"] * length,
        "time_constant": damper[COLD] / table["K_hyst"],
        "softening": damper[HOT] / damper[COLD],
    }
    values["taut_strain"] = offset(COLD) + float(strain_under(problem.data.tension, values))
    drawn = {name: jnp.asarray([value]) for name, value in values.items()}
    whole = resting_starts(problem, drawn)
    return {name: whole[name][0] for name, _ in problem.layout.shapes}
