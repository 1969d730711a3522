"""Draws of a population's mean and spread, and the muscles that it says may come next."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Self

import numpy as np
import pandas as pd
import xarray as xr
from jaxtyping import Float

from muscle_bayes.conventions import Friction
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.population.coordinates import (
    NAMES,
    SITE_UNITS,
    coordinates,
    quantities,
    table_of,
)
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.markup import html_table, plain_table, three_digits

SHARED = ("J", "D")
"""Parameters of the fixture, which specimens share."""


@dataclass(frozen=True, repr=False)
class Population:
    """What specimens' posteriors say of the population that they come from.

    Args:
        mean: draws of the population's mean, in the coordinates of `population.coordinates`.
        spread: draws of its standard deviation, of each coordinate.
        specimens: of every specimen its partially pooled draws, in the same coordinates.
        shared: draws of what specimens share: the fixture's J and D, parameters of effects.
        friction: the bearing's.
        effects: names of the effects.
        base_length: of a muscle [m].
        tension: to which taut strain belongs [N].
    """

    mean: Float[np.ndarray, "draw coordinate"]
    spread: Float[np.ndarray, "draw coordinate"]
    specimens: Mapping[str, Float[np.ndarray, "draw coordinate"]]
    shared: Mapping[str, np.ndarray]
    friction: Friction
    effects: tuple[str, ...]
    base_length: float
    tension: float

    def new_muscles(self, count: int, seed: int = 0) -> dict[str, np.ndarray]:
        """`count` muscles that have not been built yet, with what they share.

        Args:
            count: how many.
            seed: of the random numbers.

        Returns:
            Arrays of Table 2's parameters, of J and D, and of `effect.parameter`.

        Example:
            >>> import muscle_bayes as mb
            >>> population = mb.fit_population({"m1": mb.load("muscle.nc")})  # of `fit`
            >>> population.new_muscles(5)["K_modulus"].shape
            (5,)
        """
        generator = np.random.default_rng(seed)
        rows = generator.integers(len(self.mean), size=count)
        noise = generator.standard_normal((count, len(NAMES)))
        place = self.mean[rows] + self.spread[rows] * noise
        shared = {key: np.asarray(value) for key, value in self.shared.items()}
        own = generator.integers(len(next(iter(shared.values()))), size=count) if shared else None
        return table_of(place, self.base_length, self.tension) | {
            key: value[own] for key, value in shared.items()
        }

    @classmethod
    def of_specimen(cls, posterior: Posterior) -> Self:
        """One specimen taken for all: no spread beyond its own posterior."""
        table, shared, length, tension = contents(posterior)
        place = coordinates(table, length, tension)
        none = np.zeros_like(place)
        return cls(place, none, {}, shared, posterior.friction, posterior.effects, length, tension)

    def summary(self) -> pd.DataFrame:
        """The middle of the population and its spread: posterior mean and 90 % interval.

        The middle is in `unit`. Spreads are relative (of a logarithm), but for taut strain and bend, whose
        spread is in strain, and softening, of whose logit it is.
        """
        middles = quantities(self.mean)
        rows = {}
        for place, name in enumerate(NAMES):
            row: dict[str, float | str] = {"unit": SITE_UNITS[name]}
            for what, value in (("middle", middles[name]), ("spread", self.spread[:, place])):
                low, high = np.quantile(value, (0.05, 0.95))
                row |= {what: value.mean(), f"{what} 5 %": low, f"{what} 95 %": high}
            rows[name] = row
        return pd.DataFrame.from_dict(rows, orient="index")

    def save(self, path: Path | str) -> None:
        """Write NetCDF, replacing `path` only when it is whole."""
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        axes = ("draw", "coordinate")
        group = {"mean": (axes, self.mean), "spread": (axes, self.spread)}
        tree = xr.DataTree.from_dict(
            {
                "population": xr.Dataset(group, coords={"coordinate": list(NAMES)}),
                "specimens": xr.Dataset({k: (axes, v) for k, v in self.specimens.items()}),
                "shared": xr.Dataset({k: (("row",), v) for k, v in self.shared.items()}),
            }
        )
        tree.attrs = {
            "kind": "population",
            "friction": self.friction,
            "effects": json.dumps(list(self.effects)),
            "base_length": self.base_length,
            "tension": self.tension,
        }
        partial = path.with_suffix(".partial")
        tree.to_netcdf(partial, engine="h5netcdf")
        partial.replace(path)

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read a population. Raises MuscleBayesError if the file is none."""
        try:
            tree = xr.load_datatree(path, engine="h5netcdf")
        except (OSError, ValueError) as error:
            raise MuscleBayesError(f"{path}: cannot be read as a population ({error})") from error
        if tree.attrs.get("kind") != "population":
            raise MuscleBayesError(
                f"{path}: is no population. Fix: write one by `muscle-bayes population`"
            )
        groups = {name: tree[name].to_dataset() for name in ("population", "specimens", "shared")}
        return cls(
            groups["population"]["mean"].to_numpy(),
            groups["population"]["spread"].to_numpy(),
            {str(k): v.to_numpy() for k, v in groups["specimens"].data_vars.items()},
            {str(k): v.to_numpy() for k, v in groups["shared"].data_vars.items()},
            tree.attrs["friction"],
            tuple(json.loads(tree.attrs["effects"])),
            float(tree.attrs["base_length"]),
            float(tree.attrs["tension"]),
        )

    def _rows(self) -> tuple[tuple[str, ...], list[list[str]]]:
        table = self.summary()
        rows = [
            [str(name), *(v if isinstance(v, str) else three_digits(v) for v in row)]
            for name, row in zip(table.index, table.to_numpy(), strict=True)
        ]
        return ("quantity", *map(str, table.columns)), rows

    def _title(self) -> str:
        names = ", ".join(self.specimens)
        return f"Population of {names or 'one specimen'}; spread is relative"

    def __repr__(self) -> str:
        return f"{self._title()}\n{plain_table(*self._rows())}"

    def _repr_html_(self) -> str:
        return f"<p>{escape(self._title())}</p>{html_table(*self._rows())}"


def contents(
    posterior: Posterior, group: str = "posterior"
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray], float, float]:
    """Of a posterior: draws of Table 2, draws of what is shared, base length [m], tension [N]."""
    from muscle_bayes.inference.model.muscle_prior import MUSCLE_PARAMETERS

    stated = {"base_length", "tension"} <= {*posterior.tree.attrs}
    if group not in posterior.tree or not stated:
        raise MuscleBayesError(
            f"the posterior has no {group} draws, or not the muscle's length and tension. Fix: fit its "
            "runs again, by `muscle-bayes fit`"
        )
    draws = posterior.tree[group].to_dataset()
    if missing := [name for name in MUSCLE_PARAMETERS if name not in draws]:
        raise MuscleBayesError(
            f"the posterior has no {', '.join(missing)}. Fix: fit runs with a muscle, "
            "`muscle-bayes fit STAIRCASE_RUN... --given FIXTURE.nc --out MUSCLE.nc`"
        )
    flat = {
        str(name): value.to_numpy().reshape(-1) for name, value in draws.items() if value.ndim == 2
    }
    own = [n for n in posterior.parameters if n.split(".")[0] in posterior.effects]
    shared = {name: flat[name] for name in (*SHARED, *own) if name in flat}
    table = {name: flat[name] for name in MUSCLE_PARAMETERS}
    attributes = posterior.tree.attrs
    return table, shared, float(attributes["base_length"]), float(attributes["tension"])
