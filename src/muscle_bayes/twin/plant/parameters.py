"""True parameters of the simulated fixture and muscle, Tables 1 and 2 as defaults."""

from dataclasses import field

from pydantic import ConfigDict
from pydantic.dataclasses import dataclass

from muscle_bayes.conventions import STRAIN_EPSILON, Friction
from muscle_bayes.data.describing.sizes import NonNegative, Positive
from muscle_bayes.twin.effects import Effect


@dataclass(frozen=True, kw_only=True, config=ConfigDict(strict=True))
class MuscleParameters:
    """Constants of eq. 13-17, with the thesis' names and Table 2's values.

    A [1/K^2], B [1/K], C [-]; F_* [N]; K_* [N/m]; H [N s/(m K)]; T_hyst_offset [C]; epsilon [-].
    """

    A: float = -1.17832e-5
    B: float = 1.40992e-5
    C: float = 0.00881695
    F_hyst_min: float = 1.75489
    K_hyst: Positive = 415.189
    F_modulus_min: float = 3.789
    K_modulus: Positive = 186.0
    H: float = -545.907
    T_hyst_offset: float = -243.380
    epsilon: Positive = STRAIN_EPSILON


COULOMB_TABLE_1 = (0.00124103, 0.00545940)
"""J [kg m^2] and D [N m] of the Coulomb column of Table 1."""

LINEAR_TABLE_1 = (0.00131390, 0.00415667)
"""J [kg m^2] and D [N m s] of the linear column of Table 1."""


@dataclass(
    frozen=True,
    kw_only=True,
    config=ConfigDict(strict=True, arbitrary_types_allowed=True),
)
class Truth:
    """What an experimenter does not know and the inference has to find.

    J [kg m^2] is the rotor alone. D is in N m where friction is Coulomb, in N m s where linear.
    """

    friction_law: Friction = "coulomb"
    J: Positive = COULOMB_TABLE_1[0]
    D: NonNegative = COULOMB_TABLE_1[1]
    muscle_a: MuscleParameters = field(default_factory=MuscleParameters)
    muscle_b: MuscleParameters = field(default_factory=MuscleParameters)
    effects: tuple[Effect, ...] = ()
