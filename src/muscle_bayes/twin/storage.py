"""Simulated runs -> run files and, apart from them, the truth file."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from muscle_bayes.data import read_metadata, write_run
from muscle_bayes.data.writer import toml_tables
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin.simulate import SimulatedRun

TRUTH_FILE = "truth.toml"

_TRUTH_HEAD = """\
# Synthetic data: the true parameters behind the runs of this folder, with the thesis' names, SI, C.
# For judging an inference, never for making one: no reader of runs opens this file.
"""


def check_free(folder: Path, names: list[str]) -> None:
    """Refuse to replace a run that was measured, or one whose origin cannot be read."""
    for name in names:
        log, metadata = folder / f"{name}.csv", folder / f"{name}.toml"
        if not log.exists() and not metadata.exists():
            continue
        try:
            synthetic = read_metadata(metadata).origin == "synthetic"
            why = "was measured"
        except MuscleBayesError:
            synthetic, why = False, "does not say that it is synthetic"
        if not synthetic:
            raise MuscleBayesError(
                f"{log}: this run {why}, a simulated one would replace it. "
                "Fix: choose another --out or --name."
            )


def save_runs(folder: Path, runs: Mapping[str, SimulatedRun], truth: Path | None = None) -> None:
    """Write runs by name, and their truth to folder/truth.toml unless told where.

    Runs that are in the folder already keep their place in the truth file.
    """
    check_free(folder, list(runs))
    path = truth or folder / TRUTH_FILE
    merged = _with_others(path, folder, merge_truths(runs))
    for name, run in runs.items():
        write_run(folder, name, run.log, run.metadata)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes((_TRUTH_HEAD + toml_tables(merged)).encode())


def check_ours(path: Path, head: str) -> None:
    """Refuse to replace a file that does not begin as ours does."""
    if path.exists() and not path.read_bytes().startswith(head.encode()):
        raise MuscleBayesError(f"{path}: exists and is not from here. Fix: choose another place.")


def _with_others(path: Path, folder: Path, truth: dict[str, Any]) -> dict[str, Any]:
    """Truth completed by that of the folder's other runs."""
    check_ours(path, _TRUTH_HEAD)
    if not path.exists():
        return truth
    old = tomllib.loads(path.read_text(encoding="utf-8"))
    others = {
        name: table
        for name, table in old.pop("runs", {}).items()
        if name not in truth["runs"] and (folder / f"{name}.csv").exists()
    }
    if not others:
        return truth
    new = dict(truth)
    mine = new.pop("runs")
    for key in {**old, **new}:
        muscle = key.startswith("muscle_")  # a run without that muscle says nothing about it
        if old.get(key) != new.get(key) and not (muscle and (key not in old or key not in new)):
            raise MuscleBayesError(
                f"{path}: its true {key} differs from that of the new runs, and "
                f"{', '.join(others)} still belong to it. Fix: choose another --out."
            )
    return {**old, **new, "runs": {**others, **mine}}


def merge_truths(runs: Mapping[str, SimulatedRun]) -> dict[str, Any]:
    """Truth of a set: what its rigs share once, and what belongs to a run under its name."""
    merged: dict[str, Any] = {}
    for name, run in runs.items():
        for key, table in run.truth.items():
            if key == "run":
                continue
            if merged.setdefault(key, table) != table:
                raise MuscleBayesError(
                    f"run {name!r}: its true {key} differs from that of the runs before it; "
                    "save runs of different rigs in different folders"
                )
    return {**merged, "runs": {name: run.truth["run"] for name, run in runs.items()}}
