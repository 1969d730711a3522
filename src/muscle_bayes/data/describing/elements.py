"""What hangs between rotor and stator: the element tables of a run's metadata."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from muscle_bayes.data.describing.sizes import Finite, Length, NonNegative, Positive, Radius

Linkage = Literal["pins", "drum", "straight"]
SpringLinkage = Literal["pins", "drum", "straight", "torsion"]


class Table(BaseModel):
    """A table of NAME.toml: immutable, no unknown keys, no silent conversion of text to numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


def as_tuple(value: Any) -> Any:
    """TOML has lists only."""
    return tuple(value) if isinstance(value, list) else value


class _Linked(Table):
    """An element whose length follows the coordinate through a linkage.

    pins:     eq. 7-10, geometry in [fixture]
    drum:     L = length_at_zero + drum_radius theta, constant lever
    straight: L = length_at_zero + x
    """

    linkage: Linkage = "pins"
    drum_radius: Radius | None = None
    """m"""
    length_at_zero: Length | None = None
    """m, length at coordinate zero"""

    @model_validator(mode="after")
    def _linkage_has_its_lengths(self) -> "_Linked":
        _check_lengths(self)
        return self


_LENGTHS = {
    "pins": (),
    "drum": ("drum_radius", "length_at_zero"),
    "straight": ("length_at_zero",),
    "torsion": (),
}


def _check_lengths(element: "_Linked | SpringElement", optional: tuple[str, ...] = ()) -> None:
    """Whether an element has the lengths that its linkage needs, and no others."""
    needed = _LENGTHS[element.linkage]
    for key in ("drum_radius", "length_at_zero"):
        given = getattr(element, key) is not None
        if key in needed and not given and key not in optional:
            raise ValueError(
                f"{key}: missing, linkage {element.linkage!r} needs it; add {key} in m"
            )
        if given and key not in needed:
            raise ValueError(
                f"{key}: not used by linkage {element.linkage!r}; remove it or change linkage"
            )


class MuscleElement(_Linked):
    """A coiled muscle."""

    kind: Literal["muscle"] = "muscle"
    base_length: Length
    """L_base, m"""
    heater_length: Length | None = None
    """L_heater of eq. 11, m; None = heated over its whole length"""
    specimen: Annotated[str, Field(min_length=1)] | None = None
    """name of the muscle, where a population is fitted of several"""

    @model_validator(mode="after")
    def _heater_is_not_longer(self) -> "MuscleElement":
        if self.heater_length is not None and self.heater_length > self.base_length:
            raise ValueError(
                f"heater_length: {self.heater_length} m is longer than base_length "
                f"{self.base_length} m; check both, or remove heater_length if wholly heated"
            )
        return self


class SpringElement(Table):
    """A linear spring with a damper beside it. Keys that are absent are estimated.

    pins, drum, straight: tension rate (L - free_length) + damping dL/dt, L of the linkage [m]
    torsion:              torque -(tension_at_zero + rate theta + damping omega) on the rotor
    """

    kind: Literal["spring"] = "spring"
    model: Literal["linear", "reference"] = "linear"
    """reference: the thesis' own spring (eq. 12), of which nothing is estimated"""
    linkage: SpringLinkage = "pins"
    drum_radius: Radius | None = None
    """m"""
    length_at_zero: Length | None = None
    """m, length at coordinate zero"""
    rate: Positive | None = None
    """N/m; N m/rad where linkage is torsion. None = estimated"""
    free_length: Length | None = None
    """m, length at which the spring's line pulls with no force. None = see tension_at_zero"""
    tension_at_zero: Finite | None = None
    """N (N m where linkage is torsion), pull at coordinate zero; instead of free_length. None =
    estimated, where free_length is not stated"""
    closed_length: Length | None = None
    """m, length at which the coils touch: shorter, the spring does not pull. None = none"""
    damping: NonNegative | None = None
    """N s/m; N m s/rad where linkage is torsion. None = estimated"""

    @model_validator(mode="after")
    def _keys_agree(self) -> "SpringElement":
        self._check_model()
        _check_lengths(self, optional=("length_at_zero",) if self.linkage == "straight" else ())
        if self.free_length is not None and self.tension_at_zero is not None:
            raise ValueError(
                "free_length: given together with tension_at_zero; keep the one that was measured"
            )
        for key in ("free_length", "closed_length"):
            if getattr(self, key) is None:
                continue
            if self.linkage == "torsion":
                raise ValueError(
                    f"{key}: a torsion spring has no length; give tension_at_zero in N m"
                )
            if self.linkage == "straight" and self.length_at_zero is None:
                raise ValueError(
                    f"length_at_zero: missing, {key} needs it; add length_at_zero in m, "
                    f"or leave {key} out"
                )
        return self

    def _check_model(self) -> None:
        if self.model != "reference":
            return
        if self.linkage == "torsion":
            raise ValueError(
                "linkage: the reference spring is none of torsion; use another linkage"
            )
        for key in ("rate", "free_length", "tension_at_zero", "closed_length", "damping"):
            if getattr(self, key) is not None:
                raise ValueError(
                    f"{key}: the reference spring has its own; remove it, or model = 'reference'"
                )


class ArmElement(Table):
    """Rigid pendulum arm: torque -moment sin(theta - hanging_angle), and its inertia.

    Mass and distance give both: moment = m g d, inertia m d^2. Else what is absent is estimated.
    """

    kind: Literal["arm"] = "arm"
    mass: Positive | None = None
    """kg"""
    centre_distance: Length | None = None
    """m from the axis to the centre of mass"""
    moment: Positive | None = None
    """m g d, N m, instead of mass and centre_distance. None of the three = estimated"""
    moment_of_inertia: NonNegative | None = None
    """kg m^2 about the axis. None = m d^2; without a mass it counts to J, and where fixture.inertia
    states J it is estimated"""
    hanging_angle: Finite | None = None
    """rad, where the arm hangs at rest. None = 0 where mass or moment is stated, else estimated"""

    @model_validator(mode="after")
    def _keys_agree(self) -> "ArmElement":
        for key, other in (("mass", "centre_distance"), ("centre_distance", "mass")):
            if getattr(self, key) is None and getattr(self, other) is not None:
                raise ValueError(
                    f"{key}: missing, {other} is given; give both, or moment in N m instead, "
                    "or neither where they are to be estimated"
                )
        if self.moment is not None and self.mass is not None:
            raise ValueError("moment: given together with mass; keep what was measured")
        return self


class NoElement(Table):
    """Nothing on this side."""

    kind: Literal["none"] = "none"


Element = Annotated[
    MuscleElement | SpringElement | ArmElement | NoElement, Field(discriminator="kind")
]
