"""Run notebooks/*.py and write them as .ipynb with what they show.

A notebook's cell tagged `parameters` says how long it computes and where results are kept; the latter is
set anew after it, so that nothing of an earlier run is taken over. The first cell gets the time that the
run took.
"""

import argparse
import os
import resource
import shutil
import sys
from pathlib import Path
from time import perf_counter

import jupytext
import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

from muscle_bayes.compiled import keep_compiled_code

PROJECT = Path(__file__).parents[1]
NOTEBOOKS = PROJECT / "notebooks"
TIMEOUT = 1800
"""Longest cell, s."""
INJECTED = "injected-parameters"


def keep_in(notebook: nbformat.NotebookNode, kept: Path) -> None:
    """Add a cell that sets KEPT, where the cell tagged `parameters` names it."""
    for index, cell in enumerate(notebook.cells):
        if "parameters" in cell.metadata.get("tags", ()) and "KEPT =" in cell.source:
            source = f"KEPT = Path({str(kept.resolve())!r})"
            cell = nbformat.v4.new_code_cell(source, metadata={"tags": [INJECTED]})
            notebook.cells.insert(index + 1, cell)
            return


def execute(path: Path, out: Path, kept: Path) -> None:
    """Run one notebook in a kernel of its own; what was injected is left out of what is written."""
    notebook = jupytext.read(path)
    notebook.metadata.kernelspec = {
        "name": "python3",
        "display_name": "Python 3",
        "language": "python",
    }
    keep_in(notebook, kept)
    resources = {"metadata": {"path": str(NOTEBOOKS)}}
    quiet = ["--IPKernelApp.log_level=40"]  # not a warning a kernel about local sockets
    client = NotebookClient(
        notebook, timeout=TIMEOUT, kernel_name="python3", resources=resources, extra_arguments=quiet
    )
    begun = perf_counter()
    client.execute()
    took = f"*Ran in {perf_counter() - begun:.0f} s on {os.cpu_count()} cores.*"
    notebook.cells[0].source += f"\n\n{took}"
    notebook.metadata.jupytext = {"formats": "ipynb,py:percent"}
    notebook.cells = [c for c in notebook.cells if INJECTED not in c.metadata.get("tags", ())]
    nbformat.write(notebook, out / f"{path.stem}.ipynb")


def main() -> int:
    """Run the notebooks named, or all; tells the time of each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("notebooks", nargs="*", type=Path, help="all unless named")
    parser.add_argument("--out", type=Path, required=True, help="folder of the .ipynb")
    parser.add_argument(
        "--kept", type=Path, help="folder of posteriors; reports/notebooks, emptied, by default"
    )
    asked = parser.parse_args()
    keep_compiled_code()
    os.environ.pop("MPLBACKEND", None)  # figures go into the notebook
    os.environ["PYTHONWARNINGS"] = "ignore:IProgress not found"  # tqdm without widgets
    kept = asked.kept or PROJECT / "reports" / "notebooks"
    if asked.kept is None:
        shutil.rmtree(kept, ignore_errors=True)
    kept.mkdir(parents=True, exist_ok=True)
    failed = 0
    for path in asked.notebooks or sorted(NOTEBOOKS.glob("*.py")):
        begun, before = perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        told = "ok"
        try:
            execute(path, asked.out, kept)
        except CellExecutionError as error:
            failed, told = failed + 1, f"FAILED\n{error}"
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        print(
            f"{path.stem}: {perf_counter() - begun:.1f} s, processor {busy:.1f} s, {told}",
            flush=True,
        )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
