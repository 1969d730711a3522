"""What hangs between rotor and stator: the element tables of a run's metadata."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Linkage = Literal["pins", "drum", "straight"]


class Table(BaseModel):
    """A table of NAME.toml: immutable, no unknown keys, no silent conversion of text to numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class _Linked(Table):
    """An element whose length follows the coordinate through a linkage.

    pins:     eq. 7-10, geometry in [fixture]
    drum:     L = length_at_zero + drum_radius theta, constant lever
    straight: L = length_at_zero + x
    """

    linkage: Linkage = "pins"
    drum_radius: Positive | None = None
    """m"""
    length_at_zero: Positive | None = None
    """m, length at coordinate zero"""

    @model_validator(mode="after")
    def _linkage_has_its_lengths(self) -> "_Linked":
        needed = {"pins": (), "drum": ("drum_radius", "length_at_zero")}.get(
            self.linkage, ("length_at_zero",)
        )
        for key in ("drum_radius", "length_at_zero"):
            given = getattr(self, key) is not None
            if key in needed and not given:
                raise ValueError(
                    f"{key}: missing, linkage {self.linkage!r} needs it; add {key} in m"
                )
            if given and key not in needed:
                raise ValueError(
                    f"{key}: not used by linkage {self.linkage!r}; remove it or change linkage"
                )
        return self


class MuscleElement(_Linked):
    """A coiled muscle."""

    kind: Literal["muscle"] = "muscle"
    base_length: Positive
    """L_base, m"""
    heater_length: Positive | None = None
    """L_heater of eq. 11, m; None = heated over its whole length"""

    @model_validator(mode="after")
    def _heater_is_not_longer(self) -> "MuscleElement":
        if self.heater_length is not None and self.heater_length > self.base_length:
            raise ValueError(
                f"heater_length: {self.heater_length} m is longer than base_length "
                f"{self.base_length} m; check both, or remove heater_length if wholly heated"
            )
        return self


class SpringElement(_Linked):
    """The reference spring (eq. 12)."""

    kind: Literal["spring"] = "spring"


class ArmElement(Table):
    """Rigid pendulum arm: torque -m g d sin(theta - hanging_angle), inertia m d^2."""

    kind: Literal["arm"] = "arm"
    mass: Positive
    """kg"""
    centre_distance: Positive
    """m from the axis to the centre of mass"""
    hanging_angle: Finite = 0.0
    """rad, where the arm hangs at rest"""


class NoElement(Table):
    """Nothing on this side."""

    kind: Literal["none"] = "none"


Element = Annotated[
    MuscleElement | SpringElement | ArmElement | NoElement, Field(discriminator="kind")
]
