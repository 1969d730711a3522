"""What discovery costs, and whether a plain criterion would select as well.

    python -m benchmarks.discovery NAME=PATH... [--outcomes reports/trial/outcomes.json]

Each PATH is a folder of runs, searched in a process of its own, with an empty compilation cache and then
with a full one: CPU-minutes, cold and warm. Of a trial's outcomes, the Bayesian information criterion (the
first step of stepwise selection) is compared with `discover` on the same fits.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.trial.counts import DETECTABLE, Rate
from muscle_bayes.discovery.weigh import NONE

RESULT = Path(__file__).parent / "results" / "discovery.json"
SEARCH = """
import sys
from pathlib import Path
from muscle_bayes.data import read_runs
from muscle_bayes.discovery.discover import discover
print(discover(read_runs([Path(sys.argv[1])])))
"""


def cpu_minutes(folder: Path, cache: str) -> tuple[float, str]:
    """CPU time of one search [min], its children's included, and what it says."""
    kept = {"JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0", "JAX_COMPILATION_CACHE_DIR": cache}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-c", SEARCH, str(folder)],
        env=os.environ | kept | {"JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1"},
        capture_output=True,
        text=True,
        check=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return spent / 60.0, done.stdout.strip()


def by_bic(outcome: Mapping[str, Any]) -> str:
    """The candidate with the least criterion; none where no candidate was fitted."""
    return min(outcome["bic"] or {NONE: 0.0}, key=lambda name: outcome["bic"].get(name, 0.0))


METHODS = {"discover": lambda outcome: outcome["verdict"][0], "BIC, stepwise": by_bic}


def compared(outcomes: list[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """A row for every method: hidden effects named first, and claims where nothing is hidden."""
    single = [o for o in outcomes if o["kind"] == "single" and o["excess"] >= DETECTABLE]
    none = [o for o in outcomes if o["kind"] == "none"]
    rows = []
    for name, method in METHODS.items():
        named = Rate.of("named", "", [method(one) in one["hidden"] for one in single])
        claimed = Rate.of("claimed", "", [method(one) != NONE for one in none])
        rows.append(
            {
                "method": name,
                "named": [named.hits, named.cases, named.low, named.high],
                "false_claims": [claimed.hits, claimed.cases, claimed.low, claimed.high],
            }
        )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="*", metavar="NAME=PATH")
    parser.add_argument("--outcomes", type=Path)
    args = parser.parse_args()
    for name, _, path in (one.partition("=") for one in args.folders):
        with tempfile.TemporaryDirectory() as cache:
            for state in ("cold", "warm"):
                minutes, said = cpu_minutes(Path(path), cache)
                print(f"{name}, {state}: {minutes:.2f} CPU-minutes; {said}", flush=True)
    if args.outcomes:
        rows = compared(json.loads(args.outcomes.read_text())["outcomes"])
        RESULT.write_text(json.dumps(rows, indent=1) + "\n")
        for row in rows:
            print(row)


if __name__ == "__main__":
    main()
