"""Importing the package is quick and changes nothing for anybody else."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src"
HEAVY = (
    "arviz",
    "jax",
    "matplotlib",
    "numpyro",
    "pandas",
    "scipy",
    "serial",
    "xarray",
    "distributed",
)

EVERYTHING = """
import json, logging, os, pkgutil, sys, warnings
import jax, matplotlib, numpy

def state():
    return [jax.config.values["jax_enable_x64"], dict(matplotlib.rcParams), dict(os.environ),
            list(warnings.filters), logging.getLogger().level, len(logging.getLogger().handlers),
            numpy.geterr(), numpy.get_printoptions()]

import arviz, control, diffrax, distributed, numpyro, equinox, pandas, pydantic, serial, threadpoolctl
import typer, rich
before = state()
import muscle_bayes
names = [one.name for one in pkgutil.walk_packages(muscle_bayes.__path__, "muscle_bayes.")]
for name in names:
    __import__(name)
print(json.dumps([len(names), state() == before]))
"""


def run(code: str) -> str:
    told = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": str(SOURCE)},
        capture_output=True,
        text=True,
    )
    assert told.returncode == 0, told.stderr
    return told.stdout


@pytest.mark.parametrize("name", ["muscle_bayes", "muscle_bayes.cli", "muscle_bayes.compiled"])
def test_nothing_heavy_is_imported(name):
    code = f"import json, sys, {name}; print(json.dumps(sorted(sys.modules)))"
    loaded = set(json.loads(run(code)))
    assert name in loaded
    assert not loaded & set(HEAVY)
    assert "numpy" not in loaded or name == "muscle_bayes.cli"


def test_importing_everything_has_no_side_effects():
    count, unchanged = json.loads(run(EVERYTHING))
    assert count > 200
    assert unchanged
