"""Write docs/rigs.md: kinds of rig, each simulated by the twin, with metadata, figure and a short fit.

python -m benchmarks.rig_examples [NAME...] fits the named examples, or all, and writes the page.
What was fitted is kept in reports/rigs. `--page` writes the page alone.
"""

import json
import sys
from pathlib import Path

import matplotlib.pyplot as plt

from benchmarks.rigs import EXAMPLES, Example, example
from muscle_bayes.data.reader import run_from_bytes
from muscle_bayes.inference.posteriors.summary import summarise
from muscle_bayes.inference.sampling.fit import QUICK, fit

ROOT = Path(__file__).parents[1]
PAGE, KEPT = ROOT / "docs" / "rigs.md", ROOT / "reports" / "rigs"
INTRODUCTION = """# Kinds of rig

Each rig below was simulated by code that shares nothing with the model. The metadata are all that a fit
was told; the table stands beside what is true of the simulated rig. `make rigs` writes this page.
"""


def read(one: Example):
    """The run in an example's files."""
    log, about = one.log().encode(), one.metadata.encode()
    return run_from_bytes(log, about, Path(f"{one.name}.csv"), Path(f"{one.name}.toml"))


def fitted(name: str) -> None:
    """Keep what a short fit of an example says."""
    one = example(name)
    found = summarise(fit([read(one)], "coulomb", one.effects, effort=QUICK))
    KEPT.mkdir(parents=True, exist_ok=True)
    (KEPT / f"{name}.json").write_text(json.dumps(found))


def figure(one: Example) -> str:
    """Draw what was logged; the figure's name."""
    time, *others = one.columns.items()
    shown, axes = plt.subplots(1, len(others), figsize=(3.5 * len(others), 2.0), squeeze=False)
    for axis, (label, values) in zip(axes[0], others, strict=True):
        axis.plot(time[1], values, linewidth=0.8)
        axis.set_xlabel("time [s]")
        axis.set_title(label, fontsize=9)
    shown.tight_layout()
    name = f"figures/rig-{one.name}.png"
    shown.savefig(ROOT / "docs" / name, dpi=110)
    plt.close(shown)
    return name


def table(one: Example) -> list[str]:
    """Truth beside the posterior."""
    found = json.loads((KEPT / f"{one.name}.json").read_text())
    rows = ["| parameter | true | mean | 5 % | 95 % |", "|---|---|---|---|---|"]
    for name, true in one.truth.items():
        row = found["parameters"][name]
        numbers = " | ".join(f"{row[key]:.4g}" for key in ("mean", "q05", "q95"))
        rows.append(f"| `{name}` [{row['unit']}] | {true:.4g} | {numbers} |")
    if tied := found["only_ratios"]:
        rows += ["", f"Only ratios are identified of {', '.join(f'`{name}`' for name in tied)}."]
    words = (
        "Converged" if found["converged"] else "Not converged: " + "; ".join(found["complaints"])
    )
    explained = "explained: yes" if found["explained"] else "explained: no"
    return [*rows, "", f"{words}; {explained}."]


def page() -> None:
    """Write the page from what was kept."""
    lines = [INTRODUCTION]
    for name in EXAMPLES:
        one = example(name)
        shown = figure(one)
        lines += [f"## {name.replace('-', ' ').capitalize()}", "", one.story, ""]
        lines += [f"```{{figure}} {shown}\n:alt: What was logged of {name}\n\nThe log.\n```", ""]
        lines += ["```toml", one.metadata.strip(), "```", "", *table(one), ""]
    PAGE.write_text("\n".join(lines).rstrip() + "\n")


if __name__ == "__main__":
    chosen = [name for name in sys.argv[1:] if name != "--page"]
    if "--page" not in sys.argv:
        for name in chosen or EXAMPLES:
            fitted(name)
    page()
