"""What others printed, to hold posteriors against."""

from collections.abc import Mapping
from typing import Final

from muscle_bayes.study.config import Published, StudyConfig

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

_THESIS: Final = "W. Hunt, Polymer Artificial Muscles, WPI Major Qualifying Project"


def _ranges(values: Mapping[str, float]) -> dict[str, tuple[float, ...]]:
    return {name: (value,) for name, value in values.items()}


THESIS: Final = (
    Published(
        name="Table 1, Coulomb friction",
        source=_THESIS,
        of="coulomb",
        values=_ranges(TABLE_1["coulomb"]),
    ),
    Published(
        name="Table 1, linear friction",
        source=_THESIS,
        of="linear",
        values=_ranges(TABLE_1["linear"]),
    ),
    Published(name="Table 2", source=_THESIS, of="muscle", values=_ranges(TABLE_2)),
)
"""The thesis' tables."""


def published_by(config: StudyConfig) -> tuple[Published, ...]:
    """All tables that a study asks for."""
    return (*(THESIS if config.thesis else ()), *config.published)


def values_of(tables: tuple[Published, ...], *fits: str) -> dict[str, tuple[float, ...]]:
    """Values by parameter that belong to any of these fits; an earlier table's count."""
    found: dict[str, tuple[float, ...]] = {}
    for table in tables:
        if table.of in fits:
            found = {**table.values, **found}
    return found


def middles(ranges: Mapping[str, tuple[float, ...]]) -> dict[str, float]:
    """One number for each range, as figures mark it."""
    return {name: 0.5 * (ends[0] + ends[-1]) for name, ends in ranges.items()}
