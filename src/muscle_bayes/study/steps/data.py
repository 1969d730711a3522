"""What was logged: a summary and a figure of each run."""

from muscle_bayes.json_file import write_json
from muscle_bayes.progress import Report
from muscle_bayes.report.run_figure import run_figure
from muscle_bayes.report.run_summary import summarise
from muscle_bayes.study.plan import Plan
from muscle_bayes.study.steps.figures import Drawn, origin_of


def make(plan: Plan, name: str, report: Report) -> None:
    """Write results/data.json and figures/run-NAME."""
    drawn, summaries = Drawn(plan), {}
    for number, run in enumerate(plan.runs(tuple(plan.logs))):
        report("runs", number, len(plan.logs))
        # A folder's place on this machine says nothing about the run.
        summaries[run.name] = {k: v for k, v in summarise(run).items() if k != "path"}
        caption = f"Run {run.name} ({run.metadata.protocol}) as logged."
        drawn.add(f"run-{run.name}", run_figure(run), caption, origin_of([run]))
    write_json(plan.result(name), {"runs": summaries, "figures": drawn.listed})
