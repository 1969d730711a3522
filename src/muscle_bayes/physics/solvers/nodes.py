"""Steps to given times, of which some may be the same."""

from typing import Any

import diffrax


class StepToNodes(diffrax.StepTo):
    """`diffrax.StepTo`, but times need only not fall: steps of no length pad runs to one shape."""

    def wrap(self, direction: Any) -> "StepToNodes":
        return self

    def init(self, terms, t0, t1, y0, dt0, args, func, error_order):  # type: ignore[no-untyped-def]
        return self.ts[1], 2
