"""What an experimenter would hand over of a rig, and what is true of it."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np


class Example(NamedTuple):
    """A simulated run of somebody's rig."""

    name: str
    story: str
    """What the rig is, in a few sentences."""
    columns: Mapping[str, np.ndarray]
    """The log, by the header's names; equal lengths."""
    metadata: str
    """Text of NAME.toml."""
    truth: Mapping[str, float]
    """True values of what is to be estimated, by the name of the parameter."""
    effects: tuple[str, ...] = ()
    """Effects that the rig has beside the nominal model."""

    def log(self) -> str:
        """Text of NAME.csv, nine digits a number."""
        rows = zip(*self.columns.values(), strict=True)
        lines = [",".join(self.columns), *(",".join(f"{x:.9g}" for x in row) for row in rows)]
        return "\n".join(lines) + "\n"
