"""The public names: what they are, that they are quick to import, and that their examples run."""

import ast
import doctest
import inspect
import io
import json
import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import arviz as az
import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from numpyro import distributions as dist

import muscle_bayes as mb
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.sampling import fit as fitting
from muscle_bayes.inference.sampling.sampler import Effort
from muscle_bayes.markup import three_digits
from muscle_bayes.physics.effects import Backlash
from muscle_bayes.physics.effects.own import own_effects
from muscle_bayes.progress import shown_progress
from muscle_bayes.study.published import TABLE_1, TABLE_2

SOURCE = Path(__file__).parents[1] / "src"
LITTLE = Effort(chains=2, warmup=60, draws=60, rounds=1, min_ess=1)
FUNCTIONS = [name for name in mb.__all__ if name[0].islower()]
COMPUTED = [name for name in FUNCTIONS if not name.startswith("plot_")]


def test_importing_is_quick_and_every_name_is_listed():
    code = (
        "import time; t = time.perf_counter(); import muscle_bayes as mb; t = time.perf_counter() - t\n"
        "import sys; heavy = {'jax', 'arviz', 'numpy', 'pandas', 'rich'} & set(sys.modules)\n"
        "print(t, *heavy, *(name for name in mb.__all__ if name not in dir(mb)))"
    )
    told = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": str(SOURCE)},
        capture_output=True,
        text=True,
        check=True,
    )
    seconds, *others = told.stdout.split()
    assert float(seconds) < 0.1
    assert not others


@pytest.mark.parametrize("name", mb.__all__)
def test_a_public_name_can_be_imported(name):
    assert getattr(mb, name) is getattr(mb, name)
    assert name in dir(mb)


def test_the_page_of_public_names_lists_them_all():
    page = (SOURCE.parent / "docs" / "api.md").read_text(encoding="utf-8")
    shown = re.findall(r"^\| `mb\.(\w+)`", page, re.MULTILINE)
    assert sorted(shown) == sorted(mb.__all__)


def test_types_are_declared_from_where_names_are_imported():
    (block,) = (one for one in ast.parse(inspect.getsource(mb)).body if isinstance(one, ast.If))
    declared = {
        alias.asname or alias.name: f"{node.module}:{alias.name}".removeprefix("muscle_bayes.")
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert {**declared, "load": mb._HOME["load"]} == mb._HOME
    assert {*mb._HOME, "__version__"} == set(mb.__all__)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="fitt"):
        _ = mb.fitt  # type: ignore[attr-defined]


def test_examples_are_found_and_others_listed():
    assert [run.name for run in mb.load_example("staircases")] == [
        f"staircase-{load}g" for load in (139, 166, 212)
    ]
    assert [run.name for run in mb.load_example("spring-3")] == ["spring-3"]
    with pytest.raises(mb.MuscleBayesError, match=r"no example 'spring'.*springs, staircases"):
        mb.load_example("spring")


def test_a_plant_takes_the_parameters_of_run_muscle_and_effects():
    (run,) = mb.load_example("staircase-166g")
    values = TABLE_1["coulomb"] | TABLE_2 | {"bias-torque.torque": 0.01}
    plant = mb.plant_of(run, values, effects=["bias-torque"])
    assert plant.side_a.parameters.K_modulus == TABLE_2["K_modulus"]
    assert [effect.name for effect in plant.effects] == ["bias-torque"]
    with pytest.raises(mb.MuscleBayesError, match=r"staircase-166g: no value for H, T_hyst_offset"):
        mb.plant_of(
            run, {name: values[name] for name in values if name not in ("H", "T_hyst_offset")}
        )


def test_an_unknown_friction_is_told():
    runs = mb.load_example("spring-1")
    told = r"friction 'dry' is not known\. Fix: use coulomb or linear\."
    with pytest.raises(mb.MuscleBayesError, match=told):
        mb.fit(runs, "dry", progress=False)
    with pytest.raises(mb.MuscleBayesError, match=told):
        mb.plant_of(runs[0], TABLE_1["coulomb"], "dry")


@pytest.mark.parametrize("runs", ["x.csv", Path("x.csv"), ["x.csv"]])
def test_paths_are_read_before_they_are_fitted(runs):
    for function in (mb.fit, mb.discover, mb.calibration_model):
        with pytest.raises(mb.MuscleBayesError, match=r"read first\. Fix: .*mb\.read_runs\(\["):
            function(runs)


def _springs(**options):
    return mb.fit(mb.load_example("springs"), progress=False, **options)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: mb.fit(None), "runs must be read first"),
        (lambda: mb.fit([]), r"no runs were given\. Fix"),
        (lambda: mb.discover([]), r"no runs were given\. Fix"),
        (lambda: mb.fit(*mb.load_example("spring-1")), r"not spring-1 alone\. Fix: give \[run\]"),
        (lambda: mb.plot_run(mb.load_example("spring-1")), "runs must be read first"),
        (lambda: mb.plant_of("run.csv", {}), "runs must be read first"),
        (lambda: _springs(effects="backlash"), r"not 'backlash'\. Fix: give \['backlash'\]"),
        (lambda: _springs(effects=Backlash), r"not Backlash\. Fix: give \[Backlash\]"),
        (lambda: _springs(effects=[Posterior]), "Posterior'> is no effect"),
        (lambda: _springs(priors=["J"]), r"priors must be a dictionary, not \['J'\]"),
        (lambda: _springs(priors={"J": dist.Poisson(1.0)}), "prior of 'J' is discrete"),
        (lambda: _springs(given="fixture.nc"), r"not 'fixture\.nc'\. Fix: load one"),
        (lambda: _springs(effort=3), "no effort 3"),
        (lambda: mb.identify("muscle.nc"), r"posterior must be a Posterior, not 'muscle\.nc'"),
        (lambda: mb.predict("muscle.nc", []), "posterior must be a Posterior"),
        (lambda: mb.compare("dry.nc", "wet.nc"), r"first must be a Posterior, not 'dry\.nc'"),
        (lambda: mb.check([]), r"prediction must be a Prediction, not list\. Fix: give one"),
        (lambda: mb.drift([]), "prediction must be a Prediction"),
        (lambda: mb.tune("muscle.nc"), "muscle must be a Posterior"),
    ],
)
def test_what_is_no_such_thing_is_told(call, told):
    with pytest.raises(mb.MuscleBayesError, match=told):
        call()


def test_a_model_takes_effects_as_classes():
    runs = mb.load_example("spring-1")
    named, classes = (mb.calibration_model(runs, effects=[one]) for one in ("backlash", Backlash))
    assert str(named) == str(classes)
    assert "backlash." in str(classes)
    assert "backlash" not in own_effects()


def test_one_path_is_one_run():
    path = mb.load_example("spring-1")[0].path
    for one in (path, str(path)):
        assert [run.name for run in mb.read_runs(one)] == ["spring-1"]


@pytest.fixture(scope="module")
def little() -> pytest.MonkeyPatch:
    """Fits sample little, and each set of runs once."""
    patch = pytest.MonkeyPatch()
    whole, kept = fitting.fit, {}

    def fit(runs, friction="coulomb", effects=(), **options):
        key = (*(run.name for run in runs), friction, *effects)
        if key not in kept:
            kept[key] = whole(runs, friction, effects, **options | {"effort": LITTLE})
        return kept[key]

    patch.setattr(fitting, "fit", fit)
    yield patch
    patch.undo()


@pytest.fixture(scope="module")
def posterior(little) -> Posterior:
    return mb.fit(mb.load_example("springs"), progress=False)


@pytest.fixture(scope="module")
def muscle() -> Posterior:
    """Draws that scatter about published values."""
    generator = np.random.default_rng(0)
    published = TABLE_1["coulomb"] | TABLE_2
    draws = {
        name: (("chain", "draw"), value * (1 + 0.03 * generator.standard_normal((2, 20))))
        for name, value in published.items()
    }
    prior = {
        name: (("chain", "draw"), value * (1 + 0.2 * generator.standard_normal((1, 400))))
        for name, value in TABLE_2.items()
    }
    tree = xr.DataTree.from_dict({"posterior": xr.Dataset(draws), "prior": xr.Dataset(prior)})
    tree.attrs = {
        "friction": "coulomb",
        "effects": "[]",
        "parameters": json.dumps(list(published)),
        "converged": 1,
        "complaints": "[]",
        "base_length": 0.1,
        "tension": 5.0,
    }
    return Posterior(tree)


def test_arviz_takes_a_posterior(posterior, tmp_path):
    mpl.use("Agg")
    posterior.save(tmp_path / "p.nc")
    tree = mb.load(tmp_path / "p.nc").tree
    names = list(posterior.parameters)
    az.plot_trace(tree, var_names=names)
    az.plot_autocorr(tree, var_names=names)
    az.plot_forest(tree, var_names=names)
    assert list(az.summary(tree, var_names=names).index) == names
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Estimated shape parameter of Pareto")
        assert az.loo(tree, var_name="spring-1").n_data_points > 100
    for group in ("posterior", "prior", "sample_stats", "posterior_predictive", "log_likelihood"):
        assert {"chain", "draw"} <= set(tree[group].coords)


def test_a_posterior_shows_three_digits_and_units(posterior):
    for shown in (repr(posterior), posterior._repr_html_()):
        assert "kg m^2" in shown
        assert "N m" in shown
        table = re.sub(r"<[^>]+>", " ", shown).rpartition("R-hat")[2]
        numbers = [one.partition("e")[0] for one in re.findall(r"(?<!\^)[\d.]+(?:e-\d+)?", table)]
        assert len(numbers) == 6 * len(posterior.parameters)
        assert all(len(one.replace(".", "").strip("0")) <= 3 for one in numbers)


@pytest.mark.parametrize(
    ("value", "shown"),
    [(1234.5, "1230"), (0.0012, "0.00120"), (2.7e-6, "2.7e-06"), (-0.9999, "-1.00"), (0.0, "0")],
)
def test_three_digits(value, shown):
    assert three_digits(value) == shown


def test_progress_is_shown_as_lines_where_there_is_no_terminal(monkeypatch):
    out = io.StringIO()
    monkeypatch.setattr(sys, "stderr", out)
    with shown_progress() as report:
        for stage, total in (("searching", 3), ("sampling", 100), ("predicting", 1)):
            for done in range(total + 1):
                report(stage, done, total)
    with shown_progress(False) as report:
        report("nothing", 1, 1)
    assert out.getvalue().splitlines() == [
        "searching (starts): 0 of 3",
        "searching (starts): 3 of 3, 0 s",
        "sampling (draws of each chain): 0 of 100",
        "sampling (draws of each chain): 100 of 100, 0 s",
        "predicting: 0 of 1",
        "predicting: 1 of 1, 0 s",
    ]


def test_a_fit_shows_its_progress(monkeypatch):
    out = io.StringIO()
    monkeypatch.setattr(sys, "stderr", out)
    monkeypatch.setattr(
        fitting, "fit", lambda *a, report, **k: (report("sampling", 50, 100), k["effort"])[1]
    )
    assert mb.fit([], effort="quick") is fitting.QUICK
    assert "sampling (draws of each chain): 50 of 100" in out.getvalue()


def test_an_unknown_effort_is_told():
    with pytest.raises(mb.MuscleBayesError, match=r"no effort 'fast'.*quick, full"):
        mb.fit([], effort="fast")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_docstring_states_arguments_returns_and_an_example(name):
    told = inspect.getdoc(getattr(mb, name)) or ""
    assert "Returns:" in told or "**Returns:**" in told
    assert name.startswith("plot_") or ">>> " in told
    for argument in inspect.signature(getattr(mb, name)).parameters:
        assert f"{argument}:" in told or f"`{argument}`" in told or f"{argument}, " in told


@pytest.mark.parametrize("name", [*COMPUTED, "Posterior"])
@pytest.mark.timeout(1200)
def test_the_example_of_a_docstring_runs(name, little, muscle, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    muscle.save(tmp_path / "muscle.nc")
    example = doctest.DocTestParser().get_doctest(
        inspect.getdoc(getattr(mb, name)) or "", {}, name, None, 0
    )
    assert example.examples
    out = io.StringIO()
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    found = doctest.DocTestRunner(optionflags=flags).run(example, out=out.write)
    assert not found.failed, out.getvalue()
