"""A fitted posterior: draws, what they were made from, and whether to trust them."""

import json
from dataclasses import dataclass
from pathlib import Path

import arviz as az
import xarray as xr

from muscle_bayes.conventions import Friction
from muscle_bayes.errors import MuscleBayesError


@dataclass(frozen=True)
class Posterior:
    """Draws as an ArviZ DataTree, with the few things asked of it most."""

    tree: xr.DataTree

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

    def summary(self):
        """Table of the parameters: mean, sd, 90 % interval, ESS and R-hat."""
        return az.summary(
            self.tree, var_names=list(self.parameters), ci_prob=0.9, ci_kind="eti", round_to="none"
        )

    def save(self, path: Path) -> None:
        """Write NetCDF, replacing `path` only when it is whole."""
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(".partial")
        self.tree.to_netcdf(partial, engine="h5netcdf")
        partial.replace(path)

    @classmethod
    def load(cls, path: Path) -> "Posterior":
        """Read a posterior. Raises MuscleBayesError if the file is none."""
        try:
            tree = xr.load_datatree(path, engine="h5netcdf")
        except (OSError, ValueError) as error:
            raise MuscleBayesError(f"{path}: cannot be read as a posterior ({error})") from error
        if "converged" not in tree.attrs or "posterior" not in tree:
            raise MuscleBayesError(
                f"{path}: is NetCDF, but not a posterior written by `muscle-bayes fit`"
            )
        return cls(tree)

    def _repr_html_(self) -> str:
        verdict = "converged" if self.converged else "NOT CONVERGED: " + "; ".join(self.complaints)
        return f"<p><b>Posterior</b>, {verdict}</p>{self.summary()._repr_html_()}"

    def __repr__(self) -> str:
        verdict = "converged" if self.converged else "NOT CONVERGED"
        return f"Posterior({verdict}, {', '.join(self.parameters)})\n{self.summary()}"
