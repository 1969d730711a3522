"""Which of the stages that are ready runs first."""

from collections.abc import Sequence
from pathlib import Path
from typing import get_args

from muscle_bayes.study.plan import Preset
from muscle_bayes.study.stages import Stage


def urgent_first(stages: Sequence[Stage], preset: Preset) -> list[Stage]:
    """The stages by how long they and what waits for them take, the longest first.

    Processes that take stages in this order are left without work for a short time only, and no stage
    comes before one that it needs.
    """
    column = get_args(Preset).index(preset)
    ahead: dict[Path, float] = {}

    def time_ahead(stage: Stage) -> float:
        if stage.result not in ahead:
            makes = {stage.result, *stage.also}
            waiting = [time_ahead(other) for other in stages if makes & {*other.needs}]
            ahead[stage.result] = stage.seconds[column] + max(waiting, default=0.0)
        return ahead[stage.result]

    return sorted(stages, key=time_ahead, reverse=True)
