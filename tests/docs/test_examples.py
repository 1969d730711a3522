"""What the pages show can be run: Python blocks, commands with their options, targets of make, links."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from collections import Counter

import pytest
import typer
from pages import DOCS, GUIDES, PAGES, PROJECT, README, blocks, command_lines, mentions

from muscle_bayes.cli import app
from muscle_bayes.data.describing.metadata import Metadata
from muscle_bayes.data.validation import _models

COMMANDS = typer.main.get_command(app).commands  # type: ignore[attr-defined]
LITTLE = """
import muscle_bayes.inference.sampling.fit as module
from muscle_bayes.inference.sampling.sampler import Effort

_fit = module.fit
module.fit = lambda *a, **k: _fit(*a, **k | {"effort": Effort(2, 60, 60, 1, 1)})
"""
"""Runs before the examples, so that they sample little."""


def test_python_of_readme_and_guides_runs():
    shown = [block for path in (*GUIDES, README) for block in blocks(path, "python")]
    assert len(shown) >= 3
    first = "from muscle_bayes.compiled import keep_compiled_code\nkeep_compiled_code()\n"
    told = subprocess.run(
        [sys.executable, "-c", "\n".join([first, LITTLE, *shown])],
        cwd=PROJECT,
        env=os.environ | {"PYTHONPATH": str(PROJECT / "src")},
        capture_output=True,
        text=True,
    )
    assert told.returncode == 0, told.stderr


@pytest.mark.parametrize("path", sorted(DOCS.glob("*.md")), ids=lambda path: path.stem)
def test_python_of_other_pages_imports_what_exists(path):
    for block in blocks(path, "python"):
        for node in ast.parse(block).body:
            if isinstance(node, ast.Import | ast.ImportFrom):
                exec(compile(ast.Module([node], []), path.name, "exec"), {})


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_commands_shown_are_taken(path):
    for name, *arguments in command_lines(path, "muscle-bayes"):
        if name == "--version":
            continue
        assert name in COMMANDS, f"{path.name}: muscle-bayes {name}"
        COMMANDS[name].make_context(name, list(arguments))  # raises on options that are none
    for name, *arguments in mentions(path, "muscle-bayes"):
        if name.startswith("-") or name in ("X", "COMMAND"):
            continue
        assert name in COMMANDS, f"{path.name}: muscle-bayes {name}"
        known = {flag for option in COMMANDS[name].params for flag in option.opts}
        assert {word for word in arguments if word.startswith("--")} <= known, (
            f"{path.name}: {name}"
        )


def test_an_option_that_does_not_exist_is_noticed():
    with pytest.raises(Exception, match="No such option"):
        COMMANDS["fit"].make_context("fit", ["RUN", "--out", "a.nc", "--no-such-option"])


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_targets_of_make_exist(path):
    known = set(re.findall(r"^([a-z-]+):", (PROJECT / "Makefile").read_text(), re.MULTILINE))
    for words in (*command_lines(path, "make"), *mentions(path, "make")):
        if "-C" not in words and "--directory" not in words:
            assert {word for word in words if re.fullmatch(r"[a-z-]+", word)} <= known, path.name


@pytest.mark.parametrize("path", [README, DOCS / "index.md", *GUIDES], ids=lambda path: path.name)
def test_files_that_are_linked_exist(path):
    text = path.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text):
        # Some pages are written while the site is built.
        written = target in ("commands.md", "api/index.md") or target.endswith(".ipynb")
        if not target.startswith("http") and not written:
            assert (path.parent / target).exists(), f"{path.name}: {target}"


def test_metadata_shown_is_taken():
    shown = blocks(DOCS / "run-format.md", "toml")
    assert len(shown) == 4
    for block in shown:
        Metadata.model_validate(tomllib.loads(block))


def test_readme_fits_a_screen_and_names_how_to_test():
    lines = README.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 75
    assert command_lines(README, "make") == [["study", "PRESET=quick"], ["test"]]


def test_every_key_of_the_run_format_is_explained():
    told = re.findall(r"^\| (`[^|]*) \|", (DOCS / "run-format.md").read_text(), re.MULTILINE)
    shown = Counter(re.findall(r"`(\w+)`", " ".join(told)))
    for model in _tables(Metadata):
        for key, field in model.model_fields.items():
            if not list(_models(field.annotation)) and key != "kind" and not key.endswith("_b"):
                assert shown[key] >= 1, f"{model.__name__}.{key}"


def _tables(model):
    yield model
    for field in model.model_fields.values():
        for inner in _models(field.annotation):
            yield from _tables(inner)
