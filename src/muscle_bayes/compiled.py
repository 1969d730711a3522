"""What JAX compiles: where it is kept for the next process, and when this process forgets it."""

import os
import sys
from pathlib import Path


def keep_compiled_code() -> Path:
    """Keep compiled code in ~/.cache/muscle-bayes, so that the next process need not compile it again.

    To be called before JAX is imported: JAX reads its environment then. The user's own settings come
    first (JAX_COMPILATION_CACHE_DIR, XDG_CACHE_HOME).

    Returns:
        The folder in force.

    Example:
        >>> import muscle_bayes as mb
        >>> folder = mb.keep_compiled_code()
    """
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "muscle-bayes"
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(cache))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")
    return Path(os.environ["JAX_COMPILATION_CACHE_DIR"])


def forget_much_compiled_code(most_maps: int = 30_000) -> None:
    """Have JAX forget what this process compiled, once it takes more than `most_maps` pieces of memory.

    For processes that study many different rigs. Linux lets a process map 65,530 pieces, and aborts it
    beyond; compiled code takes some each. Elsewhere, and before JAX is imported, nothing happens.
    """
    maps = Path("/proc/self/maps")
    jax = sys.modules.get("jax")
    if jax is not None and maps.exists() and maps.read_bytes().count(b"\n") > most_maps:
        jax.clear_caches()
