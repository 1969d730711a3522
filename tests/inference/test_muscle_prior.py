"""The muscle in the sampled quantities and in the thesis' own."""

import itertools

import jax
import numpy as np
import pytest

from muscle_bayes.conventions import STRAIN_EPSILON
from muscle_bayes.inference.model.muscle_prior import (
    UNITS,
    Frame,
    completed,
    muscle_parameters,
    muscle_sites,
    replaced_by,
    resting_hyst,
)
from muscle_bayes.physics.effect import Scales
from muscle_bayes.physics.springs import tensile_spring
from muscle_bayes.study.published import TABLE_2

BASE_LENGTH, TENSION = 0.1, 6.0


def sampled_from_table_2() -> dict[str, float]:
    def strain(t: float) -> float:
        return TABLE_2["A"] * t**2 + TABLE_2["B"] * t + TABLE_2["C"]

    modulus, hyst = TABLE_2["K_modulus"] * BASE_LENGTH, TABLE_2["K_hyst"] * BASE_LENGTH
    contraction = strain(25.0) - strain(90.0)
    chord = 0.5 * (strain(25.0) + strain(90.0))
    damper = {t: TABLE_2["H"] * (t + TABLE_2["T_hyst_offset"]) for t in (25.0, 90.0)}
    return {
        "taut_strain": strain(25.0)
        + 2.0 * STRAIN_EPSILON
        + (TENSION - TABLE_2["F_modulus_min"]) / modulus
        + (TENSION - TABLE_2["F_hyst_min"]) / hyst,
        "contraction": contraction,
        "bend": (strain(57.5) - chord) / contraction,
        "modulus": modulus,
        "F_modulus_min": TABLE_2["F_modulus_min"],
        "stiffness_hyst": hyst,
        "F_hyst_min": TABLE_2["F_hyst_min"],
        "time_constant": damper[25.0] / TABLE_2["K_hyst"],
        "softening": damper[90.0] / damper[25.0],
    }


def test_table_2_comes_back_from_its_sampled_quantities() -> None:
    parameters = muscle_parameters(sampled_from_table_2(), BASE_LENGTH, TENSION)
    for name, value in TABLE_2.items():
        np.testing.assert_allclose(getattr(parameters, name), value, rtol=1e-9)


def combinations() -> list[tuple[str, ...]]:
    """All sets of Table 2's parameters that can take the place of sampled quantities."""
    names = list(replaced_by(UNITS))
    return [
        chosen for count in range(len(names) + 1) for chosen in itertools.combinations(names, count)
    ]


def test_parameters_of_table_2_stand_for_the_quantities_that_they_replace() -> None:
    whole = sampled_from_table_2()
    for chosen in combinations():
        places = replaced_by(chosen)
        assert len(set(places.values())) == len(chosen)
        values = {name: value for name, value in whole.items() if name not in places.values()}
        values |= {name: TABLE_2[name] for name in chosen}
        found = muscle_parameters(values, BASE_LENGTH, TENSION)
        for name, value in TABLE_2.items():
            np.testing.assert_allclose(getattr(found, name), value, rtol=1e-6, err_msg=str(chosen))


def test_a_muscle_may_be_described_between_other_temperatures() -> None:
    frame = Frame(21.0, 60.0)
    values = completed(TABLE_2, BASE_LENGTH, TENSION, frame)
    found = muscle_parameters(values, BASE_LENGTH, TENSION, frame)
    for name, value in TABLE_2.items():
        np.testing.assert_allclose(getattr(found, name), value, rtol=1e-9)
    np.testing.assert_allclose(values["contraction"], found.offset(21.0) - found.offset(60.0))
    np.testing.assert_allclose(values["softening"], found.damper(60.0) / found.damper(21.0))


def test_priors_reach_table_2_without_being_centred_on_it() -> None:
    sites = muscle_sites(
        Scales(force=0.18, speed=1.0, tension=TENSION, range=1.0), first_strain=0.2
    )
    shares = []
    for name, value in sampled_from_table_2().items():
        draws = np.asarray(sites[name].prior.sample(jax.random.key(3), (20_000,)))
        shares.append(float(np.mean(draws < value)))
    assert all(0.02 < share < 0.98 for share in shares)
    assert np.mean(np.abs(np.array(shares) - 0.5)) > 0.1


@pytest.mark.parametrize("held", [0.4, 1.8, 2.3, 3.0])
def test_resting_hyst_inverts_its_spring(held: float) -> None:
    values = sampled_from_table_2()
    strain = resting_hyst(held, values)
    force = tensile_spring(strain, values["stiffness_hyst"], values["F_hyst_min"])
    np.testing.assert_allclose(force, held, rtol=1e-9)
