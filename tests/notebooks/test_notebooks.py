"""Every cell of every notebook runs, with its own (quick) effort; the notebooks themselves stay stories."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import jupytext
import nbformat
import pytest

PROJECT = Path(__file__).parents[2]
NOTEBOOKS = sorted((PROJECT / "notebooks").glob("*.py"))
QUICK = [path for path in NOTEBOOKS if path.stem in ("01_quick_start", "09_bench")]


def executed(out: Path, *arguments: str) -> str:
    """What the script says that runs them; fails where a cell does."""
    command = [sys.executable, "scripts/notebooks.py", "--out", str(out), *arguments]
    paths = os.pathsep.join([str(PROJECT / "src"), os.environ.get("PYTHONPATH", "")])
    told = subprocess.run(
        command,
        cwd=PROJECT,
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
    )
    assert told.returncode == 0, told.stdout + told.stderr
    return told.stdout


def with_firmware(named: list[Path]) -> list[str]:
    """Those that can run here: the bench's needs the firmware."""
    built = (PROJECT / "firmware" / "build" / "libbench_simavr.so").exists()
    return [str(path) for path in named if built or "bench" not in path.stem]


@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    "notebooks", [QUICK, pytest.param(NOTEBOOKS, marks=pytest.mark.slow)], ids=["quick", "all"]
)
def test_every_cell_runs(notebooks, tmp_path):
    asked = with_firmware(notebooks)
    print(executed(tmp_path, *asked))
    written = sorted(tmp_path.glob("*.ipynb"))
    assert len(written) == len(asked)
    for path in written:
        cells = nbformat.read(path, as_version=4).cells
        outputs = [output for cell in cells for output in cell.get("outputs", ())]
        kinds = {kind for output in outputs for kind in output.get("data", ())}
        assert "image/png" in kinds, f"{path.stem} shows no figure"
        assert str(tmp_path) not in path.read_text(encoding="utf-8"), f"{path.stem} shows a path"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_tells_a_story_and_calls_the_library(path):
    notebook = jupytext.read(path)
    first = notebook.cells[0]
    assert first.cell_type == "markdown"
    assert first.source.startswith("# ")
    assert "You will learn" in first.source
    prose = "".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
    assert re.search(r"synthetic", prose, re.IGNORECASE), "does not say that its data are synthetic"
    code = "\n".join(
        cell.source.replace("%matplotlib", "#")
        for cell in notebook.cells
        if cell.cell_type == "code"
    )
    defined = [node for node in ast.walk(ast.parse(code)) if isinstance(node, ast.FunctionDef)]
    assert all(len(ast.unparse(one).splitlines()) <= 5 for one in defined)


def test_the_numpyro_model_takes_under_thirty_lines():
    lines = (PROJECT / "notebooks" / "04b_numpyro_model.py").read_text().splitlines()
    assert sum(bool(line) and not line.startswith("#") for line in lines) < 30


MOST_BYTES = 6_000_000
"""Of all notebooks that are shipped with their figures."""


def test_shipped_notebooks_are_paired_with_their_scripts_and_small():
    shipped = sorted((PROJECT / "notebooks").glob("*.ipynb"))
    if not shipped:
        pytest.skip("`make notebooks` has not been run")
    assert [one.stem for one in shipped] == [one.stem for one in NOTEBOOKS]
    assert sum(one.stat().st_size for one in shipped) < MOST_BYTES
    for one in shipped:
        script = jupytext.read(one.with_suffix(".py"))
        run = nbformat.read(one, as_version=4)
        run.cells[0].source = re.sub(r"\n\n\*Ran in .*\*$", "", run.cells[0].source)
        cells = [[(cell.cell_type, cell.source) for cell in each.cells] for each in (script, run)]
        assert cells[0] == cells[1], f"{one.name}: run `make notebooks`"
