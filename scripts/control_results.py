"""Laws tuned over a population and over one specimen, judged on new joints: docs/control-results.md."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from muscle_bayes.compiled import keep_compiled_code

if TYPE_CHECKING:
    from muscle_bayes.control.judging.specification import Specification


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("posterior", type=Path, help="of one muscle")
    parser.add_argument("--heater", type=Path, action="append")
    parser.add_argument("--out", type=Path, default=Path("reports/control"))
    parser.add_argument("--docs", type=Path, default=Path("docs"))
    parser.add_argument("--draws", type=int, default=96)
    parser.add_argument("--judged", type=int, default=400)
    parser.add_argument(
        "--looked-at", type=int, default=96, help="judged joints whose best input is sought"
    )
    parser.add_argument("--starts", type=int, default=64)
    parser.add_argument("--tried", type=int, default=24, help="in a round about the best")
    args = parser.parse_args()
    keep_compiled_code()
    from muscle_bayes.control.plant.draws import Surroundings, joint_draws
    from muscle_bayes.control.plant.heater_fit import assumed_heater, fit_heater
    from muscle_bayes.control.scenarios.thesis import thesis_scenarios
    from muscle_bayes.control.study import tuned_laws
    from muscle_bayes.control.tune import Effort
    from muscle_bayes.data import read_runs
    from muscle_bayes.inference.population import Population, load_population
    from muscle_bayes.inference.posteriors.posterior import Posterior
    from muscle_bayes.progress import shown_progress
    from muscle_bayes.report.control_page import write_control_report

    population, notes = load_population(args.posterior)
    specimen = Population.of_specimen(Posterior.load(args.posterior))
    heater = fit_heater(read_runs(args.heater)) if args.heater else assumed_heater()
    joints = joint_draws(population, heater.draws, args.draws + args.judged)
    alone = Surroundings(room=0.0, supply=0.0, tubes=0.0, mounting=0.0, meter_lag=(1.0, 0.0))
    alike = joint_draws(specimen, heater.draws, args.draws, surroundings=alone)
    with shown_progress() as report:
        found = tuned_laws(
            joints,
            args.draws,
            thesis_scenarios(),
            looked_at=args.looked_at,
            effort=Effort(starts=args.starts, tried=args.tried, kept=args.tried // 2),
            rivals={
                "pi-specimen": ("pi", alike),
                "two-degrees-specimen": ("two-degrees", alike),
                "pi-point": ("pi", alike.median()),
            },
            notes=[
                *notes,
                heater.note(),
                "loops are simulated; no joint was measured",
                "`-specimen`: tuned over one specimen's posterior alone; `-point`: on its median joint",
            ],
            report=report,
        )
    heaters = "".join(f" --heater {path}" for path in args.heater or ())
    command = (
        f"python scripts/control_results.py {args.posterior.name}{heaters} --draws {args.draws} "
        f"--judged {args.judged} --looked-at {args.looked_at} --starts {args.starts} --tried {args.tried}"
    )
    result = found.judgement
    page = write_control_report(result, found.bank, args.out, edges=found.edges, command=command)
    pairs = (
        (result.recommended, "pi-point"),
        ("pi", "pi-specimen"),
        ("two-degrees", "two-degrees-specimen"),
    )
    head, _, rest = page.partition("\n\n")
    page = f"{head}\n\nTerms: [glossary](glossary.md).\n\n{rest}"
    page += "\n## CVaR against laws that do not know the population\n\n"
    for law, other in pairs:
        told = result.compared(law, other)
        every = list(told.values())
        names = ", ".join(name for name, what in told.items() if what == "tied")
        tied = f"tied in {every.count('tied')}" + (f" ({names})" if names else "")
        page += (
            f"- {law} against {other}, of {len(told)} scenarios: lower in {every.count('lower')}, {tied}, "
            f"higher in {every.count('higher')}.\n"
        )
    if forced := forced_ties(result.specs, found.least):
        listed = "".join(f"- {line}\n" for line in forced)
        page += f"\nTies that no law can break:\n\n{listed}"
    publish(page, args.out, args.docs)


def forced_ties(specs: "Mapping[str, Specification]", least: Mapping[str, float]) -> list[str]:
    """Scenarios in which no law that stays cool can have a lower CVaR than another, and why.

    `least`: CVaR under the best input, by scenario.
    """
    from muscle_bayes.control.judging.specification import WORST

    lines = []
    for name, one in specs.items():
        if one.infeasible:
            lines.append(f"{name}: out of any input's reach, so only the temperature limit counts.")
        elif least.get(name, 0.0) >= WORST:
            lines.append(f"{name}: the best input's CVaR is {WORST:g}, the cut-off, as well.")
    return lines


def publish(page: str, made: Path, docs: Path) -> None:
    """The page and its figures among the docs."""
    for picture in made.glob("*.png"):
        target = docs / "figures" / f"control-{picture.name}"
        target.write_bytes(picture.read_bytes())
        page = page.replace(f"]({picture.name})", f"](figures/{target.name})")
    (docs / "control-results.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
