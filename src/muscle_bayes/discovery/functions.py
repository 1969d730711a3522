"""Smooth functions on every port, for what no named effect explains."""

from collections.abc import Sequence

import numpy as np

from muscle_bayes.discovery.anneal import annealed
from muscle_bayes.discovery.conditions import Trace, traces
from muscle_bayes.discovery.fit import Search
from muscle_bayes.discovery.fitted import Fitted, Start
from muscle_bayes.discovery.gate import Unseen
from muscle_bayes.discovery.nominal import nest
from muscle_bayes.discovery.outcome import Found, Link
from muscle_bayes.discovery.search import evidence
from muscle_bayes.discovery.weigh import Naming, blocks_of, in_dispute
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.physics.effect import MUSCLE_PORTS
from muscle_bayes.physics.effects.empirical import PORT_SIGNALS, PREFIX, TERMS, function_name

TRACED = {
    "q": ("angle", "position"),
    "speed": ("speed", "velocity"),
    "load": ("load",),
    "strain": ("sigma",),
    "hyst": ("sigma_hyst",),
    "temperature": ("T",),
}
"""Names of a port's signals in a run's trace."""


def ports(nested: Nested) -> tuple[str, ...]:
    """Names of the functions of every port that these runs have, as a nested model takes them."""
    muscle = any(name == "F_modulus_min" for name, _ in nested.layout.shapes)
    return tuple(f"{PREFIX}-{p}" for p in PORT_SIGNALS if muscle or p not in MUSCLE_PORTS)


def function_names(lines: Sequence[Trace], having: Sequence[str]) -> list[str]:
    """Every port with every signal that varies in the runs, over the range it has there."""
    found = []
    for port, signals in PORT_SIGNALS.items():
        if f"{PREFIX}-{port}" not in having:
            continue
        for signal in signals:
            seen = [
                line.signals[name]
                for line in lines
                for name in TRACED[signal]
                if name in line.signals
            ]
            values = np.concatenate(seen) if seen else np.zeros(1)
            if np.ptp(values) > 0.0:
                found.append(function_name(port, signal, *_rounded(values)))
    return found


def _rounded(values: np.ndarray) -> tuple[float, float]:
    """A range that holds nearly all values, widened to a coarse grid: 1, 2 or 5 times a power of ten."""
    low, high = np.quantile(values, (0.005, 0.995))
    if low == high:
        low, high = values.min(), values.max()
    rough = (high - low) / 10.0
    unit = 10.0 ** np.floor(np.log10(rough))
    steps = np.array([1.0, 2.0, 5.0, 10.0])
    step = unit * steps[np.searchsorted(steps, rough / unit)]
    return float(np.floor(low / step) * step), float(np.ceil(high / step) * step)


def fit_functions(
    search: Search, base: Fitted, names: Sequence[str], most: int = 5
) -> dict[str, Fitted]:
    """Functions beside `base`: all judged by what a linear step promises, the `most` best fitted.

    They act nearly linearly, so a descent begins where they are off.
    """
    nested, own = search.nested, base.point[: base.used]
    slots = {name: nested.choice((*base.effects, name)).slot.size for name in names}
    rows = [
        Start(
            (*base.effects, n), np.r_[own, np.zeros(nested.shared + slots[n] - own.size)], base.data
        )
        for n in names
    ]
    seen = search.fit(rows, steps=0)

    def promise(one: Fitted) -> float:
        gradient = np.asarray(one.look.gradient)[: one.used]
        return float(gradient @ one.precision.solve(gradient))

    order = sorted(range(len(names)), key=lambda i: -promise(seen[i]))[:most]
    plain = [seen[i].start for i in order]
    starts = annealed(search, plain, [names[i] for i in order])
    best: dict[str, Fitted] = {}
    for one in search.fit([*starts, *plain], behind=300.0):
        name = one.effects[-1]
        if name not in best or one.log_evidence > best[name].log_evidence:
            best[name] = one
    return best


def add_function(found: Found, enough: float = 0.9) -> None:
    """The best function beside the names and instead of them, and what each closes of the gap.

    Names that close `enough` of what the best function closes on unseen readings stay; the function then
    describes the remainder. Otherwise the verdict is unknown, unless the names help the function too.
    """
    search, base, last = found.search, found.base, found.last
    search.report("functions", 0, 2)
    unnamed = ports(search.nested)
    slots = len(search.nested.slots_of(last.effects)) + TERMS
    inner, (plain, named) = nest(search, (*last.effects, *unnamed), (base, last), slots)
    names = function_names(traces(inner.nested, named), unnamed)
    models = {"none": plain, "names": named}
    for key, one in {"instead": plain, "beside": named}.items():
        if key == "beside" and not found.links:
            break
        fits = fit_functions(inner, inner.slow(one), names)
        if fits:
            models[key] = inner.settled(max(fits.values(), key=evidence))
        search.report("functions", 1, 2)
    top = max(models.values(), key=evidence)
    blocks = blocks_of(traces(inner.nested, plain), in_dispute(plain, top))
    unseen = Unseen(inner, models, blocks)
    closed = {name: unseen.closed("none", name) for name in models}
    most = max(closed.values())
    share = closed["names"] / most if most > 0.0 else 1.0
    _shares(found, most)
    instead = models.get("instead")
    beside = models.get("beside") if found.links else instead
    lead = -np.inf if instead is None else instead.log_evidence - named.log_evidence
    helped = beside is not None and beside.log_evidence > (
        -np.inf if instead is None else instead.log_evidence + 3.0
    )
    found.replaces = share < enough and lead > 0.0 and not (found.links and helped)
    found.odds = float(np.exp(np.clip(lead, 0.0, 700.0))) if found.replaces else 1.0
    key = "instead" if found.replaces or not found.links else "beside"
    before = "none" if found.replaces else "names"
    after = models.get(key)
    if after is None:
        return
    gate = unseen.gate(before, key)
    if not gate.passed:
        found.replaces, found.odds = False, 1.0
        return
    blank = Naming({}, {}, {})
    rest = (closed[key] - closed[before]) / most if most > 0.0 else 0.0
    found.unknown = Link(after.effects[-1], blank, models[before], after, gate, inner, share=rest)
    if found.replaces or share < enough:
        found.stopped = "what is left is described by a function that nobody has named"


def _shares(found: Found, most: float) -> None:
    """What each named effect closes of the gap that any model closes, on readings left out."""
    if not found.links or most <= 0.0:
        return
    links = found.links
    models = {"none": found.base, **{link.effect: link.after for link in links}}
    blocks = blocks_of(traces(found.search.nested, found.base), in_dispute(found.base, found.last))
    unseen = Unseen(found.search, models, blocks)
    closed = 0.0
    for link in links:
        now = unseen.closed("none", link.effect)
        link.share, closed = (now - closed) / most, now
