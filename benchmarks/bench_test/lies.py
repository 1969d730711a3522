"""What a sensor that lies shows: time [s] and true temperatures [C] in, shown ones out."""

from collections import deque
from collections.abc import Callable

import numpy as np

Shown = Callable[[float, tuple[float, float]], tuple[float, float]]
"""Time [s] and true temperatures -> what is reported [C]."""


def stuck(time: float, true: tuple[float, float]) -> tuple[float, float]:
    return 25.0, 25.0


def flickering(time: float, true: tuple[float, float]) -> tuple[float, float]:
    shown = 25.0 + 0.1 * (round(time / 0.4) % 2)
    return shown, shown


def falling(time: float, true: tuple[float, float]) -> tuple[float, float]:
    shown = max(25.0 - 0.1 * time, 15.0)
    return shown, shown


def share(share: float) -> Shown:
    def shown(time: float, true: tuple[float, float]) -> tuple[float, float]:
        first, second = (25.0 + share * (t - 25.0) for t in true)
        return first, second

    return shown


def swapped(time: float, true: tuple[float, float]) -> tuple[float, float]:
    return true[1], true[0]


def fahrenheit(time: float, true: tuple[float, float]) -> tuple[float, float]:
    return 1.8 * true[0] + 32.0, 1.8 * true[1] + 32.0


class Late:
    """Shows what was true some time ago [s]."""

    def __init__(self, delay: float) -> None:
        self._delay = delay
        self._past: deque[tuple[float, tuple[float, float]]] = deque()

    def __call__(self, time: float, true: tuple[float, float]) -> tuple[float, float]:
        if self._past and time < self._past[-1][0]:
            self._past.clear()
        self._past.append((time, true))
        while len(self._past) > 1 and self._past[1][0] <= time - self._delay:
            self._past.popleft()
        return self._past[0][1]


class Noisy:
    """Shows 25 C and noise of a standard deviation [C]."""

    def __init__(self, deviation: float) -> None:
        self._deviation = deviation
        self._random = np.random.default_rng(0)

    def __call__(self, time: float, true: tuple[float, float]) -> tuple[float, float]:
        first, second = 25.0 + self._deviation * self._random.standard_normal(2)
        return float(first), float(second)


def stuck_above(highest: float) -> Shown:
    """True up to a temperature [C], and stuck there."""

    def shown(time: float, true: tuple[float, float]) -> tuple[float, float]:
        return min(true[0], highest), min(true[1], highest)

    return shown


def drifting(rate: float) -> Shown:
    """Rises from 25 C at a rate [C/s], whatever is true."""

    def shown(time: float, true: tuple[float, float]) -> tuple[float, float]:
        return 25.0 + rate * time, 25.0 + rate * time

    return shown
