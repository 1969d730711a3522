"""What a result was made from, as checksums."""

import ast
import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

LIBRARIES = ("muscle-bayes", "jax", "numpyro", "diffrax", "arviz", "numpy")
"""Packages whose versions a posterior depends on."""
PACKAGE = Path(__file__).parent


def fingerprint(inputs: Mapping[str, Any]) -> str:
    """SHA-256 of what a result depends on: checksums of runs, settings, versions, earlier results."""
    text = json.dumps(inputs, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def source_checksum(*layers: str) -> str:
    """SHA-256 over the source of these layers, so that what changed code made is made again.

    A layer is a folder of the package, or a file in one.
    """
    digest = hashlib.sha256()
    for layer in layers:
        place = PACKAGE / layer
        for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def code_checksum(module: str) -> str:
    """SHA-256 over the code of `modules_of(module)`; comments, docstrings and layout do not count."""
    return fingerprint(
        {name: ast.dump(_without_docstrings(tree)) for name, tree in modules_of(module).items()}
    )


def modules_of(module: str) -> dict[str, ast.Module]:
    """Syntax trees of a module of this package and of all that it imports of it, at any depth.

    What is imported by a computed name is not seen.
    """
    trees: dict[str, ast.Module] = {}
    left = [module]
    while left:
        name = left.pop()
        path = _file(name)
        if name in trees or path is None:
            continue
        trees[name] = tree = ast.parse(path.read_bytes())
        # Importing a module runs the packages that hold it.
        left += [*_imported(tree), name.rpartition(".")[0]]
    return trees


def _file(name: str) -> Path | None:
    """Source of a module of this package; None for other names."""
    first, *rest = name.split(".")
    if first != PACKAGE.name:
        return None
    place = PACKAGE.joinpath(*rest)
    return next((p for p in (place / "__init__.py", place.with_suffix(".py")) if p.is_file()), None)


def _imported(tree: ast.Module) -> Iterator[str]:
    """Names that may be modules; what is imported for type checkers alone does not run."""
    for node in _running(tree):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{one.name}" for one in node.names)


def _running(tree: ast.AST) -> Iterator[ast.AST]:
    """Nodes of a syntax tree outside `if TYPE_CHECKING`."""
    yield tree
    for node in ast.iter_child_nodes(tree):
        if not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            yield from _running(node)


def _without_docstrings(tree: ast.Module) -> ast.Module:
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            # A string that nothing is done with: of a module, class, function or attribute.
            node.body = [one for one in body if not _is_text(one)]  # type: ignore[attr-defined]
    return tree


def _is_text(node: ast.stmt) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )
