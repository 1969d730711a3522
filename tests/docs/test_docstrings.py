"""Docstrings, which are plain text with code marks, come out of the reference as they were meant."""

import sys

import pytest
from pages import DOCS

sys.path.insert(0, str(DOCS))
from reference import as_restructured_text


@pytest.mark.parametrize(
    ("written", "wanted"),
    [
        (["`x` is |y|, a*b, c_"], ["``x`` is \\|y\\|, a\\*b, c\\_"]),
        (
            ["Says", "", "    F = a * b", "", "and on"],
            ["Says", "", "::", "", "    F = a * b", "", "and on"],
        ),
        (["- one", "  goes on", "- two"], ["- one", "  goes on", "- two"]),
        (
            ["Args:", "    n_a: one", "        more", "", "Returns:", "    A b", "    c."],
            ["Args:", "", "- ``n_a``: one more", "", "Returns:", "", "A b c."],
        ),
        (["Example:", "    >>> a_b"], ["Example:", "", "::", "", "    >>> a_b"]),
        (["Alias for field number 3"], []),
    ],
)
def test_docstring(written, wanted):
    lines = list(written)
    as_restructured_text(None, "module", "m", None, {}, lines)
    assert lines == wanted
