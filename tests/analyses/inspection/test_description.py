"""The suggested scenario, word by word and number by number, from an inspection whose numbers are written down here."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.inspection.quiet_spans import AtRest
from sinssim.analyses.inspection.stream_findings import doubt, fact
from sinssim.analyses.inspection.stream_inspection import Inspection
from sinssim.analyses.inspection.suggested_scenario import suggested_scenario
from sinssim.analyses.inspection.unit_axes import Mounting
from sinssim.data import ImuData
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream
from sinssim.sensors.aiding.standstill import learn_rest

GPS = Clock("gps", 1_400_000_000)
HERE = Path("/drives")


def _unit(time: np.ndarray | None = None) -> InertialStream:
    """Return a unit of 50 Hz from 100 s on, with 0.64 s missing after 110 s."""
    if time is None:
        time = np.concatenate([100.0 + 0.02 * np.arange(501), 110.66 + 0.02 * np.arange(401)])
    return InertialStream(time, np.zeros((len(time), 3)), np.zeros((len(time), 3)))


def _fixes(speed: float = 5.0, **other: Any) -> FixStream:
    """Return fixes every 0.5 s from 95 s on, that move along the course atan2(4, 3)."""
    time = 95.0 + 0.5 * np.arange(41)
    way = speed * (time - 95.0) / 6.37e6
    velocity = np.tile(speed * np.array((0.6, 0.8, 0.0)), (41, 1))
    quality = np.where(np.arange(41) < 11, 5, 4)
    given = FixStream(
        time, 0.8 + 0.6 * way, 0.2 + 0.8 * way / np.cos(0.8), np.full(41, 300.0), "mean sea level",
        velocity_ned=velocity, quality=quality, quality_words={4: "fixed", 5: "float"},
    )  # fmt: skip
    return replace(given, **other)


def _quiet(**other: Any) -> AtRest:
    # |(2, 6, 9)| = 11, so that the specific force is 9.83 m/s²
    return replace(
        AtRest(
            [(100.5, 102.0), (103.3, 111.5)],
            np.ones(902, dtype=bool),
            np.array([2.0, -6.0, 9.0]) * 9.83 / 11.0,
            np.array([1e-5, -7e-5, 2e-5]),
            np.array([3e-5, 2e-5, 5e-5]),
            np.array([2e-3, 3e-3, 1e-3]),
            np.array([[0.0, 9e-5, 4e-5], [0.0, 0.0, 0.0]]),
        ),
        **other,
    )


def _found(**other: Any) -> Inspection:
    shakes = doubt("vibration", "It shakes.", "Increase the noise.")
    gravity = fact("accelerometers", "Gravity.", specific_force_mps2=9.83, of_gravity=1.002)
    codes = fact("fixes", "Quality.", codes={4: 30, 5: 11})
    steps = fact("fixes", "Steps.", step_sigma_m=3.3)
    against = doubt("fixes", "Steps contradict.", "Refuse them.", doubtful_codes=[5])
    named = Mounting(("backward", "left", "down"), np.radians((1.25, -2.5, 3.75)), np.radians((0.1, 0.2)), windows=7)
    result = Inspection([codes, steps, against, gravity, shakes], _unit(), _fixes(), _quiet(), residual=0.25)
    result.offset, result.late, result.drift = 7.25, 0.3, 3.456e-5
    result.velocity_delay, result.mounting = 0.125, named
    for name, value in other.items():
        setattr(result, name, value)
    return result


def _told(
    result: Inspection, clock: Clock = GPS, receiver: Clock | None = GPS, *, land: bool = False, **keys: Any
) -> str:
    fixes = None if receiver is None else (HERE / "gnss.pos", {"format": "rtklib-pos"}, receiver)
    return suggested_scenario(result, (HERE / "My log-2.csv", keys, clock), fixes, HERE, land=land)


_WHOLE = r"""name = "my_log_2"
description = "Recorded by My log-2.csv"

[log]
from_s = 2.250  # first fix, which gives the initial position

[log.imu]
file = "My log-2.csv"
format = "text"
time = 3
delimiter = "\t"
held = true
axes = ["backward", "left", "down"]  # from the direction of motion and gravity
clock_drift_ppm = 34.6  # match with the fixes, over the whole log
time_offset_s = -0.3  # the unit's stamps are late
max_gap_s = 0.65  # the longest gap, which is bridged with more noise

[log.imu.gyro]
columns = ["w x", 7]
unit = "deg/s"
rows = { "kind" = "a \"b\"" }

[log.gnss]
file = "gnss.pos"
format = "rtklib-pos"
velocity_delay_s = 0.125  # velocities are older than positions
geoid_height_m = 47.3  # the geoid's height there (EGM2008), the heights are above mean sea level
position_sigma_m = [2.33, 2.33, 4.67]  # from the steps
velocity_sigma_mps = [0.25, 0.25, 0.5]  # from the match with the inertial data
quality_factors = { "4" = 1.0 }  # steps of the position contradict the σ of the other codes

[imu]  # description of the IMU for the filter
mounting_deg = [1.25, -2.50, 3.75]  # if the vehicle moves where it points
grade = "mems-industrial"  # nearest in noise; the lines below replace its own
gyro_arw_deg_sqrt_h = 0.0688  # of the calmest axis in quiet spans
accel_vrw_ug_sqrt_hz = 102  # of the calmest axis in quiet spans
gyro_bias_sigma_deg_h = 18.6  # size of the measurements at rest
accel_bias_sigma_ug = 2001  # as large as the departure from gravity at rest
gyro_instability_deg_h = 0.0  # the grade's in-run stability is a floor of the Allan deviation:
gyro_flicker_deg_h = 2  # flicker, which makes the bias wander within minutes

[filter]
vibration_noise = 0.4  # the inertial data vibrate more in motion than at rest
smooth = true

[aiding.land_vehicle]
rate_hz = 5.0
sigma_lateral_mps = 0.05  # tyres and suspension, independent from update to update
sigma_vertical_mps = 0.1
drift_lateral_mps = 0.02  # camber and wind, for seconds
drift_vertical_mps = 0.05  # the body pitches on its suspension
mounting_sigma_deg = 2.0
lever_arm_sigma_m = 1.0
slip_sigma_deg_per_g = 3.0

[aiding.zero_velocity]
detect = true
learn_s = [[3.3, 11.5]]
rate_hz = 10.0

[aiding.zero_rate]
detect = true
learn_s = [[3.3, 11.5]]
rate_hz = 10.0
"""


def test_the_whole_scenario_of_a_drive() -> None:
    """Every line of it follows from the numbers above.

    The first fix is at 95 + 7.25 − 100 s. The gap of 0.66 s lacks 0.64 s, written in twentieths. The steps have the
    errors of two fixes, 3.3/√2 = 2.33 m. The calmest axes have 2e-5 rad/√s and 1e-3 m/s/√s; 2e-5 lies nearest to 0.1
    °/√h. What a resolution hides counts in place of a smaller mean rate, 9e-5 rad/s. Gravity is 9.83/1.002 m/s², which
    9.83 exceeds by 2001 µg. The first stop that lasts 6 s after the first fix begins at 103.3 s.
    """
    gyro = {"columns": ["w x", 7], "unit": "deg/s", "rows": {"kind": 'a "b"'}}
    keys = {"format": "text", "time": 3, "delimiter": "\t", "held": True, "gyro": gyro}
    assert _told(_found(), land=True, **keys) == _WHOLE


def test_without_wheels_the_tables_are_comments() -> None:
    text = _told(_found())
    begin = text.index("# For a land vehicle (--vehicle land), see docs/estimation.md:")
    tables = _WHOLE[_WHOLE.index("[aiding.land") :].splitlines()
    assert text[begin:].splitlines() == [
        "# For a land vehicle (--vehicle land), see docs/estimation.md:",
        "",
        *(f"# {line}" if line else "" for line in tables),
    ]
    assert "aiding" not in tomllib.loads(text)


def _imu(result: Inspection) -> list[str]:
    lines = _told(result).splitlines()
    begin = lines.index("[imu]  # description of the IMU for the filter")
    return lines[begin + 2 : lines.index("[filter]") - 1]  # without the mounting


def test_a_calm_unit_has_the_worst_axes_and_the_least_biases() -> None:
    """5e-5 rad/√s are 0.172 °/√h, 3e-3 m/s/√s 305.9 µg/√Hz; a filter needs 0.01 °/h and 100 µg at least."""
    still = _quiet(
        rate=np.array([1e-9, 2e-9, -3e-9]), hidden=np.zeros((2, 3)), gyro_density=np.array([6e-7, 5e-7, 4.5e-5]),
        specific_force=np.array([2.0, -6.0, 9.0]) * 9.8103 / 11.0,
    )  # fmt: skip
    calm = _found(quiet=still, findings=[f for f in _found().findings if f.subject != "vibration"])
    assert _imu(calm) == [
        # the calmest axis, 5e-7 rad/√s, lies nearest to 0.002 °/√h, whose grade has no floor
        'grade = "laser-navigation"  # nearest in noise; the lines below replace its own',
        "gyro_arw_deg_sqrt_h = 0.155  # of the worst axis in quiet spans",
        "accel_vrw_ug_sqrt_hz = 305.9  # of the worst axis in quiet spans",
        "gyro_bias_sigma_deg_h = 0.01  # size of the measurements at rest",
        "accel_bias_sigma_ug = 100  # as large as the departure from gravity at rest",
    ]
    assert "vibration_noise" not in _told(calm)


def test_noise_without_rest_is_that_of_motion() -> None:
    """1.2e-4 rad/√s are 0.413 °/√h, nearest to 0.2 °/√h; 0.02 m/s/√s are 2039 µg/√Hz."""
    fast = np.array([1.2e-4, 3e-5, 7e-5]), np.array([0.01, 0.02, 0.005])
    assert _imu(_found(quiet=None, fast=fast)) == [
        'grade = "consumer"  # which is it? nearest in noise, with motion in it: no span is at rest',
        "gyro_arw_deg_sqrt_h = 0.413  # what changes from sample to sample in motion",
        "accel_vrw_ug_sqrt_hz = 2039  # the same",
    ]
    (first, *_) = _imu(_found(fast=fast, residual=None))
    assert first.endswith("with motion in it: nothing shows how much of the shaking is an error")
    # what the unit reads at rest is known all the same: 0.02 rad/s, and 10 − 9.83/1.002 m/s²
    turned = _quiet(rate=np.array([0.0, -0.02, 0.0]), specific_force=np.array([2.0, -6.0, 9.0]) * 10.0 / 11.0)
    assert _imu(_found(fast=fast, residual=None, quiet=turned))[3:] == [
        "gyro_bias_sigma_deg_h = 4.13e+03  # size of the measurements at rest",
        "accel_bias_sigma_ug = 1.934e+04  # the same",
    ]
    nearest = 'grade = "mems-industrial"  # which is it? give the nearest of `sinssim list grades`'
    assert _imu(_found(quiet=None)) == [nearest]


def _of_gnss(result: Inspection) -> list[str]:
    """Return the lines of [log.gnss] on σ and quality."""
    return [line for line in _told(result).splitlines() if line.startswith(("position_s", "velocity_s", "quality"))]


@pytest.mark.parametrize(
    ("words", "step", "line"),
    [
        ({4: "fixed", 5: "fixed"}, 0.02, "[0.02, 0.02, 0.04]  # assumed for fixed ambiguities"),
        ({4: "fixed", 5: "float"}, 2.8, "[2.0, 2.0, 4.0]  # assumed for code positions"),
        ({4: "fixed", 5: "fixed"}, 0.06, "[0.04, 0.04, 0.08]  # from the steps"),
    ],
)
def test_sigmas_are_those_of_the_kind_of_receiver(words: dict[int, str], step: float, line: str) -> None:
    """A step below √2 times the 1σ shows no more than the 1σ; one of 0.06 m is that of two fixes of 0.042 m."""
    fixes = _fixes(quality_words=words)
    result = _found(fixes=fixes, residual=0.09, findings=[fact("fixes", "Steps.", step_sigma_m=step)])
    why = "" if "steps" in line else ": the file has no σ, see the data sheet"
    assert _of_gnss(result) == [
        f"position_sigma_m = {line}{why}",
        "velocity_sigma_mps = [0.1, 0.1, 0.2]  # assumed: the file has no σ",
    ]
    given = replace(fixes, position_sigma=np.ones((41, 3)), velocity_sigma=np.ones((41, 3)))
    assert _of_gnss(_found(fixes=given, findings=[])) == []
    assert _of_gnss(_found(fixes=replace(fixes, velocity_ned=None), findings=[]))[1:] == []


def test_the_run_begins_after_wrong_first_fixes() -> None:
    """A first fix at 95 + 5.5 − 100 s is early enough for a start, unless wrong fixes come before it."""
    assert "from_s" not in _told(_found(offset=5.5))
    assert "from_s = 0.500  # first fix" in _told(_found(offset=5.5, sound=(95.0, 115.0)))


def test_clocks_without_a_common_origin() -> None:
    """1 400 000 000 s of GPS time are 2024-05-17 16:53:20; the first row is 100 − 7.25 s later."""
    text = _told(_found(), Clock("machine"))
    assert 'first_row = "2024-05-17 16:54:52.750"  # GPS time by the match with the fixes\n' in text
    unknown = _told(_found(offset=None), Clock("machine"))
    assert '# first_row = "2026-01-01 00:00:00.000"  # which was the GPS time of the first row?\n' in unknown
    early = _told(_found(late=-0.0456))
    assert "time_offset_s = 0.046  # the unit's stamps are early\n" in early
    assert "time_offset_s" not in _told(_found(late=0.0009))
    assert "velocity_delay_s" not in _told(_found(velocity_delay=-0.0009))


def _start(result: Inspection) -> list[str]:
    lines = _told(result).splitlines()
    return lines[lines.index("[log.start]") + 1 : lines.index("[imu]  # description of the IMU for the filter") - 1]


def _pointing(heading_deg: float) -> Any:
    """Return an attitude by the match, of the unit, with the 1σ of 2.5°, which changes by a degree each second."""
    return lambda t: (np.radians((0.7, -1.2, heading_deg + (t - 102.25))), np.radians(2.5))


def test_the_start_of_a_vehicle_that_points_elsewhere() -> None:
    """The course is 53.13°. A heading 31.6° off is beyond three times √(2.5² + 10²) = 10.3°, one 30.5° off is not.

    The course is that of the first fix, which is the first instant of the run.
    """
    straight = Mounting(("forward", "right", "down"), np.zeros(3), np.radians((0.1, 0.2)), windows=7)
    course = float(np.degrees(np.arctan2(4.0, 3.0)))
    assert _start(_found(mounting=straight, attitude=_pointing(course + 31.6))) == [
        "roll_deg = 0.70",
        "pitch_deg = -1.20",
        "heading_deg = 84.7  # by the match with the fixes, ± 2.5°: the vehicle does not point along its first course",
    ]
    assert "[log.start]" not in _told(_found(mounting=straight, attitude=_pointing(course + 30.5)))
    assert _start(_found(mounting=None, attitude=_pointing(-20.0))) == [
        "roll_deg = 0.70",
        "pitch_deg = -1.20",
        "heading_deg = 340.0  # by the match with the fixes, ± 2.5°: the mounting is not known",
    ]


def test_the_start_is_a_question_where_nothing_shows_it() -> None:
    still = _fixes(0.0)
    assert _start(_found(fixes=still)) == [
        "heading_deg = 0.0  # which is it? The fixes do not move, and show no course"
    ]
    text = _told(_found(fixes=still))
    assert "[filter.initial_sigma]\nheading_arcmin = 5400.0  # 90°: the fixes show no course\n" in text
    question = (
        "# heading_deg = 0.0  # does x of the unit point forward? The course of the fixes is taken as its heading"
    )
    assert _start(_found(mounting=None)) == [question]
    alone = _told(_found(fixes=None, offset=None, mounting=None), receiver=None)
    asked = [f"# {key} = 0.0" for key in ("latitude_deg", "longitude_deg", "height_m", "heading_deg")]
    begin = alone.index("[log.start]")
    assert alone[begin:].splitlines()[:5] == ["[log.start]  # which are they? A run needs them", *asked]
    assert "[filter]" not in alone


def test_the_noise_at_rest_is_learned_from_a_stop_that_is_long_enough() -> None:
    """A run needs windows of 5 s in all; a second more leaves room for the digits and for windows of slow samples."""
    text = _told(_found(quiet=_quiet(spans=[(103.36, 109.24), (110.16, 116.24)])), land=True)
    (begin, end), *_ = tomllib.loads(text)["aiding"]["zero_velocity"]["learn_s"]
    assert (begin, end) == (10.2, 16.2)
    imu = ImuData(time := np.arange(400) / 17.0, np.full((399, 3), 1e-3), np.full((399, 3), 2e-3))
    assert learn_rest(imu, spans=[(begin + 0.05, end - 0.05)]).seconds > 5.0
    assert time[-1] > end
    assert "# no zero velocities: there is no stop" in _told(_found(quiet=_quiet(spans=[(103.36, 109.24)])))


def test_a_gap_that_cannot_be_bridged_bounds_the_run() -> None:
    """Parts from 100 to 104 s, 115 to 121 s and 140 to 142 s: the second one is the longest."""
    parts = [begin + 0.02 * np.arange(50 * length + 1) for begin, length in ((100.0, 4), (115.0, 6), (140.0, 2))]
    result = _found(inertial=_unit(np.concatenate(parts)), quiet=None)
    assert _told(result).splitlines()[3:7] == [
        "[log]",
        "from_s = 15.000  # longest part without a gap of more than 10 s",
        "to_s = 21.000  # a gap of more than 10 s follows",
        "",
    ]
    text = _told(result)
    assert "max_gap_s" not in text
    assert "# no zero velocities: there is no stop of 6 s or more, which shows the noise at rest" in text


def test_a_scale_far_from_gravity_and_slow_samples() -> None:
    far = [fact("accelerometers", "Far.", specific_force_mps2=15.2, of_gravity=1.55)]
    line = "check_scale = false  # the specific force is far from gravity: is that the motion?\n"
    assert line in _told(_found(findings=far))
    assert line not in _told(_found(findings=[fact("a", "b", specific_force_mps2=1.0, of_gravity=1.45)]))
    assert line in _told(_found(findings=[fact("a", "b", specific_force_mps2=1.0, of_gravity=0.69)]))
    slow = _told(_found(inertial=_unit(100.0 + 0.07 * np.arange(300)), quiet=None))
    few = "# the nonholonomic constraint and the detection of stops need at least 8 samples in half a second"
    assert few in slow
    assert few not in _told(_found(inertial=_unit(100.0 + 0.06 * np.arange(300)), quiet=None))


def test_a_reference_in_place_of_fixes() -> None:
    """A reference gives the start, from two samples after its first instant on; satellites are simulated from it."""
    reference = (HERE / "runs" / "solution.txt", "sbet", GPS)
    log = (HERE / "imu.csv", {"format": "text"}, GPS)
    lines = suggested_scenario(_found(), log, None, HERE, reference).splitlines()
    late = 2.25 + 2.0 * (118.66 - 100.0) / 901  # the mean interval
    assert lines[3:5] == ["[log]", f"from_s = {late:.3f}  # the reference gives the initial state"]
    begin = next(k for k, line in enumerate(lines) if line.startswith("[log.reference]"))
    assert lines[begin : begin + 3] == [
        "[log.reference]  # its attitude is taken as that of the vehicle; mounting_deg transforms it to the IMU",
        'file = "runs/solution.txt"',
        'format = "sbet"',
    ]
    assert lines[-1] == "[aiding.gnss]  # simulated from the reference: the files contain no fixes"
    assert not any(line.startswith("[log.start]") for line in lines)
