"""Tasks run once, survive failures of others, and are made again when their inputs change."""

import json
from pathlib import Path

import pytest

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.parallel.tasks import Tasks, connected, run_tasks


def counted(folder: str, value: int) -> dict[str, int]:
    """Square of the value; every call leaves a line behind."""
    with (Path(folder) / f"{value}.calls").open("a") as calls:
        calls.write("x\n")
    if (Path(folder) / f"{value}.broken").exists():
        raise ValueError(f"{value} is broken")
    return {"square": value * value}


def made(tmp_path: Path, **inputs) -> Tasks:
    arguments = {f"task-{value}": (str(tmp_path), value) for value in range(4)}
    return Tasks(counted, arguments, inputs)


def calls(tmp_path: Path) -> list[int]:
    paths = [tmp_path / f"{value}.calls" for value in range(4)]
    return [len(path.read_text().split()) if path.exists() else 0 for path in paths]


@pytest.fixture(scope="module")
def scheduler():
    with connected(None, 2) as client:
        yield client.scheduler.address


def test_results_are_kept_and_not_made_twice(tmp_path, scheduler):
    seen = []

    def note(done, total):
        seen.append((done, total))

    results = run_tasks(made(tmp_path), tmp_path / "out", address=scheduler, report=note)
    assert results == {f"task-{value}": {"square": value**2} for value in range(4)}
    assert list(results) == [f"task-{value}" for value in range(4)]
    assert seen == [(done, 4) for done in range(5)]
    assert run_tasks(made(tmp_path), tmp_path / "out") == results
    assert calls(tmp_path) == [1, 1, 1, 1]


def test_a_failure_is_named_and_only_it_runs_again(tmp_path, scheduler):
    (tmp_path / "2.broken").touch()
    with pytest.raises(MuscleBayesError, match=r"1 of 4 tasks failed, task-2 with .*2 is broken"):
        run_tasks(made(tmp_path), tmp_path / "out", address=scheduler)
    (tmp_path / "2.broken").unlink()
    results = run_tasks(made(tmp_path), tmp_path / "out", address=scheduler)
    assert results["task-2"] == {"square": 4}
    assert calls(tmp_path) == [1, 1, 2, 1]


def test_other_inputs_and_torn_files_are_made_again(tmp_path, scheduler):
    run_tasks(made(tmp_path, seed=0), tmp_path / "out", address=scheduler)
    run_tasks(made(tmp_path, seed=1), tmp_path / "out", address=scheduler)
    assert calls(tmp_path) == [2, 2, 2, 2]
    path = tmp_path / "out" / "task-3.json"
    path.write_text(path.read_text()[:-5])
    run_tasks(made(tmp_path, seed=1), tmp_path / "out", address=scheduler)
    assert calls(tmp_path) == [2, 2, 2, 3]
    assert json.loads(path.read_text())["result"] == {"square": 9}


def test_a_local_cluster_serves_by_default(tmp_path):
    assert run_tasks(made(tmp_path), tmp_path / "out", workers=1)["task-1"] == {"square": 1}


def test_an_address_without_a_scheduler_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("muscle_bayes.parallel.tasks.PATIENCE", 0.3)
    with pytest.raises(MuscleBayesError, match="no dask scheduler answers"):
        run_tasks(made(tmp_path), tmp_path / "out", address="tcp://127.0.0.1:1")
