"""Candidates: a score test of every effect at several strengths, which says where descents begin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, groupby
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpyro.distributions import biject_to

from muscle_bayes.discovery.fit import Search
from muscle_bayes.discovery.fitted import Fitted, Start
from muscle_bayes.inference.search.nested import Nested, general, is_function
from muscle_bayes.physics.effects import effect_type


class Candidate(NamedTuple):
    """One strength of an effect, with present parameters moved to make room for it."""

    effect: str
    strength: float
    """Share of the prior draw's distance from off."""
    gain: float
    """Rise of the log density that it promises: -e . d - |d|^2 / 2, with e the standardised errors and
    d their change, after present parameters have absorbed their share."""
    start: Start
    signature: Float[np.ndarray, " error"]
    """d."""
    scaled: bool = False
    """Whether the strength was found by `_scaled`, not given."""

    @property
    def visible(self) -> float:
        """Log odds that readings would show for it, were it true [nat]."""
        return 0.5 * float(self.signature @ self.signature)


@dataclass(frozen=True)
class Visibility:
    """What these runs could show at all, from simulations of this rig at plausible strengths."""

    share: Mapping[str, float]
    """Of an effect's prior draws, how many would be seen."""
    alike: tuple[tuple[str, str], ...]
    """Pairs that change the readings in nearly the same way: these runs cannot separate them."""

    @property
    def unseen(self) -> tuple[str, ...]:
        """Effects of which most plausible strengths would go unseen."""
        return tuple(name for name, share in self.share.items() if share < 0.5)

    def text(self) -> str:
        """A line or two."""
        seen = [name for name in self.share if name not in self.unseen]
        lines = [f"These runs could show: {', '.join(seen) or 'none of the candidates'}."]
        if self.unseen:
            lines.append(
                f"Most strengths that the prior allows would not show: {', '.join(self.unseen)}."
            )
        if self.alike:
            pairs = "; ".join(" and ".join(pair) for pair in self.alike)
            lines.append(f"They cannot separate: {pairs}.")
        return " ".join(lines)


def candidates(
    search: Search,
    base: Fitted,
    effects: Sequence[str],
    seed: int,
    *,
    draws: int = 8,
    strengths: tuple[float, ...] = (1.0, 0.1, 0.01),
) -> dict[str, list[Candidate]]:
    """Strengths of every effect beside `base`, most promising first; none that cannot be simulated.

    Strengths far from off are simulated, not extrapolated: an effect that acts only beyond some
    threshold has no slope where it is off. Of the least strength there are at least as many draws as an
    effect asks for (`scanned`), and the best of these are tried as strong as a linear step makes them, with
    either sign.
    """
    given = [
        (effect, strength, own)
        for number, effect in enumerate(effects)
        for strength, own in _drawn(
            search.nested, effect, jax.random.key(seed + number), draws, strengths
        )
    ]
    found = _tried(search, base, given, scaled=False)
    rows = [row for some in found.values() for row in _scaled(base, some, strengths[-1])]
    for effect, more in _tried(search, base, rows, scaled=True).items():
        found[effect] += more
    ordered = {effect: found.get(effect, []) for effect in effects}
    return {
        effect: sorted((one for one, _ in some), key=lambda one: -one.gain)
        for effect, some in ordered.items()
    }


Draw = tuple[str, float, np.ndarray]
"""An effect, its strength, and its parameters."""


def _tried(
    search: Search, base: Fitted, rows: Sequence[Draw], *, scaled: bool
) -> dict[str, list[tuple[Candidate, Draw]]]:
    """Candidates of every effect with the draws they come from; none that cannot be simulated."""
    nested, kept, begun = search.nested, [], []
    for effect, given in groupby(rows, key=lambda row: row[0]):
        some = list(given)
        every = _unconstrained(nested, effect, np.stack([own for _, _, own in some]))
        for row, slots in zip(some, every, strict=True):
            if np.isfinite(slots).all():
                kept.append((row, slots))
                point = _joined(nested, base, base.point, effect, slots)
                begun.append(Start((*base.effects, effect), point, base.data))
    found: dict[str, list[tuple[Candidate, Draw]]] = {}
    seen = search.explained(begun) if begun else []
    for (row, slots), start, one in zip(kept, begun, seen, strict=True):
        if not (np.isfinite(float(one.potential)) and np.isfinite(one.errors).all()):
            continue
        change = one.errors - base.errors
        absorbed = base.precision.solve(base.jacobian.T @ change)
        rest = change - base.jacobian @ absorbed
        gain = float(-base.errors @ rest - 0.5 * (rest @ rest))
        moved = base.point.copy()
        moved[: base.used] -= np.clip(absorbed, -1.0, 1.0)
        there = start._replace(point=_joined(nested, base, moved, row[0], slots))
        candidate = Candidate(row[0], row[1], gain, there, rest, scaled)
        found.setdefault(row[0], []).append((candidate, row))
    return found


def _scaled(
    base: Fitted,
    tried: Sequence[tuple[Candidate, Draw]],
    strength: float,
    most: int = 2,
    farthest: float = 2.0,
) -> list[Draw]:
    """The draws of this strength that promise most, as strong as a linear step makes them."""
    rows = []
    for one, (effect, _, own) in tried:
        size = float(one.signature @ one.signature)
        if one.strength != strength or not size > 0.0:
            continue
        score = -float(base.errors @ one.signature)
        factor = float(np.clip(score / size, -farthest / strength, farthest / strength))
        parameters = effect_type(effect).parameters.values()
        values = [np.asarray(p.weakened(x, factor)) for p, x in zip(parameters, own, strict=True)]
        rows.append((0.5 * score**2 / size, (effect, factor * strength, np.array(values))))
    rows.sort(key=lambda row: -row[0])
    return [row for _, row in rows[:most]]


def promising(found: Sequence[Candidate], most: int = 4) -> list[Candidate]:
    """Of one effect's candidates those to descend from: the most promising, one of every strength."""
    if not found or is_function(found[0].effect):
        return list(found[:2])
    chosen = list(found[:2])
    left = {one.strength for one in found if not one.scaled} - {one.strength for one in chosen}
    for strength in sorted(left, reverse=True):
        chosen.append(next(one for one in found if one.strength == strength))
    rest = [one for one in found if all(one is not other for other in chosen)]
    return (chosen + rest)[:most]


def log_bayes_factors(found: Mapping[str, Sequence[Candidate]]) -> dict[str, float]:
    """Evidence of each effect against none in the linearised model: its mean density over the prior."""
    result = {}
    for effect, some in found.items():
        gains = np.array([one.gain for one in some if one.strength == 1.0] or [-np.inf])
        result[effect] = float(np.logaddexp.reduce(np.maximum(gains, -700.0)) - np.log(gains.size))
    return result


def could_show(
    found: Mapping[str, Sequence[Candidate]], *, needed: float = 6.0, alike: float = 0.97
) -> Visibility:
    """What these runs could show: strengths that would raise the log density by `needed` nats.

    Two effects are alike where the cosine between their signatures is above `alike`.
    """
    share = {
        effect: float(
            np.mean([one.visible > needed for one in some if one.strength == 1.0] or [False])
        )
        for effect, some in found.items()
    }
    typical = {}
    for effect, some in found.items():
        shown = [one for one in some if one.visible > needed]
        if shown:
            # The weakest that is seen: strong ones saturate.
            one = min(shown, key=lambda one: one.visible).signature
            typical[effect] = one / np.linalg.norm(one)
    pairs = tuple(
        (a, b) for a, b in combinations(typical, 2) if abs(typical[a] @ typical[b]) > alike
    )
    return Visibility(share, pairs)


def _joined(
    nested: Nested, base: Fitted, point: np.ndarray, effect: str, own: np.ndarray
) -> np.ndarray:
    """The base's point with slots for one effect more, whose unconstrained parameters are `own`."""
    own = nested.own_slots(effect, own, point)
    slots = np.concatenate([point[nested.shared : base.used], own])
    unused = max(nested.slots - slots.size, 0)
    return np.concatenate([point[: nested.shared], slots, np.zeros(unused)])


def _drawn(
    nested: Nested, effect: str, key: jax.Array, draws: int, strengths: tuple[float, ...]
) -> list[tuple[float, np.ndarray]]:
    """Strength, and the effect's parameters, of draws of its prior."""
    kind, held = effect_type(effect), general(effect)
    parameters, several = kind.parameters, max(draws, kind.scanned)
    weak = np.array([*strengths * draws, *strengths[-1:] * (several - draws)])
    which = np.r_[np.repeat(np.arange(draws), len(strengths)), np.arange(draws, several)]
    columns = []
    for part, (name, parameter) in zip(
        jax.random.split(key, len(parameters)), parameters.items(), strict=True
    ):
        drawn = nested.data.priors[f"{held}.{name}"].sample(part, (several,))
        weaker = parameter.weakened(drawn[which], jnp.asarray(weak))
        columns.append(np.broadcast_to(weaker, weak.shape))
    return list(zip(weak.tolist(), np.stack(columns, axis=1), strict=True))


def _unconstrained(
    nested: Nested, effect: str, own: Float[np.ndarray, "draw k"]
) -> Float[np.ndarray, "draw k"]:
    """Draws of an effect's parameters as `nested` holds them; not finite outside their support."""
    held = general(effect)
    supports = [
        nested.data.priors[f"{held}.{name}"].support for name in effect_type(effect).parameters
    ]
    pairs = zip(supports, own.T, strict=True)
    return np.stack([np.asarray(biject_to(support).inv(x)) for support, x in pairs], axis=1)
