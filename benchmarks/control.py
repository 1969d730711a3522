"""Seconds for 1,000 new joints x 9 scenarios x 5 laws: `python -m benchmarks.control MUSCLE.nc`."""

import argparse
import time
from pathlib import Path

from muscle_bayes.compiled import keep_compiled_code

LIMIT = 60.0
"""Seconds that this may take on two cores, after compilation."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("muscle", type=Path)
    parser.add_argument("--draws", type=int, default=1000)
    args = parser.parse_args()
    keep_compiled_code()
    from muscle_bayes.cli.control_options import load_joints
    from muscle_bayes.control.batch import Bank, run
    from muscle_bayes.control.laws.gains import Gains, law_of
    from muscle_bayes.control.laws.templates import TUNED, template
    from muscle_bayes.control.scenarios.thesis import thesis_scenarios

    draws, _ = load_joints(args.muscle, None, None, None, args.draws, 0)
    laws = [template(law, draws).at([0.5] * 8) for law in TUNED]
    laws.append(Gains(law="thesis", proportional=5000.0, integral=300.0))
    bank, scenarios = Bank(draws), thesis_scenarios()
    for told in ("first time, with compilation", "warm"):
        begun, worked = time.perf_counter(), time.process_time()
        for gains in laws:
            for one in scenarios:
                run(bank, law_of(gains, draws.design), one)
        wall, cpu = time.perf_counter() - begun, time.process_time() - worked
        print(
            f"{told}: {len(draws)} joints x {len(scenarios)} scenarios x {len(laws)} laws: {wall:.1f} s "
            f"(aim: {LIMIT:g} s), {cpu:.1f} s of processor time"
        )


if __name__ == "__main__":
    main()
