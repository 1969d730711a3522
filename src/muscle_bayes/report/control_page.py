"""The controller's report: one page with tables, figures beside it, gains and header of every law."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from muscle_bayes.control.batch import Bank
from muscle_bayes.control.judging.judge import Judgement, standard_error
from muscle_bayes.control.judging.specification import cvar
from muscle_bayes.control.laws.gains import gains_header, gains_toml
from muscle_bayes.control.linear import Loop, loops
from muscle_bayes.json_file import write_json
from muscle_bayes.report.control_figures import control_figures
from muscle_bayes.report.style import save
from muscle_bayes.report.tables import Table, markdown, table
from muscle_bayes.whole_file import write_whole

SHOWN: Final = {
    "rise_time": ("rise [s]", 1.0),
    "settling_time": ("settling [s]", 1.0),
    "overshoot": ("overshoot [deg]", np.degrees(1.0)),
    "steady_error": ("steady error [deg]", np.degrees(1.0)),
    "recovery_time": ("recovery [s]", 1.0),
    "tracking": ("error / setpoint, RMS", 1.0),
    "peak_temperature": ("peak [C]", 1.0),
}
ANGLES: Final = (0.03, 0.08)
"""Where loop gains are looked at [rad]."""
FACTORS: Final = (0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.5)


def write_control_report(
    result: Judgement,
    bank: Bank,
    folder: Path,
    *,
    edges: Mapping[str, Sequence[str]] | None = None,
    command: str = "muscle-bayes tune",
) -> str:
    """Write report.md, control.json, the figures, and gains and header of every law into a folder.

    Args:
        result: of `judge`.
        bank: the joints that the laws were judged on; a part of them is used for loop gains.
        folder: where to.
        edges: of every law the gains that lie at an edge of the search.
        command: that writes it, told at the head of the page.

    Returns:
        The page, in Markdown.
    """
    law = result.recommended
    found = {f"{np.degrees(a):.1f} deg": loops(bank.draws, result.gains[law], a) for a in ANGLES}
    found = {name: loop for name, loop in found.items() if len(loop.gain)}
    for name, figure in control_figures(result, bank, found, FACTORS).items():
        save(figure, folder / f"{name}.png")
    for name, gains in result.gains.items():
        head = f"{result.notes[0] if result.notes else ''}"
        write_whole(folder / f"gains-{name}.toml", gains_toml(gains, head).encode())
        header = gains_header(gains, bank.draws.design, head)
        write_whole(folder / f"gains-{name}.h", header.encode())
    write_json(folder / "control.json", result.as_dict() | {"edges": dict(edges or {})})
    page = _page(result, found, edges or {}, command)
    write_whole(folder / "report.md", page.encode())
    return page


def _page(
    result: Judgement, found: Mapping[str, Loop], edges: Mapping[str, Sequence[str]], command: str
) -> str:
    first, _, others = result.sentence().partition(". ")
    parts = [
        "# Laws on new joints: results (simulated)\n",
        f"Written by `{command}`; do not edit. {result.draws} new joints. Numbers in brackets are Monte "
        "Carlo errors or 90 % of the joints.\n",
        f"**{first}.** {others}\n",
        "The number in a scenario's name is its frequency in Hz. Limits are the defaults, or those that "
        "were chosen, eased to 1.5 times what the best input reaches. Where a scenario is out of reach, "
        "the joint only has to stay below 100 C and be no runaway. *Duty* is heater power from 0 to 255.\n",
        *(f"- {note}" for note in result.notes),
        "\n## What is asked\n",
        _asked(result),
        "\n## Probability of meeting it\n",
        markdown(probabilities(result)),
        "\n## Excess beyond the limits: 95 % CVaR\n",
        "The mean of the worst twentieth of the largest relative miss, cut off at 3. `=` marks a tie with "
        f"{result.recommended} within two Monte Carlo errors.\n",
        _excesses(result),
        "\n## Step metrics\n",
        _steps(result),
        "\n## Gains\n",
        _gains(result, edges),
        "\n## Loop of the recommended law\n",
        _loops(found),
        "\n![responses](responses.png)\n\n![speed against heat](pareto.png)\n",
    ]
    return "\n".join([*parts, *(["![loop](loop.png)\n"] if found else [])])


def _markdown(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return markdown(table(columns, rows))


def _asked(result: Judgement) -> str:
    rows = []
    for one in result.scenarios:
        spec = result.specs[one.name]
        limits = ", ".join(_value(key, value) for key, value in spec.limits.items())
        best = ", ".join(_value(k, v) for k, v in spec.feasible.items() if k != "peak_temperature")
        kept = spec.infeasible or f"on {spec.attainable:.0%} of joints"
        rows.append((one.name, limits, best or "-", kept))
    return _markdown(
        ("scenario", "at most", "best input on 90 % of joints", "best input keeps it"), rows
    )


def _value(metric: str, value: float) -> str:
    name, unit = SHOWN[metric]
    return f"{name} {value * unit:.3g}"


def probabilities(result: Judgement) -> Table:
    """Share of joints that meets each specification under every law, with Monte Carlo errors."""
    names = [one.name for one in result.scenarios]
    rows = []
    for name in [*names, None]:
        cells = []
        for law in result.gains:
            share, error = result.probability(law, name)
            cells.append(f"{share:.3f} ({error:.3f})")
        rows.append((name or "**all**", *cells))
        if name and name in result.possible:
            found = [result.where_possible(law, name) for law in result.gains]
            told = f"{name}, on the {found[0][2]} of {result.possible[name].size} joints that can"
            rows.append((told, *(f"{share:.3f} ({error:.3f})" for share, error, _ in found)))
    rows.append(("runaways", *(str(result.runaways(law)) for law in result.gains)))
    return table(("scenario", *result.gains), rows)


def _excesses(result: Judgement) -> str:
    law = result.recommended
    compared = {other: result.compared(law, other) for other in result.gains}
    rows = []
    for one in result.scenarios:
        cells = [
            f"{cvar(result.excess(other, one.name)):.3f}"
            + (" =" if other != law and compared[other][one.name] == "tied" else "")
            for other in result.gains
        ]
        rows.append((one.name, *cells))
    return _markdown(("scenario", *result.gains), rows)


def _steps(result: Judgement) -> str:
    rows = []
    names = [key for key in SHOWN if key != "tracking"]
    for one in result.scenarios:
        if not np.any(one.course.turned) or "settling_time" not in result.specs[one.name].limits:
            continue
        for law in result.gains:
            found = result.metrics(law, one.name)
            cells = [_interval(found.get(key), SHOWN[key][1]) for key in names]
            rows.append((one.name, law, *cells))
    return _markdown(("scenario", "law", *(SHOWN[key][0] for key in names)), rows)


def _interval(metric: Mapping[str, float] | None, unit: float) -> str:
    if metric is None:
        return "-"
    low, middle, high = (
        "never" if not np.isfinite(metric[key]) else f"{metric[key] * unit:.3g}"
        for key in ("q05", "median", "q95")
    )
    return f"{middle} ({low} to {high})"


def _gains(result: Judgement, edges: Mapping[str, Sequence[str]]) -> str:
    rows = [
        (law, gains.sentence(), ", ".join(edges.get(law, ())) or "-")
        for law, gains in result.gains.items()
    ]
    return _markdown(("law", "gains", "at an edge of the search"), rows)


def _loops(found: Mapping[str, Loop]) -> str:
    rows = []
    for name, loop in found.items():
        margins = loop.margins
        stable = np.mean([one.stable for one in margins])
        cells = [
            _range([getattr(one, key) for one in margins]) for key in ("gain", "phase", "crossover")
        ]
        error = standard_error(float(stable), len(margins))
        rows.append((name, *cells, _range(loop.disk), f"{stable:.2f} ({error:.2f})"))
    header = ("held at", "gain margin", "phase margin [deg]", "crossover [rad/s]", "disk margin")
    return _markdown((*header, "stable"), rows) + (
        "\n\nDry friction has no linearisation and is left out here. The rotor's resonance, which nothing "
        "else damps, crosses |L| = 1 in many draws, and the smallest phase margin then lies there. "
        "The simulations above include friction."
    )


def _range(values: Sequence[float] | np.ndarray) -> str:
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95), method="nearest")
    return f"{middle:.3g} ({low:.3g} to {high:.3g})"
