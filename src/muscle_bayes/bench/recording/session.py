"""The runs of a sequence one after the other, those left out that are recorded already."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from muscle_bayes.bench.boards.link import Devices
from muscle_bayes.bench.heat.thermometry import far_from_room
from muscle_bayes.bench.meters.meter import first_reading
from muscle_bayes.bench.recording.loop import FIRST_READING, Outcome, StoppedError
from muscle_bayes.bench.recording.operator import Operator
from muscle_bayes.bench.recording.recorder import Recorder
from muscle_bayes.bench.recording.run_file import RunFile, free_name, run_files
from muscle_bayes.bench.recording.status import View
from muscle_bayes.bench.sequences.sequence import RunPlan, Sequence
from muscle_bayes.bench.sequences.sequence_file import run_metadata
from muscle_bayes.data import Origin, RunError, complete_attempt

_LOOK: Final = 0.05


@dataclass
class Session:
    """One sequence on open devices."""

    sequence: Sequence
    path: Path
    """of the sequence's file: names its runs, serves messages"""
    folder: Path
    """where the runs go"""
    devices: Devices
    operator: Operator
    origin: Origin = "measured"
    rig: Mapping[str, Any] = field(default_factory=dict)
    notes: str = ""
    load: float | None = None
    """kg that hang already, None = unknown"""
    wall_time: Callable[[], float] | None = None
    view: View = field(default_factory=View)
    _room_checked: bool = False

    def plans(self) -> tuple[RunPlan, ...]:
        """Every run of the sequence."""
        return self.sequence.runs(self.path.stem)

    def recorded(self) -> dict[str, str]:
        """Runs that are recorded already, each with the name of the attempt that was complete."""
        attempts = {p.name: complete_attempt(self.folder, p.name) for p in self.plans()}
        return {name: attempt for name, attempt in attempts.items() if attempt is not None}

    def check(self) -> None:
        """Raise RunError where a run's metadata cannot be made; nothing is written."""
        for plan in self.plans():
            self._metadata(plan)
            if self.path.resolve() == run_files(self.folder, plan.name)[1].resolve():
                raise RunError.at(
                    self.path,
                    f"the metadata of run {plan.name!r} would go by the name of this file",
                    "choose another --out, or give the run a name of its own",
                    key="name",
                )

    def record(self) -> Iterator[Outcome]:
        """Record what is not recorded. Raises RecordingError; later runs are not begun then."""
        done = self.recorded()
        for plan in self.plans():
            if plan.name in done:
                continue
            if not self._room_checked and (plan.heats("a") or plan.heats("b")):
                self._check_room(plan)
            self._hang(plan.load)
            name = free_name(self.folder, plan.name)
            file = RunFile(self.folder, name, self._metadata(plan))
            cell = self.sequence.load_cell or self.rig.get("load_cell")
            recorder = Recorder(
                self.devices,
                plan,
                file,
                self.operator,
                self.sequence,
                self.view,
                cell,
                self.wall_time,
            )
            self.load = None  # unknown, should the run break off
            outcome = recorder.run()
            self.load = recorder.load
            yield outcome

    def _metadata(self, plan: RunPlan) -> Any:
        return run_metadata(self.sequence, self.path, self.origin, self.rig, plan.load, self.notes)

    def _check_room(self, plan: RunPlan) -> None:
        """Compare the meter with the room before the first heat. Raises MuscleBayesError."""
        meter = self.devices.meter.device
        assert meter is not None, "the devices are open"
        reading = first_reading(meter, self.devices.clock, FIRST_READING)
        room = self._metadata(plan).fixture.room_temperature
        if question := far_from_room(reading, room):
            self._ask(
                f"{question} (fixture.room_temperature). Press a key if both are right and a tube "
                "is still warm; q stops",
                plan.load if self.load is None else self.load,
            )
        self._room_checked = True

    def _hang(self, load: float) -> None:
        """Ask for a load [kg] where another hangs, heaters off, and wait for the key."""
        if self.load == load:
            return
        self._ask(f"Hang {1000 * load:g} g, then press a key to begin; q stops", load)
        self.load = load

    def _ask(self, question: str, load: float) -> None:
        """Wait for the key with a load [kg] on the disc. Raises StoppedError at q."""
        # First drop older keys, then ask: a quick answer must not be dropped with them.
        self.operator.ask(load, 0.0)
        self.view.ask(question)
        while (key := self.operator.poll()) is None:
            self.devices.clock.sleep(_LOOK)
        if key == "stop":
            raise StoppedError("stopped by the operator before the run began")
        self.view.ask("")
