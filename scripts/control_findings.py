"""The thesis' findings on control, with numbers over the posterior: writes docs/control-findings.md.

    python scripts/control_findings.py MUSCLE.nc --fixture FIXTURE-LINEAR.nc [--heater RUN...] \\
        [--gains G.toml]
"""

import argparse
from pathlib import Path

import numpy as np

from muscle_bayes.cli.control_options import load_joints
from muscle_bayes.compiled import keep_compiled_code

DOCS = Path(__file__).parents[1] / "docs"


def interval(row, factor=1.0, form="{:.3g}"):
    """Median and 90 % interval as text."""
    low, middle, high = (form.format(factor * row[key]) for key in ("q05", "median", "q95"))
    return f"{middle} ({low} to {high})"


def cycling(found, count):
    """Steady-state error of the square wave, in counts."""
    rows = found["square"]
    error, drift = (interval(rows[key], 1 / count) for key in ("steady_error", "drift"))
    return f"{error} counts after the last cycle, growing by {drift} counts a cycle"


def load(found):
    """What the loads of the scenarios do, in degrees."""
    step = interval(found["load-step"]["disturbance"], np.degrees(1), "{:.2f}")
    sines = "; ".join(
        f"{name.rsplit('-', 1)[1]} Hz {interval(rows['disturbance'], np.degrees(1), '{:.2f}')}"
        for name, rows in found.items()
        if name.startswith("load-sine")
    )
    return f"load step {step} deg; load sines {sines} deg"


def runaway(curve):
    """A row a frequency."""
    lines = [
        "| frequency [Hz] | RMS error / RMS setpoint | adds error | too hot |",
        "|---|---|---|---|",
    ]
    for f, unstable, unsafe, (low, middle, high) in zip(
        curve.frequency, curve.unstable, curve.unsafe, curve.error, strict=True
    ):
        error = f"{middle:.2f} ({low:.2f} to {high:.2f})"
        lines.append(f"| {f:.3g} | {error} | {unstable:.0%} | {unsafe:.0%} |")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("posterior", type=Path)
    parser.add_argument("--fixture", type=Path)
    parser.add_argument("--heater", type=Path, nargs="*")
    parser.add_argument("--gains", type=Path)
    parser.add_argument("--draws", type=int, default=200)
    parser.add_argument("--out", type=Path, default=DOCS / "control-findings.md")
    args = parser.parse_args()
    keep_compiled_code()
    from muscle_bayes.control.batch import Bank
    from muscle_bayes.control.gains import read_gains
    from muscle_bayes.control.linear import operating_point, snapshot_gains
    from muscle_bayes.control.scenarios import LOAD, STEP, thesis_scenarios
    from muscle_bayes.control.study import robustness, runaway_curve
    from muscle_bayes.inference.running.precision import double_precision

    draws, notes = load_joints(args.posterior, args.heater, args.fixture, None, args.draws, 0)
    snapshot = snapshot_gains(draws, STEP)
    cases = {
        "PI by the thesis' method": snapshot,
        "the same with anti-windup": snapshot.model_copy(update={"law": "pi-antiwindup"}),
    }
    if args.gains is not None:
        cases[f"{args.gains.name}"] = read_gains(args.gains)
    count = abs(draws.design.potentiometer.radians_per_count)
    bank = Bank(draws)

    @double_precision
    def stiffness():
        first = [operating_point(draws.one(i), STEP).stiffness for i in range(min(20, len(draws)))]
        biased = [operating_point(draws.one(i), STEP, 30.0).stiffness for i in range(len(first))]
        return np.array(first), np.array(biased)

    cold, warm = stiffness()
    torque = LOAD * 9.80665 * draws.design.fixture.disc_radius
    lines = [
        "# What the thesis found of control, with numbers",
        "",
        "Written by `scripts/control_findings.py`; do not edit. "
        f"{len(draws)} draws of {args.posterior.stem}; " + "; ".join(notes) + ". "
        "Median and 90 % interval over the draws.",
        "",
        f"Stiffness of the joint: {cold.mean():.3f} N m/rad, so {1000 * LOAD:g} g on the disc turn it by "
        f"{np.degrees(torque / cold.mean()):.2f} deg before any control. Co-contraction by 30 K changes "
        f"the stiffness by {100 * (warm / cold - 1).mean():+.2f} %.",
        "",
    ]
    for name, gains in cases.items():
        found = robustness(bank, gains, thesis_scenarios(gains.period)).summary()
        lines += [
            f"## {name}",
            "",
            f"{gains.law}, {gains.proportional:.4g} duty/rad, {gains.integral:.4g} duty/(rad s), bias "
            f"{gains.bias:.3g}.",
            "",
            f"- Steady state under cycling: {cycling(found, count)}.",
            f"- Load: farthest from the setpoint, {load(found)}.",
            "- Setpoint sines of rising frequency:",
            "",
            *runaway(runaway_curve(bank, gains)),
            "",
        ]
    args.out.write_text("\n".join(lines))


if __name__ == "__main__":
    main()
