"""A small study whose stages add up numbers in no time, and tell which of them ran."""

import sys
from pathlib import Path

from muscle_bayes.study.config import StudyConfig
from muscle_bayes.study.plan import Plan
from muscle_bayes.study.roles import Roles
from muscle_bayes.study.stages import Stage

SCRIPT = """
import json, sys, time
from pathlib import Path
name, result, made, *reads = sys.argv[1:]
with open(made, "a") as file:
    file.write(name + "\\n")
if any(Path(one).read_text() == "bad" for one in reads):
    sys.exit("a reading is bad. Fix: mend it")
while any(Path(one).read_text() == "slow" for one in reads):
    time.sleep(0.02)
total = sum(int(json.loads(Path(one).read_text())) for one in reads)
part = Path(result + ".part")
part.write_text(json.dumps(total % 100))
part.replace(result)
"""


def plan_in(folder: Path, **values: str) -> Plan:
    """A plan with a run for each value."""
    logs = {}
    for name, value in values.items():
        logs[name] = folder / f"{name}.csv"
        logs[name].write_text(value)
        logs[name].with_suffix(".toml").write_text("0")
    return Plan(folder / "out", logs, Roles((), (), (), {}), "quick", StudyConfig())


def stages_of(plan: Plan) -> list[Stage]:
    """left(x) and right(y) beside each other, then sum, which needs both."""

    def stage(name: str, runs: tuple[str, ...], *needs: str) -> Stage:
        return Stage(
            name,
            "data",
            "",
            plan.result(name),
            (1, 1),
            runs=runs,
            needs=tuple(plan.result(one) for one in needs),
        )

    return [stage("left", ("x",)), stage("right", ("y",)), stage("sum", (), "left", "right")]


def process_of(stage: Stage, plan: Path) -> list[str]:
    """Runs SCRIPT over the files that a stage reads."""
    folder = plan.parents[2]
    reads = [str(folder / f"{run}.csv") for run in stage.runs] + [str(one) for one in stage.needs]
    made = str(folder / "made.txt")
    return [sys.executable, "-S", "-c", SCRIPT, stage.name, str(stage.result), made, *reads]


class Watched:
    """Which stages were made, and which stood."""

    def __init__(self) -> None:
        self.made_: list[str] = []
        self.unchanged_: list[str] = []

    def started(self, stage: str) -> None:
        pass

    def made(self, stage: str) -> None:
        self.made_.append(stage)

    def unchanged(self, stage: str) -> None:
        self.unchanged_.append(stage)
