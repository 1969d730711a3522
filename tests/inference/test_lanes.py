"""Runs side by side, padded to one length."""

from muscle_bayes.inference.model.lanes import LEAST_SIZE, padded_size


def test_few_lengths_hold_all_runs_and_none_is_much_too_long():
    runs = range(1, 5000)
    sizes = [padded_size(intervals) for intervals in runs]
    assert all(size >= intervals for size, intervals in zip(sizes, runs, strict=True))
    assert all(
        size <= max(LEAST_SIZE, 1.25 * intervals)
        for size, intervals in zip(sizes, runs, strict=True)
    )
    assert len(set(sizes)) < 30
