"""The synthetic data set that stands in for the bench's own logs until those are there."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from muscle_bayes.twin import protocols
from muscle_bayes.twin.effects import Effect, make_effect
from muscle_bayes.twin.plans import THESIS_MASSES
from muscle_bayes.twin.plant.parameters import Truth
from muscle_bayes.twin.plant.rig import Element, Fixture, Rig
from muscle_bayes.twin.protocols import Protocol
from muscle_bayes.twin.simulate import SimulatedRun, simulate
from muscle_bayes.twin.storage import check_free, check_ours, save_runs

SEED = 2016
"""Seed of the shipped set; run number n takes (SEED, n)."""

SLOW_LOG_PERIOD = 0.1
"""The long runs log every 0.1 s instead of 0.03 s, which keeps the files small."""

SPRING_RUNS = ((0.108, 0.050), (0.124, 0.050), (0.136, 0.055), (0.147, 0.055), (0.168, 0.060))
"""Mass [kg] and height of the stator pin Y_A [m]: heavier weights with the pin farther away, so
that the spring keeps above its least length and the rotor swings widely, clear of the stops."""


HIDDEN = (make_effect("coil-contact", onset=0.015),)
"""What the muscle does besides equations 13 to 17: as those of the thesis' muscle, its coils touch."""

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
        plan[f"staircase-{mass * 1000:.0f}g"] = (
            rig,
            replace(protocols.staircase(mass), log_period=SLOW_LOG_PERIOD),
        )
    plan["sawtooth"] = (
        rig,
        replace(protocols.sawtooth(THESIS_MASSES), log_period=SLOW_LOG_PERIOD),
    )
    return plan


def simulate_shipped(
    names: list[str] | None = None,
    progress: Callable[[str, float], None] | None = None,
    hidden: Sequence[Effect] = HIDDEN,
) -> dict[str, SimulatedRun]:
    """The shipped runs, or those named; `progress` hears a run's name and the share done of it."""
    runs = {}
    for number, (name, (rig, protocol)) in enumerate(shipped_runs(hidden).items()):
        if names is not None and name not in names:
            continue

        def told(share: float, name: str = name) -> None:
            if progress is not None:
                progress(name, share)

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


_README = """\
# These data are SYNTHETIC

**Nothing in this folder was measured.** Every run was written by the simulator in
`src/muscle_bayes/twin`, a model of the bench that shares no model or integration code with the
inference. The runs show that the inference finds parameters that are known; they are no evidence
about a real muscle. Each `NAME.toml` says `origin = "synthetic"`.

| Run | What it is |
|---|---|
{table}

A run is `NAME.csv`, the log, and `NAME.toml`, what an experimenter would have written down.
**An effect is hidden in the runs of the muscle**: as in the thesis, its coils touch (`coil-contact`).
`muscle-bayes study` has to find it. The folder `plain` holds the same runs with nothing hidden.

`truth.toml` holds the true parameters (Tables 1 and 2 of the thesis), each run's true sensor zero
and its state at the first row. It is for judging an inference and is never read by one.

What is simulated: the rotor with its full inertia and Coulomb friction that really sticks, the
muscle of eq. 13-17, the reference spring of eq. 12, heater tubes (4.5 C/s at full power, cooling
time constant 48 s) under the bench's controller, a thermocouple meter (noise 0.05 C, resolution
0.1 C, held about 0.4 s), a 10-bit potentiometer (noise 0.4 counts before rounding; the true zero
lies up to 2 counts off the stated one), uneven sampling with occasional pauses. Long runs log about
every 0.1 s, spring runs about every 0.03 s. Before each muscle run the muscle was trained: two
cycles to 90 C under 60 g, not logged.

To write this folder again, to the byte:

    muscle-bayes simulate shipped --out data
"""
