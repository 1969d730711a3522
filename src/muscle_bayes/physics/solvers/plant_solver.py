"""What solvers of a plant's terms have in common."""

import dataclasses
from abc import abstractmethod
from typing import Any, ClassVar, Self

import diffrax
import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.schedule import Segment
from muscle_bayes.physics.solvers.play import Stops
from muscle_bayes.physics.state import PlantState


class PlantSolver(diffrax.AbstractSolver):
    """A diffrax solver of `Plant.terms()`, forwards in time; `args` of the integration is a `Schedule`.

    Steps should end at the schedule's nodes, as `simulate` has them do. A step of no length leaves
    the state as it is.
    """

    term_structure: ClassVar = diffrax.MultiTerm[tuple[diffrax.AbstractTerm, diffrax.AbstractTerm]]
    interpolation_cls: ClassVar = diffrax.LocalLinearInterpolation
    stops: eqx.AbstractVar[Stops | None]

    def for_plant(self, plant: Plant) -> Self:
        """The solver with what it must know of a plant beyond its terms, unless that was given."""
        return self if self.stops is not None else dataclasses.replace(self, stops=plant.stops)

    @abstractmethod
    def advance(
        self, terms: diffrax.MultiTerm, drive: Segment, y: PlantState, first: Bool[Array, ""]
    ) -> PlantState:
        """The state at the drive's end, from the one at its start; `first`: in the first step."""

    def init(self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any) -> Any:
        return jnp.asarray(True), jnp.asarray(0, jnp.int32)

    def step(
        self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any, solver_state: Any, made_jump: Any
    ) -> Any:
        first, interval = solver_state
        drive = args.segment(t0, t1, interval)
        y1 = self.advance(terms, drive, y0, first)
        now = jnp.asarray(False), drive.interval
        return y1, None, {"y0": y0, "y1": y1}, now, diffrax.RESULTS.successful

    def func(self, terms: Any, t0: Any, y0: Any, args: Any) -> Any:
        return terms.vf(t0, y0, args)
