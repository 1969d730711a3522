"""STUDY.toml: what it says is understood, and what is wrong is told with file, key and mend."""

import pytest

from muscle_bayes.data import RunError
from muscle_bayes.study.config import read_config
from muscle_bayes.study.published import TABLE_1, TABLE_2, middles, published_by, values_of


def config(folder, text):
    path = folder / "study.toml"
    path.write_text(text)
    return read_config(path)


def test_an_empty_file_leaves_everything_to_protocols_and_rigs(tmp_path):
    found = config(tmp_path, "")
    assert found.fixture is None
    assert found.control is None
    assert published_by(found) == ()


def test_the_thesis_tables_are_asked_for_by_name(tmp_path):
    tables = published_by(config(tmp_path, "thesis = true"))
    assert middles(values_of(tables, "coulomb", "muscle")) == TABLE_1["coulomb"] | TABLE_2
    assert middles(values_of(tables, "linear")) == TABLE_1["linear"]


def test_published_values_are_numbers_or_ranges(tmp_path):
    text = """
    [[published]]
    name = "Table A"
    source = "them"
    of = "coulomb"
    values = { J = 1, D = [0.5, 0.7] }
    """
    (table,) = published_by(config(tmp_path, text))
    assert table.values == {"J": (1.0,), "D": (0.5, 0.7)}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("fixtures = ['a']", r"key fixtures: unknown key\. Fix: .*did you mean 'fixture'"),
        ("friction = 'dry'", r"key friction: 'dry' is not known\. Fix: use one of coulomb, linear"),
        ("seed = -1", r"key seed: -1: "),
        ("until = { a = 'late' }", r"key until"),
        ("[[published]]\nname = 'A'", r"key published.*missing\. Fix: add"),
        (
            "[[published]]\nname='A'\nsource='B'\nof='muscle'\nvalues={J=[2.0, 1.0]}",
            r"values\.J: \[2\.0, 1\.0\] is neither .* Fix: give a number",
        ),
        ("muscle = [", r"not valid TOML"),
    ],
)  # fmt: skip
def test_what_is_wrong_names_file_key_and_mend(tmp_path, text, told):
    with pytest.raises(RunError, match=told) as caught:
        config(tmp_path, text)
    assert str(tmp_path / "study.toml") in str(caught.value)
    assert "Fix: " in str(caught.value)
