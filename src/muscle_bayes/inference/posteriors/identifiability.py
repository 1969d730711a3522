"""What the data do and do not determine: a posterior held against its prior.

Each parameter x is taken as sign(x) log |x| where prior and posterior keep one sign, else as it is,
and divided by its prior spread. With prior covariance P and posterior covariance S in these
coordinates, S v = r P v gives independent directions d = P v along which the data leave the share
r of the prior's variance: 0 where they determine everything, 1 where they say nothing.
"""

import json
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from muscle_bayes.errors import refuse_all_but
from muscle_bayes.inference.posteriors.posterior import Posterior

UNDETERMINED = 0.3
"""Share of the prior's variance above which the data do not determine a direction."""
LARGE_LOADING = 0.35
"""A direction is told by the parameters that load at least this much of its largest loading."""
LARGE_SHARE = 0.3
"""So are those with at least this share of their own posterior variance along it."""
STRONG_CORRELATION = 0.7
TIED = 0.9
"""Share of a parameter's posterior variance that the others explain, above which it is tied."""
EDGE_TAIL, EDGE_SHARE = 0.01, 0.2
"""At a bound: more than EDGE_SHARE of the posterior lies in the prior's outer EDGE_TAIL."""
WINSOR = 0.01
"""Prior draws beyond these quantiles are pulled in: ratios of draws have heavy tails."""

Values = NDArray[np.float64]


@dataclass(frozen=True)
class ParameterReport:
    """How far the data inform one parameter."""

    contraction: float
    """1 - width of the posterior's 90 % interval over the prior's, on the coordinate used"""
    logarithmic: bool
    edge: str
    """low or high where it sits at a bound, else empty"""
    explained: float
    """share of its posterior variance that the other parameters explain (R^2)"""
    tied_to: dict[str, float]
    """the others that explain it where TIED, with their standardised regression weights"""


@dataclass(frozen=True)
class Direction:
    """A direction of parameter space that the prior and the posterior treat as independent."""

    variance_ratio: float
    loadings: dict[str, float]
    """movement of each parameter along it, in its prior spreads; largest is positive"""
    undetermined: bool
    words: str


@dataclass(frozen=True, repr=False)
class Identifiability:
    """The report. Trade-offs are pairs of parameters with their posterior correlation."""

    parameters: dict[str, ParameterReport]
    trade_offs: tuple[tuple[str, str, float], ...]
    directions: tuple[Direction, ...]
    """least determined first"""

    @property
    def undetermined(self) -> tuple[Direction, ...]:
        """Directions that the data do not determine."""
        return tuple(direction for direction in self.directions if direction.undetermined)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and words."""
        return asdict(self)

    def text(self) -> str:
        """The report in lines of plain text."""
        lines = ["Contraction from prior to posterior (1: fully determined, 0: not at all)"]
        for name, row in self.parameters.items():
            edge = f", AT ITS {row.edge.upper()} BOUND" if row.edge else ""
            lines.append(f"  {name}: {row.contraction:.2f}{edge}")
        lines.append("Directions that the data do not determine")
        lines += [f"  {direction.words}" for direction in self.undetermined] or ["  none"]
        lines.append(f"Trade-offs (posterior correlation beyond {STRONG_CORRELATION:g})")
        lines += [f"  {a} and {b}: {r:+.2f}" for a, b, r in self.trade_offs] or ["  none"]
        lines.append("Determined only together")
        lines += [
            f"  {_tie(name, row)}" for name, row in self.parameters.items() if row.tied_to
        ] or ["  none"]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return self.text()

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{name}<td>{row.contraction:.2f}<td>{row.edge or '-'}"
            f"<td>{row.explained:.2f}</tr>"
            for name, row in self.parameters.items()
        )
        header = "<th>parameter<th>contraction<th>at a bound<th>explained by the others"
        told = self.text().split("Directions", 1)[1]
        return f"<table><tr>{header}</tr>{rows}</table><pre>Directions{told}</pre>"


def _tie(name: str, row: ParameterReport) -> str:
    others = ", ".join(f"{other} ({weight:+.2f})" for other, weight in row.tied_to.items())
    return f"{name} follows {others}: R^2 {row.explained:.2f}"


def coordinates(prior: Values, posterior: Values) -> tuple[Values, Values, bool]:
    """Both as sign(x) log |x| if neither changes sign, and whether they are; prior tails pulled in."""
    both = np.concatenate([prior, posterior])
    logarithmic = bool(np.all(both > 0.0) or np.all(both < 0.0))
    if logarithmic:
        sign = np.sign(both[0])  # of the logarithm too, so that "up" means up for the parameter
        prior, posterior = sign * np.log(np.abs(prior)), sign * np.log(np.abs(posterior))
    return np.clip(prior, *np.quantile(prior, [WINSOR, 1.0 - WINSOR])), posterior, logarithmic


def _width(values: Values) -> float:
    low, high = np.quantile(values, [0.05, 0.95])
    return float(high - low)


def edge_of(prior: Values, posterior: Values) -> str:
    """Which end of the prior the posterior piles up at."""
    low, high = np.quantile(prior, [EDGE_TAIL, 1.0 - EDGE_TAIL])
    if np.mean(posterior < low) > EDGE_SHARE:
        return "low"
    return "high" if np.mean(posterior > high) > EDGE_SHARE else ""


def _inverse_correlation(correlation: Values) -> Values:
    """Ridged, as parameters that fully determine one another make it singular."""
    return np.linalg.inv(correlation + 1e-9 * np.eye(len(correlation)))


def _ties(names: list[str], correlation: Values) -> list[tuple[float, dict[str, float]]]:
    """R^2 of each parameter on the others and, where high, the weights that matter."""
    precision = _inverse_correlation(correlation)
    result = []
    for index in range(len(names)):
        explained = float(np.clip(1.0 - 1.0 / precision[index, index], 0.0, 1.0))
        weights = -precision[index] / precision[index, index]
        weights[index] = 0.0
        least = LARGE_LOADING * np.max(np.abs(weights))
        order = [int(i) for i in np.argsort(-np.abs(weights)) if abs(weights[i]) >= least > 0.0]
        tied = {names[i]: float(weights[i]) for i in order} if explained > TIED else {}
        result.append((explained, tied))
    return result


def _direction(names: list[str], ratio: float, move: Values, share: Values) -> Direction:
    """`share` is how much of each parameter's posterior variance lies along the direction."""
    largest = float(move[np.argmax(np.abs(move))])
    move = move * np.sign(largest)
    order = np.argsort(-np.abs(move))
    chosen = [
        int(i)
        for i in order
        if abs(move[i]) >= LARGE_LOADING * abs(largest) or share[i] >= LARGE_SHARE
    ]
    moves = [f"{names[i]} {'up' if move[i] > 0 else 'down'}" for i in chosen]
    together = " with ".join([moves[0], ", ".join(moves[1:])]) if len(moves) > 1 else moves[0]
    words = f"{together}: {min(ratio, 1.0):.0%} of the prior's variance remains"
    loadings = {names[i]: float(move[i]) for i in order}
    return Direction(ratio, loadings, ratio > UNDETERMINED, words)


def directions(names: list[str], prior: Values, posterior: Values) -> tuple[Direction, ...]:
    """Directions of S v = r P v, largest r first. Draws have shape (draw, parameter)."""
    spread = prior.std(axis=0)
    p = np.cov(prior / spread, rowvar=False).reshape(len(names), len(names))
    s = np.cov(posterior / spread, rowvar=False).reshape(len(names), len(names))
    p = p + 1e-6 * np.eye(len(names))
    ratios, vectors = eigh(s, p)
    moves = p @ vectors
    shares = ratios * moves**2 / np.diag(s)[:, None]
    return tuple(
        _direction(names, float(ratios[i]), moves[:, i], shares[:, i])
        for i in np.argsort(ratios)[::-1]
    )


def _scalars(posterior: Posterior) -> list[str]:
    return [name for name in posterior.parameters if posterior.tree["posterior"][name].ndim == 2]


def _bounded_sites(posterior: Posterior, names: list[str]) -> list[str]:
    """Scalar sampled quantities of the plant that are no parameters, yet may sit at a bound."""
    sampled = json.loads(posterior.tree.attrs["sampled"])
    group = posterior.tree["posterior"]
    return [n for n in sampled if n not in names and "." not in n and group[n].ndim == 2]


def identify(posterior: Posterior) -> Identifiability:
    """What the data determine of the plant's parameters and the effects', and what they do not.

    Args:
        posterior: with its prior's draws, as `fit` leaves it.

    Returns:
        Of each parameter how much narrower the posterior is than the prior, and whether it sits at
        a bound. Also pairs that trade off, and directions that the data do not determine.

    Example:
        >>> import muscle_bayes as mb
        >>> posterior = mb.fit(mb.load_example("springs"), effort="quick", progress=False)
        >>> report = mb.identify(posterior)
        >>> report.parameters["J"].contraction > 0.9
        True
    """
    refuse_all_but(Posterior, posterior, "posterior", "give one that `fit` or `load` returns")
    names = _scalars(posterior)
    draws: dict[str, tuple[Values, Values, bool]] = {}
    for name in [*names, *_bounded_sites(posterior, names)]:
        before, after = (
            posterior.tree[group][name].to_numpy().astype(float).ravel()
            for group in ("prior", "posterior")
        )
        draws[name] = coordinates(before, after)
    prior = np.stack([draws[name][0] for name in names], axis=1)
    after = np.stack([draws[name][1] for name in names], axis=1)
    correlation = np.corrcoef(after, rowvar=False).reshape(len(names), len(names))
    ties = dict(zip(names, _ties(names, correlation), strict=True))
    reports = {
        name: ParameterReport(
            1.0 - _width(values) / _width(before),
            log,
            edge_of(before, values),
            *ties.get(name, (0.0, {})),
        )
        for name, (before, values, log) in draws.items()
    }
    pairs = [
        (names[i], names[j], float(correlation[i, j]))
        for i in range(len(names))
        for j in range(i)
        if abs(correlation[i, j]) > STRONG_CORRELATION
    ]
    pairs.sort(key=lambda pair: -abs(pair[2]))
    return Identifiability(reports, tuple(pairs), directions(names, prior, after))


def only_ratios(posterior: Posterior, loose: float = 0.2, tied: float = 0.1) -> list[str]:
    """Positive parameters of which the readings identify no more than their ratios.

    As J, friction and rates where no mass, inertia or force is stated.

    Args:
        posterior: whose scalar parameters.
        loose: standard deviation of a logarithm above which a parameter is not identified.
        tied: share of it that a ratio's logarithm may keep.

    Returns:
        Their names: none, or two and more.
    """
    draws = {
        name: posterior.tree["posterior"][name].to_numpy().ravel() for name in _scalars(posterior)
    }
    logs = {name: np.log(values) for name, values in draws.items() if np.all(values > 0.0)}
    open_ones = {name: log for name, log in logs.items() if log.std() > loose}
    groups = [
        [other for other, log in open_ones.items() if (log - own).std() < tied * own.std()]
        for own in open_ones.values()
    ]
    largest = max(groups, key=len, default=[])
    return largest if len(largest) > 1 else []
