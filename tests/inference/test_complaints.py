"""What is said of chains that disagree."""

import numpy as np
import pytest
import xarray as xr

from muscle_bayes.inference.posteriors.assemble import where_chains_are


@pytest.mark.parametrize("runs", [(), (3,)])
def test_each_chain_is_shown_where_they_differ_most(runs: tuple[int, ...]) -> None:
    apart = np.zeros((4, 50, *runs)) + 1.0
    apart[..., -1 if runs else slice(None)] += np.array([0.3, 0.1, 0.2, 0.0])[:, None]
    dims = ["chain", "draw", *(["run"] if runs else [])]
    told = where_chains_are(xr.DataArray(apart, dims=dims, attrs={"units": "N m"}))
    assert "1, 1.1, 1.2, 1.3 N m" in told
    assert "several modes" in told
