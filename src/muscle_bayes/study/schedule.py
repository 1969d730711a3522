"""The order in which stages are begun."""

from collections.abc import Sequence
from functools import cache

from muscle_bayes.study.plan import PRESETS, Preset
from muscle_bayes.study.stages import Stage


def longest_path_first(stages: Sequence[Stage], preset: Preset) -> list[Stage]:
    """Stages by how long it takes from their beginning to the end of all that waits for them.

    With few processes this ends soonest, or nearly (critical-path list scheduling; Graham, SIAM J.
    Appl. Math. 17, 1969). Each stage comes after those it needs.
    """
    which = PRESETS.index(preset)

    @cache
    def path(place: int) -> float:
        stage = stages[place]
        made = {stage.result, *stage.also}
        after = [path(i) for i, other in enumerate(stages) if made & {*other.needs}]
        return stage.seconds[which] + max(after, default=0.0)

    return [stages[i] for i in sorted(range(len(stages)), key=lambda i: -path(i))]
