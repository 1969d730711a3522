"""`python -m benchmarks.bench_test`: what the firmware withstands, measured in simulation."""

from dataclasses import asdict
from statistics import median
from typing import TYPE_CHECKING, Annotated, Any

import typer

from muscle_bayes.cli.common import EXIT_FAILED, JsonOption, SeedOption, user_errors, write_json

if TYPE_CHECKING:
    from benchmarks.bench_test.failures import Outcome
    from benchmarks.bench_test.fuzz import FuzzReport
    from benchmarks.bench_test.overheating import Outcome as Overheating
    from benchmarks.bench_test.streaming import StreamReport
    from benchmarks.bench_test.stuck_meter import StuckOutcome


def bench_test(
    failures: Annotated[
        int, typer.Option(min=0, metavar="N", help="Failures to inject, at least; 0 = none.")
    ] = 216,
    stuck: Annotated[
        int,
        typer.Option(min=0, metavar="N", help="Meters that get stuck at any moment; 0 = none."),
    ] = 60,
    overheating: Annotated[
        int,
        typer.Option(min=0, metavar="N", help="Sensors that lie and hosts that heat on; 0 = none."),
    ] = 24,
    fuzz: Annotated[
        int, typer.Option(min=0, metavar="BYTES", help="Random command bytes; 0 = none.")
    ] = 1_000_000,
    minutes: Annotated[
        float, typer.Option(min=0.0, metavar="M", help="Sampling at 33 Hz; 0 = none.")
    ] = 30.0,
    seed: SeedOption = 0,
    json: JsonOption = None,
) -> None:
    """Try the firmware in simavr, in virtual time: failures, random commands, long sampling.

    Exits with 1 if a heater stays on for more than 0.5 s after a failure, or heats without being
    asked. Also if a tube gets hotter than a stuck meter may make it, or hotter than 120 C, or if a
    sample is lost.

    Examples:
        python -m benchmarks.bench_test
        python -m benchmarks.bench_test --failures 24 --stuck 6 --overheating 2 --fuzz 10000 --minutes 1
    """
    from benchmarks.bench_test.failures import inject_all
    from benchmarks.bench_test.fuzz import fuzz as fuzz_board
    from benchmarks.bench_test.overheating import run_all as overheat_all
    from benchmarks.bench_test.streaming import stream
    from benchmarks.bench_test.stuck_meter import stick_all
    from muscle_bayes.progress import shares, shown_progress

    trials = (
        ("failures", "failures", failures, inject_all, _tell_failures),
        ("stuck", "stuck meters", stuck, stick_all, _tell_stuck),
        ("overheating", "overheating", overheating, overheat_all, _tell_overheating),
        ("fuzz", "random commands", fuzz, fuzz_board, _tell_fuzz),
        ("stream", "sampling", 60.0 * minutes, stream, _tell_stream),
    )
    report: dict[str, Any] = {"seed": seed}
    passed = []
    with shown_progress() as progress:
        for key, stage, amount, tried, tell in trials:
            if amount:
                found: Any = tried(amount, seed, shares(progress, stage))  # type: ignore[arg-type]
                passed.append(tell(found))
                several = isinstance(found, list)
                report[key] = [asdict(one) for one in found] if several else asdict(found)
    report["passed"] = all(passed)
    if json is not None:
        write_json(json, report)
    if not report["passed"]:
        typer.echo("FAILED", err=True)
        raise typer.Exit(EXIT_FAILED)


def _tell_failures(outcomes: "list[Outcome]") -> bool:
    from rich.console import Console
    from rich.table import Table

    table = Table("failure", "injected", "off after, s: median", "most", "safe")
    for name in dict.fromkeys(outcome.failure for outcome in outcomes):
        these = [outcome for outcome in outcomes if outcome.failure == name]
        safe = sum(outcome.safe for outcome in these)
        times = [outcome.off_after for outcome in these]
        table.add_row(
            name,
            str(len(these)),
            f"{median(times):.3f}",
            f"{max(times):.3f}",
            "all" if safe == len(these) else f"{safe} of {len(these)}",
        )
    Console().print(table)
    safe = sum(outcome.safe for outcome in outcomes)
    latest = max(outcome.off_after for outcome in outcomes)
    typer.echo(
        f"{safe} of {len(outcomes)} failures: heaters off within 0.5 s; latest {latest:.3f} s"
    )
    return safe == len(outcomes)


def _tell_stuck(outcomes: "list[StuckOutcome]") -> bool:

    for what, holding in (("both tubes hard", False), ("less, or holding", True)):
        times = [outcome.off_after for outcome in outcomes if outcome.holding is holding]
        if times:
            typer.echo(
                f"{len(times)} meters stuck while heating {what}: heaters off after "
                f"{median(times):.2f} s (median), {max(times):.2f} s at most"
            )
    hottest = max(outcome.excess for outcome in outcomes)
    typer.echo(f"{len(outcomes)} stuck meters: a tube at most {hottest:.1f} C above its setpoint")
    return all(outcome.safe for outcome in outcomes)


def _tell_overheating(outcomes: "list[Overheating]") -> bool:
    from rich.console import Console
    from rich.table import Table

    from benchmarks.bench_test.overheating import HOTTEST
    from muscle_bayes.bench.boards.messages import Fault

    table = Table("sensor or host", "tried", "hottest tube, C", "heated for, s", "ended by")
    for name in dict.fromkeys(outcome.trial for outcome in outcomes):
        these = [outcome for outcome in outcomes if outcome.trial == name]
        ends = {
            "the host" if outcome.stopped else Fault(outcome.faults).name or "nothing"
            for outcome in these
        }
        table.add_row(
            name,
            str(len(these)),
            f"{max(outcome.peak for outcome in these):.1f}",
            f"{max(outcome.heated for outcome in these):.1f}",
            ", ".join(sorted(ends)),
        )
    Console().print(table)
    hottest = max(outcome.peak for outcome in outcomes)
    typer.echo(f"{len(outcomes)} trials: no tube above {hottest:.1f} C (allowed {HOTTEST:g} C)")
    return all(outcome.safe for outcome in outcomes)


def _tell_fuzz(report: "FuzzReport") -> bool:
    from benchmarks.bench_test.fuzz import LONGEST_HEAT

    typer.echo(
        f"{report.sent} random bytes, {report.commands} valid heater commands among them: a heater "
        f"on for at most {report.longest_heat:.3f} s after one, {report.wrong_heat} ms of heat that "
        f"was not asked for, {report.restarts} restarts"
    )
    return report.longest_heat <= LONGEST_HEAT and report.wrong_heat == 0 and report.restarts == 0


def _tell_stream(report: "StreamReport") -> bool:
    typer.echo(
        f"{report.duration / 60:g} min at {report.rate:.3f} Hz: {report.samples} samples, "
        f"{report.lost} lost; jitter at most {1e6 * report.jitter:.1f} us, stamps right to "
        f"{1e6 * report.stamp_error:.1f} us; "
        f"latency to the host {1e3 * report.latency_median:.1f} ms median, "
        f"{1e3 * report.latency_99:.1f} ms 99 %, {1e3 * report.latency_most:.1f} ms at most"
    )
    return report.lost == 0


app = typer.Typer(pretty_exceptions_enable=False)
app.command()(user_errors()(bench_test))

if __name__ == "__main__":
    app()
