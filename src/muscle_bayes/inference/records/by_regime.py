"""The record of a run, as its regime asks for."""

from collections.abc import Callable

from muscle_bayes.data.run import Run
from muscle_bayes.inference.records.fast import fast_record
from muscle_bayes.inference.records.imposed import imposed_record
from muscle_bayes.inference.records.record import Record
from muscle_bayes.inference.records.regime import Regime, regime_of
from muscle_bayes.inference.records.slow import slow_record


def record_of(run: Run) -> Record:
    """The run on the grid that its regime asks for."""
    return _RECORDS[regime_of(run)](run)


_RECORDS: dict[Regime, Callable[[Run], Record]] = {
    "fast": fast_record,
    "slow": slow_record,
    "imposed": imposed_record,
    "heated": imposed_record,
}
