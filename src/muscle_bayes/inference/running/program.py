"""Compiled programs that a later process need not trace again."""

import hashlib
import inspect
import pickle
from collections.abc import Callable, Hashable
from concurrent.futures import Executor, Future
from contextlib import suppress
from functools import cache, update_wrapper
from importlib.metadata import version
from pathlib import Path
from threading import RLock
from time import time
from typing import Any

import jax
import jax.numpy as jnp
from jax import export

from muscle_bayes.inference.model.problem import Layout
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.provenance import source_checksum
from muscle_bayes.whole_file import write_whole

TRACED_LAYERS = ("physics", "data", "inference")
"""Layers whose code a trace depends on."""
STATIC = ("layout", "regime")
"""Names of arguments that are not arrays."""
LIBRARIES = ("jax", "jaxlib", "numpyro", "diffrax", "equinox")
KEPT_FOR = 30 * 86_400.0
"""Time since its last use after which a trace is dropped, s: its code, layout or shapes are no more."""

MAKING = RLock()
"""Held while a program is made: JAX traces the same function in two threads at its peril."""


def _is_static(argument: Any) -> bool:
    return isinstance(argument, Layout | str)


def _array(leaf: Any) -> Any:
    return leaf if hasattr(leaf, "dtype") else jnp.asarray(leaf)


def _is_key(leaf: Any) -> bool:
    return jax.dtypes.issubdtype(leaf.dtype, jax.dtypes.prng_key)


def _shape(leaf: Any) -> jax.ShapeDtypeStruct:
    """Shape of an argument, of random keys that of their data: exported programs know no keys."""
    if _is_key(leaf):
        return jax.eval_shape(jax.random.key_data, leaf)
    return jax.ShapeDtypeStruct(leaf.shape, leaf.dtype)


def _bare(leaf: Any) -> Any:
    return jax.random.key_data(leaf) if _is_key(leaf) else leaf


def _dressed(leaf: Any, key: bool) -> Any:
    return jax.random.wrap_key_data(leaf) if key else leaf


@cache
def _code() -> str:
    """What a trace depends on, beside its arguments."""
    versions = ",".join(f"{name}={version(name)}" for name in LIBRARIES)
    return f"{source_checksum(*TRACED_LAYERS)};{versions}"


def _drop_unused(folder: Path) -> None:
    """Delete what has not been used for KEPT_FOR."""
    oldest = time() - KEPT_FOR
    for path in folder.iterdir():
        # Another process may have been quicker.
        with suppress(FileNotFoundError):
            if path.stat().st_mtime < oldest:
                path.unlink()


class _Kept:
    """An exported program on flat arguments, and the structure of what it returns."""

    def __init__(self, exported: export.Exported, skeleton: Any, keys: list[bool]) -> None:
        self.exported = exported
        self._skeleton, self._keys = skeleton, keys

    def written(self) -> bytes:
        return pickle.dumps((bytes(self.exported.serialize()), self._skeleton, self._keys))

    @classmethod
    def read(cls, written: bytes) -> "_Kept":
        serialized, skeleton, keys = pickle.loads(written)
        return cls(export.deserialize(bytearray(serialized)), skeleton, keys)

    def restored(self, leaves: list[Any]) -> Any:
        """What the traced function returns."""
        dressed = list(map(_dressed, leaves, self._keys))
        return jax.tree.map(lambda index: dressed[index], self._skeleton)


class Lowered:
    """A program for arguments of known shapes, traced; compiling can be left to another thread."""

    def __init__(self, lowered: jax.stages.Lowered, kept: _Kept | None) -> None:
        self._lowered, self._kept = lowered, kept

    def compile(self) -> Callable[..., Any]:
        """The program, to be called with the arguments that are not static."""
        compiled, kept = self._lowered.compile(), self._kept
        if kept is None:
            return compiled

        def call(*arguments: Any) -> Any:
            return kept.restored(compiled(*map(_bare, jax.tree.leaves(arguments))))

        return call


def _known(arguments: tuple[Any, ...], leaves: list[Any], structure: Any) -> Hashable:
    """What tells one compiled form of a program from another."""
    static = tuple(a for a in arguments if _is_static(a))
    return static, structure, tuple((leaf.shape, leaf.dtype) for leaf in leaves)


class Program[R]:
    """A compiled function of arrays and of static layouts and strings.

    Beside the programs that JAX compiles and keeps (JAX_COMPILATION_CACHE_DIR) the traces are kept
    that lead to them: to trace a simulation with its derivatives takes seconds, to load it takes none.
    A trace is made anew when the package's code, a library's version, the layout or a shape has
    changed, and where an effect is not of this package, for its code is not watched. A trace that was
    not used for KEPT_FOR is dropped when another is written. Without such a folder nothing is kept.
    """

    def __init__(self, function: Callable[..., R]) -> None:
        update_wrapper(self, function)
        static = [name for name in inspect.signature(function).parameters if name in STATIC]
        self._function = function
        self._traced = jax.jit(function, static_argnames=static)
        self._compiled: dict[Hashable, Callable[..., R]] = {}
        self._begun: dict[Hashable, Future[Callable[..., R]]] = {}

    def __call__(self, *arguments: Any) -> R:
        leaves, structure = jax.tree.flatten([a for a in arguments if not _is_static(a)])
        if any(isinstance(leaf, jax.core.Tracer) for leaf in leaves):
            return self._traced(*arguments)
        leaves = list(map(_array, leaves))
        known = _known(arguments, leaves, structure)
        if known not in self._compiled:
            with MAKING:
                self._make(known, arguments)
        return self._compiled[known](*jax.tree.unflatten(structure, leaves))

    def _make(self, known: Hashable, arguments: tuple[Any, ...]) -> None:
        # Another thread may have been quicker.
        if known not in self._compiled:
            begun = self._begun.pop(known, None)
            self._compiled[known] = begun.result() if begun else self.lower(*arguments).compile()

    def begin(self, pool: Executor, *arguments: Any) -> None:
        """Trace for arguments of these shapes, and leave compiling to `pool`: a call will wait for it."""
        leaves, structure = jax.tree.flatten([a for a in arguments if not _is_static(a)])
        known = _known(arguments, list(map(_array, leaves)), structure)
        if known not in self._compiled and known not in self._begun:
            self._begun[known] = pool.submit(self.lower(*arguments).compile)

    def lower(self, *arguments: Any) -> Lowered:
        """The program for arguments of these shapes, traced or loaded."""
        static = {place: a for place, a in enumerate(arguments) if _is_static(a)}
        moving = jax.tree.map(_array, [a for a in arguments if not _is_static(a)])

        def called(*moving: Any) -> R:
            rest = iter(moving)
            every = [static[i] if i in static else next(rest) for i in range(len(arguments))]
            return self._function(*every)

        path = self._path(tuple(static.values()), moving)
        if path is None:
            return Lowered(jax.jit(called).lower(*moving), None)
        shapes = [_shape(leaf) for leaf in jax.tree.leaves(moving)]
        try:
            kept = _Kept.read(path.read_bytes())
            path.touch()
        except (OSError, EOFError, ValueError, pickle.UnpicklingError):
            kept = _traced(called, moving)
            write_whole(path, kept.written())
            _drop_unused(path.parent)
        return Lowered(jax.jit(kept.exported.call).lower(*shapes), kept)

    def _path(self, static: tuple[Any, ...], moving: list[Any]) -> Path | None:
        """Where the trace is kept; None if it is not."""
        folder = jax.config.jax_compilation_cache_dir
        layouts = [one for one in static if isinstance(one, Layout)]
        effects = [effect_type(name) for layout in layouts for name in layout.effects]
        if not folder or any(not e.__module__.startswith("muscle_bayes.") for e in effects):
            return None
        leaves, structure = jax.tree.flatten(moving)
        shapes = [(leaf.shape, str(leaf.dtype)) for leaf in leaves]
        name = f"{self._function.__module__}.{self._function.__qualname__}"
        parts = (_code(), name, static, structure, shapes, jax.default_backend())
        traces = Path(folder) / "traces"
        traces.mkdir(parents=True, exist_ok=True)
        digest = hashlib.sha256(repr(parts).encode()).hexdigest()
        return traces / f"{name.split('.', 2)[-1]}-{digest[:24]}.trace"


def _traced(called: Callable[..., Any], moving: list[Any]) -> _Kept:
    leaves, structure = jax.tree.flatten(moving)
    keys = [_is_key(leaf) for leaf in leaves]
    returned: list[Any] = []

    def flat(*bare: Any) -> list[Any]:
        result = called(*jax.tree.unflatten(structure, list(map(_dressed, bare, keys))))
        out, structure_out = jax.tree.flatten(jax.tree.map(jnp.asarray, result))
        returned[:] = [
            jax.tree.unflatten(structure_out, range(len(out))),
            [_is_key(leaf) for leaf in out],
        ]
        return list(map(_bare, out))

    exported = export.export(jax.jit(flat))(*map(_shape, leaves))
    return _Kept(exported, *returned)
