"""`sinssim align`, `allan`, `calibrate`, `inspect` and `tune`: sensors at rest, on a turntable, in recorded files."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from sinssim.cli.command_line import (
    ColumnsFile,
    Debug,
    FromTime,
    GradeOption,
    Json,
    Quiet,
    ScenarioName,
    Settings,
    ToTime,
    Trial,
    Written,
    command,
    console,
    has_bars,
    out_option,
    overwrite_option,
    plot_option,
    print_json,
    print_places,
    print_result,
    record_option,
    with_grade,
)
from sinssim.errors import InputError
from sinssim.progress import shown

if TYPE_CHECKING:
    from rich.console import Console

    from sinssim.analyses.inspection.stream_inspection import Inspection

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
PlotExpected = Annotated[Path | None, plot_option("the expected errors")]
RecordSession = Annotated[Path | None, record_option("the session")]


@command
def align(
    source: Source,
    columns: ColumnsFile = None,
    grade: Grade = None,
    start: FromTime = None,
    end: ToTime = None,
    disturbed: Disturbed = False,
    latitude: Latitude = None,
    settings: Settings = None,
    plot: PlotExpected = None,
    record: RecordSession = None,
    out: Written = None,
    overwrite: Annotated[bool, overwrite_option("an existing alignment")] = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Determine heading, roll, pitch and latitude of a parked vehicle, and the expected error of each by source.

    A session lasts a few hundred seconds, during which the vehicle is stationary. A session in which the vehicle moved
    is refused. A swaying vehicle can be aligned with --disturbed. The angles are those of the sensor block.

    -o writes a directory with the report (report.html, self-contained), the recording (recording.rrd), the numbers
    (alignment.json) and the figure of the expected errors (alignment.svg).

    Examples:

        sinssim align parked --to 300 -o runs/parked-alignment
        sinssim align runs/parked/streams/imu_measured.parquet --grade laser-standard --to 600
        sinssim align log.csv --columns log.toml --grade tactical --plot expected.svg
        sinssim align log.npz --columns log.toml --disturbed --latitude 50
    """
    from sinssim.analyses.alignment_session import align

    report = align(
        source, columns=columns, grade=grade, start=start, end=end, method="disturbed" if disturbed else "quiet",
        latitude=None if latitude is None else math.radians(latitude), overrides=tuple(settings or ()),
        directory=out, overwrite=overwrite,
    )  # fmt: skip
    if plot is not None:
        from sinssim.recording.figures import save

        save(report.plot(), plot)
    if record is not None:
        from sinssim.recording.rerun_exhibits import record as record_exhibits

        record_exhibits(report.exhibits, record)
    if print_result(report, as_json=as_json) and report.directory is not None:
        print_places(report.directory)


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
Plot = Annotated[Path | None, plot_option("the Allan deviations")]
Record = Annotated[Path | None, record_option("the results")]
ImuTable = Annotated[
    bool, typer.Option("--imu", help="Print only the table [imu] of a scenario that simulates this IMU.")
]


@command
def allan(
    log: Log,
    columns: ColumnsFile = None,
    channel: Channels = None,
    start: FromTime = None,
    end: ToTime = None,
    correlation_time: CorrelationTime = None,
    plot: Plot = None,
    record: Record = None,
    out: Written = None,
    overwrite: Annotated[bool, overwrite_option("an existing analysis")] = False,
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

    -o writes a directory with the report (report.html, self-contained), the recording (recording.rrd) and the numbers
    (noise.json).

    Examples:

        sinssim allan runs/parked -o runs/parked-noise
        sinssim allan log.csv --columns log.toml --channel gyro --plot allan.svg
        sinssim allan weather.csv --columns weather.toml --channel pressure=hPa --channel air_c
        sinssim allan log.npz --columns log.toml --from 600 --to 36600 --record allan.rrd
        sinssim allan drive.toml --from 0 --to 30 --imu >> simulated.toml
    """
    from sinssim.analyses.noise_report import noise_report

    if plot is not None:
        from sinssim.recording.figures import check_format

        check_format(plot)
    if out is not None:
        from sinssim.system.files import check_directory

        check_directory(out, overwrite)
    if imu and as_json:
        from sinssim.errors import InputError

        raise InputError("--imu and --json exclude each other; give one of them.")
    with shown(has_bars(quiet)) as progress:
        report = noise_report(
            log, columns=columns, channels=tuple(channel or ()), start=start, end=end,
            correlation_time=correlation_time, progress=progress,
        )  # fmt: skip
    from sinssim.analyses.noise_exhibits import exhibits_of, save_report
    from sinssim.analyses.noise_imu_table import block_text

    shows = not (imu or as_json or quiet)
    exhibits = exhibits_of(report) if shows or plot or record or out else None
    if exhibits and plot is not None:
        from sinssim.recording.figures import figure_of, save

        save(figure_of(exhibits.chosen(exhibits.figure)), plot)
    if exhibits and record is not None:
        from sinssim.recording.rerun_exhibits import record as record_exhibits

        record_exhibits(exhibits, record)
    if exhibits and out is not None:
        out = save_report(report, exhibits, out, overwrite=overwrite)
    if imu:
        print(block_text(report), end="")
    elif as_json:
        print_json(report.to_json())
    elif exhibits and shows:
        from sinssim.recording.console import show

        show(exhibits, console(least_width=120))
        if out is not None:
            print_places(out)


@command
def calibrate(
    scenario: ScenarioName,
    out: Annotated[Path | None, out_option("runs/<name>-calibration")] = None,
    settings: Settings = None,
    grade: GradeOption = None,
    method: Annotated[
        str | None,
        typer.Option("--method", metavar="METHOD", help="separate or systematic.", show_default="the scenario's"),
    ] = None,
    overwrite: Annotated[bool, overwrite_option("an existing calibration")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Calibrate an IMU on a turntable.

    Estimates biases, scale factors, misalignments and, on request, the positions of the accelerometers from the
    sequence of the table [turntable]: by separate tests in known positions, or from the navigation errors. Reports the
    parameters that the sequence does not determine. The data are simulated, or recorded data of [log]. See
    docs/calibration.md.

    Writes a directory with the report (report.html, self-contained), the numbers (calibration.json), the file for
    [compensation] (compensation.toml) and the scenario with all default values (scenario.toml).

    Examples:

        sinssim calibrate calibration_table
        sinssim calibrate calibration_systematic --set turntable.dwell_s=60
    """
    from sinssim.analyses.turntable_calibration import calibrate
    from sinssim.scenario import load_scenario

    plan = load_scenario(scenario, with_grade(settings, grade))
    directory = out or Path("runs") / f"{plan.name}-calibration"
    result = calibrate(plan, directory, method=method, overwrite=overwrite, progress=has_bars(quiet))
    if print_result(result, as_json=as_json, quiet=quiet, least_width=110):
        print(f"Report:       {result.directory}/report.html    (in any browser)")
        print(f'Compensation: {result.directory}/compensation.toml    ([compensation] with file = "…")')


@command
def inspect(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="Recorded files of an IMU, a GNSS receiver, or both: any format of `sinssim list "
            "formats`, a text file with unknown columns, or a scenario with [log] that describes them.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="Write the suggested scenario, or the corrected one of a given scenario, to this file (.toml).",
        ),
    ] = None,
    vehicle: Annotated[
        Literal["any", "land"],
        typer.Option(
            "--vehicle",
            help="land: a wheeled vehicle; the suggested scenario then contains the nonholonomic constraint and the "
            "detection of stops.",
        ),
    ] = "any",
    trial: Trial = True,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing file.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Inspect recorded files: contents, doubtful data, and a suggested scenario.

    Examines format, columns, rate, jitter, gaps, repeated times, saturation and resolution; compares the specific force
    at rest with gravity; and compares the inertial data with the GNSS velocities. The comparison needs neither the
    attitude nor the mounting. It gives the offset of the clocks, the age of the velocities, wrong units, signs and
    axes, and the mounting of the IMU in a vehicle that moves along its longitudinal axis.

    The exit code is 2 if an error would make the results worthless.

    Examples:

        sinssim inspect imu.csv gnss.pos
        sinssim inspect imu.csv gnss.pos --vehicle land --out drive.toml
    """
    from sinssim.analyses.inspection.inspected_files import inspect
    from sinssim.system.files import write_text

    if out is not None:
        _check_out(out, overwrite)
    place = Path() if out is None else out.parent
    with shown(has_bars(quiet or as_json)) as progress:
        result = inspect(files, place, land=vehicle == "land", trial=trial, progress=progress)
    if out is not None and result.scenario is not None:  # before printing, which may end early
        write_text(out, result.scenario)
    if as_json:
        print_json({**result.inspection.as_dict(), "scenario": result.scenario, "why_no_scenario": result.why or None})
    elif not quiet:
        show_findings(result.inspection, console(least_width=100))
        if result.scenario is not None and out is None:
            print(f"\nA scenario to start from (--out FILE writes it):\n\n{result.scenario}", end="")
        if result.why:
            print(f"\n{result.why}")
    if out is not None and result.scenario is not None and not (quiet or as_json):
        print(f"\nScenario: {out}")
    if not result.inspection.usable:
        raise typer.Exit(2)


def _check_out(out: Path, overwrite: bool) -> None:
    """Raise if the suggested scenario cannot be written to a file."""
    if out.suffix != ".toml":
        raise InputError(f"--out {out}: a scenario's file ends with .toml.")
    if out.exists() and not overwrite:
        raise InputError(f"--out {out}: there is such a file already. Choose another name, or add --overwrite.")


_MARKS = {"fact": ("", ""), "doubt": ("doubt", "yellow"), "wrong": ("WRONG", "bold red")}


def show_findings(inspection: Inspection, console: Console) -> None:
    """Print the findings."""
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column("subject", no_wrap=True, max_width=28)
    table.add_column("mark", no_wrap=True)
    table.add_column("finding", overflow="fold")
    before = ""
    for finding in inspection.findings:
        mark, style = _MARKS[finding.grade]
        text = Text(finding.text)
        if finding.fix:
            text.append(f" {finding.fix}", style="bold")
        subject = finding.subject.rsplit("/", 1)[-1]
        table.add_row(Text(subject if subject != before else ""), Text(mark, style=style), text)
        before = subject
    console.print(table)
    doubts = sum(f.grade == "doubt" for f in inspection.findings)
    errors = sum(f.grade == "wrong" for f in inspection.findings)
    console.print(
        f"\n{errors} error{'s' * (errors != 1)}, {doubts} doubt{'s' * (doubts != 1)}."
        + (" Results from data with errors are worthless." if errors else ""),
        markup=False,
    )


Keys = Annotated[
    list[str] | None,
    typer.Option(
        "--key",
        metavar="KEY[=VALUE]",
        help="A noise to tune, or of recorded sensors a lever arm, time offset, delay or the mounting, with a value to "
        "begin with other than the scenario's; may be given several times.",
        show_default="of a recording the noises and biases of [imu] and the σ of each aiding sensor, of a simulation "
        "the two noise factors of [filter]",
    ),
]
HeldOut = Annotated[
    float,
    typer.Option(
        "--held-out", metavar="SHARE", min=0.0, max=0.9,
        help="Share of the data, at its end, that judges the values and is not used to find them.",
    ),
]  # fmt: skip


@command
def tune(
    scenario: ScenarioName,
    keys: Keys = None,
    held_out: HeldOut = 1.0 / 3.0,
    settings: Settings = None,
    as_json: Json = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Find the noises of a filter, or how its sensors are installed, such that its innovations are most probable.

    Each key gets its value of maximum likelihood with a 95 % interval. A key that the data cannot tell is named and
    stays. The end of the data judges the values. The last lines are the settings that apply them.

    Examples:

        sinssim tune my_drive.toml
        sinssim tune my_drive.toml --key log.gnss.sigma_factor --key imu.gyro_arw_deg_sqrt_h=0.5
        sinssim tune my_drive.toml --key log.gnss.lever_arm_m --key log.gnss.time_offset_s
        sinssim tune mems_uav --set filter.measurement_noise_factor=3
    """
    from sinssim.analyses.filter_tuning_search import tune

    with shown(has_bars(quiet or as_json)) as progress:
        result = tune(scenario, settings or (), keys=keys or (), held_out=held_out, progress=progress)
    print_result(result, as_json=as_json, quiet=quiet)
