"""`sinssim allan`: identifies the noise of sensors at rest, and of any other column of a log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import ColumnsFile, Debug, FromTime, Json, Quiet, ToTime
from sinssim.cli.terminal import console, has_bars, print_json
from sinssim.progress import shown

Log = Annotated[
    Path,
    typer.Argument(
        metavar="LOG",
        help="A recorded log (text, .parquet, .npz) of sensors at rest, a run directory, or a scenario with [log].",
    ),
]
Channels = Annotated[
    list[str] | None,
    typer.Option(
        "--channel",
        metavar="NAME[=UNIT]",
        help="gyro_x … accel_z, gyro or accel for all three axes, or any column of the log with its unit "
        "(pressure=hPa), which may be omitted if the name ends in it (pressure_hpa). May be given several times.",
        show_default="all gyros and accelerometers",
    ),
]
CorrelationTime = Annotated[
    float | None,
    typer.Option(
        "--correlation-time",
        metavar="S",
        help="Known correlation time of a Gauss-Markov bias, s.",
        show_default="estimated, if there is such a bias",
    ),
]
Plot = Annotated[
    Path | None, typer.Option("--plot", metavar="FILE", help="Draw the Allan deviations (.svg, .png or .pdf).")
]
Record = Annotated[
    Path | None, typer.Option("--record", metavar="FILE", help="Record the results for `sinssim view` (.rrd).")
]
ImuTable = Annotated[
    bool, typer.Option("--imu", help="Print only the table [imu] of a scenario that simulates this IMU.")
]


def command(
    log: Log,
    columns: ColumnsFile = None,
    channel: Channels = None,
    start: FromTime = None,
    end: ToTime = None,
    correlation_time: CorrelationTime = None,
    plot: Plot = None,
    record: Record = None,
    imu: ImuTable = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Identify the noise of sensors at rest: Allan deviation, and the terms Q, N, B, K, R with 95 % intervals.

    The terms are quantisation, random walk, bias instability, rate random walk and ramp of every channel. They are
    estimated by maximum likelihood, in the units of data sheets and scenarios. A term that the record does not show is
    reported as not observable.

    Any other column of a log is processed as the values of a quantity, such as pressure, temperature or the frequency
    of a clock.

    Examples:

        sinssim allan runs/parked
        sinssim allan log.csv --columns log.toml --channel gyro --plot allan.svg
        sinssim allan weather.csv --columns weather.toml --channel pressure=hPa --channel air_c
        sinssim allan log.npz --columns log.toml --from 600 --to 36600 --record allan.rrd
        sinssim allan drive.toml --from 0 --to 30 --imu >> simulated.toml
    """
    from sinssim.analyses.noise.noise_report import noise_report

    if plot is not None:
        from sinssim.recording.figures import check_format

        check_format(plot)
    if imu and as_json:
        from sinssim.errors import InputError

        raise InputError("--imu and --json exclude each other; give one of them.")
    with shown(has_bars(quiet)) as progress:
        report = noise_report(
            log, columns=columns, channels=tuple(channel or ()), start=start, end=end,
            correlation_time=correlation_time, progress=progress,
        )  # fmt: skip
    from sinssim.analyses.noise.noise_exhibits import block_text, exhibits_of

    shows = not (imu or as_json or quiet)
    exhibits = exhibits_of(report) if shows or plot or record else None
    if exhibits and plot is not None:
        from sinssim.recording.figures import figure_of, save

        save(figure_of(exhibits.chosen(exhibits.figure)), plot)
    if exhibits and record is not None:
        from sinssim.recording.rerun.exhibit_recording import record as record_exhibits

        record_exhibits(exhibits, record)
    if imu:
        print(block_text(report), end="")
    elif as_json:
        print_json(report.to_json())
    elif exhibits and shows:
        from sinssim.recording.console import show

        show(exhibits, console(least_width=120))
