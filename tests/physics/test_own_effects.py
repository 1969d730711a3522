"""Effects that a user writes without touching this package."""

import sys
from pathlib import Path

import jax.numpy as jnp
import pytest

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.physics.effect import Signals
from muscle_bayes.physics.effects import CATALOGUE, effect_type
from muscle_bayes.physics.effects.own import FILES

DOCUMENT = Path(__file__).parents[2] / "docs" / "architecture.md"
CODE = DOCUMENT.read_text().split("```python\n")[1].split("```")[0]
"""The example that the documentation gives."""


@pytest.fixture
def file(tmp_path, monkeypatch):
    path = tmp_path / "cable.py"
    path.write_text(CODE)
    monkeypatch.setenv(FILES, str(path))
    return path


def test_a_file_that_is_named_makes_its_effect_known(file):
    found = effect_type("cable-stretch")
    assert found is effect_type("cable-stretch")
    assert found.off().compliance == 0.0
    seen = Signals(*[jnp.asarray(0.2)] * (len(Signals._fields) - 1), memory={})
    assert float(found(jnp.asarray(0.5))(jnp.asarray(1.0), seen)) == pytest.approx(1.1)
    assert "cable-stretch" not in CATALOGUE
    assert not found.__module__.startswith("muscle_bayes.")
    with pytest.raises(MuscleBayesError, match=r"'magic' is not in .*Fix: .* cable-stretch, "):
        effect_type("magic")


def test_without_the_file_the_effect_is_unknown_and_the_way_is_told():
    with pytest.raises(MuscleBayesError, match=f"'cable-stretch' is not in .*{FILES}"):
        effect_type("cable-stretch")


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("x = 1", "holds no effect"),
        ("1 / 0", "cannot be imported: ZeroDivisionError"),
        (None, "cannot be imported: FileNotFoundError"),
    ],
)
def test_a_file_that_will_not_do_is_told(tmp_path, monkeypatch, code, told):
    path = tmp_path / "wrong.py"
    if code is not None:
        path.write_text(code)
    monkeypatch.setenv(FILES, str(path))
    with pytest.raises(MuscleBayesError, match=f"wrong.py {told}.*Fix"):
        effect_type("cable-stretch")


def test_an_installed_package_brings_its_effects_by_entry_point(tmp_path, monkeypatch):
    from muscle_bayes.physics.effects import own

    (tmp_path / "cable_package.py").write_text(CODE)
    about = tmp_path / "cable_package-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: cable-package\nVersion: 1.0\n")
    entry = "[muscle_bayes.effects]\ncable-stretch = cable_package:CableStretch\n"
    (about / "entry_points.txt").write_text(entry)
    monkeypatch.syspath_prepend(tmp_path)
    own._installed.cache_clear()
    try:
        assert float(effect_type("cable-stretch")(jnp.asarray(0.2)).compliance) == pytest.approx(
            0.2
        )
    finally:
        own._installed.cache_clear()
        sys.modules.pop("cable_package", None)


def test_one_that_has_a_name_of_the_catalogue_is_refused(file):
    file.write_text(CODE.replace('"cable-stretch"', '"cogging"'))
    with pytest.raises(MuscleBayesError, match=r"'cogging'.*of the catalogue\. Fix"):
        effect_type("cogging")
    assert effect_type("bias-torque") is CATALOGUE["bias-torque"]
