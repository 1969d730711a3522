"""Directions of import that import-linter cannot express: it knows no part of other packages."""

import ast
from pathlib import Path

import pytest

import muscle_bayes.physics

FILES = sorted(Path(muscle_bayes.physics.__file__).parent.rglob("*.py"))


def imported(tree: ast.AST):
    """Dotted names that a module imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        if isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_physics_takes_distributions_from_numpyro_and_no_sampler(file):
    names = set(imported(ast.parse(file.read_text())))
    taken = {name for name in names if name.split(".")[0] == "numpyro"}
    # `from numpyro import distributions` names both.
    taken -= {"numpyro"}
    assert all(name.startswith("numpyro.distributions") for name in taken), taken
