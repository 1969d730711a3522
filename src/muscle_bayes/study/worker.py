"""One stage in a process of its own: `python -m muscle_bayes.study.worker STEP NAME PLAN.json`."""

import os
import sys
import time
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.study.plan import Plan
from muscle_bayes.whole_file import write_whole

FAILED = 2


def progress_file(plan: Path, stage: str) -> Path:
    """Where a running stage says how far it is."""
    return plan.parent / f".{stage}.progress"


def main(step: str, name: str, place: Path) -> int:
    """Run a stage; 0 if its result stands."""
    plan = Plan.load(place)
    telling = progress_file(place, name)
    begun = time.perf_counter()

    def report(what: str, done: int, total: int) -> None:
        write_whole(telling, f"{done} {total} {what}".encode())

    os.environ.setdefault("JAX_PLATFORMS", plan.device if plan.device == "cpu" else "")
    try:
        import_module(f"muscle_bayes.study.steps.{step}").make(plan, name, report)
    except MuscleBayesError as error:
        print(error, file=sys.stderr)
        return FAILED
    finally:
        with suppress(FileNotFoundError):
            telling.unlink()
    times = os.times()
    note = f"{time.perf_counter() - begun:.1f} s, {times.user + times.system:.1f} s of processors\n"
    log = plan.out / "log" / f"{name}.txt"
    log.parent.mkdir(parents=True, exist_ok=True)
    log.write_text(note, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2], Path(sys.argv[3])))
