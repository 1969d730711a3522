"""Gains as a TOML file, as the board's integers, and as the header that `make firmware` compiles in."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Final, Literal

import jax.numpy as jnp
import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from muscle_bayes.control.laws.law import ENTRIES, Law, Numbers
from muscle_bayes.control.plant.design import Design
from muscle_bayes.data.describing.elements import Finite, NonNegative, Table, as_tuple
from muscle_bayes.data.validation import read_table
from muscle_bayes.data.writer import toml_keys
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.markup import html_table

LawName = Literal["thesis", "pi", "two-degrees", "feedforward", "cascade"]
Values = Annotated[tuple[Finite, ...], BeforeValidator(as_tuple)]
LARGEST: Final = 131071
"""Magnitude of the firmware's KP and KI: half a count may ask for full duty."""
TENTHS: Final = 10.0
"""The board's temperatures are in 0.1 C."""


class FeedForward(Table):
    """What is added to the PI's output for a setpoint, straight between entries."""

    angle: Values
    """rad, rising"""
    output: Values
    """duty, or K for `cascade`; positive where it raises the angle"""

    @model_validator(mode="after")
    def _is_a_table(self) -> "FeedForward":
        if len(self.angle) < 2 or len(self.angle) != len(self.output):
            raise ValueError(
                f"angle: {len(self.angle)} angles for {len(self.output)} outputs; "
                "give one output an angle, two at least"
            )
        if any(b <= a for a, b in zip(self.angle, self.angle[1:], strict=False)):
            raise ValueError("angle: does not rise; put the entries in rising order")
        return self


class Inner(Table):
    """Temperature loop of a cascade: duty = hold (T* - room) + heat (T* - T), T* at most `hottest`."""

    hold: NonNegative
    """duty / K"""
    heat: NonNegative
    """duty / K"""
    room: Finite = 25.0
    """C; T* of a side that is not asked for anything"""
    hottest: Finite = 90.0
    """C"""


class Gains(Table):
    """Gains of a joint's controller.

    proportional [duty / rad], integral [duty / (rad s)], positive where they hold the setpoint;
    bias [duty] of both heaters. With `inner` (law `cascade`) the output is a temperature: K / rad,
    K / (rad s), and bias [K above the room].
    """

    format: Literal[2] = 2
    law: LawName = "pi"
    period_ms: Annotated[int, Field(ge=1, le=1000)] = 30
    proportional: NonNegative
    integral: NonNegative
    bias: Annotated[float, Field(ge=0, le=255, allow_inf_nan=False)] = 0.0
    filter_time: NonNegative = 0.0
    """time constant of the setpoint filter [s]; 0: none"""
    windup_time: NonNegative = 0.0
    """tracking time of back-calculation [s]; 0: no anti-windup"""
    governor: Annotated[tuple[Finite, Finite] | None, BeforeValidator(as_tuple)] = None
    """temperatures between which duties fade to nothing [C]"""
    feedforward: FeedForward | None = None
    inner: Inner | None = None

    @model_validator(mode="after")
    def _is_a_law(self) -> "Gains":
        if self.proportional == 0 and self.integral == 0:
            raise ValueError("proportional: is zero, as is integral; give at least one of them")
        if self.governor is not None and not self.governor[0] < self.governor[1]:
            raise ValueError("governor: does not rise; give the lower temperature first")
        if (self.inner is not None) != (self.law == "cascade"):
            raise ValueError(
                f"inner: does not fit law {self.law!r}; the law 'cascade', and it alone, takes a "
                "table [inner]"
            )
        return self

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.period_ms / 1000.0

    def sentence(self) -> str:
        """The gains in words."""
        unit = "K" if self.inner is not None else "duty"
        proportional, integral = (
            f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.4g}"
            for value in (self.proportional, self.integral)
        )
        told = f"{proportional} {unit}/rad, {integral} {unit}/(rad s)"
        more = [(self.bias, f"bias {self.bias:.3g} {unit}")]
        more.append((self.filter_time, f"setpoint filter {self.filter_time:.3g} s"))
        return ", ".join([told, *(text for value, text in more if value)])

    def _repr_html_(self) -> str:
        rows = [(key, f"{value}") for key, value in self.model_dump(exclude_none=True).items()]
        return f"<p><b>Gains</b>: {self.sentence()}</p>{html_table(('gain', 'value'), rows)}"


def read_gains(path: Path) -> Gains:
    """Read gains. Raises RunError where the file has none or they make no sense."""
    return read_table(path, Gains, "write them with `muscle-bayes tune`")


def gains_toml(gains: Gains, head: str = "") -> str:
    """The gains as TOML, `head` as comment on top."""
    content = gains.model_dump(exclude_none=True)
    tables = {key: content.pop(key) for key in ("feedforward", "inner") if key in content}
    comment = "".join(f"# {line}".rstrip() + "\n" for line in head.splitlines())
    written = comment + toml_keys(content)
    return written + "".join(f"\n[{key}]\n{toml_keys(one)}" for key, one in tables.items())


def most_held(design: Design, period: float, cascade: bool = False) -> dict[str, float]:
    """Largest `proportional` and `integral` that the firmware holds at a period [s], as in `Gains`."""
    unit = design.potentiometer.radians_per_count * (TENTHS if cascade else 1.0)
    return {
        "proportional": LARGEST / (unit * 2**8) * (1.0 - 1e-9),
        "integral": LARGEST / (unit * period * 2**16) * (1.0 - 1e-9),
    }


def board_numbers(gains: Gains, design: Design) -> Numbers:
    """The nearest integers. Raises MuscleBayesError where the firmware cannot hold such gains."""
    count = design.potentiometer.radians_per_count
    unit = 1.0 if gains.inner is None else TENTHS
    # Muscle A lowers the angle: where the reading rises with the angle gains are negative.
    kp = _integer("proportional", -gains.proportional * count * unit * 2**8)
    ki = _integer("integral", -gains.integral * count * unit * gains.period * 2**16)
    tracks = gains.windup_time > 0.0 and ki != 0
    back = round(2**24 * gains.period / gains.windup_time / ki) if tracks else 0
    low, high = gains.governor or (2000.0, 2000.1)
    first, step, feed = _feed(gains, design, unit)
    inner = gains.inner or Inner(hold=0.0, heat=0.0)
    return Numbers(
        kp=kp,
        ki=ki,
        back=back,
        filter=max(round(2**16 * -np.expm1(-gains.period / max(gains.filter_time, 1e-9))), 1),
        bias=round(gains.bias * unit),
        fade_low=round(TENTHS * low),
        fade_high=round(TENTHS * high),
        feed_first=first,
        feed_step=step,
        feed=feed,
        hold=_integer("inner.hold", inner.hold / TENTHS * 2**8),
        heat=_integer("inner.heat", inner.heat / TENTHS * 2**8),
        room=round(TENTHS * inner.room),
        hottest=round(TENTHS * inner.hottest),
    )


def _integer(name: str, exact: float) -> int:
    if abs(exact) > LARGEST:
        raise MuscleBayesError(
            f"{name}: is {abs(exact) / LARGEST:.1f} times what the firmware's integers hold. "
            "Fix: use smaller gains, or a longer period for a larger integral"
        )
    if round(exact) == 0 and exact != 0.0:
        raise MuscleBayesError(
            f"{name}: is too small for the firmware's integers and would be zero. Fix: "
            "use a larger gain, or a longer period"
        )
    return round(exact)


def _feed(gains: Gains, design: Design, unit: float) -> tuple[int, int, tuple[int, ...]]:
    """First setpoint, spacing and outputs of the board's table, evenly spaced in counts."""
    table = gains.feedforward
    if table is None:
        return 0, 1, (0,) * ENTRIES
    sensor, _ = design.sensors()
    counts = np.asarray(sensor.counts(np.asarray(table.angle)))
    order = np.argsort(counts)
    first = int(np.ceil(counts.min()))
    step = max(int((counts.max() - first) // (ENTRIES - 1)), 1)
    at = first + step * np.arange(ENTRIES)
    output = -unit * np.interp(at, counts[order], np.asarray(table.output)[order])
    return first, step, tuple(round(float(x)) for x in output)


def fits_the_board(gains: Gains, design: Design) -> bool:
    """Whether the firmware's integers hold these gains."""
    try:
        board_numbers(gains, design)
    except MuscleBayesError:
        return False
    return True


def law_of(gains: Gains | Sequence[Gains], design: Design) -> Law:
    """The law of gains; of several, all of one structure, with a leading axis over them."""
    several = [gains] if isinstance(gains, Gains) else list(gains)
    rows = [board_numbers(one, design) for one in several]
    stacked = Numbers(*(np.asarray(column, float) for column in zip(*rows, strict=True)))
    if isinstance(gains, Gains):
        stacked = Numbers(*(column[0] for column in stacked))
    return Law(Numbers(*map(jnp.asarray, stacked)), several[0].inner is not None)


def gains_header(gains: Gains, design: Design, head: str = "") -> str:
    """`gains.h`. Raises MuscleBayesError as `board_numbers`."""
    found = board_numbers(gains, design)
    count = design.potentiometer.radians_per_count
    lines = [line for line in head.splitlines() if line]
    lines.append(f"law {gains.law}: {gains.sentence()}; {count:g} rad/count")
    comment = "\n".join(f" * {line}" for line in lines)
    defined: dict[str, int | str] = {
        "PERIOD_MS": gains.period_ms,
        "CASCADE": int(gains.inner is not None),
    }
    for name, value in found._asdict().items():
        wide = name in ("kp", "ki", "back", "filter", "hold", "heat")
        written = "{" + ", ".join(map(str, value)) + "}" if name == "feed" else f"{value}"
        defined[name.upper()] = f"{written}L" if wide else written
    numbers = "\n".join(f"#define GAINS_{name} {value}" for name, value in defined.items())
    return (
        f"/* Gains of the angle controller (HOLD), written by `muscle-bayes tune`.\n{comment} */\n"
        f"#ifndef GAINS_H\n#define GAINS_H\n\n{numbers}\n\n#endif\n"
    )
