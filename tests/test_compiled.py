"""Where compiled code is kept."""

import os
from pathlib import Path

from muscle_bayes.compiled import keep_compiled_code

NAME = "JAX_COMPILATION_CACHE_DIR"


def test_it_is_kept_in_the_users_cache(monkeypatch, tmp_path):
    variables = {"XDG_CACHE_HOME": str(tmp_path)}
    monkeypatch.setattr(os, "environ", variables)
    assert keep_compiled_code() == tmp_path / "muscle-bayes"
    assert variables[NAME] == str(tmp_path / "muscle-bayes")
    assert variables["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] == "0"


def test_the_users_own_settings_come_first(monkeypatch):
    monkeypatch.setattr(os, "environ", {NAME: "/elsewhere"})
    assert keep_compiled_code() == Path("/elsewhere")
