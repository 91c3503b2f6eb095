"""Further coordinates as the viewer draws them: units that people read, every row of a short run."""

from __future__ import annotations

from typing import Any

import numpy as np

from sinssim import data
from sinssim.data import Computed
from sinssim.experiments.run.run_recording import draw_coordinates
from sinssim.recording.streams import Stream, Vector
from sinssim.units import DEG


class Drawn:
    """Keeps what is drawn."""

    def __init__(self) -> None:
        self.series_of: dict[str, tuple[Any, ...]] = {}

    def series(self, entity: str, time: Any, values: Any, names: Any, **_: Any) -> None:
        self.series_of[entity] = time, values, names


def test_units_and_rows(monkeypatch: Any) -> None:
    monkeypatch.setattr(data, "BLOCK", 7)
    time, rng = np.arange(50.0), np.random.default_rng(1)
    far, near, angle, q = 6e6 + rng.random((50, 3)), rng.random((50, 3)), rng.random((50, 1)), rng.random((50, 4))
    stream = Stream(
        "inertial_euler",
        time,
        (
            Vector("position", ("x_i_m", "y_i_m", "z_i_m"), Computed(50, lambda rows: far[rows])),
            Vector("place", ("x_m", "y_m", "z_m"), near),
            Vector("velocity", ("vx_i_mps", "vy_i_mps", "vz_i_mps"), far),
            Vector("heading", ("heading_from_x_rad",), angle),
            Vector("attitude", ("q_ib_w", "q_ib_x", "q_ib_y", "q_ib_z"), q),
        ),
    )
    drawn: Any = Drawn()
    labels = draw_coordinates(drawn, [stream])
    where = "coordinates/inertial_euler"
    assert labels == {
        f"{where}/position": "km", f"{where}/place": "m", f"{where}/velocity": "m/s", f"{where}/heading": "deg",
        f"{where}/attitude": "", "coordinates": "yes",
    }  # fmt: skip
    for name, values in (("position", far / 1e3), ("place", near), ("heading", angle / DEG), ("attitude", q)):
        np.testing.assert_array_equal(drawn.series_of[f"{where}/{name}"][0], time)
        np.testing.assert_array_equal(drawn.series_of[f"{where}/{name}"][1], values)
    assert drawn.series_of[f"{where}/position"][2] == ["x i", "y i", "z i"]
    assert drawn.series_of[f"{where}/heading"][2] == ["heading from x"]
    assert draw_coordinates(drawn, []) == {}
