"""What is said of chains that disagree."""

import numpy as np
import pytest
import xarray as xr

from muscle_bayes.inference.posteriors.complaints import complaints_of, where_chains_are


@pytest.mark.parametrize("runs", [(), (3,)])
def test_each_chain_is_shown_where_they_differ_most(runs: tuple[int, ...]) -> None:
    apart = np.zeros((4, 50, *runs)) + 1.0
    apart[..., -1 if runs else slice(None)] += np.array([0.3, 0.1, 0.2, 0.0])[:, None]
    dims = ["chain", "draw", *(["run"] if runs else [])]
    told = where_chains_are(xr.DataArray(apart, dims=dims, attrs={"units": "N m"}))
    assert "1, 1.1, 1.2, 1.3 N m" in told
    assert "several modes" in told


def test_the_worst_are_named_and_the_others_counted() -> None:
    random = np.random.default_rng(1)
    sampled = xr.Dataset(
        {name: (("chain", "draw"), random.normal(size=(4, 400))) for name in "abcdefg"}
    )
    assert complaints_of(sampled, 0, 200) == []
    assert complaints_of(sampled, 3, 200) == ["3 divergent transitions"]
    for place, name in enumerate("cdefg"):
        sampled[name] = sampled[name] + (1.0 + place) * sampled.chain
    apart, *means, few = complaints_of(sampled, 0, 200)
    assert apart.startswith("R-hat is over 1.01: g ")
    assert apart.endswith(" and 2 more")
    assert [text.split(",")[0] for text in means] == [
        f"chains disagree on {name}" for name in "gfe"
    ]
    assert few.startswith("bulk ESS is below 200: ")
    assert few.endswith(" and 2 more")
