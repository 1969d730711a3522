"""The mass on the cable over time, poured in small steps so that the metadata's table is exact."""

from math import ceil

POUR_STEP = 0.2
"""Time between the steps of a pour, s."""

_TIME_DECIMALS = 3
_MASS_DECIMALS = 6


class LoadSchedule:
    """Piecewise constant mass [kg]; times are measured from the origin, set when logging starts."""

    def __init__(self, mass: float) -> None:
        self.mass = mass
        self._origin = 0.0
        self._pending: list[tuple[float, float]] = []
        self._done: list[tuple[float, float]] = [(0.0, mass)]

    def start_log(self, time: float) -> None:
        """From now on times are reported relative to `time`; what came before is forgotten."""
        self._origin = time
        self._done = [(0.0, self.mass)]
        self._pending = [(max(at - time, 0.0), mass) for at, mass in self._pending]

    def change(self, time: float, mass: float, pour_time: float) -> None:
        """Schedule a change that starts at a time [s] and takes pour_time [s]."""
        self.settle(self._pending[-1][0] + self._origin if self._pending else time)
        start = time - self._origin
        count = max(ceil(pour_time / POUR_STEP), 1)
        for index in range(count):
            at = start + (index + 0.5) / count * pour_time
            reached = self.mass + (mass - self.mass) * (index + 1) / count
            self._pending.append((round(at, _TIME_DECIMALS), round(reached, _MASS_DECIMALS)))

    def next_change(self) -> float:
        """Time of the next step [s], infinite where none is pending."""
        return self._pending[0][0] + self._origin if self._pending else float("inf")

    def settle(self, time: float) -> bool:
        """Carry out the steps due at a time; tells whether the mass changed."""
        before = self.mass
        while self._pending and self._pending[0][0] + self._origin <= time:
            at, self.mass = self._pending.pop(0)
            if self._done[-1][0] == at:
                self._done.pop()
            self._done.append((at, self.mass))
        return self.mass != before

    def table_until(self, end: float) -> tuple[list[float], list[float]]:
        """Times and masses [kg] up to `end`, both times in s after the first row."""
        done = [(at, mass) for at, mass in self._done if at <= end]
        return [at for at, _ in done], [mass for _, mass in done]
