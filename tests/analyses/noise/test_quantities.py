"""The allan command on any column of a log: pressure, temperature, a run's stream, against closed forms."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
import rerun_cli
from pyarrow import parquet, table
from rerun.chunk import RrdReader

from sinssim.analyses.noise_exhibits import deviations, exhibits_of
from sinssim.analyses.noise_report import CHANNELS, chosen_channels, noise_report, unit_in_name
from sinssim.cli.app import main
from sinssim.errors import InputError
from sinssim.recording.rerun_exhibits import record

COUNT = 20_000
SIGMA = 0.25  # hPa, of a reading
AMPLITUDE, PERIOD = 3.0, 100.0  # °C, s


@pytest.fixture(scope="module")
def weather(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """White pressure and sinusoidal temperature at 1 Hz, the times in a column that does not say its unit."""
    folder = tmp_path_factory.mktemp("weather")
    time = np.arange(1.0, COUNT + 1.0)
    pressure = 1013.0 + SIGMA * np.random.default_rng(4).standard_normal(COUNT)
    temperature = 20.0 + AMPLITUDE * np.sin(2.0 * np.pi * time / PERIOD)
    np.savetxt(
        folder / "weather.csv", np.column_stack([time, pressure, temperature]), delimiter=",", comments="",
        header="t,p,air_c", fmt="%.9f",
    )  # fmt: skip
    (folder / "weather.toml").write_text('time = "t"\n', encoding="utf-8")
    return folder / "weather.csv"


def test_white_noise_of_a_quantity(weather: Path) -> None:
    """σ of a reading every T: N = σ√T, an Allan deviation of σ/√m over m readings."""
    report = noise_report(weather, columns=weather.with_suffix(".toml"), channels=["p=hPa"])
    (channel,) = report.channels
    assert (report.interval, report.count) == (1.0, COUNT)
    assert channel.fit.mean == pytest.approx(1013.0, abs=0.01)
    walk = channel.fit.estimates["N"]
    assert walk.value == pytest.approx(SIGMA, rel=0.02)
    assert walk.low < SIGMA < walk.high
    m = channel.deviation.samples
    truth = SIGMA / np.sqrt(m)
    inside = (channel.low < truth) & (truth < channel.high)
    assert np.mean(inside) > 0.8  # neighbours wander together
    assert channel.deviation.deviation[0] == pytest.approx(SIGMA, rel=0.02)
    assert channel.units.terms["N"] == ("hPa/√Hz", 1.0)
    assert channel.units.terms["K"][0] == "hPa/√s"
    assert "assumed to be in seconds" in report.remarks[0]
    assert len(report.remarks) == 1  # 1 Hz is nothing odd here


def test_a_sinusoid_in_a_quantity(weather: Path) -> None:
    """Means over m readings of A sin(2πft): A sin²(πfmT)/(m sin(πfT)), over whole periods (IEEE Std 952, C.1.6)."""
    report = noise_report(weather, columns=weather.with_suffix(".toml"), channels=["air_c"])
    (channel,) = report.channels
    m = channel.deviation.samples
    truth = AMPLITUDE * np.sin(np.pi * m / PERIOD) ** 2 / (m * np.sin(np.pi / PERIOD))
    early = m < 10 * PERIOD  # later, what is averaged is no whole number of periods, by a part of one in the record
    np.testing.assert_allclose(channel.deviation.deviation[early], truth[early], atol=0.005 * AMPLITUDE)
    assert channel.deviation.deviation.max() == pytest.approx(0.7246 * AMPLITUDE, rel=0.02)  # at τ = 0.37 of a period
    assert channel.units.rate == ("°C", 1.0)


def test_beside_gyros(tmp_path: Path) -> None:
    """A stream of a run: increments of gyros, and a temperature that is a reading."""
    rng, count, step = np.random.default_rng(5), 5000, 0.05
    names = ["time_s", *(f"dtheta_{a}_rad" for a in "xyz"), "block_c"]
    columns = [step * np.arange(1.0, count + 1.0), *(1e-6 * rng.standard_normal((3, count)) + 1e-5)]
    data = dict(zip(names, [*columns, 30.0 + 0.1 * rng.standard_normal(count)], strict=True))
    parquet.write_table(table(data), tmp_path / "log.parquet")
    report = noise_report(tmp_path / "log.parquet", channels=["block_c", "gyro_y"], start=50.0)
    assert [channel.name for channel in report.channels] == ["gyro_y", "block_c"]
    gyro, warmth = report.channels
    assert gyro.fit.estimates["N"].value == pytest.approx(1e-6 / np.sqrt(step), rel=0.05)
    assert warmth.fit.estimates["N"].value == pytest.approx(0.1 * np.sqrt(step), rel=0.05)
    assert warmth.fit.mean == pytest.approx(30.0, abs=0.01)
    assert report.duration == pytest.approx(200.0)
    assert report.remarks == ()


def test_uneven_readings_of_a_quantity(tmp_path: Path) -> None:
    """White readings, a random walk N√Δt over each interval: N is that of the mean interval."""
    rng = np.random.default_rng(6)
    steps = rng.uniform(0.5, 1.5, COUNT)
    np.savez(tmp_path / "log.npz", time_s=np.cumsum(steps), q=5.0 + 2.0 * rng.standard_normal(COUNT) / np.sqrt(steps))
    report = noise_report(tmp_path / "log.npz", channels=["q=V"])
    assert report.channels[0].fit.estimates["N"].value == pytest.approx(2.0, rel=0.03)
    assert "uneven" in report.remarks[0]


def test_columns_by_number(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    np.savetxt(tmp_path / "log.txt", np.column_stack([np.arange(1000.0), rng.standard_normal((1000, 2))]))
    (tmp_path / "log.toml").write_text('time = 1\ntime_unit = "s"\ndelimiter = "whitespace"\n', encoding="utf-8")
    report = noise_report(tmp_path / "log.txt", columns=tmp_path / "log.toml", channels=["3=mV"])
    assert report.channels[0].deviation.deviation[0] == pytest.approx(1.0, rel=0.1)
    assert report.remarks == ()
    with pytest.raises(InputError, match=r"add tables \[gyro\] and \[accel\]"):
        noise_report(tmp_path / "log.txt", columns=tmp_path / "log.toml")


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("pressure_pa", "Pa"), ("air_c", "°C"), ("rate_deg_h", "deg/h"), ("height_m", "m"), ("speed_mps", "m/s"),
        ("pressure", None), ("pa", None), ("gyro_w", None),
    ],
)  # fmt: skip
def test_the_unit_at_the_end_of_a_name(name: str, unit: str | None) -> None:
    assert unit_in_name(name) == unit


def test_names_of_channels() -> None:
    chosen = chosen_channels(["a=b=hPa", "gyro_x=V", "accel_x", "p_pa"])
    assert chosen[0] == CHANNELS[3]
    assert [(c.name, c.units.rate[0]) for c in chosen[1:]] == [("a=b", "hPa"), ("gyro_x", "V"), ("p_pa", "Pa")]
    with pytest.raises(InputError, match="with its unit, pressure=UNIT"):
        chosen_channels(["pressure"])
    with pytest.raises(InputError, match="two units, Pa and hPa"):
        chosen_channels(["p_pa", "p_pa=hPa"])


def test_what_there_is_not_is_said(weather: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no column 'time_s'.*Its columns are t, p, air_c"):
        noise_report(weather, channels=["p=hPa"])
    with pytest.raises(InputError, match="unknown column 'q'"):
        noise_report(weather, columns=weather.with_suffix(".toml"), channels=["q=hPa"])


@pytest.mark.rendered
def test_command(weather: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["allan", str(weather), "--columns", str(weather.with_suffix(".toml")), "--channel", "p=hPa"]
    plot = tmp_path / "allan.svg"
    with pytest.raises(SystemExit) as info:
        main([*given, "--quiet", "--plot", str(plot)])
    assert not info.value.code
    assert "Allan deviation [hPa]" in plot.read_text(encoding="utf-8")
    capsys.readouterr()
    with pytest.raises(SystemExit):
        main(given)
    out = capsys.readouterr().out
    for words in ("p: mean 1013 hPa", "hPa/√Hz", "hPa (1σ) of a sample", "20000 s, 20000 samples at 1 Hz"):
        assert words in out
    with pytest.raises(SystemExit):
        main([*given, "--json"])
    channel = json.loads(capsys.readouterr().out)["channels"]["p"]
    assert channel["unit"] == "hPa"
    assert channel["mean"] == pytest.approx(1013.0, abs=0.01)
    assert channel["terms"]["N"]["unit"] == "hPa/√Hz"
    assert channel["allan"]["deviation"][0] == pytest.approx(SIGMA, rel=0.02)


def test_figure_and_recording(weather: Path, tmp_path: Path) -> None:
    report = noise_report(weather, columns=weather.with_suffix(".toml"), channels=["p=hPa", "air_c"])
    assert [chart.title for chart in deviations(report)] == ["p", "air_c"]
    file = tmp_path / "noise.rrd"
    record(exhibits_of(report), file)
    binary = Path(rerun_cli.__file__).parent / "rerun"
    done = subprocess.run([binary, "rrd", "verify", file], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    entities = {chunk.entity_path for chunk in RrdReader(file).stream()}
    assert {"/noise/quantity_1", "/noise/quantity_2"} <= entities
