"""Messages to the last word: what was wrong, where, and what would be right, each written by hand."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim import rotation
from sinssim.alignment.alignment_budget import best_headings
from sinssim.alignment.determination import determine
from sinssim.alignment.initial_conditions import _spread, initial_state
from sinssim.alignment.parked_theory import Attitude, InstrumentErrors, _check_regular
from sinssim.analyses.alignment_session import _check_is_scenario, align
from sinssim.analyses.noise_report import Samples, _of_scenario, chosen_channels, part
from sinssim.analyses.turntable_calibration import calibrate
from sinssim.arguments import check_increasing, checked_initial, numbers
from sinssim.cli.commands.analyses import _check_out
from sinssim.content import package_content
from sinssim.data import ImuData, NavState
from sinssim.errors import InputError
from sinssim.estimation.state_model import Block
from sinssim.experiments import experiment_directory
from sinssim.experiments.ensembles.batch_navigation import _initial
from sinssim.experiments.ensembles.ensemble_execution import Group, compute_task
from sinssim.experiments.experiment_directory import Kind, read_manifest
from sinssim.experiments.run.paced_stream import pace_of, place_of
from sinssim.experiments.studies.position_claims import gyro_free
from sinssim.experiments.studies.study_directory import StudyDirectory
from sinssim.experiments.studies.study_results import Evidence
from sinssim.experiments.studies.trade_schema import MOST_CELLS
from sinssim.experiments.studies.trade_sweep import FORM, sweep
from sinssim.experiments.study import load_study
from sinssim.logs.formats import read_file
from sinssim.logs.numeric_columns import bad_row
from sinssim.logs.recorded_log import _check_scale
from sinssim.logs.recorded_streams import InertialStream, made_increments
from sinssim.logs.track import track_format
from sinssim.recording.rerun_viewer import _is_timed
from sinssim.scenario import load_scenario
from sinssim.scenario.overrides import parse_value
from sinssim.scenario.true_motion import fly
from sinssim.sensors.fault_detection import threshold
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import _check_triad
from sinssim.sensors.imu.laser_gyro import detuning, path_change
from sinssim.simulation.foreign_navigator import VARIABLE, check_permission, check_programs
from sinssim.statistics.random_numbers import key
from sinssim.statistics.requirements import parse_requirement, tally
from sinssim.strapdown.attitude import functional_iteration
from sinssim.strapdown.frames.route_pole import route_pole
from sinssim.system.extensions import _kind_of, items_of
from sinssim.system.files import MARK, check_directory, check_place
from sinssim.truth.curve import checked_knots
from sinssim.truth.flight.jsbsim_model import _changed_model
from sinssim.truth.motions.coning_and_rocking import SpinRock
from sinssim.truth.motions.parked_and_great_circle import GreatCircle
from sinssim.truth.motions.turntable import Dwell, RotationTable, Turn
from sinssim.truth.motions.vibration import Mount

NONE: Any = None
KNOTS = np.arange(9.0), np.outer(np.arange(9.0), [7e6, 1.0, 1.0]), np.tile([1.0, 0.0, 0.0, 0.0], (9, 1))

PRODUCTS = len(list((package_content("scenarios") / "grades").glob("*.toml")))


def knots(column: int, row: int, value: float) -> Any:
    """Check a curve's knots of which one number is another."""
    changed = [part.copy() for part in KNOTS]
    changed[column][row] = value
    return checked_knots(*changed)


def scale(force: float) -> None:
    """Check a specific force at 10 Hz for 30 s."""
    imu = ImuData(np.arange(301.0) / 10.0, np.zeros((300, 3)), np.tile([0.0, 0.0, -force / 10.0], (300, 1)))
    unit: Any = SimpleNamespace(file="imu.csv")
    _check_scale(imu, unit)


MESSAGES: list[tuple[Callable[[Path], Any], str]] = [
    (lambda at: _of_scenario(at / "p.toml", at / "c.toml", ()),
     "--columns describes a log; AT/p.toml is a scenario, which describes its own log: leave it out."),
    (lambda at: _of_scenario(at / "p.toml", None, ["pressure", "other"]),
     "AT/p.toml: of a scenario gyros and accelerometers are analysed; for the column 'pressure' give the file itself, "
     "and its description with --columns."),
    (lambda at: Mount(25.0, -0.5),
     "a mount of 25.0 Hz with a damping of -0.5: both must be positive and finite."),
    (lambda at: scale(4.903325),
     "imu.csv: the specific force is 4.903 m/s² (median), but at rest and in any usual motion it is about 9.807: a "
     "factor of 0.5. Check accel.unit and kind (rates, or increments over 0.1 s), or set "
     "log.imu.check_scale = false."),
    (lambda at: knots(0, 5, 3.5), "knot 5 at 3.5 s is not later than the previous knot, at 4.0 s."),
    (lambda at: knots(0, 5, np.nan), "knot 5: its time is not a finite number."),
    (lambda at: knots(1, 6, np.inf), "knot 6: its position is not a finite number."),
    (lambda at: knots(2, 7, 1.5), "knot 7 at 7.0 s: its quaternion has norm 3, it must be 1."),
    (lambda at: checked_knots(*(part[:5] for part in KNOTS)), "a curve needs at least 6 knots, got 5."),
    (lambda at: checked_knots(KNOTS[0], KNOTS[1][:8], KNOTS[2]),
     "a curve needs K times, (K, 3) positions and (K, 4) quaternions; got arrays of shapes (9,), (8, 3) and (9, 4)."),
    (lambda at: track_format(at / "none.gpx", None),
     "track.file = 'AT/none.gpx' cannot be read: there is no such file."),
    (lambda at: sweep("parked", ["imu.rate_hz=50,,100"]),
     f"--vary imu.rate_hz=50,,100: a value is missing beside a comma. {FORM}"),
    (lambda at: sweep("parked", ["imu.rate_hz=a:b"]),
     f"--vary imu.rate_hz=a:b: 'a:b' is not a range of numbers. {FORM}"),
    (lambda at: sweep("parked", ["imu.rate_hz=50 Hz"]),
     "--vary imu.rate_hz=50 Hz: '50 Hz' has a unit, 'Hz'; the unit is part of the key's name. Write the number alone."),
    (lambda at: sweep("parked", ["imu.rate_hz"]),
     f"--vary imu.rate_hz: write KEY=VALUES, for example imu.rate_hz=50,100. {FORM}"),
    (lambda at: load_study("parked"), "parked is a scenario, not a study; vary its keys with --vary KEY=VALUES."),
    (lambda at: load_study(written(at, "a.toml", 'scenario = "parked"\n[[parts]]\n')),
     "AT/a.toml has parts and a scenario: a study either compares algorithms on motions, by [[parts]], or varies the "
     "keys of a scenario, by [[axes]]. Make two studies of it."),
    (lambda at: load_study(written(at, "b.toml", "seed = 3\n")),
     "AT/b.toml is not a study: it has neither [[parts]], which compare algorithms on motions, nor a scenario with "
     "[[axes]], which vary its keys. The keys of a scenario are varied without a file by --vary KEY=VALUES."),
    (lambda at: _check_out(at / "plan.txt", overwrite=False), "--out AT/plan.txt: a scenario's file ends with .toml."),
    (lambda at: _check_out(written(at, "plan.toml", ""), overwrite=False),
     "--out AT/plan.toml: there is such a file already. Choose another name, or add --overwrite."),
    (lambda at: best_headings(0, 0.8, NONE, 60.0), "a set of 0 headings: there must be at least one."),
    (lambda at: best_headings(2, 0.8, NONE, 60.0, angle="roll"),
     "the error of the roll does not depend on the heading; choose heading or latitude."),
    (lambda at: _check_is_scenario("p.toml", "c.toml"),
     "p.toml is a scenario, which describes its own sensors; --columns is for logs (.csv, .txt, .tsv, .dat, .asc, "
     ".log, .parquet, .npz)."),
    (lambda at: items_of(at / "none"), "there is no file or folder 'AT/none'"),
    (lambda at: read_manifest(written(at, "file", ""), KIND), "AT/file is a file; give the name of a folder with -o."),
    (lambda at: read_manifest(at, KIND),
     "the folder AT is not empty and holds no trade study: it lacks a readable results.json. It stays unchanged; give "
     "another folder with -o."),
    (lambda at: determine(np.ones((2, 3)), np.ones((3, 3))),
     "the shapes of gyro (2, 3) and accel (3, 3) do not fit together."),
    (lambda at: _kind_of(at / "a.txt"),
     "AT/a.txt is not a Python file (.py), nor the TOML file of a grade or of an aircraft"),
    (lambda at: _kind_of(written(at, "a.py", "x = 3\n")),
     "AT/a.py is nothing that sinssim can use: an attitude algorithm has functions start_k, dcm_k, step_k and "
     "quaternion_k, a navigation frame solve and check, a view blueprint, a file format recognises and read, an export "
     "format SUFFIX, HOLDS and write, a filter a class Filter, an aiding sensor a class that derives from "
     "AidingSensor, and a leg one that derives from LegBase"),
    (lambda at: check_place(written(at, "file", ""), overwrite=False),
     "the run directory AT/file is a file; give the name of a folder with -o."),
    (lambda at: check_place(written(at, "some.txt", "").parent, overwrite=True),
     f"the folder AT is not empty and holds no run: it lacks the file {MARK}, by which sinssim recognises a run. It "
     "stays unchanged; give another folder with -o."),
    (lambda at: check_place(written(at, "recording.rrd", "").parent, overwrite=True),
     f"the folder AT is not empty and holds no run: it lacks the file {MARK}, by which sinssim recognises a run. It "
     "stays unchanged; give another folder with -o. If it is a run of an older sinssim, move or remove it yourself."),
    (lambda at: check_directory(None, overwrite=True), "overwrite needs the directory of a result."),
    (lambda at: GreatCircle.between(PLACE, (-PLACE[0], PLACE[1] + np.pi), 0.0, 100.0),
     "no great circle is defined from [30. 10.]° to [-30. 190.]°: the places coincide or are antipodal."),
    (lambda at: GreatCircle.between(PLACE, (0.0, 0.0), 0.0, -5.0),
     "speed = -5.0 m/s along the great circle must be positive and finite."),
    (lambda at: check_programs(navigator(command=["a/run.py"])),
     "navigator.1.command: there is no file 'a/run.py'."),
    (lambda at: check_programs(navigator(library="/a/libnav.so")),
     "navigator.1.library: there is no file '/a/libnav.so'."),
    (lambda at: check_programs(navigator(command=["a/run.py"], file=written(at, "run.py", ""))),
     "navigator.1.command: 'a/run.py' is not executable (chmod +x)."),
    (lambda at: check_permission(navigator(), navigator(library="a", file=at / "nav.so").navigator[0]),
     "the navigator mine is the library AT/nav.so, which is started only if you allow it: give --allow-programs, or "
     "keep it in the folder navigators of a project of yours, which the key `use` or SINSSIM_CONTENT names."),
    (lambda at: _changed_model(model(at, "<a>"), NONE),
     "AT/made/made.xml is not XML: no element found: line 1, column 3."),
    (lambda at: _changed_model(model(at, "<a/>"), aircraft(engine="3")),
     "model_changes of made: made.xml has no element 'engine'."),
    (lambda at: place_of("udp://10.0.0.1:9", "--to", ("udp", "pty")),
     "--to udp://10.0.0.1:9 is not this machine; nothing was sent. --allow-network allows other machines."),
    (lambda at: place_of("udp://127.0.0.1", "--listen", ("udp", "tcp")),
     "--listen udp://127.0.0.1 lacks a port; give for example udp://127.0.0.1:14550."),
    (lambda at: place_of("tcp://:9", "--listen", ("tcp",)),
     "--listen tcp://:9 lacks a host; give for example tcp://127.0.0.1:14550."),
    (lambda at: place_of("http://a:9", "--to", ("udp", "pty")),
     "--to http://a:9 is none of udp://HOST:PORT, pty:; give for example udp://127.0.0.1:14550."),
    (lambda at: chosen_channels(["a=Pa", "b=1", "a=hPa"]),
     "the column 'a' is given with two units, Pa and hPa; give one of them."),
    (lambda at: part(SAMPLES, 12.5, 13.0, "a.csv"),
     "a.csv: there are no samples from 12.5 s to 13 s; the log runs from 5 to 8 s."),
    (lambda at: part(SAMPLES, 7.5, None, "a.csv"),
     "a.csv: there are no samples from 7.5 s; the log runs from 5 to 8 s."),
    (lambda at: parse_requirement("r95 <= 1.2.3 m"),
     """requirement 'r95 <= 1.2.3 m': '1.2.3' is not a number; write it like "r95(3600 s) <= 1852 m"."""),
    (lambda at: parse_requirement("r95 >= 3 m"),
     """requirement 'r95 >= 3 m': >= is not a limit of an error; write it like "r95(3600 s) <= 1852 m"."""),
    (lambda at: parse_requirement("r95 <= 0 m"),
     "requirement 'r95 <= 0 m': the limit 0 must be a positive number."),
    (lambda at: parse_requirement("miss <= 3 m"),
     "requirement 'miss <= 3 m': a miss is that of a waypoint; write it like miss(waypoint 3), or with its name."),
    (lambda at: parse_requirement("heading <= 3 m"),
     "requirement 'heading <= 3 m': 'm' is a unit of length; heading is an angle. Known units: rad, mrad, deg, °, "
     "arcmin, ', arcsec, \"."),
    (lambda at: parse_requirement("rate(run) <= 1 nmi/h"),
     "requirement 'rate(run) <= 1 nmi/h': a rate is not limited over the whole run, as it has none at the start; give "
     "a time or end."),
    (lambda at: parse_requirement("rate(0 s) <= 1 nmi/h"),
     "requirement 'rate(0 s) <= 1 nmi/h': (0 s) must be a positive time."),
    (lambda at: parse_requirement("r95(-2 s) <= 1 nmi"),
     "requirement 'r95(-2 s) <= 1 nmi': (-2 s) must be a time from the start on."),
    (lambda at: tally(parse_requirement("r95 <= 1 m"), np.arange(3.0), np.ones((2, 4))),
     "errors have the shape (2, 4); N runs at 3 times need (N, 3)."),
    (lambda at: align("a.csv", overrides=["imu.rate_hz=5", "seed=2"]),
     "a.csv is a log, but --set imu.rate_hz=5 is for scenarios; give its sensors with --grade NAME."),
    (lambda at: _spread("sigma", [1.0, -2.0, 3.0], "m/s"),
     "sigma = [1.0, -2.0, 3.0] m/s must be standard deviations: zero or more."),
    (lambda at: _spread("sigma", [1.0, 2.0], "m/s"),
     "sigma = [1.0, 2.0] must be 3 finite numbers, north, east, down, m/s."),
    (lambda at: compute_task(Group(NONE, range(2), at / "runs")),
     f"a worker on {os.uname().nodename} does not see the folder AT/runs. All workers need the same file system: give "
     "a directory on a shared one with -o."),
    (lambda at: read_file(written(at, "a.pos", POS.format("", "deg"))),
     "AT/a.pos, line 4: it has 23 fields; the rows before have 24."),
    (lambda at: read_file(written(at, "b.pos", POS.format(" 30 30.0", "d'\""))),
     "AT/b.pos, line 4: it has 27 fields; the rows before have 28."),
    (lambda at: SpinRock([0.0, 0.0, 0.0], 1.0, 0.1, 2.0),
     "axis = [0.0, 0.0, 0.0] of the spin must be three numbers, not all zero."),
    (lambda at: made_increments(InertialStream(np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)))),
     "the log has 1 samples in this span; at least two are needed."),
    (lambda at: checked_initial(NONE),
     "initial must be NavState(latitude, longitude, height, velocity_ned, q_nb), not None."),
    (lambda at: check_increasing("time", np.array([1.0, 2.0, 2.0, 3.0])),
     "time must increase: time[1] = 2 s is followed by time[2] = 2 s."),
    (lambda at: sweep("parked", ["imu.rate_hz=5:5:log3"]),
     "--vary imu.rate_hz=5:5:log3: 5:5:log3 needs two different positive ends and at least log2: values in equal "
     "ratios, the ends included."),
    (lambda at: sweep("parked", ["imu.rate_hz=5:9:0"]),
     "--vary imu.rate_hz=5:9:0: the step of 5:9:0 must not be 0."),
    (lambda at: sweep("parked", ["imu.rate_hz=5:9:-1"]),
     "--vary imu.rate_hz=5:9:-1: the step of 5:9:-1 leads away from 9, so that there is no value."),
    (lambda at: sweep("parked", ["imu.rate_hz=1:9e9:1"]),
     f"--vary imu.rate_hz=1:9e9:1: 1:9e9:1 has 9000000000 values, and a study has at most {MOST_CELLS} cells; give a "
     "larger step."),
    (lambda at: align("parked", overrides=['imu.rotation.type="continuous"']),
     "the scenario parked has [imu.rotation]; the alignment uses the mean measurements of an IMU that does not rotate "
     "in the vehicle. Remove the table."),
    (lambda at: initial_state(determine([0.0, 0.0, -7.2921151e-5], [0.0, 0.0, -9.83]), 0.0, 0.0),
     "navigation cannot start: heading not determined. The heading is not determined: at latitude 90.000 deg the "
     "Earth's rate has no horizontal part."),
    (lambda at: route_pole((0.5, 0.2, 0.5, 0.2), 0.0, 0.0, np.zeros(3)),
     "route = (0.5, 0.2, 0.5, 0.2): A and B coincide or are antipodal; they determine no great circle."),
    (lambda at: items_of(written(at, "other", "").parent),
     "the folder 'AT' has none of the folders algorithms, frames, aiding, filters, legs, formats, writers, views, "
     "grades or aircraft with a file in it"),
    (lambda at: sweep("parked", ["ensemble.runs=2,3"]),
     "parked: --vary ensemble.runs: the key 'ensemble.runs' cannot be varied: every ensemble has the number of runs "
     "of the study."),
    (lambda at: sweep("parked", ["imu.rate_hz=2,3"], ["imu.rate_hz=5"]),
     "parked: --vary imu.rate_hz: the key 'imu.rate_hz' is fixed by set = [\"imu.rate_hz=…\"], too: fix it, or vary "
     "it."),
    (lambda at: sweep("parked", ["imu.rate_hz=2,3", "imu.rate_hz=4,5"]),
     "parked: --vary imu.rate_hz: the key 'imu.rate_hz' is varied by --vary imu.rate_hz, too ('imu.rate_hz'); give "
     "each key once."),
    (lambda at: numbers("x", np.zeros((1,) * 33)),
     "x is not an array of numbers: it has 33 axes, more than 32."),
    (lambda at: numbers("x", [True, False]), "x is not an array of numbers: it holds true and false."),
    (lambda at: numbers("x", [1.0, None]), "x is not an array of numbers: a value is None or text."),
    (lambda at: numbers("x", "12"), "x = '12' is not an array of numbers: it holds text."),
    (lambda at: read_file(written(at, "a.csv", FLYSIGHT.replace("sAcc", "other"))),
     "AT/a.csv: $COL,GNSS has no column sAcc."),
    (lambda at: read_file(written(at, "b.csv", FLYSIGHT.replace("81.75", "high"))),
     "AT/b.csv: the column hMSL of GNSS: could not convert string to float: 'high'."),
    (lambda at: rotation.quaternion_from_euler("x", 0.0, 0.0), "roll = 'x' is not an array of numbers: it holds text."),
    (lambda at: rotation.quaternion_from_euler(0.0, "x", 0.0),
     "pitch = 'x' is not an array of numbers: it holds text."),
    (lambda at: rotation.quaternion_from_euler(0.0, 0.0, "x"),
     "heading = 'x' is not an array of numbers: it holds text."),
    (lambda at: rotation.rotate(np.zeros((2, 3)), np.zeros(3)),
     "expected an array with 4 values in its last axis, got shape (2, 3)."),
    (lambda at: rotation.normalize(np.zeros((5, 3))),
     "a quaternion needs 4 values in its last axis, not the shape (5, 3)."),
    (lambda at: rotation.quaternion_from_dcm(np.zeros((3, 4))),
     "a direction cosine matrix needs the shape (3, 3) in its last axes, not (3, 4)."),
    (lambda at: key(-1), "the seed -1 cannot be used; it must be a whole number from 0 to 2⁶⁴ − 1."),
    (lambda at: detuning(NONE, 0.0, -5.0), "thermal_speed = -5.0 m/s must be positive."),
    (lambda at: path_change(NONE, 1.0, 1.0, 1.5),
     "control = 1.5, the fraction that path-length control removes, must lie between 0 and 1."),
    (lambda at: omitted_triad("gyro", correlation_time=-2.0), "gyro correlation_time = -2.0 s must be greater than 0."),
    (lambda at: omitted_triad("gyro", random_walk=-2.0), "gyro random_walk = -2.0 (SI) must be at least 0."),
    (lambda at: omitted_triad("gyro", scale=np.array([0.0, -1.0, 0.0])),
     "gyro scale = [0.0, -1.0, 0.0] must be greater than −1 (a reading of zero)."),
    (lambda at: omitted_triad("accelerometer", g_sensitivity=np.eye(3)),
     "accelerometer g_sensitivity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] (SI) must be zero; it is an "
     "error of gyros."),
    (lambda at: _initial([START, START, START], 2),
     "a batch needs one initial state, or one for each of 2 runs; there are 3."),
    (lambda at: _check_regular(Attitude(np.zeros(2), np.zeros(2), np.zeros(2)), np.radians([50.0, 89.96])),
     "the latitude is 89.9600 deg (element [1]): at a pole the heading is undefined and the first-order error theory "
     "does not hold; stay at least 0.05 deg away."),
    (lambda at: _check_regular(Attitude(np.zeros(()), np.zeros(()), np.radians(-90.0)), np.zeros(())),
     "the pitch is -90.0000 deg: with a vertical axis heading and roll are undefined and the first-order error theory "
     "does not hold; stay at least 0.05 deg away."),
    (lambda at: Block("gyro bias", np.array([1.0, -2.0, 3.0])),
     "block 'gyro bias': sigma = [ 1. -2.  3.] must be finite and not negative."),
    (lambda at: Block("gyro bias", 1.0, correlation_time=-5.0),
     "block 'gyro bias': correlation_time = -5.0 s must be positive."),
    (lambda at: InstrumentErrors(np.ones((2, 4)), 1.0, 1.0, 1.0),
     "gyro_bias has shape (2, 4); give one number, or (..., 3) forward-right-down."),
    (lambda at: RotationTable([Dwell(3.0), Turn((0.0, 0.0, 1.0), 1.0, -2.0, 1.0)]),
     "step 2 of the rotation table: its rate of -2.0 rad/s must be positive and finite."),
    (lambda at: RotationTable([Turn((0.0, 0.0, 0.0), 1.0, 2.0, 1.0)]),
     "step 1 of the rotation table: its axis (0.0, 0.0, 0.0) must have three finite numbers, not all zero."),
    (lambda at: RotationTable([Turn((0.0, 0.0, 1.0), np.radians(30.0), np.radians(20.0), 2.0)]),
     "step 1 of the rotation table: a turn by 30° never reaches 20°/s with ramps of 2 s; use a ramp of at most 1.5 s "
     "or a lower rate."),
    (lambda at: parse_requirement("r95(3 weeks) <= 1 m"),
     "requirement 'r95(3 weeks) <= 1 m': (3 weeks) needs a unit of time, one of s, min, h; write it like "
     """"r95(3600 s) <= 1852 m"."""),
    (lambda at: threshold(1.5, 3), "false_alarm = 1.5 must be a probability between 0 and 1."),
    (lambda at: threshold(0.1, 0), "freedom = 0 must be at least 1: three sensors have no redundancy."),
    (lambda at: read_file(written(at, "a.gpx", '<?xml version="1.0"?>\n<gpx>\n<trk>')),
     "AT/a.gpx, line 3: no element found; the file is not complete XML."),
    (lambda at: calibrate("parked"),
     "the scenario parked has no sequence to calibrate with: add [turntable], for example with sequence = "
     '"19-positions", or give the scenario calibration_table or calibration_systematic.'),
    (lambda at: fly(load_scenario("one_component")),
     "the scenario one_component has [one_component], a motion in a vertical plane without a position on the Earth: "
     "only `sinssim run` supports it. Give a scenario with [flight], [parked], [great_circle], [motion], "
     "[track] or [turntable]."),
    (lambda at: load_scenario("parked", ["imu.grade=laser-standrd"]),
     "parked: imu.grade: unknown IMU grade 'laser-standrd'. Did you mean 'laser-standard'? Known: "
     f"consumer, ideal, laser-navigation, laser-standard, mems-industrial, mems-tactical, tactical, and {PRODUCTS} "
     "products (`sinssim list grades`) (set from outside the file)."),
    (lambda at: parse_value("1 2", "--set a.b"),
     "--set a.b: '1 2' is not a TOML value. Valid are a number, true, a word, "
     '"text in quotes" or an array such as [1, 2, 3]; the shell may have removed quotes.'),
    (lambda at: _is_timed(written(at, "notes.rrd", "# notes")),
     "AT/notes.rrd is not a recording, or it is damaged (REASON)."),
    (lambda at: pace_of("fast"), "--pace fast must be a number, or max."),
    (lambda at: pace_of("-1"), "--pace -1 must be positive: 1 is the pace of the clock, max the fastest."),
]  # fmt: skip
ROW = "2024/05/01 10:00:0{} 50{} 8{} 100.0 1 9 0.1 0.1 0.1 0 0 0 0 1.5 1.0 2.0 3.0 0.1 0.1 0.1 0.0 0.0 0.0"
POS = (
    "% program : RTKPOST\n%  GPST          latitude({1}) longitude({1}) height(m)  Q ns sdn(m) sde(m) sdu(m) sdne(m) "
    "sdeu(m) sdun(m) age(s) ratio vn(m/s) ve(m/s) vu(m/s) sdvn sdve sdvu sdvne sdveu sdvun\n"
    + ROW.format(1, "{0}", "{0}") + "\n" + ROW.format(2, "{0}", "{0}").removesuffix(" 0.0") + "\n"
)  # fmt: skip
FLYSIGHT = (
    "$FLYS,1\n$COL,GNSS,time,lat,lon,hMSL,velN,velE,velD,hAcc,vAcc,sAcc,numSV\n$DATA\n"
    "$GNSS,2024-05-01T10:00:00.00Z,50.5,8.5,81.75,1.0,2.0,3.0,0.5,0.7,0.1,9\n"
    "$GNSS,2024-05-01T10:00:00.20Z,50.5,8.5,81.75,1.0,2.0,3.0,0.5,0.7,0.1,9\n"
)
START = NavState(0.5, 0.2, 100.0, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
SAMPLES = Samples("increments", np.arange(5.0, 9.0), {})
PLACE = (np.pi / 6.0, np.pi / 18.0)
KIND = Kind("results.json", (), "cells", "trade", "a", "trade study", "cell", "cells")


def omitted_triad(name: str, **fields: Any) -> None:
    _check_triad(TriadErrors(**fields), name)


def navigator(library: str | None = None, command: list[str] | None = None, file: Path | None = None) -> Any:
    """Return a scenario of one navigator of others."""
    one = SimpleNamespace(name="mine", library=library, command=command, file=file)
    return SimpleNamespace(navigator=(one,), use=())


def model(folder: Path, text: str) -> Path:
    """Write the definition of a model of an aircraft."""
    (folder / "made").mkdir()
    return written(folder / "made", "made.xml", text).parent


def aircraft(**changes: str) -> Any:
    return SimpleNamespace(model_changes=changes)


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


@pytest.mark.parametrize("number", range(len(MESSAGES)))
def test_a_message(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    call, text = MESSAGES[number]
    with pytest.raises(InputError) as error:
        call(tmp_path)
    told = str(error.value).replace(str(tmp_path), "AT")
    if "REASON" in text:  # that of a library
        begin, end = text.split("REASON")
        assert told.startswith(begin)
        assert told.endswith(end)
    else:
        assert told == text


def test_a_file_that_is_no_table() -> None:
    """A reason is told up to 300 characters, without what cannot be printed."""
    error = bad_row(Path("a.csv"), [], [3], ",", ValueError("bad\x07 " + "x" * 400 + "."), numbers=True)
    assert str(error) == f"a.csv cannot be read as numbers in columns: bad  {'x' * 295}."
    rows = [(4, ["1", "2", "3"]), (5, ["1", "2"])]
    assert str(bad_row(Path("a.csv"), rows, [3], ",", ValueError(), hint=", as its head says")) == (
        "a.csv, line 5: it has 2 fields; 3 separated by ',' are needed, as its head says."
    )
    assert str(bad_row(Path("a.csv"), [(7, ["1", "\0"])], [3], ",", ValueError())) == (
        "a.csv, line 7: this is not text, it has zero bytes."
    )


def test_directories_of_studies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In use by another process, of another study, begun already, and a disk that is full."""
    study: Any = SimpleNamespace(name="mine")
    folder, told = tmp_path / "study", list[str]()
    with StudyDirectory(folder, study) as directory:
        monkeypatch.setattr(directory, "free", lambda: 12.4)
        with (
            pytest.raises(InputError) as full,
            directory.writing("the report could not be written to", " All is kept."),
        ):
            raise OSError(28, "No space left on device")
        (folder / directory.KIND.manifest).write_text(json.dumps({"kind": directory.KIND.kind, "name": "other"}))
        told.append(str(full.value))
    for options in ({}, {"resume": True}):
        with pytest.raises(InputError) as error:
            StudyDirectory(folder, study, **options)
        told.append(str(error.value))
    monkeypatch.setattr(experiment_directory, "try_hold", lambda path: None)
    with pytest.raises(InputError) as error:
        StudyDirectory(tmp_path / "busy", study)
    told.append(str(error.value))
    assert [text.replace(str(tmp_path), "AT") for text in told] == [
        "the report could not be written to AT/study: No space left on device (12 MB are free). All is kept.",
        "AT/study already holds a study. Continue or extend it with --resume, give another folder with -o, or replace "
        "it with --overwrite.",
        "the study in AT/study cannot be continued: it is the study other, not mine. It stays unchanged; give another "
        "folder with -o, or replace it with --overwrite.",
        "another process is computing the study in AT/busy; wait for it, or give another -o.",
    ]


def test_a_frame_without_its_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    entries = {"mine": SimpleNamespace(file="my_file"), "level": SimpleNamespace(file="level")}
    monkeypatch.setattr(functional_iteration, "FRAME_REGISTRY", entries)
    monkeypatch.setattr(functional_iteration, "frames_that", lambda able: [n for n, e in entries.items() if able(e)])
    with pytest.raises(InputError) as error:
        functional_iteration.engine("mine")
    assert str(error.value) == (
        "functional-iteration has its own engine for each frame, but none for mine; it can be used in the frames "
        "level. All other algorithms navigate in mine."
    )


def test_what_a_claim_lacks() -> None:
    assert gyro_free(Evidence([])).reason == (
        "The study lacks the numbers that decide it: a block of six accelerometers with errors, tilted by less than 5° "
        "for more than one and a half Schuler periods."
    )
