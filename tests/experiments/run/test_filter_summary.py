"""A run with a filter: streams, view, summary and report hold what the filter said, however it ended."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as pq
import pytest
import rerun.blueprint as rrb
from rerun.chunk import RrdReader

from sinssim.estimation import BLOCKS
from sinssim.experiments.run import filter_summary
from sinssim.experiments.run.filter_summary import for_people, sentences
from sinssim.experiments.run.run_execution import run
from sinssim.experiments.run.run_streams import state_columns
from sinssim.recording import style
from sinssim.recording.rerun_viewer import find_run_info
from sinssim.recording.rerun_views import all_views, load_view
from sinssim.scenario import Scenario
from sinssim.sensors.aiding.gnss import Jump, Ramp
from sinssim.strapdown.navigation_error import navigation_error
from tests.recording.rerun.test_views import views
from tests.recording.shown import still
from tests.recording.test_directory import read_recording, verify

AIDING = {
    "gnss": {
        "outages_s": [[30.0, 50.0]],
        "latency_s": 0.2,
        "jumps": [{"from_s": 70.0, "to_s": 75.0, "north_m": 500.0}],
        "correlated_position_sigma_m": 2.0,
    },
    "baro": {},
    "attitude": {"rate_hz": 0.5, "bias_sigma_arcmin": 3.0},
}


def scenario(**tables) -> Scenario:
    own = {
        "name": "filtered",
        "seed": 3,
        "great_circle": {"latitude_deg": 50.0, "course_deg": 60.0, "speed_mps": 200.0, "duration_s": 100.0},
        "imu": {"grade": "laser-standard", "rate_hz": 50.0},
        "navigation": {"initial_error": {"position_sigma_m": 5.0, "tilt_sigma_arcmin": 1.0}},
        "aiding": AIDING,
        "filter": {"smooth": True},
    }
    return Scenario.model_validate({**own, **tables})


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    told: list[tuple[str, float]] = []
    directory = tmp_path_factory.mktemp("filter") / "run"
    return run(scenario(), directory, progress=lambda stage, fraction: told.append((stage, fraction))), told


def table(result, name: str):
    return pq.read_table(result.directory / "streams" / f"{name}.parquet")


def test_aided_solutions_are_recorded_beside_the_inertial_one(recorded):
    result, told = recorded
    found = result.aided.estimate
    assert {"nav_quaternion", "nav_aided", "nav_smoothed", "error_aided", "error_smoothed", "filter"} <= {
        p.stem for p in (result.directory / "streams").glob("*.parquet")
    }
    for name, solution in (("aided", found.solution), ("smoothed", found.smoothed.solution)):
        t = table(result, f"nav_{name}")
        assert t.column_names == table(result, "nav_quaternion").column_names
        np.testing.assert_array_equal(t["time_s"].to_numpy(), solution.time)
        np.testing.assert_array_equal(t["latitude_rad"].to_numpy(), solution.latitude)
        np.testing.assert_array_equal(t["q_nb_z"].to_numpy(), solution.q_nb[:, 3])
        error = navigation_error(result.truth.trajectory.state(solution.time), solution)
        e = table(result, f"error_{name}")
        np.testing.assert_allclose(e["position_n_m"].to_numpy(), error.position_ned[:, 0], rtol=0, atol=1e-9)
        np.testing.assert_allclose(e["phi_d_rad"].to_numpy(), error.attitude[:, 2], rtol=0, atol=1e-12)
    assert [f for stage, f in told if stage == "filter"] == [0.0, 1.0]
    assert result.summary["timing"]["filter_s"] > 0.0


def test_filter_stream_has_every_state_with_its_unit(recorded):
    result, _ = recorded
    found, t = result.aided.estimate, table(result, "filter")
    model = found.model
    assert t.column_names[:4] == ["time_s", "sigma_position_n_m", "sigma_position_e_m", "sigma_position_d_m"]
    sigma = [name for name in t.column_names if name.startswith("sigma_")]
    assert len(sigma) == model.size
    for i, name in enumerate(sigma):
        np.testing.assert_array_equal(t[name].to_numpy(), found.sigma[:, i])
    bias = found.parameters["gyro bias"]
    for i, axis in enumerate("xyz"):
        np.testing.assert_array_equal(t[f"gyro_bias_{axis}_radps"].to_numpy(), bias[:, i])
        true = result.aided.parameters["gyro bias"][i]
        np.testing.assert_array_equal(t[f"error_gyro_bias_{axis}_radps"].to_numpy(), true - bias[:, i])
    for name in ("gnss_position_bias_d_m", "baro_bias_m", "attitude_bias_x_rad", "accelerometer_bias_y_mps2"):
        assert {name, f"error_{name}", f"sigma_{name}"} <= set(t.column_names)


def test_every_reading_is_recorded_with_what_became_of_it(recorded):
    result, _ = recorded
    for sensed, innovations in zip(result.aided.sensed, result.aided.estimate.innovations, strict=True):
        m = sensed.measurements
        t = table(result, f"aiding_{m.label.replace('-', '_')}")
        np.testing.assert_array_equal(t["time_s"].to_numpy(), m.time)
        np.testing.assert_array_equal(t["arrival_s"].to_numpy(), m.arrival)
        np.testing.assert_array_equal(t["nis"].to_numpy(), innovations.nis)
        np.testing.assert_array_equal(t["accepted"].to_numpy(), innovations.accepted.astype(float))
    t = table(result, "aiding_gnss_position")
    assert t.column_names[1:7] == ["latitude_rad", "longitude_rad", "height_m", "sigma_n_m", "sigma_e_m", "sigma_d_m"]
    nu = np.column_stack([t[f"innovation_{axis}_m"].to_numpy() for axis in "ned"])
    s = np.column_stack([t[f"innovation_sigma_{axis}_m"].to_numpy() for axis in "ned"])
    jumped = (t["time_s"].to_numpy() >= 70.0) & (t["time_s"].to_numpy() <= 75.0)
    np.testing.assert_array_equal(t["accepted"].to_numpy() == 0.0, jumped)
    assert np.all(np.abs(nu[~jumped]) < 5.0 * s[~jumped])
    assert np.all(nu[jumped, 0] < -400.0)
    assert np.min(t["arrival_s"].to_numpy() - t["time_s"].to_numpy()) == pytest.approx(0.2, abs=1e-9)


def test_recording_equals_parquet_and_is_valid(recorded):
    result, _ = recorded
    assert verify(result.directory / "recording.rrd").returncode == 0
    entities = read_recording(result.directory / "recording.rrd")
    seen = set()
    for entity, (times, values, names) in entities.items():
        stream = entity.split("/")[2]
        if not stream.startswith(("filter", "aiding", "nav_aided", "error_smoothed")):
            continue
        seen.add(stream)
        t = table(result, stream)
        np.testing.assert_array_equal(times, np.rint(t["time_s"].to_numpy() * 1e9).astype(np.int64))
        np.testing.assert_array_equal(values, np.column_stack([t[name].to_numpy() for name in names]))
    assert seen == {
        "filter", "aiding_gnss_position", "aiding_gnss_velocity", "aiding_baro", "aiding_attitude", "nav_aided",
        "error_smoothed",
    }  # fmt: skip


def test_view_shows_what_is_recorded_over_the_whole_run(recorded):
    result, _ = recorded
    recording = result.directory / "recording.rrd"
    info = find_run_info(recording)
    assert "filter" in [tab.name for tab in all_views(info, "filter").root_container.contents]
    entities = {chunk.entity_path for chunk in RrdReader(recording).stream()}
    found = views(load_view("filter", info).root_container)
    plots = [view for view in found if isinstance(view, rrb.TimeSeriesView)]
    assert len(plots) == 15
    for view in found:
        assert any(e == str(view.origin) or e.startswith(f"{view.origin}/") for e in entities), view.origin
    for view in plots:
        span = view.properties["TimeAxis"].view_range.as_arrow_array().to_pylist()[0]
        beside = bool(view.properties["PlotLegend"].visible.as_arrow_array().to_pylist()[0])
        assert span["start"] == 0  # a legend stands after the run, on no line
        assert span["end"] >= 150_000_000_000 if beside else span["end"] == 100_000_000_000
    for view in plots[:3]:
        assert re.search(r"\[(m|mm|nmi)\]", view.name)


def test_bands_are_three_sigma_around_zero_with_the_error_in_the_same_unit(recorded):
    result, _ = recorded
    info = find_run_info(result.directory / "recording.rrd")
    found = result.aided.estimate
    sizes = {"mm": 1e-3, "m": 1.0, "km": 1e3, "arcsec": np.pi / 648e3, "arcmin": np.pi / 10.8e3, "deg": np.pi / 180}
    for entity, column, sign in (("position_east", 1, 1.0), ("height", 2, -1.0), ("azimuth", 8, 1.0)):
        size = sizes[info.label(f"filter/{entity}")]
        rows = {}
        for chunk in RrdReader(result.directory / "recording.rrd").stream():
            if chunk.entity_path == f"/filter/{entity}/0" and "Scalars:scalars" in chunk.to_record_batch().schema.names:
                batch = chunk.to_record_batch()
                values = batch.column("Scalars:scalars").flatten().to_numpy().reshape(-1, 3)
                rows = values
        np.testing.assert_allclose(rows[:, 0] * size, 3.0 * found.sigma[:, column], rtol=1e-12)
        np.testing.assert_allclose(rows[:, 1], -rows[:, 0], rtol=0, atol=0)
        np.testing.assert_allclose(
            rows[:, 2] * size, sign * result.aided.state_errors[:, column], rtol=1e-9, atol=1e-15
        )


def test_summary_says_whether_the_filter_is_right(recorded):
    result, _ = recorded
    kept = json.loads((result.directory / "summary.json").read_text())["filter"]
    assert kept == result.summary["filter"]
    assert kept["divergence"] is None
    for name in ("aided", "smoothed"):
        assert set(kept[name]) == set(result.summary["algorithms"]["quaternion"])
    position = kept["sensors"]["gnss-position"]
    assert position["readings"] == 100 - 21
    assert position["taken"] == 79 - 6
    assert position["refused"] == 6
    assert position["first_refused_s"] == 70.0
    assert kept["sensors"]["baro"]["verdict"] == "consistent"
    (jump,) = kept["faults"]
    assert jump["caught"] is True
    assert jump["readings"] == jump["refused"] == 6  # positions jump, velocities do not
    assert jump["max_horizontal_error_m"] < 10.0
    nees = kept["nees"]
    assert nees["all states"]["states"] == 30  # the height of the fixes has no bias
    assert nees["all states"]["lower_95"] < 1.0 < nees["all states"]["upper_95"]
    assert 0.3 < nees["all states"]["value"] < 3.0
    assert kept["noise"]["gyro noise"]["verdict"] == "consistent"
    assert kept["noise"]["gyro noise"]["value"] == pytest.approx(1.0, abs=0.4)
    states = kept["states"]
    assert states["position_n_m"]["sigma_start"] == 5.0
    assert states["position_n_m"]["reduction"] == pytest.approx(5.0 / states["position_n_m"]["sigma_end"])
    assert states["gyro_bias_z_radps"]["observable"] is False


def test_report_shows_the_filter(recorded):
    result, _ = recorded
    page = (result.directory / "report.html").read_text(encoding="utf-8")
    section = page[page.index("The aided solution") : page.index("How the run was computed")]
    for words in ("North position error", "Azimuth misalignment, φD", "gnss-velocity innovations [σ]", "NEES per state",
                  "gyro bias x [deg/h]", "no GNSS", "GNSS again", ">jump, jump ends<", "inertial, quaternion",
                  "smoothed"):  # fmt: skip
        assert words in section
    assert "With the aiding sensors and the filter:" in page[: page.index("The aided solution")]
    assert "nan" not in still(section).lower().replace("nano", "")
    assert section.count("<svg xmlns") == 9 + 4


def test_units_that_people_use():
    assert for_people("gyro_bias_x_radps", np.pi / 180.0 / 3600.0, None)[:2] == ("gyro bias x", "deg/h")
    name, unit, values = for_people("accelerometer_bias_y_mps2", 9.80665e-6, None)
    assert (name, unit) == ("accelerometer bias y", "µg")
    assert values[0] == pytest.approx(1.0)
    assert np.isnan(values[1])
    assert for_people("gyro_misalignment_xy_rad", np.pi / 648e3) == ("gyro misalignment xy", "arcsec", [1.0])
    assert for_people("phi_n_rad", np.pi / 10.8e3) == ("phi n", "arcmin", [1.0])
    assert for_people("gyro_scale_x", 1e-6)[1:] == ("ppm", [1.0])
    assert for_people("velocity_n_mps", 2.0) == ("velocity n", "m/s", [2.0])


def test_a_sensor_or_block_has_one_colour_whatever_is_beside_it():
    sensors = ["gnss-position", "gnss-velocity", "baro", "magnetometer", "airspeed", "odometer", "zero-velocity",
               "zero-rate", "attitude", "star-tracker", "master-velocity", "master-attitude"]  # fmt: skip
    blocks = [*BLOCKS, "gnss-position bias", "gnss-velocity bias", "baro bias", "baro scale", "magnetometer bias",
              "magnetometer deviation", "airspeed wind", "odometer scale", "star-tracker bias",
              "master-attitude bias"]  # fmt: skip
    for names in (sensors, blocks):
        found = style.colors(names)
        assert len(set(found)) == len(names)
        assert [style.colors([name])[0] for name in reversed(names)] == found[::-1]


def test_columns_of_every_block_differ():
    from sinssim.scenario.filter_model import filter_model

    everything = {"gnss": {"correlated_position_sigma_m": 1.0, "correlated_velocity_sigma_mps": 1.0,
                           "lever_arm_sigma_m": 1.0},
                  "baro": {"scale_sigma_ppm": 1.0}, "airspeed": {},
                  "magnetometer": {"bias_sigma_deg": 1.0, "deviation_sigma_deg": 1.0},
                  "odometer": {"scale_sigma_ppm": 1.0}, "attitude": {"bias_sigma_arcmin": 1.0},
                  "star_tracker": {"bias_sigma_arcsec": 1.0}}  # fmt: skip
    s = scenario(
        aiding=everything,
        imu={"grade": "mems-industrial"},
        filter={"states": ["gyro scale", "gyro misalignment", "accelerometer scale", "accelerometer misalignment"]},
    )
    model = filter_model(s)
    kinds = {"gnss-position": "gnss-position", "gnss-velocity": "gnss-velocity", "baro": "baro-height",
             "magnetometer": "heading", "airspeed": "airspeed", "odometer": "speed", "attitude": "attitude",
             "star-tracker": "attitude"}  # fmt: skip
    columns = [column for block in model.blocks for column in state_columns(block, kinds)]
    assert len(set(columns)) == len(columns) == model.size
    for name in ("phi_e_rad", "gyro_misalignment_zy_rad", "gnss_lever_arm_x_m", "gnss_velocity_bias_d_mps",
                 "magnetometer_bias_rad", "odometer_scale", "star_tracker_bias_z_rad", "accelerometer_scale_z",
                 "gyro_instability_x_radps", "airspeed_wind_e_mps", "magnetometer_deviation_cos_rad",
                 "baro_scale"):  # fmt: skip
        assert name in columns


# Filters that go wrong


def test_filter_that_contradicts_its_sensors_says_so_and_leaves_a_whole_recording(tmp_path):
    lost = {"gnss": {"velocity": False, "jumps": [{"from_s": 20.0, "east_m": 5000.0}]}}
    result = run(scenario(aiding=lost, filter={}), tmp_path / "run")
    end = result.summary["filter"]["divergence"]
    assert end["time_s"] == 20.0
    assert end["measurement"].startswith("gnss-position 19")
    assert "the gate rejected" in end["reason"]
    assert result.summary["status"] == "finished"
    assert set(result.summary["algorithms"]) == {"quaternion"}
    assert verify(result.directory / "recording.rrd").returncode == 0
    page = (result.directory / "report.html").read_text(encoding="utf-8")
    assert "The filter diverged at 20.0 s at gnss-position 19" in page
    events = pq.read_table(result.directory / "streams" / "events.parquet").to_pydict()
    assert any("the filter diverged" in text for text in events["text"])


def test_satellites_that_never_come_leave_the_inertial_solution(tmp_path):
    none = {"gnss": {"outages_s": [[0.0, 1000.0]]}}
    result = run(scenario(aiding=none, filter={}), tmp_path / "run")
    kept = result.summary["filter"]
    assert any("the result is the inertial solution" in remark for remark in kept["remarks"])
    assert kept["sensors"]["gnss-position"]["verdict"] == "unknown"
    assert verify(result.directory / "recording.rrd").returncode == 0
    assert (result.directory / "streams" / "aiding_gnss_position.parquet").exists()


@pytest.mark.parametrize(("factor", "verdict"), [(0.3, "optimistic"), (3.0, "pessimistic")])
def test_filter_that_is_told_wrong_noise_is_called_inconsistent(factor, verdict):
    result = run(scenario(aiding={"gnss": {}}, filter={"measurement_noise_factor": factor, "gate": 0.0}))
    kept = result.summary["filter"]
    assert kept["consistent"] is False
    for sensor in kept["sensors"].values():
        assert sensor["verdict"] == verdict
        assert sensor["tests"]["NIS"]["value"] == pytest.approx(factor**-2, rel=0.25)
    meaning = {"optimistic": "the noise is larger than assumed", "pessimistic": "the noise is smaller than assumed"}[
        verdict
    ]
    (sentence,) = (line for line in sentences(kept) if line.startswith("The filter is"))
    assert sentence.startswith(f"The filter is not consistent: {verdict} ({meaning}) by gnss-position, gnss-velocity")
    assert kept["noise"]["gyro noise"]["verdict"] == kept["noise"]["accelerometer noise"]["verdict"] == "consistent"


def test_run_without_a_filter_has_nothing_of_it(tmp_path):
    result = run(scenario(aiding=None, filter=None), tmp_path / "run")
    assert result.aided is None
    assert "filter" not in result.summary
    assert not list((result.directory / "streams").glob("*aid*"))
    assert "The aided solution" not in (result.directory / "report.html").read_text(encoding="utf-8")
    assert not Path(result.directory / "streams" / "filter.parquet").exists()


def test_a_ramp_that_is_believed_again_is_said_to_be():
    taken = np.ones(200, dtype=bool)
    taken[50:120] = False
    taken[90] = True  # one by chance
    time = np.arange(200.0)
    assert filter_summary._believed_again(time, taken) == 120.0
    assert filter_summary._believed_again(time[:140], taken[:140]) is None  # twenty are too few
    assert filter_summary._believed_again(time, np.ones(200, dtype=bool)) is None
    assert filter_summary._forged(Ramp(from_s=50.0, north_mps=0.3, east_mps=0.4), 160.0) == pytest.approx(55.0)
    assert filter_summary._forged(Jump(from_s=50.0, east_m=7.0), 160.0) == pytest.approx(7.0)
    ramp = {
        "kind": "ramp", "from_s": 50.0, "to_s": 199.0, "readings": 150, "refused": 109, "first_refused_s": 50.0,
        "believed_again_s": 160.0, "forged_then_m": 60.0, "caught": True, "max_horizontal_error_m": 70.0,
    }  # fmt: skip
    caught, again = filter_summary.fault_sentences({"faults": [ramp]})
    assert "was detected by the gate" in caught
    assert again.startswith("From 160 s on, with GNSS errors of 60.0 m, the filter accepted the fixes again")


def test_what_the_monitor_detects_is_said():
    ramp = {
        "kind": "ramp", "from_s": 50.0, "to_s": 199.0, "readings": 50, "refused": 0, "first_refused_s": None,
        "believed_again_s": None, "forged_then_m": None, "caught": False, "max_horizontal_error_m": 70.0,
    }  # fmt: skip
    sensors = {
        name: {"withdrawn_s": at, "verdict": "consistent"} for name, at in (("gnss-position", 90.0), ("baro", None))
    }
    (said,) = filter_summary.fault_sentences({"faults": [ramp], "sensors": sensors})
    assert "was detected by the monitor of the innovations 40 s after its start: the fixes are withdrawn" in said
    assert said.endswith("the error of the solution reached 70.0 m.")
    sensors["gnss-position"]["withdrawn_s"] = 45.0  # before the ramp begins
    (said,) = filter_summary.fault_sentences({"faults": [ramp], "sensors": sensors})
    assert "was not detected by the gate" in said


def test_the_first_long_series_of_rejected_fixes_and_their_withdrawal_are_detections():
    """Twenty in a row are by chance, thirty are not; the first of all fixes counts, and what is no fix does not."""

    def of(kind, *spans, withdrawn=np.inf):
        accepted = np.ones(200, dtype=bool)
        for begin, end in spans:
            accepted[begin:end] = False
        series = SimpleNamespace(kind=kind, sensor=kind, time=np.arange(200.0), nis=np.ones(200), accepted=accepted)
        series.withdrawn = withdrawn
        return series

    found = filter_summary.detections(
        [of("gnss-position", (20, 40), (60, 100), (120, 180), withdrawn=190.0), of("gnss-velocity", (60, 90)),
         of("baro-height", (10, 150))]
    )  # fmt: skip
    assert found == [
        {"time_s": 60.0, "by": "gate", "sensors": ["gnss-position", "gnss-velocity"]},
        {"time_s": 190.0, "by": "monitor", "sensors": ["gnss-position"]},
    ]
    assert [filter_summary.detected(one)[1:] for one in found] == [
        ("rejected", "rejected by the gate: gnss-position and gnss-velocity"),
        ("withdrawn", "withdrawn by the monitor: gnss-position"),
    ]


def test_a_detection_is_in_every_medium(tmp_path):
    """A ramp that the gate rejects from its first fix on: numbers, marks, events, and the true place on the maps."""
    gnss = {"ramps": [{"from_s": 40.0, "north_mps": 80.0}, {"from_s": 200.0, "north_mps": 1.0}]}  # one after the end
    result = run(scenario(aiding={"gnss": gnss, "baro": {}}, filter={}), tmp_path / "run")
    (found,) = result.summary["filter"]["detections"]
    assert found == {"time_s": 40.0, "by": "gate", "sensors": ["gnss-velocity"]}  # at once; its position is near yet
    page = (result.directory / "report.html").read_text(encoding="utf-8")
    assert page.count(">ramp, rejected<") >= 9 + 2  # above the bands and the innovations
    assert ">ramp 40 s, rejected 40 s<" in page[: page.index("The aided solution")]
    events = pq.read_table(result.directory / "streams" / "events.parquet").to_pydict()
    assert [text for text in events["text"] if "leg" not in text] == [
        "GNSS ramp begins", "rejected by the gate: gnss-velocity",
    ]  # fmt: skip
    placed = filter_summary.places_of(
        filter_summary.moments(result.scenario, [found], (0.0, 100.0)), result.truth.trajectory
    )
    at = result.truth.trajectory.state(np.array([40.0, 40.0]))
    np.testing.assert_array_equal(placed.latitude, at.latitude)
    assert {"/map/faults", "/world/faults"} <= {
        str(chunk.entity_path) for chunk in RrdReader(result.directory / "recording.rrd").stream()
    }


def test_every_reading_that_is_not_used_has_its_reason(tmp_path, recorded):
    """Readings taken and not used add up to all, also with those before the filter's start; streams keep every one."""
    parked = {"latitude_deg": 50.0, "heading_deg": 20.0, "duration_s": 40.0}
    aiding = {"zero_velocity": {"rate_hz": 1.0, "outages_s": [[25.0, 28.0]], "latency_s": 1.5}}
    quiet = {"grade": "laser-navigation", "rate_hz": 10.0}
    own = scenario(
        great_circle=None, parked=parked, imu=quiet, navigation={}, aiding=aiding, filter={"alignment_s": 10.0}
    )
    result = run(own, tmp_path / "run")
    numbers = result.summary["filter"]["sensors"]["zero-velocity"]
    assert numbers["readings"] == 36
    assert numbers["unused"] == {"before the start of the filter": 10}
    assert numbers["taken"] == 26
    said = list(sentences(result.summary["filter"]))
    assert "Measurements before the start of the filter, which are not used: 10 of 36 of zero-velocity." in said
    rows = table(result, "aiding_zero_velocity")
    known = np.isfinite(rows["nis"].to_numpy())
    assert known.tolist() == [False] * 10 + [True] * 26
    np.testing.assert_array_equal(rows["accepted"].to_numpy(), known)
    np.testing.assert_array_equal(
        rows["innovation_n_mps"].to_numpy()[known], result.aided.estimate.innovations[0].value[:, 0]
    )
    jumps = recorded[0].summary["filter"]["sensors"]
    for s in jumps.values():
        assert s["taken"] + sum(s["unused"].values()) == s["readings"]
    assert jumps["gnss-position"]["unused"] == {"rejected by the gate": jumps["gnss-position"]["refused"]}
