"""The limit of vanishing inertia: dry friction as a play operator, HYST by an L-stable step."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Self

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.materialise import materialise
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.schedule import Segment
from muscle_bayes.physics.solvers.exponential_midpoint import (
    Memory,
    exponential_step,
    paired,
    stacked,
)
from muscle_bayes.physics.solvers.plant_solver import PlantSolver
from muscle_bayes.physics.solvers.play import Forces, Search, Stops, play, stopped
from muscle_bayes.physics.state import Pair, PlantState

GAMMA = 1.0 - 0.5**0.5
"""Coefficient that makes the two-stage Rosenbrock method ROS2 L-stable."""


class QuasiStatic(PlantSolver):
    """0 = a(t, y) - d(t, y) sign(v), v = 0 while |a| <= d: motion whose inertia does not count.

    First the rotor slides to the drive of the step's middle. Then HYST crosses the step with the rotor
    along (midpoint rule). Last the rotor slides on to the drive at the end. The order is two with dry
    friction. It is one with friction in proportion to speed, which is taken from the mean speed over half
    a step. `speed` of the state is the mean over the step's second half. So q - speed (t1 - t0) / 2 is
    the coordinate in the middle. The initial state's `speed` does not count. In the first step, even one
    of no length, the rotor comes to rest. Where the load jumps a short step should follow, lest HYST
    sees the new load from the old coordinate. What leaving inertia out changes is to be checked
    against `StickSlip`.

    `stops`: endstops, `relaxing`: sides whose sigma_hyst moves; None: those of the plant that `simulate`
    is given. `search`: how rests are searched for.
    """

    stops: Stops | None = None
    relaxing: tuple[int, ...] | None = eqx.field(static=True, default=None)
    search: Search = eqx.field(static=True, default=Search())

    def order(self, terms: Any) -> int:
        return 2

    def for_plant(self, plant: Plant) -> Self:
        solver, sides = super().for_plant(plant), (plant.side_a, plant.side_b)
        if self.relaxing is not None:
            return solver
        relaxing = tuple(place for place, side in enumerate(sides) if side.relaxes)
        return dataclasses.replace(solver, relaxing=relaxing)

    def init(self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any) -> Any:
        if self.stops is None or self.relaxing is None:
            raise ValueError(
                "QuasiStatic must know the plant's endstops and muscles. Fix: use `simulate`, or "
                "QuasiStatic().for_plant(plant)"
            )
        return super().init(terms, t0, t1, y0, args)

    @property
    def _sides(self) -> tuple[int, ...]:
        assert self.relaxing is not None
        return self.relaxing

    @property
    def _ends(self) -> Stops:
        assert self.stops is not None
        return self.stops

    def advance(
        self, terms: diffrax.MultiTerm, drive: Segment, y: PlantState, first: Bool[Array, ""]
    ) -> PlantState:
        duration = drive.t1 - drive.t0
        half, middle = 0.5 * duration, 0.5 * (drive.t0 + drive.t1)
        origin, smooth = paired(y.memory), terms.terms[0].vf
        hyst = (y.hyst[0], y.hyst[1])
        begin = y._replace(speed=jnp.zeros_like(y.q), hyst=hyst, memory=origin)

        def moved(t: Scalar, at: PlantState, over: Scalar) -> Memory:
            def rates(memory: Memory) -> Mapping[str, Array | Pair]:
                return smooth(t, at._replace(memory=memory), drive).memory

            return materialise(exponential_step(rates, at.memory, origin, over, self._sides))

        def slide(at: PlantState, to_end: Bool[Array, ""]) -> tuple[PlantState, Scalar]:
            if y.memory:
                seen = jax.tree.map(lambda a, b: 0.5 * (a + b), hyst, at.hyst)
                since, over = jnp.where(to_end, middle, drive.t0), jnp.where(to_end, duration, half)
                memory = moved(since, at._replace(hyst=seen), over)
                at = at._replace(memory=memory)
            balance = _Balance(terms, drive, jnp.where(to_end, drive.t1, middle), at, half)
            q = self._slid(balance)

            def crossed() -> PlantState:
                return materialise(self._crossed(balance, q, duration))

            at = jax.lax.cond(to_end, lambda: at._replace(q=q), crossed)
            return at, at.q

        # To the middle and to the end: a loop, so that a slide is compiled once.
        there, (passed, end) = jax.lax.scan(slide, begin, jnp.array([False, True]))
        lasts = duration > 0.0
        speed = jnp.where(lasts, (end - passed) / jnp.where(lasts, half, 1.0), 0.0)
        arrived = PlantState(end, speed, jnp.stack(there.hyst), stacked(there.memory))
        return jax.tree.map(lambda a, b: jnp.where(lasts | first, a, b), arrived, y)

    def rest(
        self, terms: diffrax.MultiTerm, t: Scalar, y: PlantState, drive: Segment
    ) -> PlantState:
        """The state after a slide in no time [s], HYST and memory being held."""
        still = y._replace(speed=jnp.zeros_like(y.q))
        return still._replace(q=self._slid(_Balance(terms, drive, t, still, jnp.zeros_like(y.q))))

    def _slid(self, balance: "_Balance") -> Scalar:
        return play(forces_at, balance.begin.q, balance, self._ends, self.search)

    def _crossed(self, balance: "_Balance", at: Scalar, duration: Scalar) -> PlantState:
        """HYST at the step's end, the rotor in its middle, from its rest `at` under the middle's drive."""
        path = materialise(self._path(balance, at))
        moves = self._moves(balance, path, duration)
        q = path.at(tuple(0.5 * move for move in moves))
        begin = balance.begin
        return begin._replace(q=q, hyst=self._after(begin.hyst, moves))

    def _after(self, hyst: Pair, moves: tuple[Scalar, ...]) -> Pair:
        for side, move in zip(self._sides, moves, strict=True):
            hyst = _with(hyst, side, hyst[side] + move)
        return hyst

    def _path(self, balance: "_Balance", at: Scalar) -> "_Path":
        """The rotor's path from its rest `at` under a drive, to first order in sigma_hyst.

        Where the rotor slides the balance of forces sets the tension, and HYST follows that and not the
        springs' stiffness. HYST seen from a rotor at rest would give way as soon as its own spring was
        relieved: far too little, where MODULUS is stiff.
        """
        q, duration = balance.begin.q, balance.duration
        at = materialise(at)
        (pull, dry), (slope, dry_slope) = jax.jvp(lambda x: forces_at(x, balance), (at,), (1.0,))
        relief = [balance.relief(side, at) for side in self._sides]
        # How hard would the rotor be pulled at q, temperature and HYST having moved? HYST first takes
        # back what temperature made the rotor slide, under a tension that stays; then it relaxes
        # against a rotor that rests.
        still_at, still = jax.tree.map(stopped, (at, balance))
        rates = [still.relaxation(side, still_at) for side in self._sides]
        speeds = [by * rate for by, (rate, _) in zip(relief, rates, strict=True)]
        total, slide = sum(speeds), (q - at) * slope
        opposed = total * slide < 0.0
        taking = jnp.where(opposed, jnp.abs(slide) / jnp.where(opposed, jnp.abs(total), 1.0), 0.0)
        taking = jnp.minimum(taking, duration)
        left = duration - taking
        growth = sum(
            speed * left / (1.0 - left * jnp.minimum(by_hyst, 0.0))
            for speed, (_, by_hyst) in zip(speeds, rates, strict=True)
        )
        held = pull + slide + total * taking + growth
        direction = jnp.sign(held)
        static = forces_at(q, balance)[1]
        inside = (at > self._ends[0]) & (at < self._ends[1])
        slope = slope - direction * dry_slope
        firm = (slope < 0.0) & inside
        free = firm & ((jnp.abs(held) > static) | (static == 0.0))
        softness = jnp.where(free, -1.0 / jnp.where(free, slope, -1.0), 0.0)
        onward = at + (pull - direction * dry) * softness
        at = jnp.where(firm & ~free, q, jnp.where(static == 0.0, at, onward))
        return _Path(at, tuple(by * softness for by in relief))

    def _moves(self, balance: "_Balance", path: "_Path", duration: Scalar) -> tuple[Scalar, ...]:
        """How far HYST moves in `duration` along the rotor's path, by side.

        ROS2 (Verwer et al., SIAM J. Sci. Comput. 20, 1999): second order, L-stable.
        """
        if not self._sides:
            return ()

        def rates(*moves: Scalar) -> tuple[Scalar, ...]:
            rate = balance.hyst_rates(path.at(moves), self._after(balance.begin.hyst, moves))
            return tuple(rate[side] for side in self._sides)

        none = tuple(jnp.zeros_like(path.q) for _ in self._sides)
        columns = []
        for place in range(len(none)):

            def along(move: Scalar, place: int = place) -> tuple[Scalar, ...]:
                return rates(*none[:place], move, *none[place + 1 :])

            value, column = jax.jvp(along, (none[place],), (1.0,))
            columns.append(column)
        value, columns = materialise((value, columns))
        solve = _inverse(columns, GAMMA * duration)
        first = solve(value)
        late = rates(*(duration * one for one in first))
        second = solve(tuple(a - 2.0 * b for a, b in zip(late, first, strict=True)))
        return tuple(duration * (1.5 * a + 0.5 * b) for a, b in zip(first, second, strict=True))


class _Balance(NamedTuple):
    """Forces on a rotor that slides from rest at `begin` under the drive of one instant."""

    terms: diffrax.MultiTerm
    drive: Segment
    t: Scalar
    begin: PlantState
    duration: Scalar
    """How long the slide takes [s]."""

    def relief(self, side: int, at: Scalar) -> Scalar:
        """d force / d sigma_hyst of one side, the rotor at `at`."""

        def pull(value: Scalar) -> Scalar:
            begin = self.begin._replace(hyst=_with(self.begin.hyst, side, value))
            return forces_at(at, self._replace(begin=begin))[0]

        return jax.jvp(pull, (self.begin.hyst[side],), (1.0,))[1]

    def hyst_rates(self, q: Scalar, hyst: Pair) -> Pair:
        """d sigma_hyst/dt [1/s] while the rotor is at q."""
        smooth, begin = self.terms.terms[0], self.begin
        return smooth.vf(self.t, begin._replace(q=q, hyst=hyst), self.drive).hyst

    def relaxation(self, side: int, at: Scalar) -> tuple[Scalar, Scalar]:
        """One side's d sigma_hyst/dt [1/s] and its derivative by sigma_hyst, the rotor at `at`."""

        def rate(value: Scalar) -> Scalar:
            return self.hyst_rates(at, _with(self.begin.hyst, side, value))[side]

        return jax.jvp(rate, (self.begin.hyst[side],), (1.0,))


def forces_at(x: Scalar, balance: _Balance) -> Forces:
    """Accelerations by all but dry friction, and by it at most, at the end of a slide to x.

    What depends on speed sees the mean of the slide. Per unit of inertia, whatever that is: a balance
    does not depend on it.
    """
    terms, drive, t, begin, duration = balance
    lasts = duration > 0.0
    speed = jnp.where(lasts, (x - begin.q) / jnp.where(lasts, duration, 1.0), 0.0)
    y = begin._replace(q=x, speed=speed)
    smooth, dry = terms.terms
    return smooth.vf(t, y, drive).speed, dry.vf(t, y, drive).speed


class _Path(NamedTuple):
    """Where the rotor is while HYST moves over a step: q + sum of along * (its move), by side."""

    q: Scalar
    along: tuple[Scalar, ...]

    def at(self, moves: tuple[Scalar, ...]) -> Scalar:
        """Coordinate after these moves of sigma_hyst."""
        return self.q + sum(by * move for by, move in zip(self.along, moves, strict=True))


def _with(hyst: Pair, side: int, value: Scalar) -> Pair:
    return (value, hyst[1]) if side == 0 else (hyst[0], value)


def _inverse(
    columns: list[tuple[Scalar, ...]], step: Scalar
) -> Callable[[tuple[Scalar, ...]], tuple[Scalar, ...]]:
    """The map x -> (1 - step * matrix)^-1 x of a matrix with one or two columns."""
    if len(columns) == 1:
        scale = 1.0 / (1.0 - step * columns[0][0])
        return lambda x: (scale * x[0],)
    (aa, ba), (ab, bb) = columns
    a, b, c, d = 1.0 - step * aa, -step * ab, -step * ba, 1.0 - step * bb
    scale = 1.0 / (a * d - b * c)
    return lambda x: (scale * (d * x[0] - b * x[1]), scale * (a * x[1] - c * x[0]))
