"""Gains as a TOML file: read with clear errors, written, and rounded to the bench's integers."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from muscle_bayes.data.elements import Finite, NonNegative, Table
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.files import parse_toml, read_bytes
from muscle_bayes.data.tables import _as_tuple
from muscle_bayes.data.validation import explain
from muscle_bayes.data.writer import toml_keys
from muscle_bayes.markup import html_table

LawName = Literal["pi", "pi-antiwindup", "pi-feedforward", "cascade"]
Numbers = Annotated[tuple[Finite, ...], BeforeValidator(_as_tuple)]


class FeedForward(Table):
    """What is added to the PI's output for a setpoint, straight between entries."""

    angle: Numbers
    """rad, rising"""
    output: Numbers
    """duty, positive where it raises the angle"""

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


class Gains(Table):
    """Gains of a joint's controller.

    proportional [duty / rad], integral [duty / (rad s)], positive where they hold the setpoint;
    bias [duty] of both heaters. For the law `cascade` the output is a temperature: K / rad,
    K / (rad s), and bias [K above the room].
    """

    format: Literal[1] = 1
    law: LawName = "pi-antiwindup"
    period_ms: Annotated[int, Field(ge=1, le=1000)] = 30
    proportional: NonNegative
    integral: NonNegative
    bias: Annotated[float, Field(ge=0, le=255, allow_inf_nan=False)] = 0.0
    feedforward: FeedForward | None = None

    @model_validator(mode="after")
    def _law_has_what_it_needs(self) -> "Gains":
        if self.proportional == 0 and self.integral == 0:
            raise ValueError("proportional: is zero, as is integral; give at least one of them")
        if (self.feedforward is not None) != (self.law == "pi-feedforward"):
            raise ValueError(
                f"feedforward: does not fit law {self.law!r}; the law 'pi-feedforward', and it "
                "alone, takes a table [feedforward]"
            )
        return self

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.period_ms / 1000.0

    def _repr_html_(self) -> str:
        output = "K" if self.law == "cascade" else "duty"
        rows = [
            ("proportional", f"{self.proportional:.5g}", f"{output} / rad"),
            ("integral", f"{self.integral:.5g}", f"{output} / (rad s)"),
            ("bias", f"{self.bias:.3g}", output),
            ("period", f"{self.period_ms}", "ms"),
        ]
        if self.feedforward is not None:
            rows.append(("feedforward", f"{len(self.feedforward.angle)} entries", output))
        return f"<p><b>Gains</b> of {self.law}</p>{html_table(('gain', 'value', 'unit'), rows)}"


def read_gains(path: Path) -> Gains:
    """Read gains. Raises RunError where the file has none or they make no sense."""
    try:
        return Gains.model_validate(parse_toml(read_bytes(path, "the gains"), path))
    except ValidationError as error:
        key, problem, mend = explain(error, Gains)
        raise RunError.at(path, problem, mend, key=key) from None


def gains_toml(gains: Gains, head: str = "") -> str:
    """The gains as TOML, `head` as comment on top."""
    content = gains.model_dump(exclude_none=True)
    table = content.pop("feedforward", None)
    comment = "".join(f"# {line}".rstrip() + "\n" for line in head.splitlines())
    written = comment + toml_keys(content)
    return written if table is None else f"{written}\n[feedforward]\n{toml_keys(table)}"
