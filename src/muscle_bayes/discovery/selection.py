"""Forward selection: named effects join one after the other, or two where each needs the other."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from muscle_bayes.discovery.candidates import could_show, log_bayes_factors
from muscle_bayes.discovery.conditions import traces
from muscle_bayes.discovery.draws import Draws
from muscle_bayes.discovery.fit import Search
from muscle_bayes.discovery.fitted import Fitted
from muscle_bayes.discovery.gate import Gate, Unseen, gate_by_runs
from muscle_bayes.discovery.locate import locate
from muscle_bayes.discovery.outcome import Found, Link
from muscle_bayes.discovery.search import (
    evidence,
    fit_candidates,
    from_starts,
    scored,
    with_own_motion,
)
from muscle_bayes.discovery.weigh import (
    NONE,
    Naming,
    blocks_of,
    could_claim,
    in_dispute,
    linear,
    weigh,
)

NOTHING_LEFT = "nothing significant that a named effect explains remains"


def add_names(
    found: Found, names: Sequence[str], smallest: float, told: Callable[[str], None], most: int = 3
) -> None:
    """Named effects, one after the other while readings not seen are predicted better by them."""
    search, remaining = found.search, list(names)
    while True:
        current = found.last
        begun = search.slow(current)
        search.report("score test", len(found.links), most)
        screened = scored(search, begun, remaining, search.seed)
        if found.visible is None:
            found.visible = could_show(screened)
            told(found.visible.text())
        left = found.left
        if left.steps < smallest or not could_claim(left.p_value) or len(found.links) == most:
            found.naming = found.naming or linear(log_bayes_factors(screened)).supported(
                left.p_value
            )
            found.stopped = NOTHING_LEFT
            if left.significant and left.steps < smallest:
                found.stopped = (
                    f"the misfit that is left is small: {left.steps:.2g} steps of the sensor RMS, "
                    f"below {smallest:g}"
                )
            elif len(found.links) == most and left.significant:
                found.stopped = f"{most} effects were added, which is the most"
            return
        better, fits = fit_candidates(search, begun, screened)
        near = with_own_motion(search, fits)
        if better.log_evidence > begun.log_evidence + 3.0:
            current = max(current, search.settled(better), key=evidence)
        naming = _weighed(found, current, near, fits, left.p_value)
        found.naming = found.naming or naming
        _set_last(found, current)
        if not naming.claims:
            found.stopped = NOTHING_LEFT
            return
        after = near[naming.best]
        gate = judge(search, current, after)
        rival = near.get(naming.tie[1]) if naming.tie else None
        links = [Link(naming.best, naming, current, after, gate, search, rival)]
        if not gate.passed:
            found.stopped = (
                f"{naming.best} would come next, but does not predict unseen readings better: "
                f"{gate.gain:+.1f} nat, standard error {gate.se:.1f}"
            )
            room = len(found.links) + 1 < most
            links = _with_another(found, links[0], remaining) if room else []
        if not links:
            return
        found.links += links
        for link in links:
            remaining.remove(link.effect)
        for index in range(len(found.links) - 1):
            _replace(found, index, remaining)
        found.left = locate(search, found.last)


def _with_another(found: Found, unsure: Link, names: Sequence[str]) -> list[Link]:
    """An effect that predicts unseen readings better only beside another, with that other one.

    Both stay if the two together, and each beside the other, predict them better.
    """
    search, first = found.search, unsure.after
    left = locate(search, first)
    if not could_claim(left.p_value):
        return []
    begun = search.slow(first)
    others = [name for name in names if name != unsure.effect]
    _, fits = fit_candidates(search, begun, scored(search, begun, others, search.seed))
    near = with_own_motion(search, fits, most=2)
    naming = _weighed(found, first, near, fits, left.p_value)
    if not naming.claims:
        return []
    both = near[naming.best]
    (second,) = search.fit([search.with_effects(both, (*unsure.before.effects, naming.best))])
    gates = [
        judge(search, before, both) for before in (unsure.before, search.settled(second), first)
    ]
    if not all(gate.passed for gate in gates):
        return []
    rival = near.get(naming.tie[1]) if naming.tie else None
    return [
        replace(unsure, gate=gates[1]),
        Link(naming.best, naming, first, both, gates[2], search, rival),
    ]


def _replace(found: Found, index: int, remaining: list[str]) -> None:
    """Another effect in the place of an earlier one, where the whole set is likelier with it.

    What explains most of a misfit alone may explain little of it beside what was added later.
    """
    search, last, old = found.search, found.last, found.links[index].effect
    present = tuple(link.effect for link in found.links if link.effect != old)
    (without,) = search.fit([search.with_effects(last, present)])
    begun = search.slow(without)
    fits = from_starts(search, scored(search, begun, remaining, search.seed + 1))
    near = with_own_motion(search, fits, most=2)
    best = max(near, key=lambda name: near[name].log_evidence, default=None)
    if best is None or near[best].log_evidence < last.log_evidence + 3.0:
        return
    remaining[:] = [old, *(name for name in remaining if name != best)]
    naming = _weighed(found, without, {**near, old: last}, {**fits, old: last}, found.left.p_value)
    order = [best if link.effect == old else link.effect for link in found.links]
    before, links = found.base, []
    for size, link in enumerate(found.links, 1):
        (after,) = search.fit([search.with_effects(near[best], order[:size])])
        after = search.settled(after)
        new = replace(link, effect=order[size - 1], before=before, after=after)
        if link.effect == old:
            new = replace(new, naming=naming, rival=near.get(naming.tie[1]) if naming.tie else None)
        links.append(replace(new, gate=judge(search, before, after)))
        before = after
    found.links = links
    if index == 0:
        found.naming = naming


def _set_last(found: Found, current: Fitted) -> None:
    """A better fit of the model that candidates were compared with takes its place."""
    if found.links:
        found.links[-1].after = current
    else:
        found.base = current


def _weighed(
    found: Found,
    base: Fitted,
    near: Mapping[str, Fitted],
    fits: Mapping[str, Fitted],
    p_value: float,
) -> Naming:
    """Probabilities of all candidates, those of the two likeliest checked against sampled posteriors.

    `p_value` is that of the misfit that they are to explain.
    """
    search = found.search
    best = max([base, *near.values()], key=evidence)
    lines = traces(search.nested, base)
    blocks = blocks_of(lines, in_dispute(base, best))
    naming = weigh(base, near, blocks, search.seed, among=len(fits))
    naming = naming.with_far(
        {n: one.log_evidence for n, one in fits.items() if n not in near},
        {n: fits[n].log_evidence for n in near},
    )
    models = {NONE: base, **near}
    checked: dict[str, Draws] = {}
    for name in [name for name in naming.order if name in models][:2]:
        search.report("probabilities, by importance sampling", len(checked), 2)
        checked[name] = found.draws_of(search, models[name])
        found.checks.append(checked[name].text(name))
    corrections = {name: one.log_evidence - one.laplace for name, one in checked.items()}
    if not all(one.good for one in checked.values()):
        corrections = {}
    return naming.corrected(corrections).supported(p_value)


def judge(search: Search, before: Fitted, after: Fitted) -> Gate:
    """By blocks of the fitted runs in turn, and by held-out runs where there are any."""
    search.report("gate", 0, 1)
    lines = traces(search.nested, before)
    blocks = blocks_of(lines, in_dispute(before, after))
    models = {"before": before, "after": after}
    gate = Unseen(search, models, blocks).gate("before", "after")
    if not search.held:
        return gate
    whole = traces(search.nested, before, whole=True)
    return gate.weighed_with(gate_by_runs(search, before, after, whole))
