"""Checksums tell what a result was made from."""

from muscle_bayes.provenance import fingerprint, source_checksum


def test_fingerprint_does_not_depend_on_order() -> None:
    assert fingerprint({"a": 1, "b": 2}) == fingerprint({"b": 2, "a": 1})
    assert fingerprint({"a": 1}) != fingerprint({"a": 2})


def test_a_file_is_a_layer_as_a_folder_is() -> None:
    assert source_checksum("report/style.py") != source_checksum("report/bands.py")
    assert source_checksum("report") != source_checksum("report/style.py")
