"""Units, signs and constants that every layer shares.

Everything inside is SI: s, m, kg, rad, N, N m; temperatures are in degrees Celsius, strain is a pure
number. The rotor's coordinate q is the angle theta [rad] where motion is rotary, the position x [m]
where it is linear. "Generalised force" stands for torque [N m] or force [N] accordingly; positive
lengthens element A, so a load is positive and element A's tension acts with a negative sign.
"""

from typing import Final, Literal

GRAVITY: Final = 9.80665
"""Standard acceleration of free fall, m/s^2."""

STRAIN_EPSILON: Final = 1e-3
"""Strain over which a tensile spring rises from zero to its minimum force (eps of eq. 13 and 14)."""

SPRING_RATE: Final = 145.71
"""Rate of the reference spring, N/m (eq. 12)."""

SPRING_INTERCEPT: Final = -5.2097
"""Force of the reference spring's line at zero length, N (eq. 12)."""

SPRING_MIN_LENGTH: Final = 0.04682
"""Length below which the reference spring's coils touch, m (eq. 12)."""

Motion = Literal["rotary", "linear"]
Friction = Literal["coulomb", "linear"]
