"""`sinssim sensors`: explains a grade of sensors."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from sinssim.cli.options import Debug, Json
from sinssim.cli.terminal import console, print_json


def command(
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
    from sinssim.scenario.load import override
    from sinssim.sensors.imu.grades import find_grade
    from sinssim.sensors.imu.imu import Imu
    from sinssim.toml_file import validate

    find_grade(grade)
    data: dict[str, object] = {"grade": grade}
    overridden = {override(data, setting.removeprefix("imu.")) for setting in settings or ()}
    section = validate(Imu, data, "", f"sensors {grade}", overridden)
    from sinssim.experiments.run.grade_expectation import expectation_exhibits, expectation_numbers
    from sinssim.recording.console import show_items
    from sinssim.sensors.error_propagation import expect

    expectation = expect(section, math.radians(latitude))
    if as_json:
        print_json(expectation_numbers(expectation))
    else:
        show_items(expectation_exhibits(expectation), console())
