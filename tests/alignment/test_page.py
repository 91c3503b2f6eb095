"""The documentation's examples run as they are printed."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from sinssim.alignment import ideal_readings
from sinssim.cli.app import main

PAGE = (Path(__file__).parents[2] / "docs" / "alignment.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def sinssim(line):
    with pytest.raises(SystemExit) as info:
        main(shlex.split(line, comments=True)[1:])
    return info.value.code or 0


def test_python(capsys):
    names: dict[str, object] = {}
    for block in blocks("python"):
        exec(block, names)
    assert names["off"] == pytest.approx(names["first_order"].heading, rel=1e-2)
    assert np.degrees(names["first_order"].heading) * 60 == pytest.approx(-3.6 * np.cos(0.7), abs=0.1)
    assert names["sigma"].shape == (161, 360)
    assert abs(names["found"].heading - 0.7) < 4 * names["expected"].heading
    assert names["enough"] == pytest.approx(322, abs=1)
    assert np.degrees(np.ptp(names["turned"].headings)) == pytest.approx(180.0)
    assert names["p0"].shape == (15, 15)


@pytest.mark.parametrize("index", [0, 1])
def test_logs(tmp_path, capsys, index):
    """A log that is made by hand as the description says, from the ideal readings."""
    gyro, accel = ideal_readings(*np.radians([123.0, 2.0, -3.0, 50.0]))
    time = np.arange(1, 1201) * 0.05
    if index == 0:  # milliseconds, right-forward-up, deg/h and mg
        rows = [1e3 * time, *(np.degrees([gyro[1], gyro[0], -gyro[2]]) * 3600), *(accel[[1, 0, 2]] / 9.80665e-3)]
        rows[-1] = -rows[-1]
        begin, separator = "t,wx,wy,wz,fx,fy,fz\n", ","
    else:
        rows, begin, separator = [time, *gyro, *accel], "my unit\ns rad/s m/s2\n", "   "
    table = np.column_stack(np.broadcast_arrays(*rows))
    (tmp_path / "log.txt").write_text(begin + "\n".join(separator.join(map(repr, row)) for row in table.tolist()))
    (tmp_path / "log.toml").write_text(blocks("toml")[index])
    assert sinssim(f"sinssim align {tmp_path}/log.txt --columns {tmp_path}/log.toml --json") == 0
    result = json.loads(capsys.readouterr().out)
    for name, value in (("heading", 123.0), ("roll", 2.0), ("pitch", -3.0), ("latitude", 50.0)):
        assert result[f"{name}_deg"] == pytest.approx(value, abs=1e-7)


@pytest.mark.slow
def test_commands(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rate, force = (np.tile(reading, (1200, 1)) for reading in ideal_readings(0.3, 0.0, 0.0, np.radians(50.0)))
    columns = [1e2 * np.arange(1, 1201)[:, None], *(np.degrees(rate[:, [1, 0, 2]] * [1, 1, -1]) * 3600,)]
    table = np.hstack([*columns, force[:, [1, 0, 2]] * [1, 1, -1] / 9.80665e-3])
    np.savetxt("log.csv", table, delimiter=",", header="t,wx,wy,wz,fx,fy,fz", comments="", fmt="%.17g")
    Path("log.toml").write_text(blocks("toml")[0])
    lines = [line for line in blocks("sh")[0].splitlines() if line.startswith("sinssim align")]
    assert len(lines) == 4
    for line in lines:
        assert sinssim(line) == 0, capsys.readouterr().err
    assert Path("expected.svg").exists()
    assert Path("parked.rrd").stat().st_size > 10_000
