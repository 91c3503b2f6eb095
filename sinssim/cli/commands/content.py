"""`sinssim list`, `sensors`, `new` and `aircraft`: names that scenarios accept, grades, project folders, aircraft."""

from __future__ import annotations

import ast
import math
import sys
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

import typer

from sinssim.cli.command_line import Debug, Json, Quiet, command, console, has_bars, print_json
from sinssim.errors import SinssimError, check_name
from sinssim.progress import shown
from sinssim.system.registries import described


class Listing(StrEnum):
    """What can be listed."""

    AIRCRAFT = "aircraft"
    SCENARIOS = "scenarios"
    STUDIES = "studies"
    ALGORITHMS = "algorithms"
    FRAMES = "frames"
    GRAVITY = "gravity"
    CURVATURES = "curvatures"
    ELLIPSOIDS = "ellipsoids"
    GRADES = "grades"
    VIEWS = "views"
    AIDING = "aiding"
    FILTERS = "filters"
    STATES = "states"
    FORMATS = "formats"
    EXPORTS = "exports"


@command
def list_(
    kind: Annotated[Listing, typer.Argument(help="Kind of names.", show_default=False)],
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """List the names that scenarios and options accept, each with a description.

    Aircraft, scenarios and studies in the folders `aircraft`, `scenarios` and `scenarios/studies` of the current folder
    precede those of the package, as do views in the folders of the environment variable SINSSIM_VIEWS. The content of
    the project folders in SINSSIM_CONTENT, and of installed packages, is listed with its location.

    Example:

        sinssim list grades
    """
    _print_names(names_of(kind), as_json=as_json)
    if kind is Listing.GRADES and not as_json:
        print("Explanation of a grade, term by term: sinssim sensors GRADE", file=sys.stderr)


def _print_names(names: Mapping[str, str], *, as_json: bool = False) -> None:
    """Print names, each with its sentence."""
    if as_json:
        print_json(names)
        return
    width = max((len(name) for name in names), default=0)
    for name, sentence in names.items():
        print(f"{name:<{width}}  {sentence}".rstrip())
    sys.stdout.flush()  # an error of standard output is then the last line


def names_of(kind: Listing) -> Mapping[str, str]:
    """Return the description of each name of a kind."""
    match kind:
        case Listing.FORMATS:
            from sinssim.logs.formats import FORMATS

            return {**{name: entry.sentence for name, entry in FORMATS.shipped.items()}, **described("formats")}
        case Listing.EXPORTS:
            from sinssim.logs.formats import WRITERS

            return {**{name: entry.sentence for name, entry in WRITERS.shipped.items()}, **described("writers")}
        case Listing.ALGORITHMS:
            from sinssim.strapdown.attitude import SCENARIO_ALGORITHMS

            return {**SCENARIO_ALGORITHMS, **described("algorithms")}
        case Listing.FRAMES:
            from sinssim.strapdown.frames import FRAMES

            return {**FRAMES, **described("frames")}
        case Listing.FILTERS:
            from sinssim.estimation import KINDS

            return {**KINDS, **described("filters")}
        case Listing.GRAVITY:
            from sinssim.earth.ellipsoids import GRAVITY_MODELS

            return GRAVITY_MODELS
        case Listing.CURVATURES:
            from sinssim.strapdown.mechanization import CURVATURES

            return CURVATURES
        case Listing.ELLIPSOIDS:
            from sinssim.earth.ellipsoids import describe_ellipsoids

            return describe_ellipsoids()
        case Listing.GRADES:
            from sinssim.sensors.imu.grades import GRADES

            return {**GRADES, **_descriptions("grades")}
        case Listing.STATES:
            from sinssim.scenario.filter_section import BLOCKS_OF_STATES

            return BLOCKS_OF_STATES
        case Listing.AIDING:
            from sinssim.scenario.filter_section import describe_sensors

            return {**describe_sensors(), **described("aiding")}
        case Listing.VIEWS:
            from sinssim.content import list_content

            return {name: _first_sentence(file) for name, file in list_content("viz").items()}
        case Listing.AIRCRAFT:
            return _descriptions("aircraft")
        case Listing.SCENARIOS:
            return _descriptions("scenarios")
        case Listing.STUDIES:
            return _descriptions("studies")


def _descriptions(kind: Literal["aircraft", "scenarios", "studies", "grades"]) -> dict[str, str]:
    """Return the descriptions in the TOML files of a content folder."""
    from sinssim.content import list_content

    return {name: _description(file) for name, file in list_content(kind).items()}


def _description(file: Path) -> str:
    """Return a TOML file's description; an invalid file must not hide the others."""
    from sinssim.toml_mistakes import read_toml

    try:
        return str(read_toml(file)[1].get("description", ""))
    except SinssimError as error:
        return f"(cannot be used: {error})"


def _first_sentence(file: Path) -> str:
    """Return the first line of a Python file's docstring, without running the file."""
    try:
        return (ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or "").split("\n")[0]
    except (OSError, ValueError, SyntaxError) as error:
        return f"(cannot be used: {type(error).__name__}: {error})"


@command
def sensors(
    grade: Annotated[
        str, typer.Argument(metavar="GRADE", help="A name from `sinssim list grades`, or a grade's TOML file.")
    ],
    latitude: Annotated[
        float, typer.Option("--latitude", metavar="DEG", min=-90.0, max=90.0, help="Latitude of the vehicle.")
    ] = 45.0,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Replace a value of the grade, by its key in a scenario's [imu]; may be given several times.",
        ),
    ] = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Describe a grade of sensors: each error term, and the position error that it alone causes in one hour.

    Closed forms give the position errors of a vehicle at rest that navigates unaided from an exact initial state.
    Errors that appear only in motion are given for one turn or one acceleration. See docs/sensors.md.

    Examples:

        sinssim sensors laser-standard --latitude 60
        sinssim sensors my_unit.toml
        sinssim sensors tactical --set gyro_bias_sigma_deg_h=0.3 --set gyro_quantum_arcsec=2.0
    """
    from sinssim.scenario.overrides import override
    from sinssim.sensors.imu.grades import find_grade
    from sinssim.sensors.imu.imu_section import Imu
    from sinssim.toml_mistakes import validate

    find_grade(grade)
    data: dict[str, object] = {"grade": grade}
    overridden = {override(data, setting.removeprefix("imu.")) for setting in settings or ()}
    section = validate(Imu, data, "", f"sensors {grade}", overridden)
    from sinssim.recording.console import show_items
    from sinssim.scenario.notes import keys_without_effect
    from sinssim.sensors.error_propagation import expect, expectation_exhibits, expectation_numbers

    expectation = expect(section, math.radians(latitude))
    if as_json:
        print_json(expectation_numbers(expectation))
    else:
        notes = keys_without_effect(section, expectation.duration)
        show_items(expectation_exhibits(expectation, notes), console())


@command
def new(
    paths: Annotated[
        list[str],
        typer.Argument(metavar="[navigator] FOLDER", help="The folder to create; it must not exist, or must be empty."),
    ],
    language: Annotated[
        str | None,
        typer.Option("--language", metavar="NAME", help="Language of the navigator: c, c++, python, octave or rust."),
    ] = None,
    debug: Debug = False,
) -> None:
    """Create a project folder: a scenario with your own sensors, algorithm and view, or with your own navigator.

    The README.md of the folder describes each file and the commands. No existing file is changed. With `navigator` and
    a language, the folder has a navigator in that language, which navigates on the data of a scenario.

    Examples:

        sinssim new my_project
        sinssim new navigator my_navigator --language c
    """
    from sinssim.content import LANGUAGES, new_navigator, new_project

    *what, folder = paths
    if what not in ([], ["navigator"]) or bool(what) != (language is not None):
        raise typer.BadParameter("write `new FOLDER`, or `new navigator FOLDER --language c`")
    build = ""
    if language is None:
        files = new_project(Path(folder))
    else:
        check_name("language", language, LANGUAGES)
        files, build = new_navigator(Path(folder), language)
    width = max(len(file) for file, _ in files)
    print(f"{folder} is ready:")
    for file, sentence in files:
        print(f"  {file:<{width}}  {sentence}")
    print(f"Next: cd {folder}, then {f'(cd navigators; {build}), then ' if build else ''}sinssim run scenario.toml")


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
    flies it well, with take-off and landing if it flies a circuit, and says why another model cannot be flown. This
    takes up to ten minutes. `check` flies the plan with an existing aircraft.

    Examples:

        sinssim aircraft list
        sinssim aircraft add J3Cub
        sinssim aircraft add my_model --from models -o aircraft/mine
        sinssim aircraft check 737
    """
    if task is Task.LIST:
        if model is not None:
            raise typer.BadParameter("write `aircraft list` without a name")
        from sinssim.truth.aircraft_design.model_survey import described_models

        _print_names(described_models(), as_json=as_json)
        return
    if model is None:
        raise typer.BadParameter(f"write `aircraft {task} {'MODEL' if task is Task.ADD else 'NAME'}`")
    if task is Task.ADD:
        _add(model, folder, out or Path("aircraft") / model, quiet=quiet, as_json=as_json)
        return
    from sinssim.recording.console import show_items
    from sinssim.truth.aircraft_design.acceptance_flight import acceptance_items, acceptance_numbers
    from sinssim.truth.aircraft_design.design_process import acceptance_apart

    height, errors = acceptance_apart(model)
    if as_json:
        print_json(acceptance_numbers(model, height, errors))
    else:
        show_items(acceptance_items(model, height, errors), console())


def _add(model: str, folder: Path | None, out: Path, *, quiet: bool, as_json: bool) -> None:
    """Design an aircraft and write its folder."""
    from sinssim.recording.console import show_items
    from sinssim.truth.aircraft_design.acceptance_flight import acceptance_items, acceptance_numbers
    from sinssim.truth.aircraft_design.aircraft_file import check_place, write_aircraft
    from sinssim.truth.aircraft_design.design_process import design_apart
    from sinssim.truth.aircraft_design.model_survey import find_model

    check_place(out)
    place = find_model(model, folder)
    with shown(has_bars(quiet or as_json)) as report:
        made = design_apart(model, folder, report)
    write_aircraft(out, made.text, place if folder is not None else None)
    if as_json:
        print_json(
            {**acceptance_numbers(model, made.height, made.errors), "on_ground": made.on_ground, "directory": str(out)}
        )
    elif not quiet:
        show_items(acceptance_items(model, made.height, made.errors), console())
        print(made.on_ground)
        print(f'Aircraft: {out / "aircraft.toml"}    (flight.aircraft = "{out.name}")')
