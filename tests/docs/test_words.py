"""Pages, help and report speak plainly: short sentences, and the field's terms."""

import inspect
import re
from pathlib import Path

import jupytext
import pytest
import typer
from pages import DOCS, GUIDES, PROJECT, README

import muscle_bayes as mb
from muscle_bayes.cli import app
from muscle_bayes.report import words
from muscle_bayes.study import answers

MOST = 25
"""Words of a sentence."""
PLAIN = [README, *GUIDES, *(DOCS / f"{name}.md" for name in (
    "index", "model", "conventions", "evidence", "glossary", "api", "gallery", "effects", "bench",
    "protocol", "run-format", "architecture", "contributing", "control", "discovery", "rigs",
    "control-results", "discovery-stories", "predictive-control", "real-rigs", "bench-trials",
)), PROJECT / "data" / "README.md", *sorted((PROJECT / "notebooks").glob("*.py"))]  # fmt: skip
SECTIONS = sorted((Path(answers.__file__).parent / "document" / "sections").glob("*.typ"))
REPORT = [Path(words.__file__), Path(answers.__file__), *SECTIONS]
PUBLIC = [name for name in mb.__all__ if callable(getattr(mb, name))]
COMMANDS = typer.main.get_command(app).commands  # type: ignore[attr-defined]

PRIVATE = (
    r"told apart", r"kept apart", r"tells? apart", r"\bmend(s|ed|ing)?\b", r"\bafresh\b",
    r"\bgross\b", r"\blanes?\b", r"\buntold\b", r"\b(data|runs|readings|logs?) tell\b",
    r"\btells? (of|the (heater|fixture|muscle))\b", r"\bjolted\b", r"\bcomplaints?\b", r"\bwalled\b",
    r"\bbasins?\b", r"\bholds? for possible\b", r"\bposed?\b",
)  # fmt: skip
"""What the field has other words for (left column of the list of names)."""


def prose(text: str) -> list[str]:
    """Paragraphs and list items of Markdown, without code, tables, headings and addresses."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"^(    |\t).*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"\$\$.*?\$\$", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    lines = [line for line in text.splitlines() if not re.match(r"\s*(\||#|:{3,}|>)", line)]
    text = re.sub(r"\n\s*(-|\d+\.) ", "\n\n", "\n".join(lines))
    return [" ".join(one.split()) for one in text.split("\n\n") if one.strip()]


def prose_of(path: Path) -> list[str]:
    """Prose of a page, or of a notebook's Markdown cells."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        cells = jupytext.reads(text, fmt="py:percent").cells
        text = "\n\n".join(one.source for one in cells if one.cell_type == "markdown")
    return prose(text)


def sentences(paragraphs: list[str]) -> list[str]:
    """Sentences, ended by a point, a question or an exclamation mark before a space."""
    found = []
    for one in paragraphs:
        one = re.sub(r"\b(e\.g|i\.e|Fig|eq|vs|W)\. ", r"\1 ", one)
        found += [part for part in re.split(r"(?<=[.?!])[\"*)]*\s+", one) if part.strip()]
    return found


def too_long(paragraphs: list[str]) -> list[str]:
    return [one for one in sentences(paragraphs) if len(one.split()) > MOST]


def shown_by_report(path: Path) -> list[str]:
    """Text of a section's template, or of the sentences that Python makes."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        parts = re.findall(r'((?:\bf?"[^"\n]+"\s*)+)', text)
        return [re.sub(r'"\s*f?"|^f?"|"\s*$', "", one) for one in parts]
    text = re.sub(r"\$[^$]*\$", "x", text)
    text = re.sub(r"^\s*(//.*|#.*|\]|\[|\}.*|.*[{}]\s*|.*= cases.*)$", "", text, flags=re.MULTILINE)
    return prose(text)


def docstrings(name: str) -> list[str]:
    """Docstrings of a public name and, where it is a class, of its public members."""
    public = getattr(mb, name)
    members = vars(public).items() if inspect.isclass(public) else ()
    said = [public, *(one for key, one in members if not key.startswith("_"))]
    return [inspect.getdoc(one) or "" for one in said if one.__doc__ != type(one).__doc__]


def said_by(docstring: str) -> list[str]:
    """Paragraphs of a docstring, each argument one; equations and examples left out."""
    text = re.sub(r"^ *>>>.*?(?=\n\n|\Z)", "", docstring, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"^(Args|Returns|Raises|Yields|Example):$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^    (\w+): ", r"\n\1: ", text, flags=re.MULTILINE)
    return [" ".join(one.split()) for one in text.split("\n\n") if one.strip()]


@pytest.mark.parametrize("path", PLAIN, ids=lambda path: path.name)
def test_sentences_of_pages_are_short(path):
    assert too_long(prose_of(path)) == []


@pytest.mark.parametrize("path", REPORT, ids=lambda path: path.name)
def test_sentences_of_the_report_are_short(path):
    assert too_long(shown_by_report(path)) == []


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_sentences_of_help_are_short(name):
    told = [COMMANDS[name].help, *(one.help or "" for one in COMMANDS[name].params)]
    assert too_long(told) == []


@pytest.mark.parametrize("name", PUBLIC)
def test_sentences_of_public_docstrings_are_short(name):
    assert too_long([part for one in docstrings(name) for part in said_by(one)]) == []


@pytest.mark.parametrize("path", [*PLAIN, *REPORT], ids=lambda path: path.name)
def test_no_private_terms_in_pages_and_report(path):
    shown = " ".join(shown_by_report(path) if path in REPORT else prose_of(path))
    shown = re.sub(r"`[^`]*`|\{[^}]*\}", "", shown)  # names of the code are what they are
    assert [term for term in PRIVATE if re.search(term, shown, re.IGNORECASE)] == []


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_no_private_terms_in_help(name):
    shown = " ".join([COMMANDS[name].help, *(one.help or "" for one in COMMANDS[name].params)])
    assert [term for term in PRIVATE if re.search(term, shown, re.IGNORECASE)] == []


def test_a_long_sentence_and_a_private_term_are_noticed():
    assert too_long([" ".join(["word"] * 26) + "."]) != []
    assert too_long([" ".join(["word"] * 20) + ". " + " ".join(["word"] * 20)]) == []
    assert any(re.search(term, "what the data tell of J") for term in PRIVATE)


def test_claims_name_tests_that_exist():
    text = (DOCS / "evidence.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(tests/[\w/]+(?:\.py)?)`", text))
    assert len(named) > 30
    assert [one for one in sorted(named) if not (PROJECT / one).exists()] == []
