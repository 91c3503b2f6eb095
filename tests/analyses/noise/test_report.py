"""The allan command and what is behind it: logs, channels, units, tables, JSON, figure, recording, refusals."""

from __future__ import annotations

import json
import re
import subprocess
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rerun_cli
from pyarrow import csv, parquet, table
from rerun.chunk import RrdReader

from sinssim.analyses.noise_exhibits import deviations, exhibits_of
from sinssim.analyses.noise_report import (
    CHANNELS,
    chosen_channels,
    clock,
    even_increments,
    four_digits,
    noise_report,
)
from sinssim.cli.app import main
from sinssim.errors import InputError
from sinssim.experiments.run.finished_runs import runs_in
from sinssim.logs.column_description import LogDescription
from sinssim.logs.imu_samples import Samples
from sinssim.recording.figures import figure_of
from sinssim.recording.rerun_exhibits import record
from tests.oracles import noise
from tests.recording.shown import curves_of
from tests.slow import slow

T = 0.1
COUNT = 20_000
DEG_H = np.pi / 180.0 / 3600.0
UG = 9.80665e-6
GYRO_N, ACCEL_N = 0.12 / 60.0 * np.pi / 180.0, 0.05 / 60.0  # 0.12 deg/√h; 0.05 m/s/√h
GYRO_MEAN, ACCEL_MEAN = np.array([10.0, 0.0, -11.0]) * DEG_H, np.array([0.1, 0.0, -9.81])


def increments(seed=0, count=COUNT):
    rng = np.random.default_rng(seed)
    gyro = np.stack([noise.random_walk(rng, count, T, GYRO_N) for _ in range(3)], axis=1) + GYRO_MEAN * T
    accel = np.stack([noise.random_walk(rng, count, T, ACCEL_N) for _ in range(3)], axis=1) + ACCEL_MEAN * T
    return gyro, accel


def write(path, gyro, accel, times=None):
    """Write the package's own columns."""
    ends = T * np.arange(1, len(gyro) + 1) if times is None else times
    names = ["time_s", *(f"dtheta_{a}_rad" for a in "xyz"), *(f"dvel_{a}_mps" for a in "xyz")]
    data = table(dict(zip(names, np.column_stack([ends, gyro, accel]).T, strict=True)))
    (parquet.write_table if path.suffix == ".parquet" else csv.write_csv)(data, path)
    return path


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return write(tmp_path_factory.mktemp("log") / "imu.parquet", *increments())


@pytest.fixture(scope="module")
def report(log):
    return noise_report(log)


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as info:
        main(["allan", *map(str, arguments)])
    captured = capsys.readouterr()
    return info.value.code or 0, captured.out, captured.err


def test_every_channel_in_datasheet_lines(report):
    found = report.to_json()
    assert found["duration_s"] == pytest.approx(2000.0)
    assert found["samples"] == COUNT
    assert found["interval_s"] == pytest.approx(T)
    assert list(found["channels"]) == ["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"]
    for name, channel in found["channels"].items():
        walk = channel["terms"]["N"]
        truth, unit = (0.12, "deg/√h") if name.startswith("gyro") else (0.05 / 60.0 / UG, "µg/√Hz")
        assert walk["unit"] == unit
        assert walk["value"] == pytest.approx(truth, rel=0.02)
        assert walk["low"] < walk["value"] < walk["high"]
        assert channel["terms"]["K"]["value"] is None
        assert channel["remarks"] == []
        key = "deg_h" if name.startswith("gyro") else "ug"
        allan = channel["allan"]
        # N/√τ in the unit of rates: 0.12 deg/√h is 0.12·60 deg/h over a second
        first = truth * 60.0 if name.startswith("gyro") else truth
        assert allan["tau_s"][0] == pytest.approx(T)
        assert allan[f"deviation_{key}"][0] == pytest.approx(first / np.sqrt(T), rel=0.02)
        assert allan[f"fit_{key}"][0] == pytest.approx(first / np.sqrt(T), rel=0.02)
        assert allan[f"low_{key}"][-1] < allan[f"deviation_{key}"][-1] < allan[f"high_{key}"][-1]
        assert allan["degrees_of_freedom"][0] > 1e4 > 10.0 > allan["degrees_of_freedom"][-1]
    assert found["channels"]["gyro_x"]["mean_deg_h"] == pytest.approx(10.0, abs=1.0)
    assert found["channels"]["accel_z"]["mean_ug"] == pytest.approx(-9.81 / UG, rel=1e-5)


@pytest.mark.parametrize(
    ("symbol", "gyro", "accel"),
    [
        ("Q", np.pi / 648000.0, 1e-3),
        ("N", np.pi / 180.0 / 60.0, UG),
        ("B", DEG_H, UG),
        ("K", DEG_H / 60.0, UG / 60.0),
        ("R", DEG_H / 3600.0, UG / 3600.0),
        ("sigma_b", DEG_H, UG),
    ],
)
def test_units_by_their_definitions(symbol, gyro, accel):
    from sinssim.analyses.noise_report import UNITS

    assert UNITS["gyro"].terms[symbol][1] == pytest.approx(gyro, rel=1e-12)
    assert UNITS["accel"].terms[symbol][1] == pytest.approx(accel, rel=1e-12)


def test_rates_at_rounded_times_in_other_axes(tmp_path):
    """A text log in right-forward-up, deg/s and g, its times rounded to a tenth of a millisecond."""
    gyro, accel = increments(1)
    rates = np.degrees(gyro / T)[:, [1, 0, 2]] * [1, 1, -1]
    forces = (accel / T / 9.80665)[:, [1, 0, 2]] * [1, 1, -1]
    ends = np.round(T * np.arange(1, COUNT + 1) + np.random.default_rng(0).uniform(-3e-4, 3e-4, COUNT), 4)
    np.savetxt(tmp_path / "log.txt", np.column_stack([ends, rates, forces]), fmt="%.12e")
    (tmp_path / "log.toml").write_text(
        'kind = "rates"\ntime = 1\ntime_unit = "s"\ndelimiter = "whitespace"\naxes = ["right", "forward", "up"]\n'
        '[gyro]\ncolumns = [2, 3, 4]\nunit = "deg/s"\n[accel]\ncolumns = [5, 6, 7]\nunit = "g"\n'
    )
    both = {"channels": ["gyro_y", "accel_x"]}
    found = noise_report(tmp_path / "log.txt", columns=tmp_path / "log.toml", **both)
    own = noise_report(write(tmp_path / "own.csv", gyro, accel), **both)
    assert found.remarks == ()
    for a, b in zip(found.channels, own.channels, strict=True):
        assert a.name == b.name
        assert a.fit.mean == pytest.approx(b.fit.mean, rel=1e-6, abs=1e-12)
        np.testing.assert_allclose(a.deviation.deviation, b.deviation.deviation, rtol=1e-5)


def test_a_run_directory(tmp_path, report):
    (tmp_path / "run" / "streams").mkdir(parents=True)
    write(tmp_path / "run" / "streams" / "imu_measured.parquet", *increments())
    found = noise_report(tmp_path / "run", channels=["gyro_z"])
    assert [channel.name for channel in found.channels] == ["gyro_z"]
    np.testing.assert_array_equal(found.channels[0].deviation.deviation, report.channels[2].deviation.deviation)


def test_gyros_alone_need_no_accelerometers(tmp_path):
    gyro, _ = increments()
    np.savez(tmp_path / "log.npz", w=gyro)
    (tmp_path / "log.toml").write_text('rate_hz = 10\n[gyro]\ncolumns = "w"\nunit = "rad"\n')
    found = noise_report(tmp_path / "log.npz", columns=tmp_path / "log.toml", channels=["gyro"])
    assert [channel.name for channel in found.channels] == ["gyro_x", "gyro_y", "gyro_z"]


def test_a_part_of_a_log(log):
    part = noise_report(log, channels=["gyro_x"], start=500.0, end=1500.0)
    assert part.duration == pytest.approx(1000.0)
    assert part.count == 10_000
    gyro, _ = increments()
    np.testing.assert_allclose(part.channels[0].fit.mean * 1000.0, gyro[5000:15000, 0].sum(), rtol=1e-9)


def test_uneven_times_keep_the_noise_and_are_said(tmp_path):
    """Integrals over truly uneven intervals: the random walk is what it was."""
    rng = np.random.default_rng(3)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 0.15, COUNT))])
    steps = np.diff(times)
    gyro = GYRO_N * np.sqrt(steps)[:, None] * rng.standard_normal((COUNT, 3)) + GYRO_MEAN * steps[:, None]
    accel = ACCEL_N * np.sqrt(steps)[:, None] * rng.standard_normal((COUNT, 3)) + ACCEL_MEAN * steps[:, None]
    found = noise_report(write(tmp_path / "log.parquet", gyro, accel, times[1:]))
    after = steps[1:]  # the length of the first one is not given
    assert f"uneven by up to {100.0 * np.abs(after / after.mean() - 1.0).max():.3g} % of an int" in found.remarks[0]
    for channel, truth in zip(found.channels, [GYRO_N] * 3 + [ACCEL_N] * 3, strict=True):
        assert channel.fit.estimates["N"].value == pytest.approx(truth, rel=0.03)
        i = int(np.searchsorted(channel.deviation.tau, 2.0))
        tau = channel.deviation.tau[i]
        assert channel.deviation.deviation[i] == pytest.approx(truth / np.sqrt(tau), rel=0.06)


def test_uneven_rates_hold_their_mean():
    """A constant rate stays one, however uneven its samples are."""
    times = np.concatenate([[0.0], np.cumsum(np.random.default_rng(0).uniform(0.5, 1.5, 400))])
    for kind, values in (("rates", np.full((400, 3), 2.0)), ("increments", np.outer(np.diff(times), [2.0, 2.0, 2.0]))):
        samples = Samples(kind, times, {"gyro": np.asarray(values)})
        timing = clock(samples, "log")
        assert not timing.even
        np.testing.assert_allclose(even_increments(samples, CHANNELS[0], timing), 2.0 * timing.interval, rtol=1e-12)


def test_a_constant_channel_is_left_out_unless_it_was_asked_for(tmp_path):
    gyro, accel = increments()
    gyro[:, 1] = 1e-5
    file = write(tmp_path / "log.parquet", gyro, accel)
    found = noise_report(file)
    assert [channel.name for channel in found.channels] == ["gyro_x", "gyro_z", "accel_x", "accel_y", "accel_z"]
    assert found.remarks == ("gyro_y is left out: it is constant.",)
    with pytest.raises(InputError, match=r"log.parquet, gyro_y: all 20000 samples are 1e-05: a constant channel"):
        noise_report(file, channels=["gyro_y"])
    with pytest.raises(InputError, match="all channels are constant"):
        noise_report(write(tmp_path / "flat.parquet", 0.0 * gyro + 1.0, 0.0 * accel))


@pytest.mark.parametrize(("misfit", "said"), [(0.05, "describe the spectrum to 5 % only"), (0.6, "by 60 % rms")])
def test_a_misfit_is_said_in_per_cent(report, misfit, said):
    channel = report.channels[0]
    remarks = list(replace(channel, fit=replace(channel.fit, misfit=misfit)).remarks())
    assert any(said in remark for remark in remarks)


def test_a_spike_is_said_with_its_time(tmp_path):
    gyro, accel = increments(count=5000)
    sigma = GYRO_N * T**0.5
    gyro[1234, 0] += 40.0 * sigma
    gyro[1234, 1] += 3.0 * sigma
    found = noise_report(write(tmp_path / "log.parquet", gyro, accel), channels=["gyro"])
    time, size = found.channels[0].spike
    assert time == pytest.approx(123.5)
    assert size == pytest.approx(2.0 * 40.0 / 6.0**0.5, rel=0.1)  # 1, −2, 1 of noises
    assert any("sample at 123.5 s is 3" in remark for remark in found.channels[0].remarks())
    assert [channel.spike for channel in found.channels[1:]] == [None, None]


@pytest.mark.parametrize(("factor", "said"), [(1.0, ""), (T, "mean specific force is 0.981 m/s²"), (0.0, "is 0.")])
def test_accelerometers_that_do_not_feel_gravity_are_said(tmp_path, factor, said):
    """For example rates that are taken for increments."""
    gyro, accel = increments(count=1000)
    accel += (factor - 1.0) * ACCEL_MEAN * T
    remarks = " ".join(noise_report(write(tmp_path / "log.parquet", gyro, accel), channels=["accel_x"]).remarks)
    assert (remarks == "") == (said == "")
    assert said in remarks


def test_channels_by_name():
    assert chosen_channels([]) == chosen_channels(["accel", "gyro", "gyro_x"])
    assert chosen_channels(["accel_z", "gyro_y"]) == [CHANNELS[1], CHANNELS[5]]
    with pytest.raises(InputError, match=r"unknown channel 'gyro_w'. Did you mean 'gyro_.'"):
        chosen_channels(["gyro_w"])


def test_progress_goes_from_reading_to_the_end(log):
    told = []
    noise_report(log, channels=["gyro_x", "accel_y"], progress=lambda what, share: told.append((what, share)))
    assert told[0] == ("Reading imu.parquet", 0.0)
    assert told[-1][1] == 1.0
    assert ("Allan deviation of accel_y", 0.75) in told
    assert [share for _, share in told] == sorted(share for _, share in told)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.15, "0.1500"), (1234.0, "1234"), (0.0, "0"), (-98.7654, "-98.77"), (2.1e-7, "2.100e-07"), (3e8, "3.000e+08")],
)
def test_four_digits(value, text):
    assert four_digits(value) == text


# The command


def test_tables(log, capsys):
    code, out, err = run(capsys, log, "--channel", "gyro_x", "--channel", "accel_z")
    assert code == 0
    assert err == ""
    assert "2000 s, 20000 samples at 10 Hz" in out
    assert "gyro_x: mean" in out
    for words in ("random walk", "deg/√h", "deg/h/√Hz", "µg/√Hz", "m/s/√h", "not observable", "< "):
        assert words in out
    assert "gyro_y" not in out


def test_json_alone_on_standard_output(log, capsys):
    code, out, _ = run(capsys, log, "--channel", "gyro_x", "--json")
    assert code == 0
    assert list(json.loads(out)["channels"]) == ["gyro_x"]


def test_known_correlation_time(log, capsys):
    code, out, _ = run(capsys, log, "--channel", "gyro_x", "--correlation-time", "100", "--json")
    channel = json.loads(out)["channels"]["gyro_x"]
    assert code == 0
    assert set(channel["terms"]) == {"Q", "N", "B", "K", "R", "sigma_b"}
    assert channel["correlation_time_s"] == 100.0
    assert channel["correlation_time_band_s"] is None


@pytest.mark.rendered
@pytest.mark.parametrize("suffix", [".svg", *slow(".png", ".pdf")])
def test_plot(log, capsys, tmp_path, suffix):
    file = tmp_path / f"allan{suffix}"
    code, out, _ = run(capsys, log, "--channel", "gyro_x", "--plot", file, "--quiet")
    assert (code, out) == (0, "")
    head = file.read_bytes()[:500]
    assert {".svg": b"<svg", ".png": b"\x89PNG", ".pdf": b"%PDF"}[suffix] in head
    if suffix == ".svg":
        text = file.read_text(encoding="utf-8")
        for words in ("averaging time τ [s]", "Allan deviation [deg/h]", "95 % band", "deg/√h"):
            assert words in text


def test_a_chart_for_each_channel(report):
    charts = list(deviations(report))
    assert [chart.title.split()[0] for chart in charts] == [channel.name for channel in report.channels]
    assert [chart.heading(True).split()[-1] for chart in charts] == ["[deg/h]"] * 3 + ["[µg]"] * 3
    for chart, channel in zip(charts, report.channels, strict=True):
        np.testing.assert_array_equal(chart.marks[1].y, channel.deviation.deviation)
        low, high = chart.ends(upright=True)
        assert low < channel.low.min() < channel.deviation.deviation.max() < high


def test_every_axis_shows_two_numbers(tmp_path):
    """Also of flicker alone, whose deviations are all alike."""
    gyro, accel = increments(count=1000)
    gyro[:, 0] = noise.flicker(np.random.default_rng(3), 1000, T, 3.0 * DEG_H)
    flat = noise_report(write(tmp_path / "log.parquet", gyro, accel), channels=["gyro_x"])
    (panel,) = figure_of(deviations(flat)).axes
    found = flat.channels[0].deviation.deviation / DEG_H
    assert found.max() < 3.0 * found.min()
    bottom, top = panel.get_ylim()
    assert bottom < found.min() < found.max() < top
    assert sum(bottom <= at <= top for at in panel.get_yticks()) >= 2


def test_recording(report, tmp_path):
    file = tmp_path / "made" / "noise.rrd"
    record(exhibits_of(report), file)
    binary = Path(rerun_cli.__file__).parent / "rerun"
    done = subprocess.run([binary, "rrd", "verify", file], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    chunks = list(RrdReader(file).stream().filter(content="/noise/gyro/rate"))
    assert 8000 < sum(chunk.num_rows for chunk in chunks if not chunk.is_static) <= 8192  # what a screen can show
    entities = {chunk.entity_path for chunk in RrdReader(file).stream()}
    assert {"/noise/gyro/rate", "/noise/gyro/sum", "/noise/accel/sum", "/noise/figures/allan_deviation"} <= entities
    assert "/noise/tables" in entities
    assert [path.name for path in file.parent.iterdir()] == ["noise.rrd"]


def test_the_directory(log, capsys, tmp_path):
    """All curves of its page can be zoomed: Allan deviations, which have a scale of their own, and the record."""
    place = tmp_path / "noise"
    code, out, _ = run(capsys, log, "--channel", "gyro_x", "--json", "-o", place)
    assert (code, json.loads(out)) == (0, json.loads((place / "noise.json").read_text(encoding="utf-8")))
    assert (place / "recording.rrd").is_file()
    curves = curves_of(place / "report.html")
    assert [(chart["key"], chart["timed"]) for chart in curves] == [
        ("gyro_x", False), ("gyro/rate", True), ("gyro/sum", True),
    ]  # fmt: skip
    assert [entry.kind for entry in runs_in(tmp_path)] == ["noise analysis"]
    code, _, err = run(capsys, tmp_path / "none.csv", "-o", place)
    assert code == 2
    assert "--overwrite" in err  # before anything is read


def test_a_recording_that_cannot_be_written(report, tmp_path):
    from sinssim.errors import RunError

    (tmp_path / "file").write_text("")
    with pytest.raises(RunError, match="cannot be written"):
        record(exhibits_of(report), tmp_path / "file" / "noise.rrd")


def bad(kind, tmp_path):
    """Return the arguments for a log with something wrong."""
    gyro, accel = increments(count=1000)
    times = T * np.arange(1, 1001)
    match kind:
        case "nan":
            gyro[123, 1] = np.nan
        case "short":
            gyro, accel, times = gyro[:100], accel[:100], times[:100]
        case "unordered":
            times[[500, 501]] = times[[501, 500]]
        case "gap":
            times[700:] += 12.0
    return write(tmp_path / "log.parquet", gyro, accel, times)


@pytest.mark.parametrize(
    ("kind", "options", "said"),
    [
        ("nan", [], "log.parquet, sample 123: the column 'dtheta_y_rad' is empty or not finite"),
        ("short", [], "log.parquet, gyro_x: 100 samples are too few to distinguish noise terms; at least 256"),
        ("unordered", [], "log.parquet, sample 501: the time 50.1 s is not later than 50.2 s"),
        ("gap", [], "log.parquet, sample 700: there are no samples for 12.1 s from 70 s on"),
        ("gap", ["--to", "90"], "log.parquet, sample 700: there are no samples for 12.1 s"),
        ("good", ["--from", "200"], "there are no samples from 200 s; the log runs from 0 to 100 s"),
        (
            "good",
            ["--correlation-time", "-1"],
            "gyro_x: correlation_time = -1.0 must be one positive number",
        ),
        ("good", ["--from", "9", "--to", "3"], "there are no samples from 9 s to 3 s; the log runs from 0 to 100 s"),
        ("good", ["--channel", "gyrox"], "unknown channel 'gyrox'. Did you mean 'gyro_x'"),
        ("good", ["--plot", "allan.bmp"], "the file name of a figure must end in .svg, .png, .pdf"),
    ],
)
def test_refusals_in_one_paragraph(kind, options, said, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, bad(kind, tmp_path), *options)
    assert code == 2
    assert out == ""
    assert said in " ".join(err.split())
    assert err.count("\n") == 1


def test_what_is_no_log(tmp_path, capsys):
    code, _, err = run(capsys, tmp_path)
    assert code == 2
    assert "is not a run directory: it has no streams/imu_measured.parquet" in err
    code, _, err = run(capsys, tmp_path / "log.parquet")
    assert code == 2
    assert "cannot be read" in err


@pytest.mark.parametrize("kind", ["gap"])
def test_a_part_before_a_gap(kind, tmp_path):
    assert noise_report(bad(kind, tmp_path), channels=["gyro_x"], end=70.0).count == 700


PAGE = Path(__file__).parent.parent.parent.parent / "docs" / "allan.md"


@pytest.mark.slow
def test_the_example_of_the_documentation(tmp_path, capsys, monkeypatch):
    """Its code runs, and prints the numbers of the page, which hold what its code puts in."""
    monkeypatch.chdir(tmp_path)
    page = PAGE.read_text(encoding="utf-8")
    make, use = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    times, description = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    assert LogDescription(**tomllib.loads(times)).stated_time_unit == "ms"
    exec(compile(make, str(PAGE), "exec"), {})
    Path("bench.toml").write_text(description)
    printed = re.search(r"\$ sinssim allan (.*?)\n(.*?)```", page, re.DOTALL)
    arguments = [a for a in printed[1].split() if a not in ("--plot", "allan.png")]
    _, out, _ = run(capsys, *arguments)
    shown = out.translate(str.maketrans("│┃", "  "))
    for line in printed[2].splitlines():
        words = line.split()
        assert any(words == other.split() for other in shown.splitlines()), line

    found = noise_report(Path("bench.npz"), columns=Path("bench.toml"), channels=["gyro_x", "accel_x"])
    gyro, accel = (channel.fit.estimates for channel in found.channels)
    for estimate, truth in (
        (gyro["Q"], 1.5 / 12**0.5 * DEG_H),
        (gyro["N"], 0.15 * DEG_H * 60.0),
        (gyro["B"], 2.0 * DEG_H),
        (gyro["R"], 12.0 * DEG_H / 3600.0),
        (accel["N"], 0.06 / 60.0),
        (accel["B"], 30.0 * UG),
        (accel["sigma_b"], 300.0 * UG),
    ):
        assert estimate.low < truth < estimate.high
    exec(compile(use, str(PAGE), "exec"), {})
    assert capsys.readouterr().out.startswith("gyro_x")
