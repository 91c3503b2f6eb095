"""What an inspection changes in a scenario, from findings written by hand."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.inspection.log_corrections import (
    _of_clocks,
    _placed,
    bridges,
    changes,
    clock_keys,
    corrected_scenario,
    first_stop,
    since,
    starts,
)
from sinssim.analyses.inspection.stream_findings import doubt
from sinssim.analyses.inspection.stream_inspection import Inspection, _axes_and_gravity
from sinssim.analyses.inspection.suggested_scenario import _sigmas
from sinssim.data import Array
from sinssim.logs.recorded_streams import Clock

UNIT = np.array([50.0, 50.5, 51.0, 52.0])


def fixes(*time: float, without: int = 0) -> Any:
    """Fixes of which the first ones have no latitude."""
    place = np.full(len(time), 0.5)
    place[:without] = np.nan
    return SimpleNamespace(time=np.array(time), latitude=place, longitude=0.0 * place + 1.0, height=0.0 * place + 2.0,
                           quality=None)  # fmt: skip


def seen(**found: Any) -> Any:
    usual = {"inertial": SimpleNamespace(time=UNIT), "fixes": None, "offset": None, "stated": None, "late": 0.0,
             "drift": 0.0, "velocity_delay": None, "quiet": None, "findings": [], "mounting": None,
             "reading": None, "sound": None}  # fmt: skip
    return SimpleNamespace(**{**usual, **found})


def test_times_of_the_fixes_since_the_first_row() -> None:
    """The unit's clock is 40 s ahead, and its first row is at 50 s: 12.5 s of the fixes are 2.5 s after it."""
    one = seen(offset=40.0, fixes=fixes(12.5, 13.5))
    assert since(one, 12.5) == 2.5
    assert since(seen(), 12.5) == -37.5
    assert starts(one) == 2.5
    early = {"offset": 38.9, "fixes": fixes(12.5, 13.5)}
    assert starts(seen(**early)) == 0.0  # 1.4 s are no reason to wait
    assert starts(seen(**early, sound=(12.5, 13.5))) == pytest.approx(1.4)  # unless wrong fixes come before
    assert starts(seen(offset=40.0, fixes=fixes(9.0, 12.5, 13.5, without=1))) == 2.5
    assert starts(seen(offset=40.0, fixes=fixes(12.5, without=1))) == 0.0
    assert starts(seen(fixes=fixes(12.5))) == starts(seen(offset=40.0)) == 0.0
    assert starts(seen(stated=40.0, fixes=fixes(12.5, 13.5))) == 2.5  # the files state it, the motion does not show it


def test_a_reference_has_to_contain_the_start() -> None:
    """Two mean steps of 2/3 s after the first fix, as soon as that is later than the first row."""
    steps = 2.0 * 2.0 / 3.0
    late, early = (seen(offset=40.0, fixes=fixes(t)) for t in (10.4, 9.0))
    assert starts(late, of_reference=True) == pytest.approx(0.4 + steps, rel=1e-12)
    assert starts(early, of_reference=True) == 0.0
    twice = SimpleNamespace(time=np.array([50.0, 50.0, 51.0, 52.0]))  # stamps that repeat begin a little earlier
    assert starts(seen(inertial=twice, offset=40.0, fixes=fixes(9.0)), of_reference=True) == pytest.approx(steps)


def test_the_first_stop_is_long_enough_within_the_run() -> None:
    """Six seconds; what lies before the start at 2.5 s does not count."""

    def stop(*spans: tuple[float, float]) -> Any:
        return first_stop(seen(offset=40.0, fixes=fixes(12.5), quiet=SimpleNamespace(spans=spans)))

    assert stop((51.0, 58.4), (60.0, 65.9), (70.0, 76.0), (80.0, 99.0)) == (20.0, 26.0)
    assert stop((51.0, 58.6)) == (2.5, pytest.approx(8.6))
    assert stop((51.0, 58.4)) is None
    assert first_stop(seen(offset=40.0, fixes=fixes(12.5))) is None
    assert first_stop(seen(quiet=SimpleNamespace(spans=((51.0, 99.0),)))) is None


def test_keys_of_the_clocks() -> None:
    """Day 10 of GPS time, 3723.25 s into it, for the first row at 50 s with the unit 40 s ahead and 2 s stated."""
    machine, dated = Clock("machine"), Clock("gps", 10 * 86400 + 3715)
    one = seen(offset=40.0, late=0.5, inertial=SimpleNamespace(time=UNIT + 0.25))
    (found,) = clock_keys(one, machine, dated, 2.0)
    assert found == ("first_row", "1980-01-16 01:02:03.250", "GPS time by the match with the fixes")
    # both are dated, or neither: the offset is corrected by what the stamps are late
    for unit, receiver in ((dated, dated), (machine, machine), (machine, None)):
        expected = ("time_offset_s", 1.766, "the unit's stamps are late")
        assert list(clock_keys(seen(offset=40.0, late=0.2344), unit, receiver, 2.0)) == [expected]
    (found,) = clock_keys(seen(offset=40.0, late=-0.2344), dated, None)
    assert found == ("time_offset_s", 0.234, "the unit's stamps are early")
    assert list(clock_keys(seen(offset=40.0, late=1e-3), dated, None)) == []
    assert [value for _, value, _ in clock_keys(seen(offset=40.0, late=1.1e-3), dated, None)] == [-0.001]
    assert list(clock_keys(seen(late=0.5), dated, None)) == []


def log(**imu: Any) -> Any:
    usual = {"time_offset_s": 2.0, "clock_drift_ppm": 0.0, "max_gap_s": 0.5, "stamps": "as-given",
             "matrix": np.eye(3), "gyro": None}  # fmt: skip
    gnss = SimpleNamespace(quality_factors=None)
    return SimpleNamespace(imu=SimpleNamespace(**{**usual, **imu}), gnss=gnss, from_s=None, to_s=None)


def test_delay_drift_and_codes_of_quality() -> None:
    """Three codes without factors, one of which is doubted; a delay only if it is doubted."""
    clocks = (Clock("machine"), None)
    codes = fixes(1.0, 2.0, 3.0, 4.0)
    codes.quality = np.array([5, 1, 2, 1])
    delayed = doubt("fixes", "late", "give it", velocity_delay_s=0.1)
    coded = doubt("fixes", "steps", "leave them out", doubtful_codes=(2,))
    one = seen(fixes=codes, drift=-3.04e-6, velocity_delay=0.1234, findings=[delayed, coded])
    section = log(clock_drift_ppm=10.0)
    assert list(_of_clocks(one, section, clocks)) == [
        (("log", "imu", "clock_drift_ppm"), 7.0, "match of the velocities over the whole log"),
        (("log", "gnss", "velocity_delay_s"), 0.123, "velocities are older than positions"),
        (("log", "gnss", "quality_factors"), {"1": 1.0, "5": 1.0}, "steps contradict the σ of the other codes"),
    ]
    section.gnss.quality_factors = {"1": 2.0, "2": 3.0, "5": 4.0}
    assert list(_of_clocks(one, section, clocks))[2][1] == {"1": 2.0, "5": 4.0}
    section.gnss.quality_factors = {"2": 3.0}
    assert len(list(_of_clocks(one, section, clocks))) == 2  # no fix would be left
    assert list(_of_clocks(seen(velocity_delay=0.1234), section, clocks)) == []
    section.gnss = None
    assert [keys for keys, _, _ in _of_clocks(one, section, clocks)] == [("log", "imu", "clock_drift_ppm")]


def test_axes_of_a_mounting() -> None:
    """The file's x, y and z are stated as right, forward and up; what is stated as forward, right and down points left,
    forward and down."""
    matrix = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    scenario: Any = SimpleNamespace(imu=SimpleNamespace(mounting_deg=None), log=log(matrix=matrix))
    one = seen(mounting=SimpleNamespace(axes=("left", "forward", "down")))
    assert list(_placed(one, scenario)) == [
        (("log", "imu", "axes"), ["forward", "left", "up"], "direction of motion and gravity")
    ]
    assert list(_placed(seen(mounting=SimpleNamespace(axes=("forward", "right", "down"))), scenario)) == []
    assert list(_placed(seen(), scenario)) == []
    scenario.imu.mounting_deg = (1.0, 2.0, 3.0)
    assert list(_placed(one, scenario)) == []


def steps(*lengths: tuple[int, float]) -> Array:
    """Return times from 7 s on, in runs of equal steps."""
    return 7.0 + np.cumsum([0.0, *(size for count, size in lengths for _ in range(count))])


def test_what_gaps_need() -> None:
    """A gap is what a step lasts longer than the usual 0.1 s. The bridge is the next twentieth of a second, at least
    5 ms longer. Gaps of more than 10 s cut the log; the longest part counts, with its own gaps.
    """
    assert bridges(steps((30, 0.1), (1, 0.17), (30, 0.1)), 0.05) == (None, None)  # less than 1.75 steps
    assert bridges(steps((30, 0.1), (1, 0.33), (30, 0.1)), 0.05) == (0.25, None)
    assert bridges(steps((30, 0.1), (1, 0.298), (30, 0.1)), 0.05) == (0.25, None)  # 2 ms less than 0.2 s is too near
    assert bridges(steps((30, 0.1), (1, 0.33), (30, 0.1)), 0.24) == (None, None)
    time = steps((30, 0.1), (1, 0.6), (20, 0.1), (1, 10.2), (40, 0.1), (1, 1.3), (10, 0.1), (1, 30.0), (50, 0.1))
    bridge, span = bridges(time, 0.5)
    assert bridge == 1.25
    assert span == (pytest.approx(15.8), pytest.approx(22.1))


def test_all_changes_of_a_log_with_gaps_and_repeated_stamps() -> None:
    time = steps((30, 0.1), (1, 0.0), (1, 0.6), (20, 0.1), (1, 12.0), (90, 0.1), (1, 1.3), (10, 0.1))
    one = seen(inertial=SimpleNamespace(time=time), offset=40.0, late=-0.3)
    scenario: Any = SimpleNamespace(imu=SimpleNamespace(mounting_deg=None), log=log())
    scenario.log.from_s, scenario.log.to_s = 1.23, None
    found, cannot = changes(one, scenario, (Clock("machine"), None))
    assert cannot == []
    part = "the longest part without a gap of more than 10 s"
    assert found == [
        (("log", "imu", "time_offset_s"), 2.3, "the unit's stamps are early"),
        (("log", "imu", "max_gap_s"), 1.25, "the longest gap in the inertial data, which is bridged"),
        (("log", "from_s"), 17.6, part),
        (("log", "to_s"), 28.9, part),
        (("log", "imu", "stamps"), "even", "stamps repeat"),
    ]
    scenario.log.from_s, scenario.log.to_s = 18.0, 25.5  # within that part already
    scenario.log.imu.stamps = "even"
    found, _ = changes(one, scenario, (Clock("machine"), None))
    assert [keys[-1] for keys, _, _ in found] == ["time_offset_s", "max_gap_s"]
    scenario.log.to_s = 40.0
    found, _ = changes(one, scenario, (Clock("machine"), None))
    assert [value for _, value, _ in found[2:]] == [18.0, 28.9]
    one.reading = (np.eye(3), np.eye(3))
    assert changes(one, scenario, (Clock("machine"), None))[1] == [
        "The right reading of the inertial data cannot be described: the format of the file defines its units and "
        "axes. Write the data as a text file, and inspect that."
    ]


def test_the_text_of_a_corrected_scenario(tmp_path: Path) -> None:
    """Comments and other keys stay; files are found from the new folder."""
    (tmp_path / "of" / "data").mkdir(parents=True)
    (tmp_path / "of" / "s.toml").write_text(
        '# mine\n[log]\nfrom_s = 1.0 # early\n[log.imu]\nfile = "data/imu.csv"\nmax_gap_s = 0.5\n'
        '[log.imu.barometer]\nfile = "other.csv"\n[log.gnss]\nfile = "data/../gnss.pos"\n'
    )
    found = [(("log", "imu", "max_gap_s"), 1.35, "a gap"), (("log", "to_s"), 9.5, "its end"),
             (("log", "outages", "at_s"), [[3.0, 4.0]], "new")]  # fmt: skip
    head = (
        "# Corrected from s.toml by sinssim inspect:\n#   log.imu.max_gap_s = 1.35: a gap\n"
        "#   log.to_s = 9.5: its end\n#   log.outages.at_s = [[3.0, 4.0]]: new\n"
    )
    path = tmp_path / "of" / "s.toml"
    for folder, imu, gnss, other in (
        (tmp_path / "of", "data/imu.csv", "data/../gnss.pos", "other.csv"),
        (tmp_path, "of/data/imu.csv", "of/gnss.pos", "of/other.csv"),
        (tmp_path / "of" / "data", "imu.csv", f"{tmp_path.resolve().as_posix()}/of/gnss.pos",
         f"{tmp_path.resolve().as_posix()}/of/other.csv"),
    ):  # fmt: skip
        text = corrected_scenario(path, folder, found)
        assert text.startswith(head + "# mine\n[log]\nfrom_s = 1.0 # early\nto_s = 9.5\n")
        assert f'[log.imu]\nfile = "{imu}"\nmax_gap_s = 1.35\n' in text
        assert f'[log.imu.barometer]\nfile = "{other}"\n' in text
        assert f'[log.gnss]\nfile = "{gnss}"\n' in text
        assert "[log.outages]\nat_s = [[3.0, 4.0]]\n" in text


def test_a_horizontal_axis_that_is_vertical() -> None:
    axes = ("forward", "right", "down")
    (finding,) = _axes_and_gravity(np.array([[0.2, -9.7, 0.1], [0.0, -9.9, -0.1]]), axes)
    assert (finding.subject, finding.grade, finding.numbers) == ("mounting", "doubt", {"gravity_along": "right"})
    assert finding.text == (
        "The y axis, which the format says points right, points down: the mean specific force along it is -9.8 m/s². "
        "The unit is mounted otherwise, and the course is not its heading."
    )
    assert list(_axes_and_gravity(np.array([[0.0, 0.0, -9.8]]), axes)) == []
    assert list(_axes_and_gravity(np.array([[6.9, 0.0, -6.9]]), axes)) == []


def test_an_inspection_as_plain_data() -> None:
    mounting = SimpleNamespace(axes=("forward", "right", "down"), angles=np.radians([1.0, -2.0, 3.0]))
    found = Inspection([doubt("clock", "Late.", "Wait.", s=3.0)], offset=0.25, drift=2e-6, velocity_delay=0.1,
                       mounting=mounting)  # type: ignore[arg-type]  # fmt: skip
    assert found.as_dict() == {
        "usable": True,
        "findings": [{"subject": "clock", "grade": "doubt", "text": "Late.", "fix": "Wait.", "numbers": {"s": 3.0}}],
        "imu_clock_minus_gnss_clock_s": 0.25, "imu_clock_drift_ppm": 2.0, "velocity_delay_s": 0.1,
        "axes": ["forward", "right", "down"], "mounting_deg": pytest.approx([1.0, -2.0, 3.0]),
    }  # fmt: skip


def of_receiver(**more: Any) -> Any:
    usual = {"time": np.arange(5.0) / 4.0, "position_sigma": None, "covariance": None, "quality": None,
             "quality_words": {}, "velocity_ned": None, "velocity_sigma": None}  # fmt: skip
    return SimpleNamespace(**usual | more)


@pytest.mark.parametrize(
    ("fixes", "found", "lines"),
    [
        ({}, {}, ["position_sigma_m = [2.0, 2.0, 4.0]  # assumed for code positions: the file has no σ, see the data "
                  "sheet"]),
        ({"quality": np.array([4.0]), "quality_words": {4: "fixed"}}, {},
         ["position_sigma_m = [0.02, 0.02, 0.04]  # assumed for fixed ambiguities: the file has no σ, see the data "
          "sheet"]),
        # four fixes a second, of which only one says something new
        ({}, {"lasting": True},
         ["position_sigma_m = [4.0, 4.0, 8.0]  # assumed for code positions: the file has no σ, see the data sheet; "
          "errors last for a second"]),
        # a step of 4.2426 m has the errors of two fixes of 3 m
        ({}, {"findings": [doubt("steps", "", "", step_sigma_m=4.2426)]},
         ["position_sigma_m = [3.0, 3.0, 6.0]  # from the steps"]),
        ({"position_sigma": 1}, {"findings": [doubt("steps", "", "", sigma_factor=2.345)]},
         ["sigma_factor = 2.35  # steps of the position scatter as much more than the stated 1σ"]),
        ({"position_sigma": 1, "velocity_ned": 1}, {},
         ["velocity_sigma_mps = [0.1, 0.1, 0.2]  # assumed: the file has no σ"]),
        ({"position_sigma": 1, "velocity_ned": 1}, {"residual": 0.3},
         ["velocity_sigma_mps = [0.3, 0.3, 0.6]  # from the match with the inertial data"]),
    ],
)  # fmt: skip
def test_sigmas_that_a_file_has_not(fixes: dict[str, Any], found: dict[str, Any], lines: list[str]) -> None:
    usual = {"findings": [], "lasting": False, "residual": None}
    assert list(_sigmas(SimpleNamespace(**usual | found, fixes=of_receiver(**fixes)))) == lines
