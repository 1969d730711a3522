"""Where JAX keeps what it compiles, so that the next process need not compile it again."""

import os
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
