"""The motion on a turntable: positions, errors of the table, ready sequences, the way through the whole package."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.errors import InputError
from sinssim.experiments.ensembles.ensemble_plan import truth_key
from sinssim.experiments.run.run_execution import run
from sinssim.scenario import Scenario
from sinssim.scenario.plan_summary import plan_lines
from sinssim.scenario.planned_limits import expected_duration
from sinssim.scenario.true_motion import fly
from sinssim.truth.motions.turntable import SEQUENCES, Turntable, settling
from sinssim.units import ARCSEC


def scenario(seed: int = 0, imu: dict[str, Any] | None = None, **table: Any) -> Scenario:
    own = {"latitude_deg": 50.0, "dwell_s": 4.0, "rate_deg_s": 45.0, **table}
    sensors = {"grade": "ideal", "rate_hz": 100.0, **(imu or {})}
    return Scenario.model_validate({"name": "t", "seed": seed, "turntable": own, "imu": sensors})


def positions(described: Scenario) -> Rotation:
    """Return the attitudes q_nb in the middle of the dwells."""
    middles = [0.5 * (begin + end) for begin, end in described.turntable.dwells]
    return Rotation.from_quat(fly(described).state(middles).q_nb, scalar_first=True)


@pytest.mark.parametrize(("name", "count", "different"), [
    ("six-positions", 6, 6), ("six-positions-and-rates", 12, 6), ("24-positions", 24, 24), ("19-positions", 19, 10),
])  # fmt: skip
def test_ready_sequences(name: str, count: int, different: int) -> None:
    """All axes of a block go up and down; every position has axes along the vertical."""
    found = positions(scenario(sequence=name)).as_matrix()
    assert len(found) == count == len(SEQUENCES[name].turns) + 1
    assert len({tuple(np.round(one).astype(int).ravel()) for one in found}) == different
    assert np.abs(found[:, 2]).max(axis=1) == pytest.approx(1.0, abs=1e-9)
    assert {(int(np.argmax(np.abs(row))), bool(row.sum() > 0.0)) for row in found[:, 2]} == {
        (axis, sign) for axis in range(3) for sign in (True, False)
    }


def test_errors_of_the_table_are_where_they_are_said_to_be() -> None:
    """C = e^[τ×] A_p e^[ε_p×] in every position, at degree level, full turns included."""
    sigma = {"position_sigma_arcsec": 3600.0, "tilt_sigma_arcsec": 1800.0}
    wrong = scenario(seed=5, sequence="six-positions-and-rates", **sigma)
    nominal = positions(scenario(sequence="six-positions-and-rates"))
    errors = wrong.turntable.draw_errors(5)
    expected = Rotation.from_rotvec(errors.tilt) * nominal * Rotation.from_rotvec(errors.position)
    assert (positions(wrong) * expected.inv()).magnitude() == pytest.approx(0.0, abs=1e-12)
    many = np.array([wrong.turntable.draw_errors(seed).position for seed in range(100)])
    # 3600 numbers: 5 σ of their standard deviation
    assert many.std() / ARCSEC == pytest.approx(3600.0, rel=5.0 / np.sqrt(2.0 * many.size))
    assert np.einsum("ki,ki->k", errors.axis, [turn.axis for turn in wrong.turntable.all_turns]) == pytest.approx(0.0)
    assert truth_key(wrong) != truth_key(wrong.model_copy(update={"seed": 6}))
    assert truth_key(scenario(seed=1)) == truth_key(scenario(seed=2))


def test_the_increments_are_those_of_the_motion() -> None:
    """Independent quadrature of the rates by Simpson's rule, across a turn with its settling."""
    described = scenario(seed=5, sequence="six-positions", position_sigma_arcsec=3600.0)
    trajectory = fly(described)
    coarse = trajectory.increments(10.0)
    edges = coarse.time[30:120]
    t = np.linspace(edges[0], edges[-1], 200 * (len(edges) - 1) + 1)
    rate, force = trajectory.rates(t)
    h = t[1] - t[0]
    for values, found in ((rate, coarse.dtheta), (force, coarse.dvel)):
        pairs = (values[:-2:2] + 4.0 * values[1:-1:2] + values[2::2]) * h / 3.0
        total = pairs.reshape(len(edges) - 1, 100, 3).sum(axis=1)
        assert total == pytest.approx(found[30:119], abs=1e-8)


def test_through_the_whole_package() -> None:
    """A turntable is a source of motion like any other: checked, flown, sensed, navigated."""
    turns = [
        {"axis": [1.0, 0.0, 0.0], "angle_deg": 90.0},
        {"axis": [0.0, 0.0, 1.0], "angle_deg": -180.0, "dwell_s": 2.0},
    ]
    described = scenario(turns=turns, imu={"lever_arm_m": [0.1, 0.0, 0.2], "mounting_deg": [0.0, 0.0, 90.0]})
    assert expected_duration(described) == pytest.approx(4.0 + 4.0 + 4.0 + 6.0 + 2.0)
    assert any(line.startswith("turntable") for line in plan_lines(described))
    result = run(described)
    assert np.abs(result.errors["quaternion"].position_ned).max() < 1e-4
    assert np.linalg.norm(result.errors["quaternion"].attitude, axis=1).max() < 1e-7


@pytest.mark.slow
def test_mounting_turns_the_positions_and_the_axes() -> None:
    """A calibration of a block that is mounted askew has the same result as that of one that is not."""
    from sinssim.analyses.turntable_calibration import calibrate

    common = {"sequence": "six-positions-and-rates", "dwell_s": 20.0}
    sensors = {"grade": "laser-standard", "rate_hz": 20.0}
    for mounting in ([0.0, 0.0, 0.0], [10.0, -20.0, 130.0]):
        result = calibrate(scenario(seed=3, imu={**sensors, "mounting_deg": mounting}, **common), method="separate")
        assert {name for name, seen in zip(result.names, result.observable, strict=True) if not seen} == {
            "gyro bias x", "gyro bias y", "gyro bias z",  # in 20 s their 0.01 deg/h is below the random walk
        }  # fmt: skip
        assert result.chi_square_of_errors is not None
        assert result.chi_square_of_errors[0] < 65.0  # of 21: once in 10^6


def test_dwells_of_given_turns() -> None:
    """A turn takes its angle by its rate, the ramp, and the settling; a turn may have a rate and a dwell of its own."""
    turns = (
        {"axis": (1.0, 0.0, 0.0), "angle_deg": -90.0},
        {"axis": (0.0, 2.0, 0.0), "angle_deg": 120.0, "rate_deg_s": 20.0, "dwell_s": 7.0},
    )
    table = Turntable(
        turns=turns, dwell_s=50.0, first_dwell_s=11.0, rate_deg_s=30.0, ramp_s=2.0, settle_s=0.5, heading_deg=33.0,
        pitch_deg=-4.0,
    )  # fmt: skip
    assert table.dwells == ((0.0, 11.0), (16.5, 66.5), (75.0, 82.0))
    assert table.duration_s == 82.0
    assert table.start_deg == (0.0, -4.0, 33.0)
    assert Turntable(sequence="19-positions").start_deg == (-90.0, 0.0, 0.0)
    assert Turntable(roll_deg=5.0).start_deg == (5.0, 0.0, 0.0)
    assert len(Turntable().all_turns) == 18  # the usual sequence
    with pytest.raises(InputError, match=r"turn 2 by 40° never reaches 20°/s with ramp_s = 2\.5; .* at most 2, or"):
        Turntable(turns=({**turns[0], "rate_deg_s": 5.0}, {**turns[1], "angle_deg": 40.0}), ramp_s=2.5)


def test_the_axis_that_points_down() -> None:
    """Six positions: forward turns right, down, left and up; then the nose goes up and down."""
    down = [
        np.round(positions(scenario(sequence="six-positions")).as_matrix()[:, 2]).astype(int).tolist(),
        np.round(positions(scenario(sequence="six-positions-and-rates")).as_matrix()[:, 2]).astype(int).tolist(),
    ]
    six = [[0, 0, 1], [0, 1, 0], [0, 0, -1], [0, -1, 0], [-1, 0, 0], [1, 0, 0]]
    assert down == [six, six + 6 * [[1, 0, 0]]]
    full = SEQUENCES["six-positions-and-rates"].turns[5:]
    assert [(axis.index(1.0), angle) for axis, angle in full] == [
        (0, 360.0), (0, -360.0), (1, 360.0), (1, -360.0), (2, 360.0), (2, -360.0),
    ]  # fmt: skip


def test_four_headings_of_each_face() -> None:
    """In each group of four of the 24 positions the same axis points down, and each turn within it is by 90°."""
    found = positions(scenario(sequence="24-positions")).as_matrix().reshape(6, 4, 3, 3)
    assert np.abs(np.diff(found[:, :, 2], axis=1)).max() < 1e-9
    # of a turn by 90° about the vertical, the next north row is a former east row or its opposite
    assert np.abs(np.abs(np.einsum("gki,gki->gk", found[:, 1:, 0], found[:, :-1, 1])) - 1.0).max() < 1e-9
    assert {tuple(row) for row in np.round(found[:, 0, 2]).astype(int).tolist()} == {
        (0, 0, 1), (0, 0, -1), (0, 1, 0), (0, -1, 0), (1, 0, 0), (-1, 0, 0),
    }  # fmt: skip


def test_nineteen_positions_are_those_of_the_toolbox() -> None:
    """PSINS, in axes right, forward, up: three turns about forward and back, one about up, three about right and back,
    two about up, and three back; right, forward, up are here Y, X, −Z."""
    x, y, back = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)
    axes = [x] * 6 + [back] + [y] * 6 + [back] * 5
    signs = [1, 1, 1, -1, -1, -1, 1, 1, 1, 1, -1, -1, -1, 1, 1, -1, -1, -1]
    assert SEQUENCES["19-positions"].turns == tuple((a, 90.0 * sign) for a, sign in zip(axes, signs, strict=True))
    found = positions(scenario(sequence="19-positions")).as_matrix()
    assert found[0] == pytest.approx(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]), abs=1e-9)
    for k in range(7):  # there and back
        assert found[6 - k] == pytest.approx(found[k], abs=1e-9)
        assert found[13 - k] == pytest.approx(found[7 + k], abs=1e-9)


def test_sizes_of_the_errors_of_the_table() -> None:
    """Tilt and positions about three axes, and the direction of an axis about the two across it: 1σ of each."""
    table = Turntable(sequence="six-positions", position_sigma_arcsec=40.0, tilt_sigma_arcsec=90.0)
    draws = [table.draw_errors(seed) for seed in range(300)]
    tilt, axis = np.array([d.tilt for d in draws]) / ARCSEC, np.array([d.axis for d in draws]) / ARCSEC
    # 900 and 300 numbers: 5 σ of their standard deviation
    assert np.sqrt(np.mean(tilt**2)) == pytest.approx(90.0, rel=5.0 / np.sqrt(1800.0))
    expected = 40.0 * np.array([[0, 1, 1]] * 3 + [[1, 1, 0]] * 2)
    assert np.sqrt(np.mean(axis**2, axis=0)) == pytest.approx(expected, rel=5.0 / np.sqrt(600.0), abs=1e-12)


def test_a_turn_ends_beside_its_position_by_the_errors_of_both_axes() -> None:
    """To first order the settling is ε' − e^[−θn×] ε + (I − e^[−θn×]) η: here from angles of some 1e-6 rad."""
    before, after = 1e-6 * np.array([3.0, -5.0, 7.0]), 1e-6 * np.array([2.0, 4.0, -6.0])
    n = np.array([0.0, 0.0, 1.0])
    # a turn by +90° about z takes the axes back by −90°: (x, y, z) of the former axes is (y, −x, z) in the new ones
    expected = after - 1e-6 * np.array([-5.0, -3.0, 7.0])
    assert settling(n, n, 0.5 * np.pi, before, after) == pytest.approx(expected, abs=1e-10)
    # an axis tilted by η about x, turned by 180°: 2η are left
    tilted = Rotation.from_rotvec([1e-6, 0.0, 0.0]).apply(n)
    assert settling(n, tilted, np.pi, np.zeros(3), np.zeros(3)) == pytest.approx([2e-6, 0.0, 0.0], abs=1e-11)
