"""Search the measured rigs from Coulomb friction alone and write docs/discovery-real.md.

python scripts/real_discoveries.py FOLDER [NAME...], with xl330-drop, emps and heating-wire in FOLDER.
"""

import argparse
from pathlib import Path

from muscle_bayes.compiled import keep_compiled_code
from muscle_bayes.data import read_runs
from muscle_bayes.discovery.discover import discover
from muscle_bayes.discovery.result import Discovery
from muscle_bayes.report.discovery_figures import misfit_figure
from muscle_bayes.report.discovery_summary import summary
from muscle_bayes.report.style import save

DOCS = Path(__file__).parents[1] / "docs"
HELD_OUT = {"xl330-drop": ("drop-4",)}
PUBLISHED = {
    "xl330-drop": ("viscous-friction", "stribeck-friction", "load-dependent-friction"),
    "emps": ("viscous-friction", "bias-torque"),
    "heating-wire": (),
}
"""Effects beside Coulomb friction in the published fits; none was published for the wire."""


def told(name: str, found: Discovery, origins: dict[str, str]) -> str:
    """What was found, held against what is published."""
    added = [step.added for step in found.steps]
    known = PUBLISHED[name]
    if known:
        tied = sorted({effect for step in found.steps for effect in step.tie} - {*added})
        against = f"Published beside Coulomb friction: {', '.join(known)}. Added of these: "
        against += (", ".join(one for one in known if one in added) or "none") + ". "
        if more := [one for one in known if one in tied]:
            against += f"In a tie with what was added: {', '.join(more)}. "
        more = [effect for effect in added if effect not in known]
        against += f"Found besides: {', '.join(more) or 'nothing'}."
    else:
        against = "Nothing is published for this rig in such terms; what follows is a finding, not a check."
    text = summary(found, origins).partition("\n")[2].replace("\n## ", "\n### ")
    text = text.replace(" (`unknown.png`)", "")  # which the command would draw
    return f"## {name}\n\n{against}\n{text}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", default=list(PUBLISHED))
    args = parser.parse_args()
    keep_compiled_code()
    parts = [
        "# Discovery on measured rigs",
        "",
        "Written by `scripts/real_discoveries.py`; do not edit. Measured data; searched from Coulomb "
        "friction alone, all effects of the catalogue that such a rig can show being candidates.",
        "",
    ]
    for name in args.names:
        runs = read_runs([args.folder / name])
        found = discover(runs, hold_out=HELD_OUT.get(name, ()))
        origins = {run.name: run.metadata.origin for run in runs}
        save(misfit_figure(found, origins), DOCS / "figures" / f"real-{name}.png")
        parts += [told(name, found, origins), f"![Misfit of {name}](figures/real-{name}.png)", ""]
        (DOCS / "discovery-real.md").write_text("\n".join(parts))
        print(f"{name}: {found}", flush=True)


if __name__ == "__main__":
    main()
