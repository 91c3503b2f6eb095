"""Errors of recorded sensors are states of the filter, in SI."""

from __future__ import annotations

from typing import Any

import pytest

from sinssim.errors import InputError
from sinssim.logs.log_files import other_stream, recorded_errors
from sinssim.scenario.filter_model import filter_model
from sinssim.scenario.schema import Scenario


def scenario(**other: Any) -> Scenario:
    baro = {
        "file": "x.csv", "name": "baro", "kind": "baro-height", "reading": {"column": "h", "unit": "m"},
        "sigma": {"value": 1.0, "unit": "m"},
    }  # fmt: skip
    log = {"imu": {"file": "x.csv"}, "others": [{**baro, **other}]}
    return Scenario.model_validate({"name": "x", "log": log, "imu": {"grade": "tactical"}, "filter": {"states": []}})


def test_bias_and_scale_factor_are_states() -> None:
    """30 ft are 9.144 m."""
    own = scenario(bias_sigma={"value": 30.0, "unit": "ft"}, bias_correlation_time_s=600.0, scale_sigma_ppm=2e4)
    blocks = {block.name: block for block in filter_model(own, 60.0, recorded_errors(own.log)).blocks}
    assert blocks["baro bias"].sigma == pytest.approx([9.144])
    assert blocks["baro bias"].correlation_time == 600.0
    assert blocks["baro scale"].sigma == pytest.approx([0.02])


def test_a_sensor_without_them_has_no_states() -> None:
    own = scenario()
    assert not any(block.name.startswith("baro") for block in filter_model(own, 60.0, recorded_errors(own.log)).blocks)


def test_a_wrong_bias_is_refused() -> None:
    with pytest.raises(ValueError, match="bias_sigma"):
        scenario(bias_sigma={"column": "b", "unit": "m"})
    with pytest.raises(InputError, match="unit of baro-height"):
        other_stream(scenario(bias_sigma={"value": 3.0, "unit": "deg"}).log.others[0])  # type: ignore[union-attr]
