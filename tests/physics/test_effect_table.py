"""The documentation's page of effects is what the effects say of themselves."""

import runpy
from pathlib import Path

from muscle_bayes.physics.effects import CATALOGUE
from muscle_bayes.report.effect_text import catalogue

PROJECT = Path(__file__).parents[2]
SCRIPT = runpy.run_path(str(PROJECT / "scripts" / "write_effect_table.py"))


def test_the_page_is_up_to_date_and_has_every_effect():
    text = SCRIPT["page"]()
    assert SCRIPT["PAGE"].read_text(encoding="utf-8") == text, "run `make effect-table`"
    assert text.count("### `") == len(CATALOGUE)


def test_every_effect_says_what_it_does_and_where_it_comes_from():
    for one in catalogue():
        assert all((one.what, one.equation, one.symbols, one.source, one.parameters)), one.name
