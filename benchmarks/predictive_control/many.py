"""Many joints under predictive control, on every core; processes cannot import `__main__`."""

import multiprocessing
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from muscle_bayes.compiled import keep_compiled_code
from muscle_bayes.control.judging.metrics import Metrics
from muscle_bayes.control.plant.draws import JointDraws


@dataclass
class _Worker:
    """What a process keeps from joint to joint."""

    joints: JointDraws
    controller: Any
    scenarios: tuple[Any, ...]
    seeds: np.ndarray


_WORKER: list[_Worker] = []


def _begin(joints: JointDraws, median: JointDraws, seeds: np.ndarray) -> None:
    import jax

    jax.config.update("jax_enable_x64", True)
    keep_compiled_code()
    from benchmarks.predictive_control.loop import Controller, Settings
    from muscle_bayes.control.scenarios.thesis import thesis_scenarios

    controller = Controller(median.one(), Settings())
    _WORKER.append(_Worker(joints, controller, thesis_scenarios(), seeds))


def _joint(index: int) -> tuple[dict[str, Metrics], list[float]]:
    """Metrics of one joint in every scenario, and seconds of its plans."""
    from benchmarks.predictive_control.loop import respond

    own = _WORKER[0]
    own.controller.seconds.clear()
    joint, seed = own.joints.one(index), int(own.seeds[index])
    found = {s.name: respond(joint, own.controller, s, seed)[0] for s in own.scenarios}
    return found, list(own.controller.seconds)


def each(joints: JointDraws, median: JointDraws, seeds: np.ndarray, workers: int) -> Iterator[Any]:
    """Metrics by scenario, and seconds of plans, of one joint after another; `median` is the model."""
    context = multiprocessing.get_context("spawn")
    begin = (joints, median, seeds)
    with ProcessPoolExecutor(workers, context, _begin, begin) as pool:
        for number, found in enumerate(pool.map(_joint, range(len(joints)))):
            print(f"predictive: joint {number + 1} of {len(joints)}", flush=True)
            yield found
