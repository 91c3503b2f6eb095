"""Functions of every stage, from numbers that are chosen: numbers as text, checks of arrays, route, names, tables."""

from __future__ import annotations

import warnings
from math import atan2, cos, inf, nan, pi, sin, tan
from typing import Any

import numpy as np
import pytest

from sinssim import toml_section
from sinssim.arguments import (
    POSITIVE,
    check_finite,
    check_increasing,
    checked_imu,
    checked_increments,
    checked_initial,
    doubles,
    first_not_finite,
    longest_gap,
    names,
    not_finite_in,
    number,
    quaternion,
    vector,
)
from sinssim.data import ImuData, Measurements, NavSolution, NavState
from sinssim.earth.ellipsoids import normal
from sinssim.errors import InputError, SinssimWarning, nearest, printable, respelled, shortened, unknown_name, warn
from sinssim.strapdown.frames.route_pole import (
    distance_from_pole,
    nearest_allowed,
    route_along,
    route_pole,
    sentence,
    too_near,
)
from sinssim.units import capital, number_text, signed, size_text


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0, 3, "0"), (nan, 3, "–"), (-inf, 3, "–"), (1.2345, 3, "1.23"), (12.345, 3, "12.3"), (123.45, 3, "123"),
        (1234.5, 3, "1234"), (999_999.0, 2, "999999"), (1e6, 3, "1.00e+06"), (1.2345e-4, 3, "0.000123"),
        (9.99e-5, 3, "9.99e-05"), (1.2345e-9, 2, "1.2e-09"), (-0.056789, 4, "-0.05679"), (7.0, 4, "7.000"),
    ],
)  # fmt: skip
def test_numbers_as_text(value: float, digits: int, text: str) -> None:
    assert number_text(value, digits) == text


def test_signs_sizes_and_capitals() -> None:
    assert [signed(v) for v in (-1.2345, 1.2345, 0.0, nan)] == ["−1.23", "1.23", "0", "–"]
    assert signed(-0.056789, 2) == "−0.057"
    sizes = {
        2.345e9: "2.35 GB",
        1e9: "1 GB",
        999e6: "999 MB",
        1e6: "1 MB",
        12_340.0: "12.3 kB",
        1e3: "1 kB",
        999.0: "999 B",
    }
    assert {size: size_text(size) for size in sizes} == sizes
    assert (capital("one TWO"), capital(""), capital("é")) == ("One TWO", "", "É")


def test_rows_that_are_not_finite() -> None:
    rows = np.arange(70_000.0 * 2).reshape(-1, 2)
    assert first_not_finite(rows) is None
    rows[69_999, 0], rows[65_540, 1] = nan, inf
    assert first_not_finite(rows) == 65_540
    assert first_not_finite(np.array([1.0, 2.0, -inf, inf])) == 2
    assert first_not_finite(np.array([1e308, 1e308, 1e308])) is None  # their sum is infinite
    fine, bad = np.zeros((4, 3)), np.zeros((4, 3))
    bad[2, 1] = nan
    assert not_finite_in(np.zeros(4), bad, bad) == ("velocity", 2)
    assert not_finite_in(bad[:, 1], bad, bad) == ("height", 2)
    assert not_finite_in(np.zeros(4), fine, bad) == ("attitude", 2)
    assert not_finite_in(np.zeros(4), fine, fine) is None


def test_messages_about_rows() -> None:
    with pytest.raises(InputError, match=r"x\[1\] = nan m is not a finite number\. Fill the gaps"):
        check_finite("x", np.array([3.0, nan]), "m")
    with pytest.raises(
        InputError, match=r"x\[1\] = inf rad is not a finite number \(interval ending at t = 7\.500000 s\)"
    ):
        check_finite("x", np.array([3.0, inf]), "rad", np.array([5.0, 6.0, 7.5]))
    with pytest.raises(InputError, match=r"t must increase: time\[2\] = 7 s is followed by time\[3\] = 7 s\."):
        check_increasing("t", np.array([5.0, 6.0, 7.0, 7.0, 6.0]))
    late = np.arange(70_000.0)
    late[65_537] = 3.0
    with pytest.raises(InputError, match=r"time\[65536\] = 65536 s is followed by time\[65537\] = 3 s"):
        check_increasing("t", late)


def test_gaps() -> None:
    """An interval of more than five typical ones is a gap; the typical one is the median."""
    assert longest_gap(np.array([0.0, 2.0, 4.0, 6.0, 16.0, 18.0])) is None  # five times
    assert longest_gap(np.array([0.0, 2.0, 4.0, 6.0, 16.5, 18.5])) == (3, 2.0)
    assert longest_gap(np.array([0.0, 1.0, 11.0, 21.0, 31.0, 41.0])) is None  # one short interval is no measure
    time = np.array([0.0, 2.0, 4.0, 6.0, 16.5, 18.5])
    imu = ImuData(time, np.zeros((5, 3)), np.zeros((5, 3)))
    with pytest.raises(InputError, match=r"missing for 10\.5 s from time\[3\] = 6 s on; usual intervals are 2 s"):
        checked_increments(imu)


def test_checked_increments_are_doubles() -> None:
    flags = np.ones((2, 6), dtype=np.uint8)
    given = ImuData(np.array([1, 2, 4]), np.array([[1, 2, 3], [4, 5, 6]]), np.ones((2, 3)), flags)
    found = checked_imu(given)
    assert (found.time.dtype, found.dtheta.tolist(), found.flags is flags) == (
        np.float64,
        [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
        True,
    )
    assert checked_imu(found) is found
    for time, dtheta, dvel in ((3, 2, 3), (2, 2, 2), (4, 2, 2), (1, 0, 0)):
        with pytest.raises(InputError, match="do not belong together"):
            checked_increments(ImuData(np.arange(float(time)), np.zeros((dtheta, 3)), np.zeros((dvel, 3))))


def test_checked_initial_states() -> None:
    q = np.array([0.5, -0.5, 0.5, 0.5]) * (1.0 + 5e-7)
    latitude, longitude, height, velocity, own = checked_initial(NavState(0.5, -3.0, 70.0, [1, 2, 3], q))
    assert (latitude, longitude, height, velocity.tolist()) == (0.5, -3.0, 70.0, [1.0, 2.0, 3.0])
    assert own.tolist() == pytest.approx([0.5, -0.5, 0.5, 0.5], rel=1e-15)
    assert checked_initial(NavState(pi / 2, 0.0, 0.0, [0, 0, 0], q))[0] == pi / 2
    for wrong, said in (
        (NavState(1.58, 0.0, 0.0, [0, 0, 0], q), r"initial.latitude = 1\.58 rad lies outside ±π/2"),
        (NavState(0.5, 0.0, 0.0, [0, 0, 0], q * (1.0 + 2e-6)), "unit quaternion"),
        (NavState(0.5, 0.0, 0.0, [0, 0], q), "3 finite numbers, m/s"),
        (NavState(0.5, nan, 0.0, [0, 0, 0], q), "initial.longitude = nan must be one finite number, rad for angles"),
    ):
        with pytest.raises(InputError, match=said):
            checked_initial(wrong)


@pytest.mark.parametrize(
    ("options", "good", "bad", "said"),
    [
        ({"low": 2.0}, 2.0, 1.99, "x = 1.99 must be one finite number of at least 2, m."),
        ({"low": 2.0, "high": 5.0}, 5.0, 5.01, "x = 5.01 must be one finite number from 2 to 5, m."),
        ({"low": POSITIVE}, 1e-300, 0.0, "x = 0.0 must be one positive number, m."),
        ({"low": POSITIVE, "high": 5.0}, 5.0, 6, "x = 6 must be one positive number of at most 5, m."),
        ({}, -7.0, inf, "x = inf must be one finite number, m."),
    ],
)
def test_numbers_within_limits(options: dict[str, float], good: float, bad: float, said: str) -> None:
    assert number("x", good, "m", **options) == good
    with pytest.raises(InputError) as error:
        number("x", bad, "m", **options)
    assert str(error.value) == said


def test_vectors_quaternions_and_names() -> None:
    assert vector("v", (1, 2), 2).tolist() == [1.0, 2.0]
    assert doubles("d", 7).tolist() == [7.0]
    for wrong, said in (
        ([1.0, 2.0, 3.0], r"v = \[1.0, 2.0, 3.0\] must be 2 finite numbers, m/s\."),
        ([1.0, nan], "finite"),
    ):
        with pytest.raises(InputError, match=said):
            vector("v", wrong, 2, "m/s")
    assert quaternion("q", [0.0, 3.0, 0.0, 4.0]).tolist() == [0.0, 3.0, 0.0, 4.0]  # not normalised
    assert quaternion("q", [2e-6, 0, 0, 0])[0] == 2e-6
    for wrong in ([9e-7, 0, 0, 0], [2e6, 0, 0, 0]):
        with pytest.raises(InputError, match="unit norm, scalar first"):
            quaternion("q", wrong)
    assert names("n", "frame", ("b", "a"), ["a", "b"]) == ["b", "a"]
    with pytest.raises(InputError, match="must be a list of names: a, b"):
        names("n", "frame", "a", ["a", "b"])


def test_texts_of_bounded_length() -> None:
    assert shortened("x" * 80) == "x" * 80
    assert shortened("x" * 81) == "x" * 80 + "… (81 characters)"
    assert shortened("abcdef", 4) == "abcd… (6 characters)"
    assert printable("a" * 4800 + "b" * 1200) == "a" * 4800 + "b" * 1200
    assert printable("a" * 4800 + "c" * 7 + "b" * 1200) == "a" * 4800 + " … (7 characters) … " + "b" * 1200


def test_names_that_are_meant() -> None:
    assert respelled("Altitude-FT") == "height_ft"
    assert respelled("gyro_arw_deg_per_rt_hr") == "gyro_arw_deg_sqrt_h"
    assert nearest("alt_m", ["altitude_m", "latitude_m"]) == "altitude_m"
    assert nearest("quaterion", ["euler", "quaternion"]) == "quaternion"
    assert nearest("zzz", ["euler", "quaternion"]) is None
    error = unknown_name("frame", "levle", ["wander", "level"])
    assert str(error) == "unknown frame 'levle'. Did you mean 'level'? Known: level, wander."
    assert str(unknown_name("frame", 7, ["wander", "level"])) == "unknown frame 7. Known: level, wander."


def test_a_warning_names_the_line_of_the_user() -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warn("A remark.")
    (one,) = caught
    assert (str(one.message), one.category, one.filename) == ("A remark.", SinssimWarning, __file__)


def place(latitude: float, longitude: float) -> np.ndarray:
    return np.array([cos(latitude) * cos(longitude), cos(latitude) * sin(longitude), sin(latitude)])


def test_the_pole_of_a_route() -> None:
    """To the left: of a route to the east the north pole, of a route north the point 90° to the west."""
    np.testing.assert_allclose(normal([0.3, -0.8], [0.5, 2.0]), [place(0.3, 0.5), place(-0.8, 2.0)], atol=1e-15)
    for velocity in ([0.0, 7.0, 3.0], [0.0, 0.0, 5.0]):  # at rest the route goes east
        pole = route_pole(None, 0.4, 0.7, velocity)
        assert pole @ place(0.4, 0.7) == pytest.approx(0.0, abs=1e-15)
        np.testing.assert_allclose(pole, place(pi / 2 - 0.4, 0.7 + pi), atol=1e-15)
    np.testing.assert_allclose(route_pole(None, 0.4, 0.7, [5.0, 0.0, 0.0]), place(0.0, 0.7 - pi / 2), atol=1e-15)
    np.testing.assert_allclose(route_pole((0.0, 0.2, 0.0, 0.9), 9.0, 9.0, [1, 0, 0]), [0.0, 0.0, 1.0], atol=1e-15)
    with pytest.raises(InputError, match="antipodal"):
        route_pole((0.2, 0.3, -0.2, 0.3 + pi), 0.0, 0.0, [1, 0, 0])


def test_a_route_along_the_velocity() -> None:
    """Course 30° from φ = 0.4: a quarter of the circle ahead sin φ = cos φ₀ cos K, and there the same pole."""
    velocity = [3.0 * cos(pi / 6.0), 3.0 * sin(pi / 6.0), -1.0]
    route = route_along(0.4, 0.7, velocity)
    assert route[:2] == (0.4, 0.7)
    ahead = place(*route[2:])
    assert ahead[2] == pytest.approx(cos(0.4) * cos(pi / 6.0))
    assert ahead @ place(0.4, 0.7) == pytest.approx(0.0, abs=1e-15)
    step = atan2(sin(pi / 6.0), tan(0.0) * cos(0.4) - sin(0.4) * cos(pi / 6.0))  # of longitude, by the sine rule
    assert route[3] == pytest.approx(0.7 + step)
    np.testing.assert_allclose(route_pole(route, 0, 0, [1, 0, 0]), route_pole(None, 0.4, 0.7, velocity), atol=1e-15)


def test_the_distance_from_a_pole() -> None:
    """Speed × step over 0.005 rad; 1 mm at least. Distances over a sphere of 6371 km, from the nearer pole."""
    assert nearest_allowed([200.0, 0.0], [0.01, 0.01]).tolist() == pytest.approx([400.0, 1e-3])
    pole = place(0.3, 0.5)
    found = distance_from_pole(pole, np.array([0.31, -0.28]), np.array([0.5, 0.5 - pi]))
    assert found == pytest.approx([63_710.0, 127_420.0], rel=1e-9)


def test_a_motion_that_comes_too_near() -> None:
    """Past the pole of a route at 300 m with 200 m/s and 0.01 s: 400 m are needed; the third row is the first one."""
    pole = place(0.0, 0.5)
    metre = 1.0 / 6371e3
    latitude = np.array([-900.0, -500.0, 250.0, 300.0]) * metre
    longitude = 0.5 + np.array([0.0, 0.0, 0.0, 20.0]) * metre
    time = np.array([7.0, 7.01, 7.02, 7.03])
    velocity = np.tile([120.0, -160.0, 50.0], (4, 1))
    row, said = too_near(pole, time, latitude, longitude, velocity)
    assert row == 2
    assert said.startswith(
        "the transverse frame cannot be used within 400 m of its route's pole at 0.0000°, 28.6479° with 200 m/s and "
        "steps of 0.01 s, because it rotates by more than 0.29° per step: the vehicle is 250 m from there at t = "
        "7.02 s."
    )
    row, said = too_near(-pole, time, latitude, longitude, velocity)  # the point opposite the pole
    assert (row, "at 0.0000°, 28.6479°" in said) == (2, True)
    assert too_near(pole, time, latitude + 700.0 * metre, longitude + 500.0 * metre, velocity) is None
    other = sentence(place(-0.3, -0.5), 1.23456, 2.0, 0.5, "now")
    assert "within 200 m of its route's pole at -17.1887°, -28.6479° with 2 m/s" in other
    assert "the vehicle is 1.235 m from there now." in other


def test_the_rows_of_a_solution_and_the_name_of_a_sensor() -> None:
    rows = np.arange(3.0)
    solution = NavSolution(
        rows, rows + 1.0, rows + 2.0, rows + 3.0, np.outer(rows, [4.0, 5.0, 6.0]), np.outer(rows, [1, 2, 3, 4]), rows
    )
    state = solution.state(1)
    assert (state.latitude, state.longitude, state.height) == (2.0, 3.0, 4.0)
    assert (state.velocity_ned.tolist(), state.q_nb.tolist()) == ([4.0, 5.0, 6.0], [1.0, 2.0, 3.0, 4.0])
    assert solution.state().height == 5.0
    bare = Measurements("speed", rows, rows, rows[:, None], rows[:, None])
    assert (bare.label, len(bare), bare.lever_arm.tolist()) == ("speed", 3, [0.0, 0.0, 0.0])
    assert Measurements("speed", rows, rows, rows[:, None], rows[:, None], name="wheels").label == "wheels"


class Table(toml_section.Section):
    altitude_m: toml_section.Height = 3.0
    axis: toml_section.Axis = (0.0, 0.0, 1.0)
    rows: tuple[toml_section.Vector3, ...] = ()


def test_values_of_tables() -> None:
    """Lists become tuples at any depth; height_ is another word for altitude_; an axis needs a direction."""
    own = Table(height_m=7.0, rows=[[1.0, 2.0, 3.0]])
    assert (own.altitude_m, own.rows) == (7.0, ((1.0, 2.0, 3.0),))
    assert repr(own) == "Table(altitude_m=7, rows=((1, 2, 3)))"
    with pytest.raises(InputError, match="height_m and altitude_m are one quantity"):
        Table(height_m=7.0, altitude_m=8.0)
    assert Table(axis=[0.0, 1e-6, 0.0]).axis == (0.0, 1e-6, 0.0)
    with pytest.raises(InputError, match="has the length 9e-07 and no usable direction"):
        Table(axis=[0.0, 9e-7, 0.0])
    with pytest.raises(InputError, match=r"takes its values by name, for example Table\(altitude_m=…\)"):
        Table(7.0)


@pytest.mark.parametrize(
    ("kind", "low", "high"),
    [
        (toml_section.Latitude, -90.0, 90.0), (toml_section.Longitude, -180.0, 360.0),
        (toml_section.Heading, -360.0, 360.0),
        (toml_section.Moment, 0.0, 1e9), (toml_section.Height, -12e3, 1e6), (toml_section.Speed, 0.0, 12e3),
        (toml_section.Velocity, -12e3, 12e3), (toml_section.Offset, -1e6, 1e6), (toml_section.Spread, 0.0, 1e6),
        (toml_section.Noise, 1e-12, 1e6), (toml_section.CorrelationTime, 1e-3, 1e9), (toml_section.Rate, 1e-6, 1e6),
        (toml_section.Frequency, 1e-6, 1e5), (toml_section.TurnRate, -36e4, 36e4),
        (toml_section.NotNegative, 0.0, None),
        (toml_section.Turn, 5e-324, 36e3), (toml_section.Duration, 5e-324, 1e9), (toml_section.Timeout, 5e-324, 1e6),
        (toml_section.Positive, 5e-324, None),
    ],
)  # fmt: skip
def test_limits_of_values(kind: Any, low: float, high: float | None) -> None:
    from pydantic import TypeAdapter, ValidationError

    adapter = TypeAdapter(kind)
    for value in (low, *(() if high is None else (high,))):
        assert adapter.validate_python(value) == value
    beyond = 0.0 if low == 5e-324 else low - max(abs(low), 1.0) * 1e-9 if low != 1e-12 else 0.9e-12
    for value in (beyond, *(() if high is None else (high * (1.0 + 1e-9),))):
        with pytest.raises(ValidationError):
            adapter.validate_python(value)
