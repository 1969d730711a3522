"""The synthetic data set that stands in for the bench's own logs until those are there."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from muscle_bayes.twin import protocols
from muscle_bayes.twin.effects import Effect, make_effect
from muscle_bayes.twin.plant.parameters import Truth
from muscle_bayes.twin.plant.rig import Element, Fixture, Rig
from muscle_bayes.twin.protocols import THESIS_MASSES, Protocol
from muscle_bayes.twin.simulate import SimulatedRun, simulate
from muscle_bayes.twin.storage import check_free, check_ours, save_runs

SEED = 2016
"""Seed of the shipped set; run number n takes (SEED, n)."""

SLOW_LOG_PERIOD = 0.1
"""The long runs log every 0.1 s instead of 0.03 s, which keeps the files small."""

SPRING_RUNS = ((0.108, 0.050), (0.124, 0.050), (0.136, 0.055), (0.147, 0.055), (0.168, 0.060))
"""Mass [kg] and height of the stator pin Y_A [m]: heavier weights with the pin farther away, so
that the spring keeps above its least length and the rotor swings widely, clear of the stops."""


HIDDEN = (
    make_effect("coil-contact", onset=0.015),
    make_effect("damper-law", activation_temperature=3000.0),
)
"""What the muscle does besides equations 13 to 17: its coils touch, and HYST's damper falls more steeply.

The thesis found the first by eye, and names the second as a possible cause of the drift it left open."""

_README = Path(__file__).with_name("shipped_readme.md").read_text(encoding="utf-8")
PLAIN = "plain"
"""Folder, in that of the shipped set, of the same runs with nothing hidden."""


def shipped_runs(hidden: Sequence[Effect] = HIDDEN) -> dict[str, tuple[Rig, Protocol]]:
    """Rig and protocol of every shipped run, in the order of their seeds."""
    plan: dict[str, tuple[Rig, Protocol]] = {}
    for number, (mass, anchor_y) in enumerate(SPRING_RUNS, 1):
        rig = Rig(fixture=Fixture(anchor_y_a=anchor_y), element_a=Element(kind="spring"))
        plan[f"spring-{number}"] = (rig, protocols.spring(mass))
    rig = Rig(truth=Truth(effects=tuple(hidden)))
    for mass in THESIS_MASSES:
        plan[f"staircase-{mass * 1000:.0f}g"] = (rig, protocols.staircase(mass))
    plan["sawtooth"] = (rig, protocols.sawtooth())
    for name, (rig, protocol) in plan.items():
        if protocol.name != "spring":
            plan[name] = (rig, replace(protocol, log_period=SLOW_LOG_PERIOD))
    return plan


def simulate_shipped(
    names: list[str] | None = None,
    progress: Callable[[str, float], None] | None = None,
    hidden: Sequence[Effect] = HIDDEN,
) -> dict[str, SimulatedRun]:
    """The shipped runs, or those named; `progress` hears a run's name and the share done of it."""
    runs = {}
    for number, (name, (rig, protocol)) in enumerate(shipped_runs(hidden).items()):
        if names is None or name in names:
            told = None if progress is None else partial(progress, name)
            runs[name] = simulate(rig, protocol, (SEED, number), told)
    return runs


def write_shipped(
    folder: Path, progress: Callable[[str, float], None] | None = None
) -> dict[str, SimulatedRun]:
    """Write the whole set with truth.toml and README.md, and return its runs by name.

    The same runs with nothing hidden go into its folder PLAIN.
    """
    for one in (folder, folder / PLAIN):
        check_free(one, list(shipped_runs()))
    check_ours(folder / "README.md", _README.partition("\n")[0])
    runs = simulate_shipped(progress=progress)
    save_runs(folder, runs)
    save_runs(folder / PLAIN, simulate_shipped(progress=progress, hidden=()))
    (folder / "README.md").write_bytes(readme().encode())
    return runs


def readme() -> str:
    """README.md of the shipped folder."""
    rows = []
    for name, (rig, protocol) in shipped_runs().items():
        if protocol.name == "spring":
            what = (
                f"reference spring, Y_A = {rig.fixture.anchor_y_a * 1000:.0f} mm, "
                f"{protocol.load * 1000:.0f} g released at theta = 0"
            )
        elif protocol.name == "staircase":
            what = (
                f"muscle under {name.split('-')[1][:-1]} g, setpoint in steps to 90 C, three times"
            )
        else:
            masses = " -> ".join(f"{mass * 1000:.0f}" for mass in THESIS_MASSES)
            what = f"muscle, fast to 90 C and back, twice per load, load poured {masses} g"
        rows.append(f"| `{name}` | {what} |")
    return _README.format(table="\n".join(rows))
