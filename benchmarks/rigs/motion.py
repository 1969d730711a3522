"""Motion of one coordinate with dry friction, by small steps of the midpoint rule."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

Force = Callable[[float, float, float], float]
"""Generalised force but for dry friction at (time, coordinate, speed)."""


class Motion(NamedTuple):
    """Coordinate and speed at the rows' times."""

    q: np.ndarray
    speed: np.ndarray


def moved(
    force: Force,
    inertia: float,
    dry: float,
    time: np.ndarray,
    q: float,
    speed: float = 0.0,
    longest: float = 2e-4,
) -> Motion:
    """The motion from (q, speed) at time[0].

    A step that would reverse under a force that friction holds ends at rest; friction at rest holds any
    force up to `dry`.
    """
    found = [(q, speed)]
    now = float(time[0])
    for end in time[1:].tolist():
        steps = max(int(np.ceil((end - now) / longest)), 1)
        step = (end - now) / steps
        for _ in range(steps):
            q, speed = _stepped(force, inertia, dry, now, step, q, speed)
            now += step
        now = end
        found.append((q, speed))
    return Motion(*np.array(found).T)


def _stepped(
    force: Force, inertia: float, dry: float, now: float, step: float, q: float, speed: float
) -> tuple[float, float]:
    pull = force(now, q, speed)
    if speed == 0.0 and abs(pull) <= dry:
        return q, 0.0
    sign = np.sign(speed) if speed != 0.0 else np.sign(pull)
    half = speed + 0.5 * step * (pull - sign * dry) / inertia
    middle = force(now + 0.5 * step, q + 0.5 * step * speed, half)
    after = speed + step * (middle - sign * dry) / inertia
    if after * sign < 0.0:
        stop = step * speed / (speed - after)
        rest = q + 0.5 * stop * speed
        if abs(force(now + stop, rest, 0.0)) <= dry:
            return rest, 0.0
    return q + step * half, after
