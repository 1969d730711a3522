"""Seconds for 1,000 draws x 9 closed loops on this machine: `python -m benchmarks.control POSTERIOR.nc`."""

import argparse
import time
from pathlib import Path

from muscle_bayes.compiled import keep_compiled_code

LIMIT = 60.0
"""Seconds that this may take on two cores, after compilation."""


def seconds(bank, gains, scenarios) -> tuple[float, float]:
    """Seconds of the whole study by the clock, and of all cores together."""
    from muscle_bayes.control.study import robustness

    begun, worked = time.perf_counter(), time.process_time()
    robustness(bank, gains, scenarios)
    return time.perf_counter() - begun, time.process_time() - worked


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("posterior", type=Path)
    parser.add_argument("--fixture", type=Path)
    parser.add_argument("--draws", type=int, default=1000)
    args = parser.parse_args()
    keep_compiled_code()
    from muscle_bayes.cli.control_options import load_joints
    from muscle_bayes.control.batch import Bank
    from muscle_bayes.control.gains import Gains
    from muscle_bayes.control.scenarios import thesis_scenarios

    draws, _ = load_joints(args.posterior, None, args.fixture, None, args.draws, 0)
    bank, gains = Bank(draws), Gains(proportional=5000.0, integral=300.0)
    scenarios = thesis_scenarios()
    first, second = (seconds(bank, gains, scenarios) for _ in range(2))
    print(
        f"{args.draws} draws x {len(scenarios)} scenarios: {second[0]:.1f} s (aim: {LIMIT:g} s), "
        f"{second[1]:.1f} s of processor time"
    )
    print(f"first time, with compilation or loading what is kept: {first[0]:.1f} s")


if __name__ == "__main__":
    main()
