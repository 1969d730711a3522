"""HTML and PDF from results: text and layout in `study/document`, numbers and statements from here."""

import json
from pathlib import Path
from typing import Literal

from muscle_bayes.json_file import write_json
from muscle_bayes.progress import Report
from muscle_bayes.study.contents import contents
from muscle_bayes.study.plan import Plan
from muscle_bayes.study.results import Results
from muscle_bayes.study.stages import DOCUMENT, all_stages
from muscle_bayes.whole_file import write_whole

Kind = Literal["html", "pdf"]
KINDS: tuple[Kind, ...] = ("html", "pdf")


def make(plan: Plan, name: str, report: Report) -> None:
    """Write summary.json, results/report.json, report.html and report.pdf."""
    report("numbers", 0, 2)
    stages, left_out = all_stages(plan)
    results = Results.of(plan, [stage.name for stage in stages])
    write_json(plan.out / "summary.json", results.summary())
    write_json(plan.result(name), contents(results, left_out))
    report("typesetting", 1, 2)
    for kind in KINDS:
        write_whole(plan.out / f"report.{kind}", typeset(plan.result(name), plan.out, kind))


def typeset(content: Path, out: Path, kind: Kind) -> bytes:
    """The report as `html` or `pdf`. The same content gives the same bytes, whatever the day."""
    import typst

    made = typst.compile(
        DOCUMENT / "report.typ",
        root=Path(content.resolve().anchor),
        format=kind,
        ignore_system_fonts=True,
        sys_inputs={
            "content": _inside(content),
            "folder": _inside(out),
            "kind": kind,
        },
    )
    if kind != "html":
        return made
    style = (DOCUMENT / "report.css").read_bytes()
    made = made.replace(b"</head>", b"<style>\n" + style + b"</style></head>", 1)
    residuals = json.loads(content.read_text(encoding="utf-8"))["residuals"]
    numbers = json.dumps(residuals).replace("<", "\\u003c").encode()
    script = (DOCUMENT / "report.js").read_bytes()
    data = b'<script type="application/json" id="residual-data">' + numbers + b"</script>"
    return made.replace(b"</body>", data + b"<script>\n" + script + b"</script></body>", 1)


def _inside(path: Path) -> str:
    """A path as typst wants it, from the root."""
    return "/" + path.resolve().relative_to(path.resolve().anchor).as_posix()
