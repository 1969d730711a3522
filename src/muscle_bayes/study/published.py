"""What others printed, to hold posteriors against."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from muscle_bayes.study.config import Published, StudyConfig, read_config

THESIS: Final = read_config(Path(__file__).with_name("thesis.toml")).published
"""The thesis' tables: of its fixture, fitted to five spring records, with dry and with linear friction, and
of its muscle, fitted to three staircase records (F_modulus_min and K_modulus by hand)."""
_VALUES: Final = {one.of: {name: ends[0] for name, ends in one.values.items()} for one in THESIS}
TABLE_1: Final = {law: _VALUES[law] for law in ("coulomb", "linear")}
"""J [kg m^2], D [N m, or N m s for linear friction]."""
TABLE_2: Final = _VALUES["muscle"]


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
