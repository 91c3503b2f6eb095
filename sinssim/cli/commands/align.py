"""`sinssim align`: aligns a parked vehicle and gives the expected error."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import ColumnsFile, Debug, FromTime, Json, Settings, ToTime
from sinssim.cli.terminal import console, print_json

Source = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO_OR_LOG", help="A scenario's TOML file or name, or a recorded log (text, .parquet, .npz)."
    ),
]
Grade = Annotated[
    str | None,
    typer.Option(
        "--grade",
        metavar="NAME|FILE",
        help="Grade of a log's sensors, for the expected error, or a replacement of a scenario's imu.grade: a name "
        "from `sinssim list grades`, or a grade's TOML file.",
    ),
]
Disturbed = Annotated[
    bool,
    typer.Option("--disturbed", help="Align a swaying vehicle by the cone that gravity describes in inertial space."),
]
Latitude = Annotated[
    float | None, typer.Option("--latitude", metavar="DEG", help="Latitude, if known (for --disturbed).")
]
Plot = Annotated[
    Path | None, typer.Option("--plot", metavar="FILE", help="Draw the expected errors (.svg, .png or .pdf).")
]
Record = Annotated[
    Path | None, typer.Option("--record", metavar="FILE", help="Record the session for `sinssim view` (.rrd).")
]


def command(
    source: Source,
    columns: ColumnsFile = None,
    grade: Grade = None,
    start: FromTime = None,
    end: ToTime = None,
    disturbed: Disturbed = False,
    latitude: Latitude = None,
    settings: Settings = None,
    plot: Plot = None,
    record: Record = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Determine heading, roll, pitch and latitude of a parked vehicle, and the expected error of each by source.

    A session lasts a few hundred seconds, during which the vehicle is stationary. A session in which the vehicle moved
    is refused. A swaying vehicle can be aligned with --disturbed. The angles are those of the sensor block.

    Examples:

        sinssim align parked --to 300 --record parked.rrd
        sinssim align runs/parked/streams/imu_measured.parquet --grade laser-standard --to 600
        sinssim align log.csv --columns log.toml --grade tactical --plot expected.svg
        sinssim align log.npz --columns log.toml --disturbed --latitude 50
    """
    from sinssim.analyses.alignment_session import align

    report = align(
        source, columns=columns, grade=grade, start=start, end=end, method="disturbed" if disturbed else "quiet",
        latitude=None if latitude is None else math.radians(latitude), overrides=tuple(settings or ()),
    )  # fmt: skip
    if plot is not None:
        from sinssim.recording.figures import save

        save(report.plot(), plot)
    if record is not None:
        from sinssim.recording.rerun.exhibit_recording import record as record_exhibits

        record_exhibits(report.exhibits, record)
    if as_json:
        print_json(report.summary)
    else:
        from sinssim.recording.console import show

        show(report.exhibits, console())
