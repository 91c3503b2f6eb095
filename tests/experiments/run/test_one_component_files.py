"""Streams, numbers and table of a one-component run, from solutions that are chosen."""

from __future__ import annotations

from math import pi, sqrt
from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.experiments.run.one_component_exhibits import error_table, numbers, one_component_streams
from sinssim.recording.rerun_exhibits import markdown_of
from sinssim.simulation.one_component_run import PlaneReadings
from sinssim.strapdown.one_component_system import PlaneErrors
from tests.recording.test_motion_streams import columns, rows

TIME = np.array([2.0, 4.0, 8.0])
SECOND, RADIUS = pi / 648_000.0, 6.4e6


def errors(first: float) -> PlaneErrors:
    """Return errors of which every one differs: a position of `first` micro-radians at the start, and so on."""
    return PlaneErrors(
        TIME, np.array([first, -2.0 * first, 1.5 * first]), np.array([1.0, -3.0, 2.0]) * first * 1e-6,
        np.array([4.0, 5.0, -6.0]) * first * SECOND,
    )  # fmt: skip


def result(rate: bool = True, **readings: np.ndarray) -> SimpleNamespace:
    dvel = np.array([[3.0, 19.0], [7.0, 40.0]])
    found = SimpleNamespace(
        velocity=rows(11.0, 1)[:, 0], coordinate=rows(12.0, 1)[:, 0], pitch=np.array([0.1, 0.3, 0.7]),
        rate=rows(14.0, 1)[:, 0] if rate else None,
    )  # fmt: skip
    truth = SimpleNamespace(
        time=TIME, velocity=rows(1.0, 1)[:, 0], height=rows(2.0, 1)[:, 0], pitch=rows(3.0, 1)[:, 0],
        body_pitch=rows(4.0, 1)[:, 0], rate=rows(5.0, 1)[:, 0], horizontal=rows(6.0, 1)[:, 0],
        vertical=rows(7.0, 1)[:, 0],
    )  # fmt: skip
    section = SimpleNamespace(variant="two-integrals", mounting_angle_deg=30.0, radius_m=RADIUS, gravity_mps2=10.0)
    return SimpleNamespace(
        section=section, truth=truth, coordinate=rows(8.0, 1)[:, 0], ideal=PlaneReadings(TIME, rows(30.0, 2, 2)),
        measured=PlaneReadings(TIME, dvel, **readings), solution=found, error=errors(1.0), perfect=errors(2.0),
        along_motion=errors(3.0), pendulum=errors(4.0), first_order=errors(5.0), closed=errors(6.0), caused=errors(2.5),
        by_source=(SimpleNamespace(name="pitch sensor", simulated=errors(7.0)),),
    )  # fmt: skip


def one(first: float, count: int = 3) -> list[float]:
    return rows(first, 1, count)[:, 0].tolist()


def test_motion_readings_and_forces() -> None:
    """Mean forces (1.5, 9.5) and (1.75, 10) m/s² at mean pitches of 0.2 and 0.5 rad."""
    held = {s.name: columns(s) for s in one_component_streams(result(dvel_arm=np.array([0.4, 0.6])))}
    assert list(held) == [
        "truth", "imu_ideal", "imu_measured", "nav_two_integrals", "forces_two_integrals", "error_two_integrals",
        "error_perfect_sensors", "error_equation_8_10", "error_equation_8_11", "error_equation_8_12",
        "error_closed_form",
    ]  # fmt: skip
    times = {"time_s": [2.0, 4.0, 8.0]}
    assert held["truth"] == {
        **times, "velocity_mps": one(1.0), "coordinate_rad": one(8.0), "height_m": one(2.0), "pitch_rad": one(3.0),
        "body_pitch_rad": one(4.0), "rate_radps": one(5.0), "horizontal_mps2": one(6.0), "vertical_mps2": one(7.0),
    }  # fmt: skip
    assert held["imu_ideal"] == {"time_s": [4.0, 8.0], "dvel_x_mps": [30.01, 31.01], "dvel_y_mps": [30.02, 31.02]}
    assert held["imu_measured"] == {
        "time_s": [4.0, 8.0], "dvel_x_mps": [3.0, 7.0], "dvel_y_mps": [19.0, 40.0], "dvel_arm_mps": [0.4, 0.6],
    }  # fmt: skip
    nav = held["nav_two_integrals"]
    body = nav.pop("body_pitch_rad")
    assert body == pytest.approx([0.1 - pi / 6, 0.3 - pi / 6, 0.7 - pi / 6])
    assert nav == {
        **times, "velocity_mps": one(11.0), "coordinate_rad": one(12.0), "pitch_rad": [0.1, 0.3, 0.7],
        "rate_radps": one(14.0),
    }  # fmt: skip
    forces = held["forces_two_integrals"]
    assert forces["time_s"] == [4.0, 8.0]
    c, s = np.cos([0.2, 0.5]), np.sin([0.2, 0.5])
    assert forces["horizontal_mps2"] == pytest.approx([1.5 * c[0] - 9.5 * s[0], 1.75 * c[1] - 10.0 * s[1]])
    assert forces["vertical_mps2"] == pytest.approx([1.5 * s[0] + 9.5 * c[0], 1.75 * s[1] + 10.0 * c[1]])
    for name, first in (("two_integrals", 1.0), ("perfect_sensors", 2.0), ("equation_8_10", 3.0),
                        ("equation_8_11", 4.0), ("equation_8_12", 5.0), ("closed_form", 6.0)):  # fmt: skip
        e = errors(first)
        assert held[f"error_{name}"] == {
            **times, "velocity_mps": e.velocity.tolist(), "coordinate_rad": e.coordinate.tolist(),
            "pitch_rad": e.pitch.tolist(),
        }, name  # fmt: skip


def test_readings_of_the_other_variants() -> None:
    gyro = {s.name: columns(s) for s in one_component_streams(result(rate=False, dtheta=np.array([0.2, 0.9])))}
    assert gyro["imu_measured"]["dtheta_rad"] == [0.2, 0.9]
    assert "dvel_arm_mps" not in gyro["imu_measured"]
    assert "rate_radps" not in gyro["nav_two_integrals"]
    sensor = {s.name: columns(s) for s in one_component_streams(result(angle=np.array([0.2, 0.5, 0.9])))}
    assert sensor["attitude_measured"] == {"time_s": [2.0, 4.0, 8.0], "inertial_angle_rad": [0.2, 0.5, 0.9]}
    assert "attitude_ideal" not in sensor


def test_the_numbers() -> None:
    """Errors of size f: 6.4 f, −19.2 f, 12.8 f m; f, −2 f, 1.5 f m/s; 4 f, 5 f, −6 f arcsec."""
    found = numbers(result())
    assert found["variant"] == "two-integrals"
    assert found["schuler_period_s"] == pytest.approx(2.0 * pi * 800.0)

    def statistics(f: float) -> object:
        wanted = {
            "final_position_error_m": 12.8 * f, "rms_position_error_m": 6.4 * f * sqrt(14.0 / 3.0),
            "max_position_error_m": 19.2 * f, "final_velocity_error_mps": 1.5 * f,
            "rms_velocity_error_mps": f * sqrt(7.25 / 3.0), "max_velocity_error_mps": 2.0 * f,
            "final_pitch_error_arcsec": -6.0 * f, "rms_pitch_error_arcsec": f * sqrt(77.0 / 3.0),
            "max_pitch_error_arcsec": 6.0 * f,
        }  # fmt: skip
        return pytest.approx(wanted, rel=1e-12)

    sizes = {"simulation": 1.0, "perfect_sensors": 2.0, "equation_8_10": 3.0, "equation_8_11": 4.0,
             "equation_8_12": 5.0, "closed_form": 6.0}  # fmt: skip
    assert list(found["errors"]) == list(sizes)
    for name, size in sizes.items():
        assert found["errors"][name] == statistics(size), name
    assert list(found["errors_by_source"]) == ["pitch_sensor"]
    assert found["errors_by_source"]["pitch_sensor"] == statistics(7.0)
    for name, size in list(sizes.items())[2:]:  # from the errors that the sensors cause, of size 2.5
        apart = size - 2.5
        assert found["differences"][name] == pytest.approx({"max_m": 19.2 * apart, "relative": apart / 2.5}), name
    still = SimpleNamespace(**{**vars(result()), "caused": errors(0.0)})
    assert numbers(still)["differences"]["equation_8_10"]["relative"] is None


def test_the_table() -> None:
    found = numbers(result())
    found["errors"]["equation_8_12"]["max_velocity_error_mps"] = None
    assert markdown_of([error_table(found)]).splitlines()[:8] == [
        "|  | position, final, m | position, rms, m | position, max, m | velocity, max, m/s | pitch, max, arcmin | "
        "difference, max, m | difference, relative |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
        # R Δy of 12.8 m, 6.4 √(14/3) m rms and 19.2 m at most, 2 m/s and 6″ of the simulation; multiples of them
        "| simulation | 12.8 | 13.83 | 19.2 | 2 | 0.1 |  |  |",
        "| perfect sensors | 25.6 | 27.65 | 38.4 | 4 | 0.2 |  |  |",
        "| equation (8.10) | 38.4 | 41.48 | 57.6 | 6 | 0.3 | 9.6 | 2.0e-01 |",
        "| equation (8.11) | 51.2 | 55.3 | 76.8 | 8 | 0.4 | 28.8 | 6.0e-01 |",
        "| first order (8.12) | 64 | 69.13 | 96 | – | 0.5 | 48 | 1.0e+00 |",
        "| closed form at rest | 76.8 | 82.95 | 115.2 | 12 | 0.6 | 67.2 | 1.4e+00 |",
    ]  # fmt: skip
