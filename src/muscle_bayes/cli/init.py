"""`muscle-bayes init`: the metadata of a log, guessed from its file and asked for."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from muscle_bayes.cli.common import (
    JsonOption,
    option,
    print_error,
    writable_file,
    write_json,
)
from muscle_bayes.errors import MuscleBayesError

if TYPE_CHECKING:
    from muscle_bayes.data.guessing.answers import Answers, Question


_NUMBERS = ("sample_rate", "load", "radians_per_count", "zero_reading")


def init(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A log: CSV, text, LabVIEW, Parquet.")],
    time: Annotated[str | None, option("COLUMN", "Time column, by name or number.")] = None,
    time_unit: Annotated[str | None, option("UNIT", "Unit of the time column.")] = None,
    sample_rate: Annotated[
        float | None, option("HZ", "Rows per second, without a time column.")
    ] = None,
    position: Annotated[
        str | None, option("COLUMN", "Measured position or velocity; none: held.")
    ] = None,
    position_unit: Annotated[
        str | None, option("UNIT", "Its unit: counts, rad, deg, mm, rad/s, ...")
    ] = None,
    temperature_unit: Annotated[str | None, option("UNIT", "Unit of the temperatures.")] = None,
    element: Annotated[
        str | None,
        option(
            "WORDS",
            "What acts on the moving part: none, 'arm 0.49 0.10' (kg, m), spring, "
            "'muscle 0.12 0.003' (length, drum radius, m).",
        ),
    ] = None,
    load: Annotated[float | None, option("KG", "Mass that hangs on it.")] = None,
    radians_per_count: Annotated[
        float | None, option("RAD", "Angle of one count, of raw counts.")
    ] = None,
    zero_reading: Annotated[
        float | None, option("COUNTS", "Counts at angle zero, of raw counts.")
    ] = None,
    out: Annotated[
        Path | None,
        option(
            "FILE", "The metadata.  [default: beside the log, NAME.toml]", callback=writable_file
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the metadata.")] = False,
    ask: Annotated[
        bool | None,
        typer.Option(
            "--ask/--no-ask", help="Ask what the log cannot tell; by default in a terminal."
        ),
    ] = None,
    json: JsonOption = None,
) -> None:
    """Write a log's metadata, NAME.toml: guess what the file tells, and ask for the rest.

    Examples:
        muscle-bayes init mylog.csv
        muscle-bayes init mylog.csv --position angle --position-unit deg --element none --no-ask
    """
    from muscle_bayes.data.describing.metadata import parse_metadata
    from muscle_bayes.data.errors import RunError
    from muscle_bayes.data.files import read_bytes
    from muscle_bayes.data.guessing.answers import Answers
    from muscle_bayes.data.guessing.draft import draft_of
    from muscle_bayes.data.guessing.guess import guess_log
    from muscle_bayes.data.reader import run_from_bytes
    from muscle_bayes.whole_file import write_whole

    target = log.with_suffix(".toml") if out is None else out
    if log.suffix.lower() == ".toml":
        raise RunError.at(log, "is metadata, not a log", "name the log")
    if target.exists() and not overwrite:
        raise RunError.at(target, "exists", "give --overwrite to replace it, or another --out")
    content = read_bytes(log)
    guess = guess_log(content, log)
    answers = Answers(
        time=time,
        position=position,
        position_unit=position_unit,
        time_unit=time_unit,
        temperature_unit=temperature_unit,
        sample_rate=sample_rate,
        element=element,
        load=load,
        radians_per_count=radians_per_count,
        zero_reading=zero_reading,
    )
    _complete(answers, guess, sys.stdin.isatty() if ask is None else ask)
    text = draft_of(guess, answers).text(log.name)
    facts: dict[str, Any] = guess.facts() | {"metadata": target, "toml": text}
    parse_metadata(text.encode(), target)
    write_whole(target, text.encode())
    typer.echo(f"{target}:\n\n{text}")
    try:
        run = run_from_bytes(content, text.encode(), log, target)
    except MuscleBayesError as error:
        typer.echo(
            f"the run cannot be read yet. Fix: edit {target}, or `init` again with --overwrite"
        )
        write_json(json, facts | {"error": str(error)})
        raise
    typer.echo(repr(run))
    for repair in run.repairs:
        typer.echo(f"repaired: {repair}")
    told = {"rows": len(run.table), "repairs": [str(repair) for repair in run.repairs]}
    write_json(json, facts | told)


def _complete(answers: "Answers", guess: Any, ask: bool) -> None:
    """Ask what is missing, or say by which options it is given. Raises MuscleBayesError."""
    from muscle_bayes.data.guessing.answers import next_question

    tries: dict[str, int] = {}
    while True:
        try:
            question = next_question(guess, answers)
        except MuscleBayesError as error:
            last = next(reversed(tries), None)
            if last is None or tries[last] >= 3:
                raise
            print_error(error)  # of what was answered last
            setattr(answers, last, None)
            continue
        if question is None:
            return
        if not ask:
            if question.key in ("element", "load"):
                setattr(answers, question.key, "none" if question.key == "element" else 0.0)
                continue
            option = f"--{question.key.replace('_', '-')}"
            raise MuscleBayesError(
                f"{guess.path}: the log does not tell: {question.text}. Fix: give {option}."
            )
        tries[question.key] = tries.pop(question.key, 0) + 1
        _answer(answers, question)


def _answer(answers: "Answers", question: "Question") -> None:
    kind = float if question.key in _NUMBERS else str
    default = question.default if question.default is None else kind(question.default)
    setattr(answers, question.key, typer.prompt(question.text, default=default, type=kind))
