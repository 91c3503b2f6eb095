"""A sensor with a kind of measurement of its own, in one file of a project."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.errors import InputError
from sinssim.sensors.aiding_registry import KINDS
from tests.extending.pages import read_page

SCENARIO: dict[str, Any] = {
    "name": "by_beacon",
    "great_circle": {
        "latitude_deg": 50.0, "longitude_deg": 14.0, "course_deg": 90.0, "altitude_m": 3000.0, "speed_mps": 200.0,
        "duration_s": 20.0,
    },
    "imu": {"grade": "tactical", "rate_hz": 20.0},
    "navigation": {"initial_error": {"position_sigma_m": 200.0}},
    "filter": {"rate_hz": 2.0},
}  # fmt: skip


def project(folder: Path, **replaced: str) -> dict[str, Any]:
    """Return a scenario on the sensor of the page, which lies in a project folder."""
    text = next(block.code for block in read_page("measurement-kind").files if block.language == "python")
    for old, new in replaced.items():
        text = text.replace(old, new)
    (folder / "aiding").mkdir()
    (folder / "aiding" / "beacon.py").write_text(text, encoding="utf-8")
    beacon = {"latitude_deg": 50.1, "longitude_deg": 14.1, "rate_hz": 2.0, "lever_arm_m": [2.0, 0.0, -1.0]}
    return {**SCENARIO, "use": [str(folder)], "aiding": {"beacon": beacon}}


def test_the_filter_takes_readings_of_an_own_kind(tmp_path: Path) -> None:
    """Ranges to one beacon shrink the position's σ along the line of sight; its error agrees with its σ."""
    result = sinssim.run(sinssim.Scenario.model_validate(project(tmp_path)))
    assert result.aided is not None
    found = result.aided.estimate
    (innovations,) = found.innovations
    assert (innovations.sensor, innovations.kind, int(innovations.accepted.sum())) == ("beacon", "range", 40)
    assert found.sigma[-1, :2].min() < 0.3 * found.sigma[0, :2].min()
    assert np.abs(result.aided.error.position_ned[-1, :2] / found.sigma[-1, :2]).max() < 4.0
    assert "range_m" in result.streams["aiding_beacon"].columns


def test_a_wrong_kind_is_explained(tmp_path: Path) -> None:
    given = project(tmp_path, **{"return distance - value[:, :1], h": "return distance - value, h"})
    with pytest.raises(InputError, match=r"beacon.py.*residuals have the shape \(\d, 4\); \(\d, 1\) is needed"):
        sinssim.run(sinssim.Scenario.model_validate(given))


def test_a_kind_without_its_unit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"beacon.py.*missing 1 required keyword-only argument: 'unit'"):
        sinssim.Scenario.model_validate(project(tmp_path, **{'            unit="m",\n': ""}))


def test_a_kind_of_another_sensor_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="speed is the name of a kind of measurement of sinssim; rename its own"):
        sinssim.Scenario.model_validate(project(tmp_path, **{'"range",': '"speed",'}))


@pytest.fixture(autouse=True)
def _forgotten() -> Any:
    from sinssim.system.registries import forget

    yield
    forget("beacon")
    assert "range" not in KINDS
