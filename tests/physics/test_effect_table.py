"""The documentation's table of effects is what the effects say of themselves."""

import runpy
from pathlib import Path

from muscle_bayes.physics.effects import CATALOGUE

PROJECT = Path(__file__).parents[2]
SCRIPT = runpy.run_path(str(PROJECT / "scripts" / "write_effect_table.py"))


def test_the_table_in_the_docs_is_up_to_date():
    text = SCRIPT["DOCUMENT"].read_text(encoding="utf-8")
    assert SCRIPT["document"](text) == text, "run `make effect-table`"


def test_every_effect_has_a_line_with_a_source():
    lines = SCRIPT["table"]().splitlines()[2:]
    assert len(lines) == len(CATALOGUE)
    for line in lines:
        cells = line.replace("\\|", "").split(" | ")
        assert len(cells) == 5
        assert all(cell.strip("| ") for cell in cells), line
