"""What commands print and write, compared with texts that a person has read.

Each text holds all words and numbers of the console, the report, the summary, the streams and the recording, so that no
word, unit or number of them changes unseen. That a number is right is shown by the tests of its room, which compute it
in another way. `python -m tests.approved.test_approved [NAME ...]` writes the texts anew and prints what has changed:
it is to be read before it is kept.
"""

from __future__ import annotations

import shlex
import sys
import tempfile
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sinssim.cli.app import app
from tests.approved.outputs import differences, text_of

HERE = Path(__file__).parent
DATA = HERE.parent / "data"
SHORT = "--set imu.rate_hz=10"
PARKED = f"{SHORT} --set parked.duration_s=600"
REQUIRE = '--require "r95(end) <= 1 nmi" --require "tilt_north(300 s) <= 1 arcmin"'

CASES = {
    "parked": [f"run parked {PARKED} -o run", "allan run -o noise", "export run --to csv -o csv"],
    "mems_uav": ["run mems_uav -o run"],
    "rotating_unit": ["run rotating_unit --set great_circle.duration_s=7200 -o run"],
    "platform": [f"run platform {SHORT} -o run"],
    "one_component": ["run one_component -o run"],
    "gyro_free": ["run gyro_free -o run"],
    "attitude_sensor": [f"run attitude_sensor {SHORT} -o run"],
    "redundant_set": [f"run redundant_set {SHORT} -o run"],
    "compared_systems": [f"run compared_systems {SHORT} -o run"],
    "polar_flight": [f"run polar_flight {SHORT} -o run"],
    "drive": ["run DATA/drive/drive.toml -o run"],
    "align": ["align gyrocompassing -o align"],
    "gyrocompassing": [f"run gyrocompassing {PARKED} -o run"],
    "calibration_table": ["calibrate calibration_table -o calibration"],
    "calibration_systematic": ["calibrate calibration_systematic -o calibration"],
    "inspect": ["inspect DATA/drive/imu.csv DATA/drive/gnss.pos --out drive.toml"],
    "budget": ["budget mems_uav -o budget"],
    "budget_parked": [f"budget parked {SHORT} {REQUIRE} -o budget"],
    "ensemble": [f"ensemble parked --runs 24 {PARKED} {REQUIRE} -o ensemble"],
    "ensemble_aided": ["ensemble FILES/all_filters.toml --runs 4 --threads 1 --set filters=[] -o ensemble"],
    "trade": [
        f"compare parked --vary imu.grade=laser-navigation,laser-standard --vary imu.rate_hz=10,20 {REQUIRE} "
        "--set parked.duration_s=600 -o trade"
    ],
    "claims": ["compare FILES/claims.toml -o study"],
    "guided": ["run FILES/guided.toml -o run", "budget FILES/guided.toml -o budget"],
    "filters": ["run FILES/all_filters.toml -o run"],
    "heading_error": [f"run heading_error {SHORT} -o run"],
    "spoofed": ["run spoofed -o run"],
    "sea_voyage": ["run sea_voyage -o run"],
    "bomb_drop": ["run bomb_drop -o run"],
    "in_flight_calibration": ["run in_flight_calibration -o run"],
    "align_in_motion": ["run align_in_motion -o run"],
    "gravity_disturbance": [f"run gravity_disturbance {SHORT} -o run"],
    "waypoint_route": [f"run waypoint_route {SHORT} -o run"],
    "formats": [
        "run FILES/multirotor.toml -o run",
        *(f"export run --to {form} -o out.{form}" for form in ("kf-gins", "psins", "gnss-ins-sim", "rtklib-pos", "nmea",
          "mcap", "euroc", "tum", "gpx", "kml", "geojson", "sbet", "mat")),
        "inspect out.kf-gins/imu.txt out.kf-gins/gnss.txt", "inspect out.psins/imu.imu out.psins/gnss.avp",
        "inspect out.gnss-ins-sim", "inspect out.euroc", "inspect out.mcap", "inspect out.nmea out.gpx",
        "score run out.rtklib-pos out.tum out.sbet --name a --name b --name c",
    ],
    "several": [
        f"run parked {PARKED} -o runs/a", f"run parked {PARKED} --set seed=8 --set imu.grade=mems-tactical -o runs/b",
        "compare-runs runs/a runs/b -o both", "runs runs", "runs runs --html",
    ],
    "tune": ["tune FILES/all_filters.toml"],
    "foot_walk": ["run FILES/foot.toml -o run"],
    "sounding_rocket": ["run sounding_rocket --set imu.rate_hz=20 -o run"],
    "multirotor": ["run FILES/multirotor.toml -o run"],
    "lists": [
        *(f"list {kind}" for kind in ("aircraft", "algorithms", "frames", "gravity", "curvatures", "ellipsoids",
                                      "grades", "views", "aiding", "filters", "states", "formats", "exports")),
        "sensors laser-standard", "sensors mems-tactical", "check aided_airliner", "check first_flight",
        "check drive", "check oceanic_crossing", "check FILES/guided.toml", "check FILES/all_filters.toml",
        *(f"check --keys {table}" for table in ("imu.gyro", "filter", "flight", "aiding.gnss", "navigation", "log")),
    ],
    "helps": [f"{command} --help" for command in (
        "run", "view", "check", "compare", "aircraft add", "align", "allan", "budget", "calibrate", "compare-runs",
        "ensemble", "export", "inspect", "list", "new", "runs", "score", "sensors", "stream", "workbench")],
}  # fmt: skip
FEWER = ("formats", "several")
"""Cases whose recordings, streams and pages are those of other cases."""


def outcome(name: str, folder: Path) -> str:
    """Run the commands of a case in a folder, and return what they print and write."""
    printed = list[str]()
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for cost in ("step_cost", "attitude_cost"):
            patch.setattr(f"sinssim.experiments.studies.{cost}.least_time", lambda *given: 1000.0)
        clocks = ("time.perf_counter", "time.thread_time", "time.process_time")
        for clock in (*clocks, "sinssim.experiments.studies.trade_run.perf_counter"):
            patch.setattr(clock, lambda: 0.0)  # nothing takes any time
        for command in CASES[name]:
            result = CliRunner(env={"COLUMNS": "110"}).invoke(
                app, shlex.split(command.replace("DATA", str(DATA)).replace("FILES", str(HERE / "files")))
            )
            printed += [f"$ sinssim {command}", result.output]
            assert result.exit_code == 0, (command, result.output, result.exception)
    hidden = (".rrd", ".html", ".parquet", ".json") if name in FEWER else ()
    text = text_of("\n".join(printed), folder, hidden)
    return text.replace(str(DATA), "DATA").replace(str(HERE / "files"), "FILES")


@pytest.mark.parametrize("name", CASES)
def test_what_a_command_gives_is_as_it_was_read(name: str, tmp_path: Path) -> None:
    changed = differences(outcome(name, tmp_path), (HERE / f"{name}.txt").read_text(encoding="utf-8"))
    assert not changed, "\n".join(changed[:40])


def main() -> None:
    """Write texts anew, and print what changes."""
    for name in sys.argv[1:] or CASES:
        file = HERE / f"{name}.txt"
        with tempfile.TemporaryDirectory() as folder:
            text = outcome(name, Path(folder))
        old = file.read_text(encoding="utf-8") if file.exists() else ""
        changed = differences(text, old)
        print(f"{name}: {len(changed)} lines change", *changed[: 60 if old else 0], sep="\n")
        if changed:
            file.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
