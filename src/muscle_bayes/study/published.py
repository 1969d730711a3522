"""What the thesis printed, to hold posteriors against."""

from typing import Final

TABLE_1: Final = {
    "coulomb": {"J": 0.00124103, "D": 0.00545940},
    "linear": {"J": 0.00131390, "D": 0.00415667},
}
"""Fixture, fitted to five spring records: J [kg m^2], D [N m, or N m s for linear friction]."""

TABLE_2: Final = {
    "A": -1.17832e-5,
    "B": 1.40992e-5,
    "C": 0.00881695,
    "F_hyst_min": 1.75489,
    "K_hyst": 415.189,
    "F_modulus_min": 3.789,
    "K_modulus": 186.0,
    "H": -545.907,
    "T_hyst_offset": -243.380,
}
"""Muscle, fitted to three staircase records (F_modulus_min and K_modulus by hand)."""
