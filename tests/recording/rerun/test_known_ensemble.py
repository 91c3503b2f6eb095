"""Growth, cloud, σ and consistency of an ensemble in the viewer, from numbers that are chosen."""

from __future__ import annotations

from typing import Any

import numpy as np

from sinssim.experiments.ensembles import ensemble_recording as view
from tests.recording.made_ensemble import NUMBERS, TIME, Result
from tests.recording.spies import Drawn, values_of

CEP, R95, TINT_CEP, TINT_R95 = (0, 158, 115), (0, 114, 178), (90, 153, 136), (90, 135, 161)
MET, NOT_MET = (0, 158, 115), (213, 94, 0)
NONE = np.nan


def test_growth_and_limits() -> None:
    drawn: Any = Drawn()
    result: Any = Result(
        ("cep(60 s) <= 30 m", "met"), ("rate(end) <= 0.4 m/s", "undecided"), ("r95(run) <= 70 m", "not met")
    )
    assert view._draw_growth(drawn, result) == {"position": "m"}
    values = [[0.0] * 6, [4.5, 3.0, 8.5, 13.0, 10.0, 17.0], [42.0, 35.0, 60.0, 90.0, 75.0, NONE]]
    names = ["CEP", "CEP, low", "CEP, high", "R95", "R95, low", "R95, high"]
    colors = [CEP, TINT_CEP, TINT_CEP, R95, TINT_R95, TINT_R95]
    drawn.shows("ensemble/growth", names, TIME, values, colors)
    assert drawn.lines["ensemble/growth"][4] == [2.2, 0.8, 0.8, 2.2, 0.8, 0.8]
    # 60 s after the start at 100 s; 0.4 m/s over 300 s
    dots = {name: (one[0].tolist(), one[1].tolist(), one[2], one[3]) for name, one in drawn.dots.items()}
    assert dots.pop("ensemble/growth/limit_1") == ([160.0], [[30.0]], ["cep(60 s) <= 30 m: met"], MET)
    time, height, *_ = dots.pop("ensemble/growth/limit_2")
    np.testing.assert_allclose((time[0], height[0][0]), (400.0, 120.0))
    drawn.shows("ensemble/growth/limit_3", ["r95(run) <= 70 m: not met"], [100.0, 400.0], [[70.0], [70.0]], [NOT_MET])
    np.testing.assert_allclose(drawn.ranges["ensemble/growth"], (0.0, 120.0))


def test_the_cloud_of_positions() -> None:
    """East to the right, north up, where the picture's y points down; failed runs are left out."""
    drawn: Any = Drawn()
    result: Any = Result()
    view._draw_cloud(drawn, result, {"cep": result.cep, "r95": result.r95}, 0.5)
    time, parts = drawn.moving["ensemble/cloud/runs"]
    np.testing.assert_array_equal(time, TIME)
    frames = [np.array(frame).tolist() for frame in values_of(next(iter(parts)))]
    assert frames == [
        [[0.0, -0.0]] * 4, [[8.0, -6.0], [12.0, 8.0], [-24.0, -10.0]],
        [[-20.0, -60.0], [50.0, -40.0], [30.0, 100.0], [80.0, 20.0]],
    ]  # fmt: skip
    for key, radius in (("cep", [0.0, 9.0, 84.0]), ("r95", [0.0, 26.0, 180.0])):
        _, rings = drawn.moving[f"ensemble/cloud/{key}"]
        for ring, wanted in zip(values_of(next(iter(rings))), radius, strict=True):
            np.testing.assert_allclose(np.hypot(*np.squeeze(ring).T), wanted, rtol=1e-6, atol=1e-9)
    assert [values_of(drawn.fixed[f"ensemble/cloud/{key}"].colors)[0] >> 8 for key in ("cep", "r95", "runs")] == [
        0x009E73, 0x0072B2, 0x969696,
    ]  # fmt: skip
    words = drawn.fixed["ensemble/cloud/words"]
    assert values_of(words.labels) == ["north", "east"]
    np.testing.assert_allclose(values_of(words.positions), [[0.0, -105.0], [105.0, 0.0]], rtol=1e-6)
    cross = values_of(drawn.fixed["ensemble/cloud/axes"].strips)
    assert cross == [[[-100.0, 0.0], [100.0, 0.0]], [[0.0, -100.0], [0.0, 100.0]]]


def test_sigma_by_component_and_consistency() -> None:
    drawn: Any = Drawn()
    result: Any = Result(("position_east(end) <= 80 m", "met"), ("heading(60 s) <= 20 arcmin", "not met"))
    assert view._draw_components(drawn, result) == {
        "sigma_position": "m", "sigma_velocity": "mm/s", "sigma_attitude": "arcmin",
    }  # fmt: skip
    axes = ["north", "east", "down"]
    drawn.shows("ensemble/sigma_position", axes, TIME, [[0.0] * 3, [3.0, 7.0, 11.0], [30.0, 70.0, 110.0]])
    drawn.shows("ensemble/sigma_velocity", axes, TIME, [[NONE] * 3, [1.0, 2.0, 3.0], [10.0, 20.0, 40.0]])
    drawn.shows("ensemble/sigma_attitude", axes, TIME, [[0.5, 1.0, 9.0], [1.0, 2.0, 12.0], [2.0, 3.0, 15.0]])
    assert drawn.dots["ensemble/sigma_position/limit_1"][:2] == ([400.0], [[80.0]])
    time, height, names, color, *_ = drawn.dots["ensemble/sigma_attitude/limit_1"]
    np.testing.assert_allclose((time[0], height[0][0]), (160.0, 20.0))
    assert (names, color) == (["heading(60 s) <= 20 arcmin: not met"], NOT_MET)
    assert len(drawn.dots) == 2
    view._draw_consistency(drawn, result)
    drawn.shows("ensemble/nees", ["attitude"], TIME, [[NONE], [1.25], [0.75]])
    drawn.shows("ensemble/nis", ["gnss"], TIME, [[2.0], [0.5], [1.5]])


def test_the_summary() -> None:
    result: Any = Result()
    lines = view._markdown(result, NUMBERS).splitlines()
    assert lines[0] == "# trial: 5 runs"
    assert lines[2].startswith("Solution: aided. Seed 17.")
    at = lines.index("| | CEP (95 % band) | R95 (95 % band) |")
    assert lines[at + 2 : at + 5] == [
        "| horizontal error at the end, m | 42.0 (35.0 … 60.0) | 90.0 (75.0 … ∞) |",
        "| rate Σ t r / Σ t², nmi/h | 0.270 (0.220 … 0.330) | 0.580 (0.480 … 0.730) |",
        "| rate r(T) / T, nmi/h | 0.370 (0.320 … 0.430) | 0.680 (0.610 … 0.830) |",
    ]
    assert "- **the <worst>**, run 3: `sinssim run <3>`" in lines
    assert lines[-3:] == ["## 1 failed runs", "", "- run 2: it <fell> over."]
