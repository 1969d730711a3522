"""Independent tasks on a dask scheduler; each result is kept as soon as it is there."""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from distributed import Client, LocalCluster, as_completed

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.provenance import fingerprint
from muscle_bayes.whole_file import write_whole

WORKERS = 2
"""Processes of the local cluster."""
PATIENCE = 10.0
"""How long to wait for a scheduler that was named, s."""


@dataclass(frozen=True)
class Tasks:
    """`function(*arguments)` for each named tuple of arguments; results must be JSON's own types.

    `inputs` is everything else that the results depend on (versions, checksums, settings): results
    kept under other inputs are made again.
    """

    function: Callable[..., Any]
    arguments: Mapping[str, tuple[Any, ...]]
    inputs: Mapping[str, Any]

    @property
    def stamp(self) -> str:
        """SHA-256 of the inputs."""
        return fingerprint(self.inputs)


@contextmanager
def connected(address: str | None, workers: int = WORKERS) -> Iterator[Client]:
    """A client of the scheduler at `address`, or of a local cluster of single-threaded processes.

    Raises MuscleBayesError where no scheduler answers.
    """
    if address is not None:
        try:
            with Client(address, timeout=PATIENCE) as client:
                yield client
        except (OSError, ValueError) as error:
            raise MuscleBayesError(
                f"{address}: no dask scheduler answers ({error}). Fix: start one with `dask "
                "scheduler`, or leave the address out to use this machine."
            ) from None
        return
    with (
        LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address=":0", memory_limit=0
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


def _kept(path: Path, stamp: str) -> dict[str, Any] | None:
    """What was kept under these inputs; None if nothing, or not whole."""
    try:
        found = json.loads(path.read_text())
    except (FileNotFoundError, json.JSONDecodeError):
        return None
    return found if isinstance(found, dict) and found.get("inputs") == stamp else None


def _keep(path: Path, stamp: str, result: Any) -> None:
    write_whole(path, json.dumps({"inputs": stamp, "result": result}).encode())


def run_tasks(
    tasks: Tasks,
    folder: Path,
    *,
    address: str | None = None,
    workers: int = WORKERS,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> dict[str, Any]:
    """Results of all tasks by name, those already kept in `folder` not run again.

    Each result is written to FOLDER/NAME.json when it arrives, so that interrupted work goes on
    where it stopped. Raises MuscleBayesError naming the tasks that failed, once all others are done,
    and where no scheduler answers.
    """
    folder.mkdir(parents=True, exist_ok=True)
    results: dict[str, Any] = {}
    for name in tasks.arguments:
        kept = _kept(folder / f"{name}.json", tasks.stamp)
        if kept is not None:
            results[name] = kept["result"]
    total = len(tasks.arguments)
    report(len(results), total)
    missing = {name: tasks.arguments[name] for name in tasks.arguments if name not in results}
    failed: dict[str, str] = {}
    if missing:
        with connected(address, workers) as client:
            futures = {
                client.submit(tasks.function, *arguments, pure=False): name
                for name, arguments in missing.items()
            }
            for future in as_completed(futures):
                name = futures[future]
                if (error := future.exception()) is not None:
                    failed[name] = f"{type(error).__name__}: {error}"
                else:
                    results[name] = future.result()
                    _keep(folder / f"{name}.json", tasks.stamp, results[name])
                future.release()
                report(len(results) + len(failed), total)
    if failed:
        name, reason = next(iter(failed.items()))
        raise MuscleBayesError(
            f"{len(failed)} of {total} tasks failed, {name} with {reason}. The others are kept in "
            f"{folder}: run the command again to repeat only what failed."
        )
    return {name: results[name] for name in tasks.arguments}
