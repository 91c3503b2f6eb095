"""Orders of convergence fitted to errors that are known."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.experiments.studies.study_results import Row, fit_orders

RATES = (10.0, 20.0, 40.0, 80.0, 160.0, 320.0)


def row(algorithm: str, rate: float, error: float, **more) -> Row:
    case = {
        "part": "p", "motion": "m", "variant": "rate-gyros", "sensors": "ideal", "algorithm": algorithm,
        "frame": "level", "gravity": "normal", "curvature": "exact", "rate_hz": rate, "schedule_hz": (), "slow": "",
        "max_attitude_error_arcsec": error, "max_horizontal_error_m": 1e-9,
    }  # fmt: skip
    return Row(**{**case, **more})


def orders(rows: list[Row]) -> dict[str, float]:
    return {o.algorithm: o.order for o in fit_orders(rows) if o.quantity == "max_attitude_error_arcsec"}


def test_pure_powers():
    rows = [row(f"p{p}", rate, 50.0 * (10.0 / rate) ** p) for p in (1, 2, 4) for rate in RATES]
    rows += [row("best", rate, 1e-9) for rate in RATES]
    found = orders(rows)
    assert found == pytest.approx({"p1": 1.0, "p2": 2.0, "p4": 4.0}, abs=1e-12)


def test_the_floor_does_not_count():
    """A sixth-order error that runs into a floor of 1e-8 keeps its order; at the floor alone there is none."""
    rows = [row("six", rate, 50.0 * (10.0 / rate) ** 6 + 1e-8) for rate in RATES]
    rows += [row("floor", rate, 1e-8) for rate in RATES]
    found = orders(rows)
    assert found["six"] == pytest.approx(6.0, abs=0.01)
    assert "floor" not in found


def test_low_rates_beyond_the_motion_do_not_count():
    """Saturated below 40 Hz: only the four highest rates are fitted."""
    rows = [row("four", rate, min(100.0, 1e3 * (40.0 / rate) ** 4)) for rate in (*RATES, 640.0)]
    rows += [row("best", rate, 1e-9) for rate in RATES]
    assert orders(rows)["four"] == pytest.approx(4.0, abs=1e-9)


def test_no_order_without_a_straight_line_or_with_real_sensors():
    generator = np.random.default_rng(1)
    scattered = [row("noise", rate, 10.0 ** generator.uniform(0.0, 4.0)) for rate in RATES]
    real = [row("real", rate, 1.0 / rate, sensors="tactical") for rate in RATES]
    passed = [row("euler", rate, 1.0 / rate, passages=1) for rate in RATES]
    failed = [row("level", rate, float("nan"), status="failed") for rate in RATES]
    best = [row("best", rate, 1e-9) for rate in RATES]
    assert orders([*scattered, *real, *passed, *failed, *best]) == {}
