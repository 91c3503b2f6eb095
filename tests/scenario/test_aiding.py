"""[aiding] and [filter]: what is right loads, what is wrong is named with its place and its remedy."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sinssim.errors import InputError
from sinssim.scenario import load_scenario
from sinssim.scenario.notes import times_not_reached
from sinssim.scenario.plan_summary import plan_lines
from sinssim.strapdown.frames import FRAMES

TEXT = """\
name = "aided"

[parked]
latitude_deg = 56.0
duration_s = 200.0

[aiding.gnss]
rate_hz = 2.0
outages_s = [[50.0, 100.0], [150.0, 160.0]]
lever_arm_m = [1.0, 0.0, -0.5]

[[aiding.gnss.jumps]]
from_s = 20.0
to_s = 30.0
north_m = 40.0

[[aiding.gnss.ramps]]
from_s = 120.0
east_mps = 0.5

[aiding.baro]
bias_sigma_m = 5.0

[filter]
states = ["gyro bias", "accelerometer bias", "gyro scale"]
smooth = true
"""


def write(folder: Path, text: str) -> Path:
    file = folder / "plan.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_values_arrive_as_written(tmp_path: Path) -> None:
    scenario = load_scenario(write(tmp_path, TEXT), ["aiding.gnss.ramps.1.east_mps=0.25"])
    assert scenario.aiding is not None
    assert scenario.filter is not None
    gnss = scenario.aiding.gnss
    assert gnss is not None
    assert gnss.outages_s == ((50.0, 100.0), (150.0, 160.0))
    assert gnss.jumps[0].north_m == 40.0
    assert gnss.ramps[0].to_s is None
    assert gnss.ramps[0].east_mps == 0.25
    assert scenario.aiding.magnetometer is None
    assert scenario.filter.loop == "closed"
    again = tmp_path / "again.toml"
    again.write_text(scenario.to_toml(), encoding="utf-8")
    assert load_scenario(again) == scenario


def test_plan_names_sensors_and_filter(tmp_path: Path) -> None:
    plan = "\n".join(plan_lines(load_scenario(write(tmp_path, TEXT))))
    assert "aiding      gnss, 2 Hz; outages_s = [[50, 100], [150, 160]]" in plan
    assert "aiding      baro, 1 Hz; bias_sigma_m = 5" in plan
    assert "filter      gyro bias, accelerometer bias, gyro scale; smooth = True" in plan


def test_what_never_happens_is_said(tmp_path: Path) -> None:
    late = TEXT.replace("from_s = 120.0", "from_s = 700.0").replace("[150.0, 160.0]", "[200.0, 260.0]")
    late = late.replace("bias_sigma_m = 5.0", "latency_s = 300.0")
    notes = [line for line in plan_lines(load_scenario(write(tmp_path, late))) if line.startswith("note")]
    assert notes == [
        "note        aiding.gnss.outages_s.2 begins at 200 s, but the run ends at 200 s: it has no effect.",
        "note        aiding.gnss.ramps.1 begins at 700 s, but the run ends at 200 s: it has no effect.",
        "note        aiding.baro.latency_s = 300: no measurement arrives before the end of the run at 200 s.",
    ]
    (note,) = times_not_reached(load_scenario(write(tmp_path, TEXT + "alignment_s = 199.0\n")), 198.0)
    assert note == "filter.alignment_s = 199: the alignment takes longer than the run, which ends at 198 s."
    stop = TEXT + "\n[aiding.zero_velocity]\nduring_s = [[10.0, 20.0], [250.0, 300.0]]\n"
    (note,) = times_not_reached(load_scenario(write(tmp_path, stop)), 199.0)
    assert note.startswith("aiding.zero_velocity.during_s.2 begins at 250 s, but the run ends at 199 s")


@pytest.mark.parametrize(
    ("old", "new", "below", "said"),
    [
        ("outages_s = [[50.0, 100.0]", "outages_s = [[100.0, 50.0]", 0, "from 100 s to 50 s must end after"),
        ("[[50.0, 100.0], [150.0, 160.0]]", "[[50.0, 100.0], 150.0]", 0, "aiding.gnss.outages_s.2 must be an array"),
        ("outages_s", "outage_s", 0, "Did you mean 'aiding.gnss.outages_s'?"),
        ("to_s = 30.0", "to_s = 10.0", -2, "the interval from 20 s to 10 s must end after"),
        ("from_s = 120.0\n", "", -1, "aiding.gnss.ramps.1.from_s is missing (time at which the fault begins)"),
        ("lever_arm_m", "lever_arm_ft", 0, "the unit is part of the name, use 'lever_arm_m'"),
        ("lever_arm_m =", "position_m = 3.0\nlever_arm_m =", 0, "position_m'. Did you mean 'aiding.gnss.position'?"),
        ("lever_arm_m =", "latency_ms = 200.0\nlever_arm_m =", 0, "use 'latency_s' (latency_s = 0.2)"),
        ("lever_arm_m =", "position_sigma_m = 0.0\nlever_arm_m =", 0, "position_sigma_m = 0.0 must be at least 1e-12"),
        ("lever_arm_m =", "latency_s = -0.1\nlever_arm_m =", 0, "latency_s = -0.1 must be at least 0"),
        ("rate_hz = 2.0", "position = false\nvelocity = false", 0, "leave no measurement"),
        ("[aiding.baro]", "[aiding.barro]", 0, "unknown key 'aiding.barro'. Did you mean 'aiding.baro'?"),
        ('"gyro scale"', '"gyro bias"', 0, "'gyro bias' stands 2 times; give each block once"),
        ('"gyro scale"', '"gyro scal"', 0, "unknown block of states 'gyro scal'. Did you mean 'gyro scale'? Known:"),
        ("smooth = true", "smoth = true", 0, "Did you mean 'filter.smooth'?"),
        ("smooth = true", 'loop = "close"', 0, "filter.loop = 'close' is not known. Did you mean 'closed'?"),
        ("smooth = true", "gate = 1.0", 0, "filter.gate = 1.0 must be less than 1"),
        ("smooth = true", "measurement_noise_factor = 0.0", 0, "must be at least 0.001"),
        ("smooth = true", "inertial_noise_factor = 1e9", 0, "must be at most 1000"),
        ("smooth = true", "inertial_noise_factor = nan", 0, "must be a finite number, not nan"),
        ("smooth = true", "[filter.initial_sigma]\ntilt_arcmin = 1e5", 1, "must be at most 10800"),
        ("smooth = true", "[filter.initial_sigma]\nposition_m = 1e-9", 1, "must be at least 1e-06"),
        ("smooth = true", "rate_hz = 0.01", 0, "filter.rate_hz = 0.01 must be at least 1"),
        ("north_m = 40.0", "", -3, "north_m, east_m, up_m are all 0: give at least one of them"),
        ("east_mps = 0.5", "to_s = 130.0", -2, "north_mps, east_mps, up_mps are all 0: give at least one of them"),
        ("[1.0, 0.0, -0.5]", "[1e6, 0.0, 0.0]", 0, "aiding.gnss.lever_arm_m.1 = 1000000.0 must be at most 1000"),
        ("bias_sigma_m = 5.0", "[aiding.star_tracker]\nsigma_arcsec = [5.0, 5.0, 0.0]", 1, "must be at least 1e-12"),
        ('["gyro bias", "accelerometer bias", "gyro scale"]', '"gyro bias"', 0, 'must be an array, like ["gyro bias"]'),
        ('"gyro scale"', '"position"', 0, "every filter has the state 'position'"),
        ("smooth = true", 'alignment = "in-motion"', 0, 'alignment = "in-motion" needs alignment_s: a minute or two'),
        (
            "smooth = true", 'alignment = "in-motion"\nalignment_s = 30.0', 1,
            "alignment_s = 30 must be at least 45 for an alignment in motion",
        ),
        ("smooth = true", 'alignment = "moving"', 0, "filter.alignment = 'moving' is not known"),
    ],
)  # fmt: skip
def test_mistake(tmp_path: Path, old: str, new: str, below: int, said: str) -> None:
    line = TEXT[: TEXT.index(old)].count("\n") + 1 + below
    with pytest.raises(InputError) as caught:
        load_scenario(write(tmp_path, TEXT.replace(old, new, 1)))
    message = str(caught.value)
    assert said in message
    assert f"plan.toml, line {line}" in message
    assert "\n" not in message


def test_a_monitor_has_fixes_to_watch() -> None:
    with pytest.raises(
        InputError, match=r"filter\.monitor_s = 300 watches the innovations of GNSS, which this scenario"
    ):
        load_scenario("gyrocompassing", ["filter.monitor_s=300"])
    for name in ("spoofed", "drive"):  # simulated and recorded fixes
        assert load_scenario(name, ["filter.monitor_s=300"]).filter.monitor_s == 300.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (TEXT[: TEXT.index("[filter]")], "[aiding] needs a [filter] that uses it"),
        (TEXT[: TEXT.index("[aiding.gnss]")] + TEXT[TEXT.index("[filter]") :], "[filter] needs an aiding sensor"),
        (
            TEXT + '\n[imu.sensor_set]\ntype = "accelerometers"\narm_m = 1.0\n',
            "[filter] needs gyros and accelerometers",
        ),
        (
            TEXT[: TEXT.index("[aiding.gnss]")] + "[aiding]\n" + TEXT[TEXT.index("[filter]") :],
            "it has no sensor; give one or more of the tables gnss, baro, magnetometer, airspeed, odometer",
        ),
        (
            TEXT.replace("rate_hz = 2.0", "velocity = false") + 'alignment = "in-motion"\nalignment_s = 60.0\n',
            'filter.alignment = "in-motion" needs [aiding.gnss] with position and velocity',
        ),
        (TEXT + "[imu]\nrate_hz = 1.0\n", "aiding.gnss.rate_hz = 2 must be at most imu.rate_hz = 1"),
        (TEXT + "alignment_s = 200.0\n", "filter.alignment_s = 200 must be less than duration_s = 200"),
        (TEXT + '\n[aiding.master]\ngrade = "tacticle"\n', "Did you mean 'tactical'?"),
    ],
)
def test_tables_that_do_not_go_together(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        load_scenario(write(tmp_path, text))
    assert said in str(caught.value)


@pytest.mark.parametrize(
    "section",
    [
        *(f'frame = "{frame}"' for frame in FRAMES),
        'ellipsoid = "chapter"',
        'curvature = "simplified"',
        "rates_hz = [100.0, 50.0, 10.0]",
        'algorithms = ["euler"]',
        'algorithms = ["rotation-vector-3"]',
        'frame = "transverse"\nroute_deg = [48.0, 11.0, 49.0, 12.0]',
    ],
)
def test_the_filter_navigates_as_the_section_says(tmp_path: Path, section: str) -> None:
    scenario = load_scenario(write(tmp_path, f"{TEXT}\n[navigation]\n{section}\n"))
    assert scenario.filter is not None


def test_what_a_filter_cannot_correct_is_refused(tmp_path: Path) -> None:
    """By name, with what is right; beside the filter, or without one, it is right."""
    text = f'{TEXT}\n[navigation]\nalgorithms = ["functional-iteration", "quaternion"]\n'
    said = (
        "navigation.algorithms = ['functional-iteration', 'quaternion']: [filter] navigates by the first of them, and "
        "functional-iteration processes windows of samples"
    )
    with pytest.raises(InputError, match=re.escape(said)):
        load_scenario(write(tmp_path, text))
    behind = text.replace('"functional-iteration", "quaternion"', '"quaternion", "functional-iteration"')
    assert load_scenario(write(tmp_path, behind)).filter is not None
    alone = text[: text.index("[aiding.gnss]")] + text[text.index("[navigation]") :]
    assert load_scenario(write(tmp_path, alone)).filter is None


def test_more_algorithms_beside_the_filter(tmp_path: Path) -> None:
    """The filter navigates by the first of them, and the others stay as they are."""
    text = TEXT + '\n[navigation]\nalgorithms = ["euler", "quaternion"]\nframe = "level"\n'
    assert load_scenario(write(tmp_path, text)).navigation.algorithms == ("euler", "quaternion")
