"""Where compiled code is kept."""

import os
from pathlib import Path

import jax
import pytest

from muscle_bayes.compiled import forget_much_compiled_code, keep_compiled_code

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


def test_code_is_forgotten_where_it_takes_too_many_pieces_of_memory(monkeypatch):
    if not Path("/proc/self/maps").exists():
        pytest.skip("only Linux says how many pieces a process maps")
    cleared: list[bool] = []
    monkeypatch.setattr(jax, "clear_caches", lambda: cleared.append(True))
    forget_much_compiled_code(10**9)
    assert not cleared
    forget_much_compiled_code(1)
    assert cleared
