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
from muscle_bayes.report.style import mark_origin

ROOT = Path(__file__).parents[1]
PAGE, KEPT = ROOT / "docs" / "rigs.md", ROOT / "reports" / "rigs"
INTRODUCTION = """# Kinds of rig

Each rig below was simulated by code that shares nothing with the model. The metadata are all that a fit
is given. The table compares the result with what is true of the simulated rig. One in ten true values is
expected outside its 90 % interval. Terms: [glossary](glossary.md). `make rigs` writes this page.
"""
LABELS = {
    "x_mm": "position [mm]",
    "x_m": "position [m]",
    "angle_deg": "angle [deg]",
    "angle_rad": "angle [rad]",
    "ticks": "angle [ticks]",
    "rpm": "speed [rpm]",
    "rate_rad_s": "speed [rad/s]",
    "speed_rad_s": "speed [rad/s]",
    "torque_nm": "torque [N m]",
    "current_a": "current [A]",
    "duty": "duty",
    "force_n": "force [N]",
    "f_n": "force [N]",
    "tension_n": "tension [N]",
    "muscle_c": "temperature [C]",
    "power_w": "power [W]",
}
"""What the logs' columns hold."""
SEEN = {
    "mass-on-spring": "Position against time: an oscillation that decays within 1.5 s",
    "torsion-pendulum": "Angle against time: an oscillation that loses most of its amplitude in 8 s",
    "unknown-arm": "Angle against time: an oscillation about 0.2 rad that loses a third of its amplitude",
    "encoder-ticks": "Ticks against time: an oscillation about 20003 whose amplitude shrinks evenly",
    "flywheel": "Speed rises while a torque acts and falls while none does, twice",
    "gyroscope": "Speed against time: an oscillation whose amplitude shrinks evenly",
    "motor-current": "Angle and current against time: both swing irregularly to and fro",
    "motor-duty": "Speed approaches a new value after each step of the duty, three times",
    "tensile-test": "Position and force against time: both oscillate about a rising line",
    "force-and-position": "Position and force against time: both oscillate, with shrinking amplitude",
    "isometric-muscle": "Temperature changes between levels; the tension follows it and relaxes",
    "heater-power": "Power changes in steps; the tension follows it late",
}
"""What each figure shows, in words."""


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
    shown, axes = plt.subplots(
        1, len(others), figsize=(3.5 * len(others), 2.2), squeeze=False, layout="constrained"
    )
    for axis, (label, values) in zip(axes[0], others, strict=True):
        axis.plot(time[1], values, linewidth=0.8)
        axis.set_xlabel("time [s]")
        axis.set_ylabel(LABELS[label])
    mark_origin(shown, "synthetic")
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
    explained = "yes" if found["explained"] else "no"
    if found["converged"]:
        return [*rows, "", f"Converged; explained: {explained}."]
    why = [f"- {one[0].upper()}{one[1:]}." for one in found["complaints"]]
    return [*rows, "", "Not converged:", "", *why, "", f"Explained: {explained}."]


def page() -> None:
    """Write the page from what was kept."""
    lines = [INTRODUCTION]
    for name in EXAMPLES:
        one = example(name)
        shown = figure(one)
        lines += [f"## {name.replace('-', ' ').capitalize()}", "", one.story, ""]
        caption = f"Synthetic log of {name.replace('-', ' ')}."
        lines += [f"```{{figure}} {shown}\n:alt: {SEEN[name]}\n\n{caption}\n```", ""]
        lines += ["```toml", one.metadata.strip(), "```", "", *table(one), ""]
    PAGE.write_text("\n".join(lines).rstrip() + "\n")


if __name__ == "__main__":
    chosen = [name for name in sys.argv[1:] if name != "--page"]
    if "--page" not in sys.argv:
        for name in chosen or EXAMPLES:
            fitted(name)
    page()
