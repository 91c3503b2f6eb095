"""Names of columns: every quantity carries its unit, once."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.recording.store.streams import channel_streams
from sinssim.truth.trajectory import Channel


@pytest.mark.parametrize(
    ("name", "unit", "column"),
    [
        ("airspeed_mps", "m/s", "airspeed_mps"),
        ("thrust_n", "N", "thrust_n"),
        ("load_factor", "g", "load_factor_g"),
        ("throttle", "", "throttle"),
        ("climb", "m/s", "climb_mps"),
    ],
)
def test_columns_of_channels_carry_their_unit_once(name: str, unit: str, column: str) -> None:
    (stream,) = channel_streams({name: Channel(np.arange(3.0), np.zeros(3), unit)})
    assert stream.vectors[0].columns == (column,)
