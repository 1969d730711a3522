"""`muscle-bayes effects`: the catalogue of what a model may lack."""

from typing import TYPE_CHECKING, Annotated

import typer

from muscle_bayes.cli.common import JsonOption, write_json

if TYPE_CHECKING:
    from muscle_bayes.report.effect_text import EffectText


def effects(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NAME...]", help="Only these, with equation and parameters."),
    ] = None,
    json: JsonOption = None,
) -> None:
    """List the effects that `fit --effect` adds and that `discover` tries.

    With names: equation, parameters with units, and source of each.

    Examples:
        muscle-bayes effects
        muscle-bayes effects coil-contact damper-law
    """
    from muscle_bayes.report.effect_text import catalogue, described

    chosen = [described(name) for name in names] if names else catalogue()
    if names:
        for one in chosen:
            _show(one)
    else:
        width = max(len(one.name) for one in chosen)
        for one in chosen:
            typer.echo(f"{one.name:{width}}  {one.what}")
    write_json(json, {"effects": [one._asdict() for one in chosen]})


def _show(one: "EffectText") -> None:
    typer.echo(f"{one.name}, on the port {one.port}: {one.what}.")
    typer.echo(f"    {one.equation}\n  {one.symbols}")
    for name, unit, meaning in one.parameters:
        typer.echo(f"    {one.name}.{name} [{unit}]: {meaning}")
    typer.echo(f"  Source: {one.source or 'not stated'}\n")
