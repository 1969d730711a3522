"""Write the table of effects in docs/model.md: from what each effect says of itself."""

import inspect
import re
import sys
from pathlib import Path

from muscle_bayes.physics.effects import CATALOGUE, AnyEffectType

DOCUMENT = Path(__file__).parents[1] / "docs" / "model.md"
BEGIN, END = "<!-- effects: begin -->\n", "<!-- effects: end -->\n"


def row(name: str, effect: AnyEffectType) -> str:
    """One effect's line."""
    what = (sys.modules[effect.__module__].__doc__ or "").strip().rstrip(".")
    equation, _, rest = (inspect.getdoc(effect) or "").partition("\n\n")
    source = re.sub(r"\s+", " ", rest.partition("Source: ")[2]).strip().rstrip(".")
    parameters = ", ".join(f"{key} [{one.unit}]" for key, one in effect.parameters.items())
    equation = re.sub(r"\s+", " ", equation).replace("|", "\\|")
    return f"| `{name}` | {effect.port} | {what}: {equation} | {parameters} | {source} |"


def table() -> str:
    """The Markdown between the two marks."""
    head = "| effect | port | what it does | parameters | source |\n|---|---|---|---|---|\n"
    return head + "".join(f"{row(name, CATALOGUE[name])}\n" for name in sorted(CATALOGUE))


def document(text: str) -> str:
    """The document's text with the table written anew."""
    head, rest = text.split(BEGIN)
    return head + BEGIN + table() + END + rest.split(END)[1]


if __name__ == "__main__":
    DOCUMENT.write_text(document(DOCUMENT.read_text()))
