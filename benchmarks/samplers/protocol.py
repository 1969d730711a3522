"""What a sampler is given, and what it must leave behind."""

import os
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from muscle_bayes.inference.model.density import potential
from muscle_bayes.inference.model.problem import Problem

type Point = Float[np.ndarray, " n"]
type Density = Callable[[Point], tuple[float, Point]]
"""Log posterior of the unconstrained vector and its gradient."""


class Frame(NamedTuple):
    """Where all samplers start, and in which coordinates all but ours move: vector = mode + factor z."""

    mode: Float[np.ndarray, " n"]
    """Of the posterior, unconstrained."""
    factor: Float[np.ndarray, "n n"]
    """Cholesky factor of the inverse Fisher information there."""
    starts: Float[np.ndarray, "start n"]
    """Dispersed points, as z."""

    def vector(self, z: Float[np.ndarray, "*many n"]) -> Float[np.ndarray, "*many n"]:
        """Unconstrained vectors."""
        return self.mode + z @ self.factor.T

    def save(self, path: Path) -> None:
        """Write to an .npz file."""
        np.savez(path, **self._asdict())

    @classmethod
    def load(cls, path: Path) -> "Frame":
        """Read what `save` wrote."""
        with np.load(path) as stored:
            return cls(*(stored[name] for name in cls._fields))


class Record:
    """What a sampler has drawn up to now; it is written when the time is up, whatever goes on then."""

    def __init__(self, path: Path, cap: float) -> None:
        self.evaluations = 0
        """Of log posterior or of its gradient, warm-up included."""
        self._path, self._cap = path, cap
        self._z: list[np.ndarray] = []
        self._tuning: list[bool] = []
        self.diverging = 0
        """Draws after warm-up; -1 where the sampler does not tell."""
        self._ready = self._begun = time.perf_counter()
        self._busy = time.process_time()
        self._running = False
        self._lock = threading.Lock()

    def begin(self) -> None:
        """Everything is compiled: the clock starts, if it has not."""
        if self._running:
            return
        self._running = True
        self._begun, self._busy = time.perf_counter(), time.process_time()
        timer = threading.Timer(self._cap, self.end)
        timer.daemon = True
        timer.start()

    def add(self, z: np.ndarray, tuning: bool, diverging: bool = False) -> None:
        """One draw of every walker, (walker, n), in the frame's coordinates."""
        with self._lock:
            self._z.append(np.array(z, float))
            self._tuning.append(tuning)
            self.diverging += bool(diverging) and not tuning

    def end(self) -> None:
        """Write and leave the process: a transition under way may take minutes."""
        seconds = time.perf_counter() - self._begun
        busy = time.process_time() - self._busy
        with self._lock:
            np.savez(
                self._path,
                z=np.array(self._z),
                tuning=np.array(self._tuning, bool),
                diverging=self.diverging,
                evaluations=self.evaluations,
                seconds=seconds,
                busy=busy,
                setup=self._begun - self._ready,
            )
            os._exit(0)


class Sampler(ABC):
    """Draws from the posterior whose log density and gradient one competitor finds."""

    name: str
    """What it is called in tables."""
    settings: str
    """What it is set to, in words."""
    warmup: int
    """Iterations that are not judged, if the cap leaves more."""
    walkers: int = 1
    """Points that one process moves together."""

    def __init__(self, problem: Problem, frame: Frame) -> None:
        self.problem, self.frame = problem, frame

    @abstractmethod
    def density(self, vector: Point) -> float:
        """Log posterior at an unconstrained vector, to be compared with ours."""

    @abstractmethod
    def run(self, starts: Float[np.ndarray, "walker n"], seed: int, record: Record) -> None:
        """Compile, `record.begin()`, and draw without end."""


def our_density(problem: Problem) -> Callable[[Point], float]:
    """Our log posterior, compiled once."""
    compiled = jax.jit(potential, static_argnames="layout")
    return lambda vector: -float(compiled(vector, problem.layout, problem.data))


def whitened(
    density: Density, frame: Frame, record: Record
) -> Callable[[Point], tuple[float, Point]]:
    """Log density and gradient in z, every call counted; -inf where a solver fails.

    The first call begins the record: only then has the package around it compiled what it needs.
    """

    def counted(z: Point) -> tuple[float, Point]:
        record.begin()
        record.evaluations += 1
        try:
            # Threads of a package do not inherit the caller's precision.
            with jax.enable_x64(True):
                value, gradient = density(frame.vector(np.asarray(z, float)))
        except RuntimeError:  # CasADi's when an integration fails
            return -np.inf, np.zeros(len(z))
        if not (np.isfinite(value) and np.isfinite(gradient).all()):
            return -np.inf, np.zeros(len(z))
        return value, frame.factor.T @ gradient

    return counted
