"""Samplers are judged alike; nothing here is timed, and none of their packages is needed."""

import dataclasses
import re
from pathlib import Path

import jax
import numpy as np
import pytest

import benchmarks.samplers
from benchmarks.judging import identified, judge, kept
from benchmarks.problem import posed, reference_point
from benchmarks.samplers.numpyro_nuts import NumpyroDiffrax, NumpyroOurs
from benchmarks.samplers.protocol import Frame, whitened
from benchmarks.samplers.stan_data import data_of
from benchmarks.sampling_table import UNRELIABLE, busy_rate, rate, section

EVERY = np.ones(3, bool)


def _chains(phi: float, draws: int = 4000, chains: int = 4) -> np.ndarray:
    """Stationary autoregressive chains of three entries, standard normal."""
    rng = np.random.default_rng(3)
    shocks = rng.standard_normal((chains, draws, 3)) * np.sqrt(1.0 - phi**2)
    result = np.empty_like(shocks)
    result[:, 0] = rng.standard_normal((chains, 3))
    for i in range(1, draws):
        result[:, i] = phi * result[:, i - 1] + shocks[:, i]
    return result


def test_known_chains_have_their_effective_sample_size() -> None:
    phi = 0.6
    found = judge(_chains(phi), EVERY)
    assert found.ess == pytest.approx(16000 * (1.0 - phi) / (1.0 + phi), rel=0.15)
    assert found.verdict == "converged"


def test_chains_apart_are_not_converged() -> None:
    apart = _chains(0.0, 200) + 3.0 * np.arange(4)[:, None, None]
    assert judge(apart, EVERY).verdict == UNRELIABLE


def test_few_independent_draws_give_a_rate_but_do_not_suffice() -> None:
    assert judge(_chains(0.0, 80), EVERY).verdict == "usable"


def test_no_draws_are_no_convergence() -> None:
    for count in (0, 1, 3):
        assert judge(np.zeros((2, count, 3)), EVERY).verdict == UNRELIABLE
    still = judge(np.zeros((2, 50, 3)), EVERY)
    assert still.verdict == UNRELIABLE


def test_what_is_hardly_known_is_judged_apart() -> None:
    chains = _chains(0.0)
    chains[..., 1] += 3.0 * np.arange(4)[:, None]
    found = judge(chains, np.array([True, False, True]))
    assert found.verdict == "converged"
    assert found.rhat_all > 1.1
    assert found.ess_all < found.ess


def test_a_cap_within_the_warm_up_leaves_the_later_half() -> None:
    draws = np.arange(10)
    np.testing.assert_array_equal(kept(draws, draws < 3), draws[3:])
    np.testing.assert_array_equal(kept(draws, draws < 8), draws[5:])


def test_the_problem_hides_inertia_and_friction_only() -> None:
    problem = posed(("staircase-139g",))
    counted = identified(problem.layout)
    assert counted.size - counted.sum() == 2
    assert not counted[:2].any()


def test_whitened_density_has_its_gradient_and_refuses_failures() -> None:
    class Counter:
        evaluations = 0

        def begin(self) -> None: ...

    factor = np.array([[2.0, 0.0], [1.0, 3.0]])
    frame = Frame(np.array([1.0, -1.0]), factor, np.empty((0, 2)))
    counter = Counter()
    call = whitened(lambda x: (-float(x @ x), -2.0 * x), frame, counter)
    z = np.array([0.3, -0.7])
    value, gradient = call(z)
    vector = frame.vector(z)
    assert value == pytest.approx(-vector @ vector)
    steps = 1e-6 * np.eye(2)
    slope = [(call(z + one)[0] - call(z - one)[0]) / 2e-6 for one in steps]
    np.testing.assert_allclose(gradient, slope, rtol=1e-6)
    assert counter.evaluations == 5

    def failing(_: np.ndarray) -> tuple[float, np.ndarray]:
        raise RuntimeError("integration failed")

    assert whitened(failing, frame, counter)(z)[0] == -np.inf


def _entry(name: str, ess: float, verdict: str) -> dict:
    quality = {"draws": 100, "chains": 2, "ess": ess, "rhat": 1.2 if verdict == UNRELIABLE else 1.0}
    quality |= {"ess_all": ess / 2, "rhat_all": 1.3}
    return {
        "sampler": name,
        "settings": "",
        "seconds": 10.0,
        "busy": 20.0,
        "setup": 1.0,
        "evaluations": 1000,
        "diverging": 0,
        "density_off": 0.1,
        "call": 0.5,
        "quality": quality,
        "failure": "",
        "verdict": verdict,
    }


def test_the_section_tells_rates_bounds_and_aims() -> None:
    ours = _entry("muscle_bayes", 1000.0, "converged")
    ours |= {"walls": {"cold": 40.0, "warm": 20.0}, "stages": {"sampling": 10.0}}
    slow = _entry("NumPyro NUTS on diffrax", 5.0, UNRELIABLE)
    good = _entry("PINTS on CVODES", 50.0, "usable")
    assert rate(ours) == 100.0
    assert busy_rate(ours) == 50.0
    results = {"machine": {}, "load": 0.1, "cap": 10.0, "processes": 2, "unknowns": 3}
    results |= {"hardly_known": ["J", "D"], "largest_rhat": 1.05}
    free = _entry("NumPyro NUTS on our density", 100.0, "usable")
    results["entries"] = {"ours": ours, "numpyro_diffrax": slow, "pints_cvodes": good}
    results["entries"] |= {"numpyro_ours": free}
    text = section(results)
    assert "at most 0.5 | at least 200" in text
    paced = "| 4 | NumPyro NUTS on our density | 0.1 | 0.4 | 250 |"
    assert paced in text, "two processes, half a second a gradient, 0.1 draws each"
    assert "some 250 x: holds" in text, "less than the bound of its own draws"
    assert "50 x | 20 x: **missed**" in text
    results["entries"]["ours"] = ours | {"verdict": UNRELIABLE}
    assert section(results).count("**not shown**") == 2
    assert "reached R-hat <= 1.01" in text


def test_few_draws_are_held_against_the_lesser_of_their_bound_and_their_pace() -> None:
    ours = _entry("muscle_bayes", 1000.0, "converged")
    ours |= {"walls": {"cold": 40.0, "warm": 20.0}, "stages": {"sampling": 10.0}}
    results = {"machine": {}, "load": 0.1, "cap": 10.0, "processes": 2, "unknowns": 3}
    results |= {"hardly_known": ["J", "D"], "largest_rhat": 1.05}
    floor = _entry("emcee on the C floor", 20.0, UNRELIABLE)
    few = _entry("emcee on CVODES", 288.0, UNRELIABLE)
    results["entries"] = {"ours": ours, "emcee_cvodes": few}
    aim = "emcee and PINTS on CVODES (emcee on CVODES) | 50 x | at least"
    assert f"{aim} 3.47 x: **not shown**" in section(results)
    results["entries"]["emcee_floor"] = floor
    text = section(results)
    assert f"{aim} 1.25e+03 x: holds" in text, "a bound on the floor stays one"
    assert "| at most 0.02 | at most 0.08 | at least 1.25e+03 |" in text
    few["quality"]["ess"] = 0.5
    assert f"{aim} 2e+03 x: holds" in section(results), "now its own bound is the lesser"


def test_stan_competes_with_the_others_on_cvodes() -> None:
    ours = _entry("muscle_bayes", 1000.0, "converged")
    ours |= {"walls": {"cold": 40.0, "warm": 20.0}, "stages": {"sampling": 10.0}}
    results = {"machine": {}, "load": 0.1, "cap": 10.0, "processes": 2, "unknowns": 3}
    results |= {"hardly_known": ["J", "D"], "largest_rhat": 1.05}
    results["entries"] = {
        "ours": ours,
        "numpyro_ours": _entry("NumPyro NUTS on our density", 100.0, "usable"),
        "nutpie_casadi": _entry("nutpie NUTS on CVODES", 5.0, UNRELIABLE),
        "stan": _entry("Stan NUTS on CVODES", 10.0, UNRELIABLE),
    }
    text = section(results)
    assert "| Stan NUTS on CVODES | not converged |" in text
    assert "CVODES (Stan NUTS on CVODES) | 50 x | some 250 x: holds" in text
    assert "| Stan NUTS on CVODES | 4 | NumPyro NUTS on our density | 0.1 | 0.4 | 250 |" in text
    assert "Stan NUTS on CVODES 0.1" in text, "how far its density is off"
    missing = {"sampler": "Stan NUTS on CVODES", "failure": "Stan needs a C++ compiler"}
    results["entries"]["stan"] = missing
    text = section(results)
    assert "| Stan NUTS on CVODES | **fails:** Stan needs a C++ compiler |" in text
    assert "CVODES (nutpie NUTS on CVODES) | 50 x" in text


def test_stan_is_given_what_its_program_declares() -> None:
    with jax.enable_x64(True):
        problem = posed()
        point = np.asarray(reference_point(problem))
        frame = Frame(point, np.eye(point.size), np.empty((0, point.size)))
        data = data_of(problem, frame)
        contraction = problem.data.priors["contraction"].scale
        zeros = problem.data.priors["slow.zero"].loc
        shapes = problem.layout.shapes
        other = dataclasses.replace(problem.layout, shapes=shapes[::-1])
        with pytest.raises(ValueError, match="other unknowns"):
            data_of(dataclasses.replace(problem, layout=other), frame)
    program = Path(benchmarks.samplers.__file__).with_name("muscle.stan").read_text("utf-8")
    block = program[program.index("\ndata {") : program.index("\nparameters {")]
    assert set(data) == set(re.findall(r"(\w+);", block))
    readings, instants = sum(data["intervals"]), sum(2 * n + 1 for n in data["intervals"])
    for name in ("reading", "gap", "weight", "coarse"):
        assert data[name].shape == (readings,)
    for name in ("time", "heater"):
        assert data[name].shape == (instants,)
    names = [name for name, shape in shapes for _ in range(int(np.prod(shape)))]
    assert data["spread"][names.index("contraction")] == contraction
    first = names.index("slow.zero")
    np.testing.assert_array_equal(data["location"][first : first + 3], zeros)


@pytest.mark.slow
def test_nuts_sees_the_competitors_density_and_gradient() -> None:
    with jax.enable_x64(True):
        problem = posed(("staircase-139g",))
        point = np.asarray(reference_point(problem))
        frame = Frame(point, np.eye(point.size), np.empty((0, point.size)))
        found = []
        for kind in (NumpyroOurs, NumpyroDiffrax):
            energy, arrays = kind(problem, frame).energy()
            found.append(jax.value_and_grad(energy)(point, *arrays))
    (value, gradient), (other, slope) = found
    np.testing.assert_allclose(other, value, atol=1.0)
    assert np.linalg.norm(slope - gradient) < 0.15 * np.linalg.norm(gradient)
