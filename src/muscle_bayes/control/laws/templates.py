"""The laws that are compared: what is fixed in each, and the box in which its gains are looked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from muscle_bayes.control.laws.feedforward import static_inverse
from muscle_bayes.control.laws.gains import Gains, Inner, LawName, most_held
from muscle_bayes.control.laws.law import FULL_DUTY
from muscle_bayes.control.plant.draws import JointDraws

CEILING: Final = 98.5
"""Temperature that the governor lets the median joint hold [C]."""
CAUTION: Final = 10.0
"""Duty that the governor takes off for every kelvin nearer to it [duty / K]: with the lag of tubes and
thermocouples together this gains on the ceiling without passing it by much."""
TUNED: Final[tuple[LawName, ...]] = ("pi", "two-degrees", "feedforward", "cascade")
"""Laws that can be tuned."""

_DUTY: Final = {
    "proportional": (1000.0, 44000.0),  # at the bench's potentiometer: full duty for one count
    "integral": (5.0, 10000.0),
    "bias": (0.0, 20.0),
    "windup_time": (0.3, 1000.0),
}
_FILTER: Final = {"filter_time": (0.01, 10.0)}
_KELVIN: Final = {
    "proportional": (100.0, 2200.0),
    "integral": (0.5, 250.0),
    "bias": (0.0, 30.0),
    "windup_time": (0.3, 100.0),
    "filter_time": (0.03, 10.0),
}
BOXES: Final = {
    "pi": _DUTY,
    "two-degrees": _DUTY | _FILTER,
    "feedforward": _DUTY | _FILTER,
    "cascade": _KELVIN,
}
"""Lowest and highest of what is tuned, in the units of `Gains`."""
EDGE: Final = 0.01
"""Share of a box within which a gain is at its edge."""
LOWEST: Final = {"filter_time": "no filter"}
HIGHEST: Final = {
    "proportional": "full duty for one count",
    "windup_time": "no back-calculation",
}
"""What an edge of a box means, where nothing that matters lies beyond."""


@dataclass(frozen=True)
class Template:
    """A law with its box; a place in the unit cube stands for gains."""

    gains: Gains
    box: dict[str, tuple[float, float]]
    relay: float = np.inf
    """Proportional gain with which one count of error asks for full duty [duty / rad]."""

    def at(self, place: Sequence[float] | np.ndarray) -> Gains:
        """Gains at a place: logarithmic, but for the bias."""
        values = {}
        for x, (name, (low, high)) in zip(place[: len(self.box)], self.box.items(), strict=True):
            straight = low <= 0.0
            values[name] = low + x * (high - low) if straight else low * (high / low) ** x
        return self.gains.model_copy(update={key: float(value) for key, value in values.items()})

    def place(self, gains: Gains) -> np.ndarray:
        """Where such gains are in the unit cube, or its nearest place; the inverse of `at`."""
        found = []
        for name, (low, high) in self.box.items():
            value = float(getattr(gains, name))
            if low <= 0.0:
                found.append((value - low) / (high - low))
            else:
                found.append(np.log(max(value, low) / low) / np.log(high / low))
        return np.clip(found, 0.0, 1.0)

    def edges(self, place: np.ndarray) -> list[str]:
        """Gains that lie at an edge of the box, with what the edge means where it is physical.

        A bias of nothing is none.
        """
        found = []
        for x, (name, (low, _)) in zip(place, self.box.items(), strict=True):
            if x < EDGE and low > 0.0:
                found.append(name + self._physical(name, LOWEST))
            elif x > 1.0 - EDGE:
                found.append(name + self._physical(name, HIGHEST))
        return found

    def _physical(self, name: str, meanings: Mapping[str, str]) -> str:
        """What lies beyond an edge, in brackets, where nothing that matters does."""
        softer = self.box[name][1] < (1.0 - EDGE) * self.relay
        if name not in meanings or (name == "proportional" and softer):
            return ""
        return f" ({meanings[name]})"


def template(law: LawName, draws: JointDraws, period_ms: int = 30) -> Template:
    """The law for joints such as these: tables and the inner loop are made for their median."""
    median = draws.median()
    tube, room = median.values, float(median.values["room"][0])
    gain, cooling = (float(tube[f"heater.{key}"][0, 0]) for key in ("gain", "cooling"))
    hold = FULL_DUTY * cooling / gain
    none = CEILING + hold * (CEILING - room) / CAUTION
    governor = (round(none - FULL_DUTY / CAUTION, 1), round(none, 1))
    common = {"period_ms": period_ms, "proportional": 1.0, "integral": 1.0, "governor": governor}
    box = _on_the_board(law, draws, period_ms / 1000.0)
    if law == "cascade":
        inner = Inner(
            hold=hold, heat=15.0, room=draws.design.fixture.room_temperature, hottest=CEILING
        )
        table = static_inverse(draws, temperatures=True)
        return Template(Gains(law=law, inner=inner, feedforward=table, **common), box)
    known = static_inverse(draws) if law == "feedforward" else None
    relay = FULL_DUTY / draws.design.potentiometer.radians_per_count
    return Template(Gains(law=law, feedforward=known, **common), box, relay)


def _on_the_board(law: LawName, draws: JointDraws, period: float) -> dict[str, tuple[float, float]]:
    """The law's box, as far as the firmware's integers hold it at a control period [s]."""
    most = most_held(draws.design, period, law == "cascade")
    return {
        name: (min(low, 0.5 * most.get(name, high)), min(high, most.get(name, high)))
        for name, (low, high) in BOXES[law].items()
    }
