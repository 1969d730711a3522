"""Count what a trial has left so far, whichever code searched it; nothing is searched.

python -m benchmarks.trial.count FOLDER, with outcomes in FOLDER/cases. Of each kind, on each kind of
rig, the cases count that come before the first which is not there: none is chosen by how it ended.
"""

import json
import sys
from collections import Counter
from itertools import takewhile
from pathlib import Path

from benchmarks.trial.__main__ import write_counts
from benchmarks.trial.cases import KINDS, RIG_NAMES, cases

SEED = 0
"""Of `make trial`."""


def main(folder: Path) -> None:
    """Write trial.json, outcomes.json and trial.png, as `benchmarks.trial` does at its end."""
    kept = {path.stem: json.loads(path.read_text()) for path in (folder / "cases").glob("*.json")}
    chosen = [
        kept[one.name]
        for kind in KINDS
        for rig in RIG_NAMES
        for one in takewhile(
            lambda one: one.name in kept,
            (one for one in cases(kind, len(RIG_NAMES) * len(kept), SEED) if one.rig == rig),
        )
    ]
    codes = Counter(one["inputs"] for one in chosen)
    write_counts(folder, codes, [one["result"] for one in chosen])
    print(f"{folder}: {len(chosen)} of {len(kept)} outcomes counted")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
