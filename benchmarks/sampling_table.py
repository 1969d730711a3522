"""The section of docs/benchmarks.md on samplers, from the results; no number is typed."""

from typing import Any, NamedTuple

AIMS = (
    ("NumPyro NUTS on diffrax", ("numpyro_diffrax",), 10.0),
    (
        "the best of Stan, PyMC, nutpie, emcee and PINTS on CVODES",
        ("stan", "pymc_casadi", "nutpie_casadi", "emcee_cvodes", "pints_cvodes"),
        50.0,
    ),
    (
        "the best of emcee and PINTS even on our steps, written out in C",
        ("emcee_floor", "pints_floor"),
        50.0,
    ),
)
"""How many times ours should draw more effective samples a second."""
UNRELIABLE = "not converged"
QUICK = {
    **dict.fromkeys(("numpyro_diffrax", "pymc_casadi", "nutpie_casadi", "stan"), "numpyro_ours"),
    "emcee_cvodes": "emcee_floor",
    "pints_cvodes": "pints_floor",
}
"""Who draws in the same way from a density quick enough to tell how good such draws are."""


def rate(entry: dict[str, Any]) -> float:
    """Effective samples of the worst identified quantity per second of warm-up and draws."""
    return entry["quality"]["ess"] / entry["seconds"]


def busy_rate(entry: dict[str, Any]) -> float:
    """The same per second of processor time."""
    return entry["quality"]["ess"] / entry["busy"] if entry["busy"] else 0.0


def _ratio(ours: float, theirs: float) -> str:
    return f"{ours / theirs:.3g}" if theirs else "more than any"


def _bound(entry: dict[str, Any]) -> str:
    return "at most " if entry["verdict"] == UNRELIABLE else ""


def _rhat(value: float) -> str:
    return f"{value:.3f}" if value < 10.0 else "none"


def _row(entry: dict[str, Any], ours: dict[str, Any]) -> str:
    if entry["failure"]:
        return f"| {entry['sampler']} | **fails:** {entry['failure']} |" + " |" * 11
    quality, bound = entry["quality"], _bound(entry)
    diverging = "not told" if entry["diverging"] < 0 else str(entry["diverging"])
    each = quality["ess"] / max(entry["evaluations"], 1)
    least = "at least " if bound else ""
    cells = [
        entry["sampler"],
        entry["verdict"],
        f"{entry['seconds']:.0f} s",
        f"{quality['chains']} x {quality['draws']}",
        f"{bound}{quality['ess']:.0f}",
        _rhat(quality["rhat"]),
        f"{quality['ess_all']:.0f}, {_rhat(quality['rhat_all'])}",
        diverging,
        str(entry["evaluations"]),
        f"{bound}{each:.2g}",
        f"{bound}{rate(entry):.2g}",
        f"{least}{_ratio(rate(ours), rate(entry))}",
        f"{least}{_ratio(busy_rate(ours), busy_rate(entry))}",
    ]
    return f"| {' | '.join(cells)} |"


def _rows(entries: dict[str, dict[str, Any]]) -> list[str]:
    titles = (
        "sampler",
        "verdict",
        "time",
        "draws",
        "ESS",
        "R-hat",
        "ESS and R-hat of all",
        "divergences",
        "evaluations",
        "ESS per evaluation",
        "ESS/s",
        "ours is faster by",
        "by processor time",
    )
    head = [f"| {' | '.join(titles)} |", "|" + "---|" * len(titles)]
    return head + [_row(entry, entries["ours"]) for entry in entries.values()]


BOUND, ESTIMATE, SEEN = "at least ", "some ", ""
"""What stands before a ratio of ours to a rate that is bounded, estimated, or seen in draws."""


class Rate(NamedTuple):
    """Effective samples a second that a sampler has, and how this is known."""

    value: float
    known: str
    """BOUND, ESTIMATE or SEEN."""


def _at_own_pace(entries: dict[str, dict[str, Any]], name: str, processes: int) -> Rate | None:
    """Draws as good as on a quick density, at the pace of this one; None where no such draws tell."""
    quick = entries.get(QUICK.get(name, ""))
    if quick is None or quick["failure"]:
        return None
    each = quick["quality"]["ess"] / quick["evaluations"]
    known = BOUND if quick["verdict"] == UNRELIABLE else ESTIMATE
    return Rate(each * processes / entries[name]["call"], known)


def _known_rate(entries: dict[str, dict[str, Any]], name: str, processes: int) -> Rate:
    """What its draws tell; where they only bound the rate, the least of this and of `_at_own_pace`."""
    entry = entries[name]
    if entry["verdict"] != UNRELIABLE:
        return Rate(rate(entry), SEEN)
    bound = Rate(rate(entry), BOUND)
    paced = _at_own_pace(entries, name, processes)
    return bound if paced is None or paced.value >= bound.value else paced


def _aims(entries: dict[str, dict[str, Any]], processes: int) -> list[str]:
    lines = [
        "| ours draws more effective samples a second than | wanted | measured |",
        "|---|---|---|",
    ]
    ours = rate(entries["ours"])
    for meaning, names, wanted in AIMS:
        rates = {
            name: _known_rate(entries, name, processes)
            for name in names
            if name in entries and not entries[name]["failure"]
        }
        if not rates:
            lines.append(f"| {meaning} | {wanted:g} x | none was measured |")
            continue
        best = max(rates, key=lambda name: rates[name].value)
        theirs = rates[best]
        if ours >= wanted * theirs.value:
            holds = "holds"
        elif theirs.known == BOUND:
            holds = "**not shown**, its draws only bound its rate"
        else:
            holds = "**missed**"
        if entries["ours"]["verdict"] == UNRELIABLE:
            holds = "**not shown**, ours did not converge"
        lines.append(
            f"| {meaning} ({entries[best]['sampler']}) | {wanted:g} x "
            f"| {theirs.known}{_ratio(ours, theirs.value)} x: {holds} |"
        )
    return lines


def _at_their_pace(entries: dict[str, dict[str, Any]], processes: int) -> list[str]:
    """What a longer cap would give those whose draws were too few to tell."""
    lines = []
    for name, quick in QUICK.items():
        entry = entries.get(name)
        if entry is None or entry["failure"]:
            continue
        paced = _at_own_pace(entries, name, processes)
        if paced is None:
            continue
        bound = paced.known == BOUND
        each = entries[quick]["quality"]["ess"] / entries[quick]["evaluations"]
        cells = [
            entry["sampler"],
            f"{processes / entry['call']:.2g}",
            entries[quick]["sampler"],
            f"{'at most ' if bound else ''}{each:.2g}",
            f"{'at most ' if bound else ''}{paced.value:.2g}",
            f"{'at least ' if bound else ''}{_ratio(rate(entries['ours']), paced.value)}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    if not lines:
        return []
    return [
        "Were their draws as good as those drawn in the same way from a quick density, then at their own "
        "pace of evaluations:",
        "",
        "| sampler | evaluations a second | draws as good as | ESS per evaluation | ESS/s "
        "| ours is faster by |",
        "|---|---|---|---|---|---|",
        *lines,
        "",
        "Where a sampler's own draws only bound its rate, what is wanted of ours is held against the "
        "lesser of bound and this.",
        "",
    ]


def section(results: dict[str, Any]) -> str:
    """The section, to follow that of the gradient."""
    entries = results["entries"]
    ours = entries["ours"]
    walls, stages = ours["walls"], ours["stages"]
    told = ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in stages.items())
    enough = "reached" if ours["verdict"] == "converged" else "**did not reach**"
    versions = ", ".join(f"{name} {value}" for name, value in results["machine"].items())
    off = ", ".join(
        f"{entry['sampler']} {entry['density_off']:.1g}"
        for entry in entries.values()
        if not entry["failure"] and entry is not ours
    )
    lines = [
        "",
        "## Draws from the joint posterior of three staircases",
        "",
        f"{results['unknowns']} unknowns. Each sampler but ours draws for {results['cap']:g} s, its "
        f"compilation not counted, with {results['processes']} processes; what it had drawn by then is "
        "judged.",
        f"Machine: {versions}; load average {results['load']:.1f} when it began.",
        "",
        "ESS is arviz's bulk effective sample size of the worst quantity, R-hat the greatest. Those of "
        f"{' and '.join(results['hardly_known'])} are told with all only:",
        "spring runs are made to tell these two, quasi-static runs do not show J. Where R-hat exceeds "
        f"{results['largest_rhat']:g} the draws tell no more than a bound.",
        "Evaluations are of gradients; ours, emcee's and PINTS's of values. They include warm-up.",
        "",
        *_rows(entries),
        "",
        f"Ours {enough} R-hat <= 1.01 and ESS >= 400 within {walls['cold']:.1f} s of a cold start and "
        f"{walls['warm']:.1f} s of a warm one, by the clock of whoever started the process.",
        f"Warm: {told}. Its rate above counts sampling with warm-up, as the others' does; with "
        "everything from the start of the",
        f"process it is {ours['quality']['ess'] / walls['warm']:.2g} ESS/s warm, "
        f"{ours['quality']['ess'] / walls['cold']:.2g} cold.",
        "",
        *_at_their_pace(entries, results["processes"]),
        *_aims(entries, results["processes"]),
        "",
        "Log posteriors differ from ours at dispersed points, a constant taken off, by at most: "
        f"{off}.",
        "",
    ]
    return "\n".join(lines)
