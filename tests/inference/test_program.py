"""A kept trace computes what the function does, and is made anew when it must be."""

import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.inference.model.problem import Layout
from muscle_bayes.inference.running import program
from muscle_bayes.inference.running.program import Program

LAYOUT = Layout("coulomb", (), ("slow",), (False,), (("D", ()),))
CALLS = []


def scaled(key, tree, layout):
    """Something of every kind: random keys, a tree, and a static layout."""
    CALLS.append(1)
    noise = jax.random.normal(key, tree["x"].shape)
    return jax.random.split(key), {"y": tree["x"] * tree["by"] + noise, "sites": len(layout.shapes)}


@pytest.fixture
def folder(tmp_path: Path):
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    CALLS.clear()
    yield tmp_path
    jax.config.update("jax_compilation_cache_dir", before)


ARGUMENTS = jax.random.key(3), {"x": jnp.arange(4.0), "by": 2.0}, LAYOUT


def check(found) -> None:
    keys, values = scaled(*ARGUMENTS)
    np.testing.assert_array_equal(jax.random.key_data(found[0]), jax.random.key_data(keys))
    np.testing.assert_allclose(found[1]["y"], values["y"], rtol=1e-6)
    assert found[1]["sites"] == 1
    CALLS.clear()


def test_a_second_process_need_not_trace(folder: Path) -> None:
    first = Program(scaled)
    check(first(*ARGUMENTS))
    check(first(*ARGUMENTS))
    # Another object stands for another process: it has compiled nothing.
    found = Program(scaled)(*ARGUMENTS)
    assert not CALLS
    check(found)
    assert len(list(folder.glob("traces/*.trace"))) == 1


def test_other_shapes_other_layouts_and_other_code_are_traced_anew(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    key, tree, layout = ARGUMENTS
    Program(scaled)(*ARGUMENTS)
    others = [
        (key, {"x": jnp.arange(5.0), "by": 2.0}, layout),
        (key, tree, Layout("linear", (), ("slow",), (False,), (("D", ()),))),
    ]
    for count, arguments in enumerate(others, 2):
        Program(scaled)(*arguments)
        assert len(list(folder.glob("traces/*.trace"))) == count
    monkeypatch.setattr(program, "_code", lambda: "changed")
    Program(scaled)(*ARGUMENTS)
    assert len(list(folder.glob("traces/*.trace"))) == 4


def test_a_damaged_file_is_written_anew(folder: Path) -> None:
    Program(scaled)(*ARGUMENTS)
    (path,) = folder.glob("traces/*.trace")
    whole = path.read_bytes()
    path.write_bytes(whole[:100])
    check(Program(scaled)(*ARGUMENTS))
    assert len(path.read_bytes()) == len(whole)


def test_a_trace_is_dropped_when_it_was_not_used_for_long(folder: Path) -> None:
    key, _, layout = ARGUMENTS
    others = [(key, {"x": jnp.arange(float(size)), "by": 2.0}, layout) for size in (5, 6, 7)]
    long_ago = time.time() - 1.1 * program.KEPT_FOR
    paths = []
    for arguments in others[:2]:
        Program(scaled)(*arguments)
        (path,) = set(folder.glob("traces/*.trace")) - set(paths)
        os.utime(path, (long_ago, long_ago))
        paths.append(path)
        # Used once more, the first counts as new again.
        Program(scaled)(*others[0])
    Program(scaled)(*others[2])
    assert paths[0].exists()
    assert not paths[1].exists()
    assert len(list(folder.glob("traces/*.trace"))) == 2


def test_nothing_is_kept_of_an_effect_whose_code_is_not_watched(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Foreign:
        """An effect of a user's own."""

    monkeypatch.setattr(program, "effect_type", lambda name: Foreign)
    layout = Layout("coulomb", ("my-effect",), ("slow",), (False,), (("D", ()),))
    Program(scaled)(*ARGUMENTS[:2], layout)
    assert not list(folder.glob("traces/*.trace"))


def test_inside_another_program_it_is_a_function(folder: Path) -> None:
    twice = jax.jit(lambda key, tree: Program(scaled)(key, tree, LAYOUT)[1]["y"])
    np.testing.assert_allclose(twice(*ARGUMENTS[:2]), scaled(*ARGUMENTS)[1]["y"], rtol=1e-6)
    assert not list(folder.glob("traces/*.trace"))


def test_a_call_waits_for_what_was_begun(folder: Path) -> None:
    key, tree, layout = ARGUMENTS
    other = (key, {"x": jnp.arange(9.0), "by": tree["by"]}, layout)
    one = Program(scaled)
    with ThreadPoolExecutor(1) as pool:
        one.begin(pool, *other)
        one.begin(pool, *other)
        begun = list(one._begun.values())
        found = one(*other)
    assert len(begun) == 1
    assert begun[0].done()
    np.testing.assert_allclose(found[1]["y"], scaled(*other)[1]["y"], rtol=1e-6)
