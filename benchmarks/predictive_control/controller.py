"""A predictive controller: least squares over the horizon, duties and temperatures bounded."""

from dataclasses import dataclass, field
from typing import Any

import casadi
import numpy as np
from jaxtyping import Float

Vector = Float[np.ndarray, " n"]


@dataclass(frozen=True)
class Horizon:
    """Steps of the prediction [s], duties constant over each."""

    steps: tuple[float, ...]

    @property
    def ends(self) -> Vector:
        """Instants of the predicted states, from now [s]."""
        return np.cumsum(self.steps)

    def shifted(self, duties: Float[np.ndarray, "step 2"], by: float) -> np.ndarray:
        """Duties of a plan made `by` [s] ago, on this horizon from now."""
        middles = self.ends - 0.5 * np.asarray(self.steps) + by
        places = np.searchsorted(self.ends, middles, side="right")
        return duties[np.minimum(places, len(duties) - 1)]


@dataclass(frozen=True)
class Price:
    """What is minimised, in shares of the error that counts as 1."""

    error: float = 0.005
    """Error that costs 1 [unit of the output]."""
    duty: float = 0.02
    """Price of full duty, squared: two muscles that pull against each other are a waste."""
    change: float = 0.2
    """Price of a change by full duty."""
    heat: float = 1e4
    """Price of a kelvin beyond the ceiling, to the first power: large enough to be exact."""
    last: float = 3.0
    """Weight of the last instant's error against that of the others."""


@dataclass
class Predictive:
    """Duties that minimise the predicted error, within 0 to 1 and below a ceiling of the temperatures.

        min  sum_k h_k ((y_k - r_k) / error)^2 + duty |u_k|^2 + change |u_k - u_(k-1)|^2 + heat slack
        x_(k+1) = stage(x_k, u_k, d, h_k),   0 <= u_k <= 1,   bounded x_k <= ceiling + slack

    The states follow from the duties (single shooting). Each call takes `rounds` Gauss-Newton steps from
    the last plan; each step is a quadratic programme, solved by DAQP.
    """

    stage: casadi.Function
    horizon: Horizon
    output: int
    """Place of the controlled state."""
    bounded: Float[np.ndarray, "bound state"]
    """What of the states must stay below the ceiling, a row each."""
    inputs: int = 2
    price: Price = field(default_factory=Price)
    rounds: int = 2
    sloped: casadi.Function | None = None
    """What slopes are taken of, where `stage` has corners; by default `stage`."""

    def __post_init__(self) -> None:
        n, self.states = len(self.horizon.steps), self.stage.size1_in(0)
        self.roll = self.stage.mapaccum("roll", n)
        x, u = casadi.SX.sym("x", self.states), casadi.SX.sym("u", self.inputs)
        d, h = casadi.SX.sym("d", self.stage.size1_in(2)), casadi.SX.sym("h")
        after = (self.sloped or self.stage)(x, u, d, h)
        slopes = casadi.Function(
            "slopes", [x, u, d, h], [casadi.jacobian(after, x), casadi.jacobian(after, u)]
        )
        self.slopes = slopes.map(n)
        size = n * self.inputs
        self._weights = np.sqrt(np.asarray(self.horizon.steps)) / self.price.error
        self._weights[-1] *= np.sqrt(self.price.last)
        self._changes = np.eye(size) - np.eye(size, k=-self.inputs)
        rows = n * len(self.bounded)
        wide = size + len(self.bounded)
        shape = {"h": casadi.Sparsity.dense(wide, wide), "a": casadi.Sparsity.dense(rows, wide)}
        self._solver = casadi.conic("qp", "daqp", shape, {"error_on_fail": False})

    def predicted(self, state: Vector, duties: np.ndarray, disturbance: Vector) -> np.ndarray:
        """States at the ends of all steps, (step, state)."""
        more = np.repeat(disturbance[:, None], len(duties), 1)
        steps = np.asarray(self.horizon.steps)[None]
        return np.asarray(self.roll(state, duties.T, more, steps)).T

    def _sensitivities(
        self, state: Vector, path: np.ndarray, duties: np.ndarray, disturbance: Vector
    ) -> np.ndarray:
        """d path / d duties, (step, state, inputs of all steps)."""
        n, m = len(duties), self.inputs
        begins = np.vstack([state, path[:-1]])
        more = np.repeat(disturbance[:, None], n, 1)
        steps = np.asarray(self.horizon.steps)[None]
        by_x, by_u = (np.asarray(s) for s in self.slopes(begins.T, duties.T, more, steps))
        along = np.zeros((self.states, n * m))
        found = np.empty((n, self.states, n * m))
        for k in range(n):
            along = by_x[:, k * self.states : (k + 1) * self.states] @ along
            along[:, k * m : (k + 1) * m] += by_u[:, k * m : (k + 1) * m]
            found[k] = along
        return found

    def plan(
        self,
        state: Vector,
        disturbance: Vector,
        wanted: Vector,
        ceiling: float,
        duties: np.ndarray,
        before: Vector,
    ) -> np.ndarray:
        """Duties over the horizon, (step, input), from a first guess.

        `wanted` are the outputs wanted at the ends of the steps, `before` the duties in force now.
        """
        for _ in range(self.rounds):
            path = self.predicted(state, duties, disturbance)
            along = self._sensitivities(state, path, duties, disturbance)
            move = self._step(path, along, wanted, ceiling, duties, before)
            duties = np.clip(duties + move, 0.0, 1.0)
        return duties

    def _step(
        self,
        path: np.ndarray,
        along: np.ndarray,
        wanted: Vector,
        ceiling: float,
        duties: np.ndarray,
        before: Vector,
    ) -> np.ndarray:
        """One Gauss-Newton step of the duties: the quadratic programme."""
        price, flat = self.price, duties.reshape(-1)
        miss = self._weights * (path[:, self.output] - wanted)
        by = self._weights[:, None] * along[:, self.output]
        jump = self._changes @ flat
        jump[: self.inputs] -= before
        weights = np.repeat(self.horizon.steps, self.inputs)
        hessian = by.T @ by + np.diag(price.duty * weights)
        hessian += price.change * self._changes.T @ self._changes
        gradient = by.T @ miss + price.duty * weights * flat
        gradient += price.change * self._changes.T @ jump
        sides = len(self.bounded)
        steep = np.einsum("bx,kxu->bku", self.bounded, along).reshape(-1, flat.size)
        room = (ceiling - path @ self.bounded.T).T.reshape(-1)
        slack = np.kron(np.eye(sides), np.ones((len(duties), 1)))
        whole = np.block(
            [[hessian, np.zeros((flat.size, sides))], [np.zeros((sides, flat.size)), np.eye(sides)]]
        )
        solution: Any = self._solver(
            h=whole,
            g=np.r_[gradient, np.full(sides, price.heat)],
            a=np.hstack([steep, -slack]),
            uba=room,
            lba=-np.inf,
            lbx=np.r_[-flat, np.zeros(sides)],
            ubx=np.r_[1.0 - flat, np.full(sides, np.inf)],
        )
        return np.asarray(solution["x"])[: flat.size, 0].reshape(duties.shape)
