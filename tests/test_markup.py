"""Tables for notebooks."""

from xml.etree import ElementTree

from muscle_bayes.markup import html_table


def test_a_table_is_whole_and_its_texts_are_escaped():
    table = ElementTree.fromstring(html_table(("a<b", "c"), [("1 & 2", "<i>"), ("x", "y")]))
    assert [cell.text for cell in table.iter("th")] == ["a<b", "c"]
    assert [cell.text for cell in table.iter("td")] == ["1 & 2", "<i>", "x", "y"]
