"""Pages that are written from the code: the API by layers, and the commands."""

import inspect
import pkgutil
import re
from importlib import import_module
from pathlib import Path
from textwrap import dedent

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml

import muscle_bayes

PACKAGES = (
    "data",
    "physics",
    "inference",
    "criticism",
    "discovery",
    "control",
    "report",
    "study",
    "twin",
    "bench",
    "parallel",
)
"""Layers with an API that is called; the command line has a page of its own."""


SECTIONS = ("Args:", "Returns:", "Yields:", "Raises:", "Example:")
"""Of a public function's docstring."""


def write_api_pages(folder: Path) -> None:
    """A page a layer that documents every module of it, and an index."""
    folder.mkdir(exist_ok=True)
    lines = [
        "# API reference",
        "",
        "From the docstrings, layer by layer ([architecture](../architecture.md)).",
        "",
    ]
    for name in PACKAGES:
        package = import_module(f"muscle_bayes.{name}")
        modules = [package.__name__] + [
            one.name for one in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
        ]
        page = [f"# muscle_bayes.{name}", ""]
        for module in modules:
            page += [f"## {module.removeprefix('muscle_bayes.')}", "", "```{eval-rst}"]
            page += [f".. automodule:: {module}", "```", ""]
        _write(folder / f"{name}.md", page)
    tree = ["```{toctree}", *PACKAGES, "other", "```", ""]
    _write(folder / "index.md", lines + tree)
    other = ["# Others", ""]
    for one in pkgutil.iter_modules(muscle_bayes.__path__, "muscle_bayes."):
        if not one.ispkg:
            other += [f"## {one.name.removeprefix('muscle_bayes.')}", "", "```{eval-rst}"]
            other += [f".. automodule:: {one.name}", "```", ""]
    _write(folder / "other.md", other)


def write_command_page(path: Path) -> None:
    """All commands with their options, as typer tells them."""
    import typer
    from typer.cli import get_docs_for_click

    from muscle_bayes.cli import app

    command = typer.main.get_command(app)
    context = typer.Context(command, info_name="muscle-bayes")
    text = get_docs_for_click(obj=command, ctx=context, name="muscle-bayes", title="Commands")
    text = re.sub(
        r"Examples:\n((?: +muscle-bayes .*\n)+)",
        lambda shown: f"Examples:\n\n```sh\n{dedent(shown[1])}```\n",
        text,
    )
    _write(path, [text.replace("\\[", "[")])


def inline_mathml(translator, node) -> None:
    """An equation inside a line, as MathML: browsers set it without a script."""
    translator.body.append(tex2mathml(node.astext(), as_block=False))
    raise SkipNode


def block_mathml(translator, node) -> None:
    """An equation of its own."""
    translator.body.append(
        f'<div style="margin: 1em 0">{tex2mathml(node.astext(), as_block=True)}</div>'
    )
    raise SkipNode


def _write(path: Path, lines: list[str]) -> None:
    """Write only what has changed, so that Sphinx need not read the rest again."""
    text = "\n".join(lines)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def not_ours(app, what, name, obj, skip, options) -> bool | None:
    """Leave out functions and classes that a module only imports from another package."""
    callable_ = inspect.isroutine(obj) or inspect.isclass(obj)
    module = getattr(obj, "__module__", None) or ""
    return (
        True if callable_ and what == "module" and not module.startswith("muscle_bayes") else None
    )


def as_restructured_text(app, what, name, obj, options, lines: list[str]) -> None:
    """Turn a docstring's lines into reStructuredText, in place.

    Indented lines after a blank one are equations and stay as they are; `code` is marked as such; other
    signs that would be markup are escaped. Arguments and errors become lists, examples stay as they are.
    """
    if lines and lines[0].startswith("Alias for field number"):
        lines[:] = []
    lines[:] = _sections_listed(lines)
    result: list[str] = []
    literal = False
    for line in lines:
        indented = line.startswith((" ", "\t"))
        if literal and line.strip() and not indented:
            literal = False
            if result[-1].strip():
                result.append("")
        begins = indented and not literal and (not result or not result[-1].strip())
        if begins and line.strip():
            literal = True
            result += ["::", ""]
        result.append(line if literal else _escaped(line))
    lines[:] = result


def _sections_listed(lines: list[str]) -> list[str]:
    """The lines with what stands under Args, Returns, Raises and Yields as lists and paragraphs."""
    result: list[str] = []
    section = ""
    for line in lines:
        if line in SECTIONS:
            section = line
            result += [line, ""]
            continue
        if line.strip() and not line.startswith("    "):
            section = ""
        text = line[4:]
        if section in ("", "Example:") or not line.strip():
            result.append(line)
        elif text.startswith(" ") or (section in ("Returns:", "Yields:") and result[-1]):
            result[-1] += f" {text.strip()}"
        elif section in ("Args:", "Raises:"):
            name, _, meaning = text.partition(": ")
            result.append(f"- `{name}`: {meaning}")
        else:
            result.append(text)
    return result


def _escaped(line: str) -> str:
    parts = re.split(r"`+([^`]+)`+", line)
    return "".join(
        f"``{part}``" if index % 2 else re.sub(r"([\\*|_`])", r"\\\1", part)
        for index, part in enumerate(parts)
    )
