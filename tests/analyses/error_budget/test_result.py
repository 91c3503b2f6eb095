"""What is read from a budget: three sources at four instants, each number by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import ncx2, norm

from sinssim.analyses.error_budget.budget_exhibits import BudgetMedia
from sinssim.analyses.error_budget.budget_result import BUDGET_COMPONENTS, Added, BudgetResult, answer_of, answers
from sinssim.analyses.error_budget.error_sources import Source
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.statistics.requirements import parse_requirement
from tests.analyses.error_budget.worlds import scenario

TIME = np.array([0.0, 70.0, 100.0, 600.0])
GYRO = Source("gyro_bias", "bias", "gyros", "random", 0.03, "deg/h")
WALK = Source("accel_vrw", "velocity random walk", "accelerometers", "random", 8.0, "ug/√Hz")
START = Source("initial_given", "given errors", "initial state", "given", math.nan, "")
R95 = math.sqrt(-2.0 * math.log(0.05))  # of equal axes
ARCMIN = math.radians(1.0 / 60.0)


def diagonal(rows: list[list[float]]) -> Array:
    return np.array([np.diag(row) for row in rows])


@pytest.fixture
def result() -> BudgetResult:
    """σ of the gyros 3, 30, 60, 12 m in both axes, of the walk 4, 40, 80, 5 m; 7 m east are given, 1 m at first."""
    gyro = [[s**2] * 2 + [0.0, 0.04, 0.09, 0.0, 1e-8, 4e-8, (k + 1) * 1e-8] for k, s in enumerate((3, 30, 60, 12))]
    walk = [[s**2] * 2 + [2.0, 0.12, 0.16, 0.0, 3e-8, 5e-8, (k + 2) * 4e-8] for k, s in enumerate((4, 40, 80, 5))]
    given = np.zeros((4, 9))
    given[:, 1], given[:, 3], given[:, 8] = (1.0, 7.0, 7.0, 7.0), -0.3, 2e-4
    covariance = {"gyro_bias": diagonal(gyro), "accel_vrw": diagonal(walk)}
    made: Any = BudgetResult(
        scenario(name="made"),
        "inertial",
        TIME,
        (GYRO, WALK, START),
        covariance,
        {"initial_given": given},
        media=BudgetMedia(),
    )
    return made  # type: ignore[no-any-return]


def test_all_sources_together(result: BudgetResult) -> None:
    assert BUDGET_COMPONENTS[0::3] == ("position_north", "velocity_north", "tilt_north")
    assert BUDGET_COMPONENTS[1::3] == ("position_east", "velocity_east", "tilt_east")
    assert BUDGET_COMPONENTS[2::3] == ("position_down", "velocity_down", "heading")
    variance = [289.0, 289.0, 2.0, 0.16, 0.25, 0.0, 4e-8, 9e-8]  # 600 s: 12² is 144, and 5² is 25
    variance[:2] = [169.0, 169.0]
    sigma = [math.sqrt(v) for v in (*variance, 24e-8)]
    assert result.sigma()[3] == pytest.approx(sigma, rel=1e-12)
    assert result.sigma("accel_vrw")[1, :5] == pytest.approx([40.0, 40.0, math.sqrt(2.0), math.sqrt(0.12), 0.4])
    assert not result.sigma("initial_given").any()
    squares = [v + m**2 for v, m in zip((*variance, 24e-8), (0, 7, 0, -0.3, 0, 0, 0, 0, 2e-4), strict=True)]
    assert result.root_mean_square()[3] == pytest.approx([math.sqrt(s) for s in squares], rel=1e-12)
    assert result.bias[3].tolist() == [0.0, 7.0, 0.0, -0.3, 0.0, 0.0, 0.0, 0.0, 2e-4]


def test_circles(result: BudgetResult) -> None:
    """Equal axes: the square of the radius over σ² is noncentral χ² with two degrees of freedom and (7/σ)²."""
    sigma = np.array([5.0, 50.0, 100.0, 13.0])
    off = np.array([1.0, 7.0, 7.0, 7.0])
    for share, found in ((0.5, result.cep), (0.95, result.r95), (0.8, result.radius(0.8))):
        assert found == pytest.approx(sigma * np.sqrt(ncx2.ppf(share, 2, (off / sigma) ** 2)), rel=1e-9)
    assert result.radius(0.95, "gyro_bias") == pytest.approx(R95 * np.array([3.0, 30.0, 60.0, 12.0]), rel=1e-9)
    assert result.radius(0.5, "initial_given") == pytest.approx(off, rel=1e-9)


def test_ranking_of_the_sources(result: BudgetResult) -> None:
    """Halved, a random source has a quarter of its variance and a given one half of its error."""

    def r95(variance: float, off: float) -> float:
        return math.sqrt(variance * float(ncx2.ppf(0.95, 2, off**2 / variance)))

    now = r95(169.0, 7.0)
    gains = {"gyro_bias": now - r95(36.0 + 25.0, 7.0), "accel_vrw": now - r95(144.0 + 6.25, 7.0),
             "initial_given": now - r95(169.0, 3.5)}  # fmt: skip
    alone = {"gyro_bias": 12.0 * R95, "accel_vrw": 5.0 * R95, "initial_given": 7.0}
    square = 2.0 * 169.0 + 49.0
    shares = {"gyro_bias": 288.0 / square, "accel_vrw": 50.0 / square, "initial_given": 49.0 / square}
    found = result.improvements()
    assert [one.source.name for one in found] == sorted(gains, key=lambda name: -gains[name])
    for one in found:
        name = one.source.name
        assert (one.gain, one.alone, one.share) == pytest.approx((gains[name], alone[name], shares[name]), rel=1e-7)
    early = result.improvements(70.0)[0]
    assert (early.source.name, early.alone) == ("accel_vrw", pytest.approx(40.0 * R95))


def test_shares_of_given_errors_that_partly_cancel() -> None:
    """(3, 0) and (−1, 2) m add to (2, 2): of its square 8 m², they have 6 and 2."""
    one, other = np.zeros((1, 9)), np.zeros((1, 9))
    one[0, :2], other[0, :2] = (3.0, 0.0), (-1.0, 2.0)
    mean = {"initial_given": one, "accel_vrw": other}
    made = BudgetResult(scenario(name="made"), "inertial", TIME[3:], (START, WALK), {}, mean, media=BudgetMedia())
    assert made.bias[0, :2].tolist() == [2.0, 2.0]
    found = {one.source.name: (one.share, one.alone) for one in made.improvements()}
    assert found["initial_given"] == pytest.approx((0.75, 3.0))
    assert found["accel_vrw"] == pytest.approx((0.25, math.sqrt(5.0)))
    gains = {one.source.name: one.gain for one in made.improvements()}
    assert gains["initial_given"] == pytest.approx(math.sqrt(8.0) - math.hypot(0.5, 2.0))


def test_instants_of_tables_and_rankings(result: BudgetResult) -> None:
    """R95 at 100 s is more than 1.5 times that at the end; without it the end alone is ranked."""
    assert result.instants_to_rank == (600.0, 100.0)
    assert result.table_rows() == [2, 3]  # nearest to 100, 200, 300 s and to 400, 500, 600 s
    assert result.table_rows((70.0,)) == [1, 2, 3]
    assert result.row(70.0 + 9e-7) == 1
    with pytest.raises(InputError, match=r"no time t = 71 s; .* nearest is 70 s"):
        result.row(71.0)
    fading = result.covariance["accel_vrw"][2:] * np.array([[[1.0]], [[256.0 / 1.44]]])
    calm = BudgetResult(result.scenario, "inertial", TIME[2:], (WALK,), {"accel_vrw": fading}, {}, media=BudgetMedia())
    assert calm.r95[0] == pytest.approx(1.2 * calm.r95[1])
    assert calm.instants_to_rank == (600.0,)


def test_scaled_sources(result: BudgetResult) -> None:
    total, bias = result.scaled({"gyro_bias": 3.0, "initial_given": -0.5, "accel_vrw": 1.0})
    assert total[3, 0, 0] == pytest.approx(9.0 * 144.0 + 25.0)
    assert bias[3, 1] == pytest.approx(-3.5)
    assert result.total[3, 0, 0] == 169.0  # the result stays as it is


def test_errors_at_the_first_epoch_and_shares_of_a_change(result: BudgetResult) -> None:
    first = result.first()
    assert (first.begin.tolist(), first.end.tolist()) == ([0.0], [0.0])
    root, shares = first.shares(0, (0, 1))  # 9 + 9, 16 + 16, and 1 m²
    assert root == pytest.approx(math.sqrt(51.0))
    assert shares == [("accel_vrw", pytest.approx(32.0 / 51.0)), ("gyro_bias", pytest.approx(18.0 / 51.0)),
                      ("initial_given", pytest.approx(1.0 / 51.0))]  # fmt: skip
    two = {"a": np.array([[5.0, -2.0], [3.0, 4.0]]), "b": np.array([[1.0, 1.0], [-1.0, -6.0]])}
    change = Added(TIME[:2], TIME[1:3], {}, two)
    root, shares = change.shares(1, (0, 1))  # the sum is (2, −2): 3·2 − 4·2 = −2 and −2 + 12 = 10
    assert (root, shares) == (pytest.approx(math.sqrt(8.0)), [("b", pytest.approx(1.25)), ("a", pytest.approx(-0.25))])
    assert change.shares(1, ()) == (0.0, [])


def test_the_table_of_a_notebook(result: BudgetResult) -> None:
    html = result._repr_html_()
    assert "Budget of made, inertial, at the end" in html
    cep, r95 = (13.0 * math.sqrt(float(ncx2.ppf(p, 2, (7.0 / 13.0) ** 2))) for p in (0.5, 0.95))
    cells = [f"{cep:.4g}", f"{r95:.4g}", "gyros, bias", f"{12.0 * R95:.4g}", "accelerometers, velocity random walk",
             f"{5.0 * R95:.4g}", "initial state, given errors", ">7<"]  # fmt: skip
    places = [html.index(cell) for cell in cells]
    assert places == sorted(places)


def test_an_answer_about_a_component(result: BudgetResult) -> None:
    """σ² + m² of the velocity north is 0.04 + 0.12 + 0.09 = 0.25 m²/s² at every instant, with a limit of 0.4 m/s."""
    (found,) = answers(result, "velocity_north(100 s) <= 0.4 m/s", ["gyro_bias", "accel_vrw"])
    assert (found.value, found.time) == (pytest.approx(0.5), 100.0)
    assert not found.met
    assert found.margin == pytest.approx(-0.1)
    assert [one.sources[0].name for one in found.allowances] == ["accel_vrw", "gyro_bias"]
    walk, gyro = found.allowances
    assert walk.without == pytest.approx(math.sqrt(0.13))
    assert walk.factor == pytest.approx(0.5)  # 0.16 − 0.09 − 0.04 = 0.03 = 0.12/4
    assert walk.values == (pytest.approx(4.0),)
    assert gyro.without == pytest.approx(math.sqrt(0.21))
    assert not gyro.possible
    assert found.joint is not None
    assert (found.joint.without, found.joint.factor) == pytest.approx((0.3, math.sqrt(0.07 / 0.16)))
    assert found.joint.values == pytest.approx((0.03 * math.sqrt(0.07 / 0.16), 8.0 * math.sqrt(0.07 / 0.16)))
    assert found.everything.factor == pytest.approx(found.joint.factor)
    with pytest.raises(InputError, match=r"free: initial_given is not described by one number"):
        answers(result, "velocity_north <= 0.4 m/s", ["initial_given"])


def test_answers_throughout_and_at_instants(result: BudgetResult) -> None:
    """Heading: 1 + 8, 2 + 12, 3 + 16, 4 + 20 with 4 given, in 1e-8 rad²; the circle is largest at 100 s."""
    heading = answer_of(result, parse_requirement("heading(run) <= 1 arcmin"))
    assert heading[:2] == (pytest.approx(math.sqrt(28e-8)), 600.0)
    assert heading[2] is not None  # 1′ is 8.46e-8 rad²: 9 + 4 at the start is beyond it
    value, time, _ = answer_of(result, parse_requirement("r95(run) <= 1 km"))
    assert (value, time) == (pytest.approx(100.0 * math.sqrt(ncx2.ppf(0.95, 2, 0.0049)), rel=1e-9), 100.0)
    rate = answer_of(result, parse_requirement("rate(end) <= 1 nmi/h"))
    assert rate == (
        pytest.approx(13.0 * math.sqrt(ncx2.ppf(0.95, 2, (7.0 / 13.0) ** 2)) / 600.0, rel=1e-9),
        600.0,
        None,
    )
    cep = answer_of(result, parse_requirement("cep(0 s) <= 1 m"))
    assert cep[:2] == (pytest.approx(5.0 * math.sqrt(ncx2.ppf(0.5, 2, 0.04)), rel=1e-9), 0.0)


def test_one_axis_alone() -> None:
    """A source to the east alone: 95 % of a normal distribution lie within 1.96 σ."""
    covariance = np.zeros((1, 9, 9))
    covariance[0, 1, 1] = 9.0
    one = BudgetResult(
        scenario(name="made"), "inertial", TIME[3:], (GYRO,), {"gyro_bias": covariance}, {}, media=BudgetMedia()
    )
    assert one.r95 == pytest.approx([3.0 * norm.ppf(0.975)], rel=1e-9)
    (found,) = answers(one, "cep(end) <= 5 m")
    assert found.allowances[0].factor == pytest.approx(5.0 / 3.0 / norm.ppf(0.75), rel=1e-9)
