"""Sentences, dates and choices of exports, and the start of KF-GINS from a solution, of runs written by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from sinssim.errors import InputError
from sinssim.logs.formats import kf_gins
from sinssim.logs.formats.export_streams import choose, export
from sinssim.logs.recorded_streams import FixStream
from sinssim.logs.stored_run import RecordedRun
from tests.logs import hand_run
from tests.logs.hand_run import BESIDE, FIX, FIX_TIME, SECONDS, TIME, WEEK
from tests.logs.writers.exported import close, table

LOG_DATE = "The run's time 0 is 2017-01-01T23:59:59.125Z, the first row of the log."


def test_a_run_on_recorded_sensors(tmp_path: Path) -> None:
    """Its own date, to the microsecond; the reference stands for the truth unless another solution is chosen."""
    run = hand_run.log_run(tmp_path / "a")
    done = export(run, "csv", tmp_path / "out")
    assert done.place == tmp_path / "out"
    assert [str(file) for file in done.files] == ["out/gnss.csv", "out/imu.csv", "out/reference.csv"]
    assert done.sentences[-2:] == (
        LOG_DATE,
        "It is a run on recorded sensors without a true motion: reference stands for it.",
    )
    done = export(run, "tum", tmp_path / "aided.tum", solution=["aided"])
    assert done.sentences[-2:] == (LOG_DATE, "It is a run on recorded sensors.")
    stamps = [line.split()[0] for line in (tmp_path / "aided.tum").read_text().splitlines()[2:]]
    assert stamps == ["1483315199.375000000", "1483315199.875000000", "1483315200.375000000", "1483315200.875000000"]
    done = export(run, "tum", tmp_path / "b.tum", start="2017-01-01T23:59:59Z")
    assert done.sentences[-2] == "The run's time 0 is 2017-01-01T23:59:59Z (--start)."


def test_velocities_with_times_of_their_own_and_another_ellipsoid(tmp_path: Path) -> None:
    run = hand_run.log_run(tmp_path / "a")
    file = run / "streams" / "aiding_gnss_velocity.parquet"
    columns = parquet.read_table(file).to_pydict()
    parquet.write_table(pa.table({**columns, "time_s": [0.65, 1.65]}), file)
    fixes = RecordedRun(run).fix("gnss")
    assert (fixes.velocity_ned, fixes.velocity_sigma) == (None, None)
    done = export(run, "rtklib-pos", tmp_path / "a.pos", solution=["gnss"])
    assert done.sentences[-1] == "The velocities of gnss have other times than its positions, and are left out."
    other = hand_run.hand_run(tmp_path / "mine")
    (other / "scenario.toml").write_text('[truth]\nellipsoid = "krasovsky"\n')
    done = export(other, "rtklib-pos", tmp_path / "b.pos")
    assert done.sentences[-2:] == (
        "The run's time 0 is 2026-01-01T00:00:00Z (--start).",
        "Its coordinates are on the ellipsoid krasovsky, and are written as they are.",
    )


def test_outages(tmp_path: Path) -> None:
    run = hand_run.hand_run(tmp_path / "mine")
    done = export(run, "csv", tmp_path / "out", outages=["0.5:0.75", "1.5:1.7"])
    assert done.sentences[-1] == "The fixes in 0.5 to 0.75 s, 1.5 to 1.7 s are withheld (--outage): 1 of gnss."
    close(table(tmp_path / "out" / "gnss.csv")[:, :4], FIX_TIME[1:], FIX[1:])


def test_what_is_chosen(tmp_path: Path) -> None:
    """Measured readings before ideal ones; names of solutions, receivers and readings; each once."""
    run = RecordedRun(hand_run.hand_run(tmp_path / "mine"))
    found = choose(run, 7.5, [], 2.0)
    assert (found.solution_name, found.imu_name, found.start_gps_s, found.rate_hz) == ("truth", "measured", 7.5, 2.0)
    found = choose(run, 7.5, ["ideal", "gnss"], None)
    assert (found.solution_name, found.imu_name, found.rate_hz) == ("gnss", "ideal", None)
    close(found.solution.height[:, None], FIX[:, 2])
    for names, said in (
        (["euler", "gnss"], "--solution euler and --solution gnss both choose the solution; give one"),
        (["ideal", "measured"], "--solution ideal and --solution measured both choose the inertial data; give one"),
        (["eulr"], "unknown stream of"),
    ):
        with pytest.raises(InputError, match=said):
            choose(run, 7.5, names, None)
    assert found.with_rate(5.0).rate_hz == 5.0
    assert choose(run, 7.5, [], 2.0).with_rate(5.0).rate_hz == 2.0
    # GPS seconds and nanoseconds, of a start with a fraction
    seconds, ns = choose(run, 100.75, [], None).stamps(np.array([0.25, 0.5, 1.123456789]))
    assert (seconds.tolist(), ns.tolist()) == ([101, 101, 101], [0, 250_000_000, 873_456_789])


def test_the_start_of_kf_gins_from_a_filtered_solution(tmp_path: Path) -> None:
    """At the first reading, 0.75 s: the second row of the filter, σ of position, velocity and the angles."""
    run = hand_run.hand_run(tmp_path / "mine")
    sigma = np.arange(1.0, 37.0).reshape(4, 9) * 0.5
    names = [f"sigma_position_{a}_m" for a in "ned"] + [f"sigma_velocity_{a}_mps" for a in "ned"]
    names += [f"sigma_phi_{a}_rad" for a in "ned"]
    columns = {"time_s": TIME, **dict(zip(names, sigma.T, strict=True))}
    parquet.write_table(pa.table(columns), run / "streams" / "filter.parquet")
    export(run, "kf-gins", tmp_path / "out", solution=["euler"], start=hand_run.START)
    text = (tmp_path / "out" / "kf-gins.yaml").read_text()
    degrees = ", ".join(f"{np.degrees(x):.9g}" for x in (8.0, 8.5, 9.0))
    for line in (
        "initposstd: [5, 5.5, 6]   # m",
        "initvelstd: [6.5, 7, 7.5]   # m/s",
        f"initattstd: [{degrees}]   # deg",
        f"starttime: {SECONDS + 0.75}   # the first sample",
    ):
        assert line in text.splitlines()
    given = dict(line.split(": ", 1) for line in text.splitlines() if ": " in line)
    numbers = {
        key: [float(x) for x in given[key].partition("]")[0].strip("[ ").split(",")]
        for key in ("initpos", "initvel", "initatt")
    }
    np.testing.assert_allclose(numbers["initpos"], [BESIDE[0][1], BESIDE[1][1], BESIDE[2][1]], rtol=1e-14)
    np.testing.assert_allclose(numbers["initvel"], BESIDE[3][1], rtol=1e-14)
    np.testing.assert_allclose(np.mod(numbers["initatt"], 360.0), np.mod(BESIDE[4][1], 360.0), rtol=1e-12)


def test_the_noise_of_kf_gins(tmp_path: Path) -> None:
    """Stated sizes times the filter's factor 2; T is 1000 h, σ = √(S T/2) of the density S that drives a bias.

    Gyros: 1 °/√h; √(3² + 8²) °/h at the start; 2 · 8²/1800 + 5²/3600 (°/h)²/s. Accelerometers: 200 µg/√Hz are
    0.117680 m/s/√h; √(300² + 400²) = 500 µg are 490.3325 mGal; 400 µg √(2/900 · 1.8e6) are 24 809.1 mGal.
    """
    run = hand_run.hand_run(tmp_path / "mine")
    sizes = {
        "gyro_arw_deg_sqrt_h": 0.5, "gyro_bias_sigma_deg_h": 3.0, "gyro_instability_deg_h": 4.0,
        "gyro_correlation_time_s": 1800.0, "gyro_rrw_deg_h_sqrt_h": 5.0, "gyro_scale_sigma_ppm": 700.0,
        "accel_vrw_ug_sqrt_hz": 100.0, "accel_bias_sigma_ug": 300.0, "accel_instability_ug": 200.0,
        "accel_correlation_time_s": 900.0, "accel_rrw_ug_sqrt_h": 0.0, "accel_scale_sigma_ppm": 800.0,
    }  # fmt: skip
    text = "".join(f"{key} = {value}\n" for key, value in sizes.items())
    (run / "scenario.toml").write_text(f'[filter]\ninertial_noise_factor = 2.0\n[imu]\ngrade = "tactical"\n{text}')
    done = export(run, "kf-gins", tmp_path / "out", start=hand_run.START)
    assert any(said.endswith("and the noise of the run's sensors.") for said in done.sentences)
    lines = [line.split("#")[0].split(":") for line in (tmp_path / "out" / "kf-gins.yaml").read_text().splitlines()]
    given = {
        key.strip(): [float(x) for x in value.strip(" []").split(",")] for key, value in lines[8:-1] if "[" in value
    }
    expected = {
        "arw": 1.0, "initbgstd": np.sqrt(73.0), "gbstd": np.sqrt((128.0 / 1800.0 + 25.0 / 3600.0) * 1.8e6),
        "initsgstd": 700.0, "vrw": 200e-6 * 9.80665 * 60.0, "initbastd": 490.3325,
        "abstd": 400.0 * np.sqrt(4000.0) * 0.980665,
        "initsastd": 800.0,
    }  # fmt: skip
    for key, value in expected.items():
        np.testing.assert_allclose(given[key], [value] * 3, rtol=1e-7, err_msg=key)


def test_the_end_of_a_week(tmp_path: Path) -> None:
    """GPS week 1930 ends at 2017-01-07 23:59:42 UTC, 1 s of it is left: the last reading is 0.75 s too late."""
    assert WEEK == 1930
    run = hand_run.hand_run(tmp_path / "mine")
    with pytest.raises(InputError, match=r"the run ends 1 s after the end of the GPS week 1930, beyond"):
        export(run, "kf-gins", tmp_path / "out", start="2017-01-07T23:59:41Z")
    export(run, "kf-gins", tmp_path / "out", start="2017-01-07T23:59:40Z")
    assert table(tmp_path / "out" / "imu.txt", None, 0)[-1, 0] == 604799.75


def test_fixes_without_sigma_in_a_file_of_kf_gins(tmp_path: Path) -> None:
    """Its loader needs seven numbers: 1 m stands for what is not known."""
    here = np.radians([[-33.5, 151.25], [-33.25, 151.5]])
    fixes = FixStream(np.array([0.25, 1.75]), here[:, 0], here[:, 1], np.array([81.75, 82.5]))
    kf_gins._write_gnss(fixes, 100.5, tmp_path / "gnss.txt")
    expected = [[100.75, -33.5, 151.25, 81.75, 1.0, 1.0, 1.0], [102.25, -33.25, 151.5, 82.5, 1.0, 1.0, 1.0]]
    np.testing.assert_allclose(table(tmp_path / "gnss.txt", None, 0), expected, rtol=1e-14)
