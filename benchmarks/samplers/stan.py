"""Stan's NUTS on its own CVODES with forward sensitivities, from what PyStan 3 is made of.

PyStan's `sample` shows no draw before it has them all. So the service of its engine, httpstan, is called
here as the engine calls it: every draw comes through a socket, and those drawn within the cap are kept.
"""

import hashlib
import importlib.util
import json
import shutil
import socket
import subprocess
import sys
import sysconfig
import tempfile
import threading
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import httpstan
import numpy as np
from httpstan.services import arguments
from jaxtyping import Float

from benchmarks.samplers.protocol import Frame, Point, Record, Sampler
from benchmarks.samplers.settings import WARMUP
from benchmarks.samplers.stan_data import data_of
from muscle_bayes.inference.model.problem import Problem

PROGRAM = Path(__file__).with_name("muscle.stan")
CACHE = Path(__file__).parents[2] / ".cache" / "stan"
ENGINE = Path(httpstan.__file__).parent
FLAGS = (
    *("-O3", "-std=c++17", "-shared", "-fPIC", "-w"),
    *("-DBOOST_DISABLE_ASSERTS", "-DBOOST_PHOENIX_NO_VARIADIC_EXPRESSION"),
    *("-DSTAN_THREADS", "-D_REENTRANT", "-D_GLIBCXX_USE_CXX11_ABI=0"),
)
"""As the engine has them; `-march=native` gains nothing."""
LIBRARIES = ("sundials_cvodes", "sundials_idas", "sundials_nvecserial", "tbb")
SERVICE = "hmc_nuts_diag_e_adapt"
"""What PyStan's `sample` calls."""
LAST_WORDS = 8
"""Of its messages, which are kept for the case that it gives up."""
PATIENCE = 5.0
"""For them to be read [s]."""
WRITERS = 4
"""Connections that it opens: of messages, first point, draws and diagnostics."""


def _compile(library: Path) -> None:
    """The program with the engine's services around it, as an extension module.

    The engine would link services that it brings compiled. In its wheel for Python 3.13 they were
    compiled for 3.10 and refuse to run, so they are compiled here, too.
    """
    compiler = shutil.which("g++")
    if compiler is None:
        raise RuntimeError("Stan needs a C++ compiler; install g++")
    CACHE.mkdir(parents=True, exist_ok=True)
    headers = (ENGINE / "include", ENGINE, sysconfig.get_path("include"))
    with tempfile.TemporaryDirectory(dir=CACHE) as folder:
        source, made = Path(folder) / "muscle.cpp", Path(folder) / "muscle.so"
        translate = [ENGINE / "stanc", "--name", "muscle", "--o", source, PROGRAM]
        link = [f"-L{ENGINE / 'lib'}", *(f"-l{name}" for name in LIBRARIES)]
        command = [
            *(compiler, *FLAGS, *(f"-I{path}" for path in headers)),
            *(source, ENGINE / "stan_services.cpp", "-o", made),
            *(*link, f"-Wl,-rpath,{ENGINE / 'lib'}"),
        ]
        try:
            subprocess.run(translate, check=True)
            subprocess.run(command, check=True)
        except subprocess.CalledProcessError as trouble:
            raise RuntimeError("Stan's program was not compiled; why is above") from trouble
        made.replace(library)


def _module() -> Any:
    """The compiled program; the processes that draw find what the check of its density has compiled."""
    parts = (PROGRAM.read_text(encoding="utf-8"), version("httpstan"), sys.version, str(ENGINE))
    mark = hashlib.sha256("\n".join((*parts, *FLAGS)).encode()).hexdigest()[:16]
    library = CACHE / f"muscle-{mark}.so"
    if not library.exists():
        _compile(library)
    spec = importlib.util.spec_from_file_location("stan_services", library)
    if spec is None or spec.loader is None:
        raise ImportError(f"{library} is no extension module")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Stan(Sampler):
    """`ode_bdf_tol`, each run in its own inputs; the program states priors and noise model itself.

    Evaluations are the leapfrog steps of all draws, warm-up included. Stan does not tell those that
    find the first step size, nor those of the transition that the cap cuts off.
    """

    name = "Stan NUTS on CVODES"
    settings = "NUTS, diagonal mass matrix and step adapted"
    warmup = WARMUP

    def __init__(self, problem: Problem, frame: Frame) -> None:
        super().__init__(problem, frame)
        self._module = _module()
        self._data = data_of(problem, frame)
        self._said: deque[str] = deque(maxlen=LAST_WORDS)

    def density(self, vector: Point) -> float:
        """Log posterior; Stan finds the solution's sensitivities on the way."""
        z = np.linalg.solve(self.frame.factor, vector - self.frame.mode)
        try:
            return self._module.log_prob(self._data, z.tolist(), True)
        except (RuntimeError, ValueError):  # an integration that fails, an impossible point
            return -np.inf

    def run(self, starts: Float[np.ndarray, "walker n"], seed: int, record: Record) -> None:
        given: dict[str, Any] = {
            "data": self._data,
            "init": {"z": starts[0]},
            "random_seed": seed,
            "num_warmup": self.warmup,
            "num_samples": 10**6,
            "save_warmup": 1,
        }
        for name in arguments.function_arguments(SERVICE, self._module):
            if name not in given:
                given[name] = arguments.lookup_default(arguments.Method["SAMPLE"], name)
        folder = tempfile.TemporaryDirectory()
        path = str(Path(folder.name) / "draws")
        server = socket.socket(socket.AF_UNIX)
        server.bind(path)
        server.listen(WRITERS)
        listener = threading.Thread(target=self._listen, args=(server, folder, record), daemon=True)
        listener.start()
        record.begin()
        # Stan has its tape of derivatives in the main thread only.
        getattr(self._module, f"{SERVICE}_wrapper")(path, **given)
        listener.join(PATIENCE)
        raise RuntimeError("Stan stopped drawing: " + " ".join(self._said))

    def _listen(
        self, server: socket.socket, folder: tempfile.TemporaryDirectory, record: Record
    ) -> None:
        """Read from all writers. Once they are connected the socket's file is not needed."""
        writers = [server.accept()[0] for _ in range(WRITERS)]
        server.close()
        folder.cleanup()
        with ThreadPoolExecutor(WRITERS) as readers:
            list(readers.map(partial(self._read, record), writers))

    def _read(self, record: Record, writer: socket.socket) -> None:
        """Keep the draws among what one writer sends, until it closes."""
        drawn = 0
        for line in writer.makefile(encoding="utf-8"):
            message = json.loads(line)
            values = message["values"]
            if message["topic"] == "logger":
                self._said.append(" ".join(map(str, values)))
            if message["topic"] != "sample" or not isinstance(values, dict):
                continue
            z = np.array([values[f"z.{i + 1}"] for i in range(self.frame.mode.size)])
            record.evaluations += int(values["n_leapfrog__"])
            record.add(z[None], drawn < self.warmup, bool(values["divergent__"]))
            drawn += 1
