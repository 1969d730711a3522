"""Tables of results: rows of text, for the report, Markdown and the terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from muscle_bayes.markup import unit_of
from muscle_bayes.report.words import agrees, interval, number, percent

Numbers = Mapping[str, Any]
Table = dict[str, list[Any]]

SHOWN = 0.01
"""Least probability of an effect that gets a row."""


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """Columns and rows as the template takes them."""
    return {"columns": list(columns), "rows": [list(row) for row in rows]}


def markdown(found: Table) -> str:
    """A table in Markdown."""
    columns = found["columns"]
    lines = [columns, ["---"] * len(columns), *found["rows"]]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def shown(found: Table) -> Any:
    """A table as rich draws it."""
    from rich.table import Table as RichTable
    from rich.text import Text

    drawn = RichTable(*found["columns"])
    for row in found["rows"]:
        drawn.add_row(*map(Text, row))
    return drawn


def runs(data: Numbers, roles: Mapping[str, str]) -> Table:
    """What was logged."""
    rows = []
    for name, run in data.items():
        loads = ", ".join(f"{1e3 * load:.0f}" for load in _ends(run["load_kg"]))
        heated = run["temperature_c"].get("a", (0.0, 0.0))
        span = f"{heated[0]:.0f} to {heated[1]:.0f}" if heated[1] - heated[0] > 2.0 else "room"
        repairs = sum(repair["count"] for repair in run["repairs"])
        rows.append(
            (
                name, run["protocol"], run["origin"], roles[name], f"{run['duration_s']:.0f}",
                f"{run['rows']}", loads or "none", span, str(repairs),
            )
        )  # fmt: skip
    columns = (
        "run", "protocol", "origin", "role", "length [s]", "rows", "load [g]", "temperature [°C]",
        "repairs",
    )  # fmt: skip
    return table(columns, rows)


def _ends(values: Sequence[float]) -> list[float]:
    """All of few values, the ends of many."""
    return list(values) if len(values) < 4 else [values[0], values[-1]]


def parameters(
    summary: Numbers, units: Mapping[str, str], printed: str | None, values: Mapping[str, Any]
) -> Table:
    """Posterior of each parameter beside a published value."""
    rows = []
    for name, row in summary["parameters"].items():
        cells = [
            name,
            unit_of(units[name] or "1"),
            number(row["mean"]),
            interval(row),
        ]
        if values:
            ends = values.get(name)
            told = (
                "" if ends is None else " to ".join(number(end, 6) for end in dict.fromkeys(ends))
            )
            inside = "" if ends is None else "yes" if agrees(row, ends) else "no"
            cells += [told, inside]
        rows.append((*cells, f"{row['rhat']:.3f}", f"{row['ess_bulk']:.0f}"))
    beside = (printed or "published", "inside") if values else ()
    return table(("parameter", "unit", "mean", "90 % interval", *beside, "R-hat", "ESS"), rows)


def checks(found: Numbers) -> Table:
    """Predictions against readings."""
    rows = [
        (
            name,
            "no" if not check["ahead"] else "yes",
            number(check["rmse"], 3),
            check["unit"],
            percent(check["coverage50"]),
            percent(check["coverage90"]),
            f"{check['pit_distance']:.2f}",
        )
        for name, check in found.items()
    ]
    columns = (
        "run", "predicted ahead", "RMSE", "unit", "in the 50 % band", "in the 90 % band", "PIT distance"
    )  # fmt: skip
    return table(columns, rows)


def creep(found: Numbers) -> Table:
    """Cold phases of a run."""
    unit = found["unit"]
    rows = [
        (
            f"{phase['start']:.0f} to {phase['end']:.0f}",
            f"{1e3 * phase['load']:.0f}",
            number(phase["slope"]["measured"], 3),
            number(phase["slope"]["predicted"]["mean"], 3),
            interval(phase["slope"]["difference"], 2),
            interval(phase["shift"]["difference"], 2),
        )
        for phase in found["phases"]
    ]
    columns = (
        "time [s]", "load [g]", f"slope [{unit}/min]", "predicted", "difference, 90 %",
        f"shift, measured - predicted [{unit}], 90 %",
    )  # fmt: skip
    return table(columns, rows)


def windows(found: Numbers) -> Table:
    """Where the nominal model misfits."""
    rows = [
        (
            one["run"],
            f"{number(one['start_s'], 3)} to {number(one['end_s'], 3)}",
            one["where"],
            f"{number(one['rms'], 2)} {one['unit']}",
            number(one["p_value"], 2),
            percent(one["share"]),
        )
        for one in found["located"]
    ]
    return table(("run", "time [s]", "where", "RMS", "p", "share of the excess"), rows)


def probabilities(found: Numbers) -> Table:
    """What the model may lack."""
    order = sorted(found["probabilities"].items(), key=lambda item: -item[1])
    rows = [(name, f"{100.0 * p:.1f} %") for name, p in order if p >= SHOWN]
    return table(("the model lacks", "probability"), rows)


def added(step: Numbers, floor: Numbers) -> Table:
    """What an effect changed, run by run."""
    held = step["held_out"]
    rows = []
    for before, after, mark in (
        (step["before"], step["after"], "no"),
        (held["before"], held["after"], "yes"),
    ):
        for run, check in after.items():
            rows.append(
                (
                    run, mark, number(before[run]["rmse"], 3), number(check["rmse"], 3),
                    f"{number(floor[run], 3)} {check['unit']}", _closed(step["closed"][run]),
                    percent(check["coverage90"]),
                )
            )  # fmt: skip
    columns = (
        "run", "held out", "RMSE before", "after", "noise alone", "gap closed", "in the 90 % band",
    )  # fmt: skip
    return table(columns, rows)


def _closed(share: float | None) -> str:
    return "no gap" if share is None else percent(share)


def gains(found: Numbers) -> Table:
    """Gains of every law, and whether any lies at an edge of the search."""
    rows = []
    for law, one in found["laws"].items():
        own = one["gains"]
        unit = "K" if "inner" in own else "duty"
        edges = ", ".join(found["edges"].get(law, ())) or "no"
        per = (number(own["proportional"]), number(own["integral"]), number(own["bias"], 3))
        rows.append((law, unit, *per, number(own["filter_time"], 3), edges))
    columns = ("law", "unit", "proportional [1/rad]", "integral [1/(rad s)]", "bias", "filter [s]")
    return table((*columns, "at an edge"), rows)


def risks(found: Numbers) -> Table:
    """Probability of meeting each scenario's limits, and all, under every law."""
    laws = found["laws"]
    rows = [
        (name, *(percent(one["scenarios"][name]["probability"]) for one in laws.values()))
        for name in found["specifications"]
    ]
    every = ("all", *(percent(one["probability"]) for one in laws.values()))
    lost = ("runaways", *(str(one["runaways"]) for one in laws.values()))
    return table(("scenario", *laws), [*rows, every, lost])


def sbc(found: Numbers) -> Table:
    """Calibrations of the posterior."""
    rows = [
        (
            name, str(one["sets"]), str(one["converged"]), str(one["quantities"]),
            one["least_uniform"]["name"], number(one["least_uniform"]["p_bonferroni"], 2),
        )
        for name, one in found.items()
    ]  # fmt: skip
    columns = ("posterior", "data sets", "converged", "quantities", "least uniform", "p, corrected")
    return table(columns, rows)


def trial(found: Numbers) -> Table:
    """Rates of a trial of discovery."""
    rows = [
        (
            one["what"], one["wanted"], f"{one['hits']} of {one['cases']}",
            f"{percent(one['low'])} to {percent(one['high'])}",
        )
        for one in found["rates"]
    ]  # fmt: skip
    return table(("claim", "wanted", "found", "95 % interval"), rows)


def gradient(found: Numbers) -> Table:
    """Time of value and gradient of the log posterior, ways against each other."""
    entries = [one for one in found["entries"] if one["timing"]]
    ours = entries[0]["timing"]["median"]
    rows = [
        (
            one["competitor"], one["level"], number(one["error"], 2),
            number(1e3 * one["timing"]["median"], 3), number(one["timing"]["median"] / ours, 3),
        )
        for one in entries
    ]  # fmt: skip
    return table(("way", "accuracy", "error [counts]", "time [ms]", "times ours"), rows)


def sampling(found: Numbers) -> Table:
    """Effective samples a second, samplers against each other."""
    rows = []
    for one in found["entries"].values():
        if one["failure"]:
            rows.append((one["sampler"], f"fails: {one['failure']}", "", "", ""))
            continue
        quality = one["quality"]
        rate = quality["ess"] / one["seconds"]
        rows.append(
            (
                one["sampler"], one["verdict"], number(quality["ess"], 3), number(quality["rhat"]),
                number(rate, 2),
            )
        )  # fmt: skip
    return table(("sampler", "verdict", "ESS", "R-hat", "ESS per second"), rows)
