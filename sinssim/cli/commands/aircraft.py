"""`sinssim aircraft`: makes an aircraft from a model of JSBSim, lists the models, checks an aircraft."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import Debug, Json, Quiet, command
from sinssim.cli.terminal import console, has_bars, print_json


class Task(StrEnum):
    """What is done."""

    ADD = "add"
    LIST = "list"
    CHECK = "check"


@command
def aircraft(
    task: Annotated[Task, typer.Argument(help="What to do.", show_default=False)],
    model: Annotated[
        str | None,
        typer.Argument(metavar="[MODEL]", help="add: a model of JSBSim. check: a name of `sinssim list aircraft`."),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option(
            "--from",
            metavar="FOLDER",
            help="Folder of the model, which is copied, instead of JSBSim's package.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Folder to make.", show_default="aircraft/MODEL"),
    ] = None,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Make an aircraft from a flight dynamics model of JSBSim, list the models, or check an aircraft.

    `add` trims the model, measures its responses, designs the autopilot's gains, measures its envelope and flies an
    acceptance plan: climb, turns, lower and higher airspeed, descent, gust. It writes the folder of an aircraft that
    flies it well, and says why another model cannot be flown. This takes up to ten minutes. `check` flies the plan
    with an existing aircraft.

    Examples:

        sinssim aircraft list
        sinssim aircraft add J3Cub
        sinssim aircraft add my_model --from models -o aircraft/mine
        sinssim aircraft check 737
    """
    if task is Task.LIST:
        if model is not None:
            raise typer.BadParameter("write `aircraft list` without a name")
        _list(as_json=as_json)
        return
    if model is None:
        raise typer.BadParameter(f"write `aircraft {task} {'MODEL' if task is Task.ADD else 'NAME'}`")
    if task is Task.ADD:
        _add(model, folder, out or Path("aircraft") / model, quiet=quiet, as_json=as_json)
        return
    from sinssim.recording.console import show_items
    from sinssim.truth.aircraft_design.acceptance_exhibits import acceptance_items, acceptance_numbers
    from sinssim.truth.aircraft_design.design_process import acceptance_apart

    height, errors = acceptance_apart(model)
    if as_json:
        print_json(acceptance_numbers(model, height, errors))
    else:
        show_items(acceptance_items(model, height, errors), console())


def _list(*, as_json: bool) -> None:
    """Print the models of JSBSim's package."""
    from sinssim.truth.aircraft_design.model_survey import described_models

    names = described_models()
    if as_json:
        print_json(names)
        return
    width = max(len(name) for name in names)
    for name, sentence in names.items():
        print(f"{name:<{width}}  {sentence}")


def _add(model: str, folder: Path | None, out: Path, *, quiet: bool, as_json: bool) -> None:
    """Design an aircraft and write its folder."""
    from sinssim.progress import shown
    from sinssim.recording.console import show_items
    from sinssim.truth.aircraft_design.acceptance_exhibits import acceptance_items, acceptance_numbers
    from sinssim.truth.aircraft_design.aircraft_file import check_place, write_aircraft
    from sinssim.truth.aircraft_design.design_process import design_apart
    from sinssim.truth.aircraft_design.model_survey import find_model

    check_place(out)
    place = find_model(model, folder)
    with shown(has_bars(quiet or as_json)) as report:
        made = design_apart(model, folder, report)
    write_aircraft(out, made.text, place if folder is not None else None)
    if as_json:
        print_json({**acceptance_numbers(model, made.height, made.errors), "directory": str(out)})
    elif not quiet:
        show_items(acceptance_items(model, made.height, made.errors), console())
        print(f'Aircraft: {out / "aircraft.toml"}    (flight.aircraft = "{out.name}")')
