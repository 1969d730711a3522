"""A fitted posterior: draws, what they were made from, and whether to trust them."""

import json
from dataclasses import dataclass
from html import escape
from pathlib import Path

import arviz as az
import numpy as np
import pandas as pd
import xarray as xr

from muscle_bayes.conventions import Friction
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.markup import html_table, plain_table, three_digits

SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""First bytes of a NetCDF file."""
HEADER = ("parameter", "unit", "mean", "sd", "5 %", "95 %", "bulk ESS", "R-hat")


def _with_coordinates(tree: xr.DataTree) -> xr.DataTree:
    """The tree with coordinates of chains and draws, which ArviZ's plots and statistics need."""

    def numbered(group: xr.Dataset) -> xr.Dataset:
        missing = {"chain", "draw"} & {*group.dims} - {*group.coords}
        return group.assign_coords({axis: np.arange(group.sizes[axis]) for axis in missing})

    return tree.map_over_datasets(numbered)


@dataclass(frozen=True, repr=False)
class Posterior:
    """Draws as an ArviZ DataTree, with the few things asked of it most.

    Args:
        tree: the groups posterior, prior, sample_stats, posterior_predictive, log_likelihood,
            observed_data and constant_data. Variables carry their unit (SI) as the attribute
            `units`.

    Example:
        >>> import muscle_bayes as mb
        >>> posterior = mb.fit(mb.load_example("springs"), effort="quick", progress=False)
        >>> posterior.units["D"]
        'N m'
        >>> list(posterior.summary().index)
        ['J', 'D']
    """

    tree: xr.DataTree

    def __post_init__(self) -> None:
        object.__setattr__(self, "tree", _with_coordinates(self.tree))

    @property
    def friction(self) -> Friction:
        return self.tree.attrs["friction"]

    @property
    def effects(self) -> tuple[str, ...]:
        return tuple(json.loads(self.tree.attrs["effects"]))

    @property
    def converged(self) -> bool:
        return bool(self.tree.attrs["converged"])

    @property
    def complaints(self) -> tuple[str, ...]:
        """Why the draws are not to be trusted; empty if they are."""
        return tuple(json.loads(self.tree.attrs["complaints"]))

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the plant's parameters and of the effects'."""
        return tuple(json.loads(self.tree.attrs["parameters"]))

    @property
    def units(self) -> dict[str, str]:
        """Units of the parameters."""
        group = self.tree["posterior"]
        return {name: group[name].attrs.get("units", "") for name in self.parameters}

    def summary(self) -> pd.DataFrame:
        """Table of the parameters: mean, sd, 90 % interval, ESS and R-hat, all digits of each."""
        return az.summary(
            self.tree, var_names=list(self.parameters), ci_prob=0.9, ci_kind="eti", round_to="none"
        )

    def save(self, path: Path | str) -> None:
        """Write NetCDF, replacing `path` only when it is whole."""
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(".partial")
        self.tree.to_netcdf(partial, engine="h5netcdf")
        partial.replace(path)

    @classmethod
    def load(cls, path: Path | str) -> "Posterior":
        """Read a posterior.

        Args:
            path: NetCDF that `Posterior.save` or `muscle-bayes fit` wrote.

        Returns:
            The posterior, as it was saved.

        Raises:
            MuscleBayesError: if the file is none.

        Example:
            >>> import muscle_bayes as mb
            >>> springs = mb.load_example("springs")
            >>> mb.fit(springs, effort="quick", progress=False).save("fixture.nc")
            >>> mb.load("fixture.nc").parameters
            ('J', 'D')
        """
        if not Path(path).is_file():
            raise MuscleBayesError(
                f"{path}: there is no such file. Fix: name a posterior that `muscle-bayes fit` wrote."
            )
        with Path(path).open("rb") as file:
            begins = file.read(len(SIGNATURE))
        if begins != SIGNATURE:
            raise MuscleBayesError(
                f"{path}: is not a NetCDF file. Fix: name a posterior that `muscle-bayes fit` wrote."
            )
        try:
            tree = xr.load_datatree(path, engine="h5netcdf")
        except (OSError, ValueError) as error:
            raise MuscleBayesError(
                f"{path}: cannot be read as a posterior ({error}). Fix: name one that `muscle-bayes fit` "
                "wrote."
            ) from error
        if "converged" not in tree.attrs or "posterior" not in tree:
            raise MuscleBayesError(
                f"{path}: is NetCDF, but not a posterior. Fix: name one that `muscle-bayes fit` "
                "wrote."
            )
        return cls(tree)

    def _heading(self) -> str:
        sizes = self.tree["posterior"].sizes
        effects = "".join(f" + {name}" for name in self.effects)
        agreed = "converged" if self.converged else "NOT CONVERGED"
        drawn = f"{sizes['chain']} chains of {sizes['draw']} draws"
        return f"Posterior, {agreed}: {self.friction} friction{effects}, {drawn}"

    def _rows(self) -> list[tuple[str, ...]]:
        rows = []
        for name, row in self.summary().iterrows():
            unit = self.units[str(name).partition("[")[0]]
            numbers = [
                three_digits(row[key])
                for key in ("mean", "sd", "eti90_lb", "eti90_ub", "ess_bulk", "r_hat")
            ]
            rows.append((str(name), unit, *numbers))
        return rows

    def _repr_html_(self) -> str:
        lines = [f"<b>{escape(self._heading())}</b>", *map(escape, self.complaints)]
        return f"<p>{'<br>'.join(lines)}</p>{html_table(HEADER, self._rows())}"

    def __repr__(self) -> str:
        return "\n".join([self._heading(), *self.complaints, plain_table(HEADER, self._rows())])
