"""Checksums tell what a result was made from."""

from pathlib import Path

import pytest

from muscle_bayes import provenance
from muscle_bayes.provenance import code_checksum, fingerprint, modules_of, source_checksum


def test_fingerprint_does_not_depend_on_order() -> None:
    assert fingerprint({"a": 1, "b": 2}) == fingerprint({"b": 2, "a": 1})
    assert fingerprint({"a": 1}) != fingerprint({"a": 2})


def test_a_file_is_a_layer_as_a_folder_is() -> None:
    assert source_checksum("report/tables.py") != source_checksum("report/style.py")
    assert source_checksum("report") != source_checksum("report/style.py")


def test_code_is_followed_through_imports_and_reads_no_comments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "muscle_bayes"
    (package / "layer").mkdir(parents=True)
    files = {
        "__init__.py": "",
        "layer/__init__.py": '"""A layer."""\n',
        "layer/asked.py": "from muscle_bayes.layer import used\n\nresult = used.value\n",
        "layer/used.py": "import numpy\n\nvalue = 1\n",
        "layer/unused.py": "value = 2\n",
    }
    for name, text in files.items():
        (package / name).write_text(text)
    monkeypatch.setattr(provenance, "PACKAGE", package)

    def changed(name: str, text: str) -> bool:
        before = code_checksum("muscle_bayes.layer.asked")
        (package / name).write_text(text)
        after = code_checksum("muscle_bayes.layer.asked")
        (package / name).write_text(files[name])
        return before != after

    assert changed("layer/asked.py", files["layer/asked.py"] + "result += 1\n")
    assert changed("layer/used.py", "import numpy\n\nvalue = 3\n")
    assert changed("layer/__init__.py", "from muscle_bayes.layer import unused\n")
    assert not changed("layer/unused.py", "value = 4\n")
    assert not changed(
        "layer/used.py", '"""Used."""\nimport numpy\n\nvalue = 1  # one\n"""One."""\n'
    )


def test_what_discovery_finds_does_not_depend_on_the_sampler() -> None:
    names = modules_of("muscle_bayes.discovery.discover")
    assert "muscle_bayes.physics.effects.muscle.slack" in names
    assert "muscle_bayes.inference.sampling.sampler" not in names
