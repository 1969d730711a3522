"""Scan statistic: windows of all lengths against what chance gives the most extreme of them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.stats import gumbel_r

from muscle_bayes.inference.search.factored import FactoredPrecision

LEAST_P = 1e-12
"""Smaller p-values are not told: no tail is known so far out."""


class Scan(NamedTuple):
    """Every window, judged."""

    start: Int[np.ndarray, " window"]
    """First error of the window, all runs one after the other."""
    end: Int[np.ndarray, " window"]
    """Last error, plus one."""
    run: Int[np.ndarray, " window"]
    score: Float[np.ndarray, " window"]
    """z |z| / 2, with z the more extreme of two normal scores: how large errors are, and how lasting."""
    p_value: Float[np.ndarray, " window"]
    """Probability that without misfit any window scores as high."""
    lasting: Bool[np.ndarray, " window"]
    """Whether errors of one sign say more against the window than large ones."""
    errors: Float[np.ndarray, " error"]
    """What parameters cannot absorb of each."""
    expected: Float[np.ndarray, " error"]
    """Mean square of that without misfit."""

    def excess(self, index: int) -> Float[np.ndarray, " error"]:
        """Squares of a window's errors beyond what is expected, of lasting ones those of their mean m.

        e^2 - (e - m)^2 is what m explains of each.
        """
        inside = slice(int(self.start[index]), int(self.end[index]))
        e, expected = self.errors[inside], self.expected[inside]
        if not self.lasting[index]:
            return e**2 - expected
        return 2.0 * e * e.mean() - e.mean() ** 2 - expected / e.size


def scan(
    errors: Float[np.ndarray, " error"],
    slopes: Float[np.ndarray, "error n"],
    information: Float[np.ndarray, "n n"],
    sizes: Sequence[int],
    replicates: Float[np.ndarray, "error replicate"],
) -> Scan:
    """Judge windows of all lengths in runs of these sizes.

    Standardised errors e keep the part that parameters cannot absorb: e - S (S'S + P)^-1 S'e, with
    slopes S and S'S + P the information. Each window's sum of squares, which tells large errors, and
    its sum, which tells small ones that last, are compared with those of `replicates`, errors without
    misfit; its p-value is the probability that any window of any run is as extreme in either.
    Source: Westfall and Young, Resampling-Based Multiple Testing (1993).
    """
    precision = FactoredPrecision(information)

    def left(values: np.ndarray) -> np.ndarray:
        return values - slopes @ precision.solve(slopes.T @ values)

    null, seen = left(replicates), left(errors)
    start, end, run = _windows(sizes)

    def sums(values: np.ndarray) -> np.ndarray:
        total = np.cumsum(np.vstack([np.zeros((1, values.shape[1])), values]), axis=0)
        return total[end] - total[start]

    squares = sums(null**2)
    law = squares.mean(axis=1, keepdims=True), squares.std(axis=1, keepdims=True) + 1e-12
    spread = sums(null).std(axis=1, keepdims=True) + 1e-12

    def judged(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        large, lasting = _normal_score(sums(values**2), *law), np.abs(sums(values)) / spread
        z = np.maximum(large, lasting)
        return 0.5 * z * np.abs(z), lasting > large

    score, lasting = (one[:, 0] for one in judged(seen[:, None]))
    p_value = of_largest(score, judged(null)[0].max(axis=0))
    return Scan(start, end, run, score, p_value, lasting, seen, np.mean(null**2, axis=1))


def _normal_score(total: np.ndarray, mean: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """Standard normal score of a sum of squares of this mean and standard deviation.

    The cube root of a gamma variable is nearly normal. Source: Wilson and Hilferty, PNAS 17 (1931).
    """
    ninth = (deviation / mean) ** 2 / 9.0
    return (np.cbrt(total / mean) - (1.0 - ninth)) / np.sqrt(ninth)


def of_largest(
    score: Float[np.ndarray, " window"],
    extreme: Float[np.ndarray, " replicate"],
    counted: int = 10,
) -> Float[np.ndarray, " window"]:
    """Probability that the largest score without misfit is as high, from that of many replicates.

    Their share, and where fewer than `counted` are as high, the tail of the Gumbel distribution with
    their mean and variance, joined to it there. Source: Abrams, Kleinman and Kulldorff, International
    Journal of Health Geographics 9:61 (2010).
    """
    share = (1 + np.sum(extreme[None, :] >= score[:, None], axis=1)) / (extreme.size + 1)
    law = gumbel_r(*_by_moments(extreme))
    joint = np.sort(extreme)[-counted]
    level = counted / (extreme.size + 1)
    tail = level * np.exp(law.logsf(score) - law.logsf(joint))
    return np.where(score > joint, np.maximum(tail, LEAST_P), share)


def _by_moments(values: np.ndarray) -> tuple[float, float]:
    """Location and scale of the Gumbel distribution with these values' mean and variance."""
    scale = float(np.std(values)) * np.sqrt(6.0) / np.pi
    return float(np.mean(values)) - np.euler_gamma * scale, scale


def _windows(
    sizes: Sequence[int], shortest: int = 8
) -> tuple[Int[np.ndarray, " w"], Int[np.ndarray, " w"], Int[np.ndarray, " w"]]:
    """First and last-plus-one error and run of every window: halves, quarters, ... each by half over."""
    starts, ends, owner, offset = [], [], [], 0
    for run, size in enumerate(sizes):
        length = size
        while length >= min(shortest, size) and length > 0:
            for start in range(0, size - length + 1, max(length // 2, 1)):
                starts.append(offset + start)
                ends.append(offset + start + length)
                owner.append(run)
            length //= 2
        offset += size
    return np.array(starts), np.array(ends), np.array(owner)
