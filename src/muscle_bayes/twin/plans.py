"""Runs by name, as a user asks for them: protocol, loads and rig -> what to simulate."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from muscle_bayes.data.files import parse_toml, read_bytes
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin import protocols
from muscle_bayes.twin.plant.rig import Rig
from muscle_bayes.twin.plant.swings import spring_masses
from muscle_bayes.twin.protocols import THESIS_MASSES, Protocol, Stage


def plan_runs(
    protocol: str,
    rig: Rig,
    masses: Sequence[float] = (),
    *,
    name: str | None = None,
    stages: Path | None = None,
    log_period: float | None = None,
) -> dict[str, Protocol]:
    """Protocols by run name; masses in kg, the thesis' or what swings well where none is given."""
    for mass in masses:
        if not mass >= 0.0:
            raise MuscleBayesError(f"a mass of {mass:g} kg cannot hang from this disc")
    if (protocol == "free") != (stages is not None):
        raise MuscleBayesError(
            "protocol 'free' and a file of stages belong together. Fix: give both, or another protocol."
        )
    room = rig.fixture.room_temperature
    if protocol == "spring":
        chosen = masses or spring_masses(rig)
        runs = {f"spring-{n}": protocols.spring(m) for n, m in enumerate(chosen, 1)}
    elif protocol == "staircase":
        chosen = masses or THESIS_MASSES
        runs = {
            f"staircase-{1000 * mass:g}g": protocols.staircase(mass, room=room) for mass in chosen
        }
    elif protocol == "sawtooth":
        runs = {"sawtooth": protocols.sawtooth(masses or THESIS_MASSES, room=room)}
    elif protocol == "free":
        assert stages is not None
        run = read_stages(stages)
        if len(masses) > 1:
            raise MuscleBayesError("protocol 'free' starts with one mass; stages change it later")
        runs = {"free": replace(run, load=masses[0]) if masses else run}
    else:
        raise MuscleBayesError(
            f"unknown protocol {protocol!r}; known: spring, staircase, sawtooth, free"
        )
    if log_period is not None:
        if not 0.001 <= log_period <= 60.0:
            raise MuscleBayesError(f"a log period of {log_period} s is outside 0.001 to 60 s")
        runs = {key: replace(run, log_period=log_period) for key, run in runs.items()}
    return runs if name is None else _renamed(runs, name)


def read_stages(path: Path) -> Protocol:
    """A `free` protocol from TOML: load, initial_angle, initial_hyst and [[stage]] tables."""
    content = parse_toml(read_bytes(path), path)
    tables: Any = content.pop("stage", None)
    if not isinstance(tables, list) or not tables:
        raise MuscleBayesError(f"{path}: needs one [[stage]] table or more")
    try:
        return protocols.free([Stage(**table) for table in tables], **content)
    except TypeError as error:
        what = str(error).rpartition("() ")[2]
        raise MuscleBayesError(f"{path}: {what}") from None
    except MuscleBayesError as error:
        raise MuscleBayesError(f"{path}: {error}") from None


def _renamed(runs: dict[str, Protocol], name: str) -> dict[str, Protocol]:
    if not name or Path(name).name != name or name.startswith("."):
        raise MuscleBayesError(f"{name!r} is no name for a run: give a file name without folder")
    if len(runs) == 1:
        (run,) = runs.values()
        return {name: run}
    return {f"{name}-{number}": run for number, run in enumerate(runs.values(), 1)}
