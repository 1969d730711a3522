"""Write the table of effects in docs/model.md: from what each effect says of itself."""

from pathlib import Path

from muscle_bayes.report.effect_text import EffectText, catalogue

DOCUMENT = Path(__file__).parents[1] / "docs" / "model.md"
BEGIN, END = "<!-- effects: begin -->\n", "<!-- effects: end -->\n"


def row(one: EffectText) -> str:
    """One effect's line."""
    parameters = ", ".join(f"{name} [{unit}]" for name, unit, _ in one.parameters)
    equation = one.equation.replace("|", "\\|")
    return f"| `{one.name}` | {one.port} | {one.what}: {equation} | {parameters} | {one.source} |"


def table() -> str:
    """The Markdown between the two marks."""
    head = "| effect | port | what it does | parameters | source |\n|---|---|---|---|---|\n"
    return head + "".join(f"{row(one)}\n" for one in catalogue())


def document(text: str) -> str:
    """The document's text with the table written anew."""
    head, rest = text.split(BEGIN)
    return head + BEGIN + table() + END + rest.split(END)[1]


if __name__ == "__main__":
    DOCUMENT.write_text(document(DOCUMENT.read_text()))
