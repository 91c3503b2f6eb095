"""A one-component run in the viewer: curves, panels and the pendulum from errors that are chosen."""

from __future__ import annotations

from typing import Any

import numpy as np

from sinssim.experiments.run import one_component_exhibits as shown
from sinssim.experiments.run import one_component_exhibits as view
from tests.recording.made_one_component import ARCMIN, COORDINATE, TIME, result
from tests.recording.spies import Drawn, record, values_of

SIMULATION, CLOSED, FIRST, PENDULUM, ALONG = (
    (0, 114, 178),
    (230, 159, 0),
    (204, 121, 167),
    (0, 158, 115),
    (120, 100, 200),
)
ORANGE, GREEN, BLUE = (213, 94, 0), (0, 158, 115), (86, 180, 233)


def beside(*factors: float) -> Any:
    return np.outer(COORDINATE, factors)


def test_errors_and_panels() -> None:
    drawn = record(shown.plane_charts(result()))
    assert drawn.labels["source_1 title"] == "Δy due to the gyro bias alone"
    assert drawn.labels["source_2 title"] == "Δy due to the tilt <0> alone"
    units = {key: drawn.labels[key] for key in ("source_1", "difference", "velocity_error", "pitch_error")}
    assert units == {"source_1": "arcmin ≈ nmi", "difference": "arcsec", "velocity_error": "mm/s",
                     "pitch_error": "arcmin"}  # fmt: skip
    names = ["closed form at rest", "first order (8.12)", "equation (8.11)", "simulation"]
    colors = [CLOSED, FIRST, PENDULUM, SIMULATION]
    drawn.shows("coordinate", names, TIME, beside(2.5, 1.5, 1.02, 1.0), colors)
    drawn.shows("difference", ["equation (8.10)", "equation (8.11)"], TIME, beside(1.2, 1.8), [ALONG, PENDULUM])
    both, colors = ["closed form at rest", "simulation"], [CLOSED, SIMULATION]
    drawn.shows("source_1", both, TIME, beside(0.75, 0.5), colors)
    drawn.shows("source_2", both, TIME, beside(3.5, 3.0), colors)
    pair, paint = ["equation (8.11)", "simulation"], [PENDULUM, SIMULATION]
    drawn.shows("velocity_error", pair, TIME, np.outer([10.0, 20.0, -40.0, 30.0], (1.02, 1.0)), paint)
    drawn.shows("pitch_error", pair, TIME, np.outer([3.0, 6.0, 12.0, -24.0], (1.02, 1.0)), paint)
    widths = drawn.lines["coordinate"][4]
    assert widths == sorted(widths, reverse=True)
    assert len(set(widths)) == 4
    single: Any = result()
    single.by_source = single.by_source[:1]
    assert "source_1" not in record(shown.plane_charts(single)).lines


def test_the_motion() -> None:
    drawn = record(shown.plane_charts(result()))
    drawn.shows("velocity", ["velocity"], TIME, [[200.0], [210.0], [230.0], [195.0]], [GREEN])
    drawn.shows("height", ["height"], TIME, [[900.0], [950.0], [920.0], [970.0]], [BLUE])
    drawn.shows("body_pitch", ["pitch"], TIME, [[5.0], [7.0], [1.0], [6.0]], [ORANGE])
    force = [[0.25, -0.3], [0.5, -0.05], [-0.75, 0.7], [0.125, 0.075]]
    drawn.shows("force", ["horizontal aξ", "vertical aη − g"], TIME, force, [ORANGE, BLUE])


def test_the_pendulum_is_enlarged_by_a_round_number() -> None:
    """The largest angle is 10 arcmin: 35° is 210 times as large, rounded down to 200. Down is positive."""
    drawn: Any = Drawn()
    assert view._draw_pendulum(drawn, result()) == {"enlarged": "200"}
    for name, factor in (("closed", 2.5), ("simulation", 1.0)):
        angle = 200.0 * factor * COORDINATE * ARCMIN
        time, columns = drawn.moving[f"one_component/pendulum/{name}/bob"]
        np.testing.assert_array_equal(time, TIME)
        bob = np.column_stack((np.sin(angle), np.cos(angle)))
        np.testing.assert_allclose(np.squeeze(values_of(next(iter(columns)))), bob, rtol=1e-6)
        _, rods = drawn.moving[f"one_component/pendulum/{name}/rod"]
        ends = np.stack((np.zeros_like(bob), bob), axis=1)
        np.testing.assert_allclose(np.squeeze(values_of(next(iter(rods)))), ends, rtol=1e-6)
    words = drawn.fixed["one_component/pendulum/words"]
    assert values_of(words.labels) == ["Δy = 0: true vertical", "closed form at rest", "simulation"]
    assert [color >> 8 for color in values_of(words.colors)] == [0x787878, 0xE69F00, 0x0072B2]
    colors = {name: values_of(drawn.fixed[f"one_component/pendulum/{name}/bob"].colors)[0] >> 8
              for name in ("closed", "simulation")}  # fmt: skip
    assert colors == {"closed": 0xE69F00, "simulation": 0x0072B2}
    rim, plumb = values_of(drawn.fixed["one_component/pendulum/scale"].strips)
    assert np.round(plumb, 6).tolist() == [[0.0, 0.0], [0.0, 1.08]]
    np.testing.assert_allclose(np.hypot(*np.array(rim).T), 1.0, rtol=1e-6)
    np.testing.assert_allclose(rim[-1], [np.sin(np.radians(45.5)), np.cos(np.radians(45.5))], rtol=1e-6)
