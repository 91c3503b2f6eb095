"""What an ensemble shows, from numbers written by hand: curves, bands, circles, ellipses, limits, tables, words."""

from __future__ import annotations

from math import inf, log, nan, pi, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex

from sinssim.charts import Chart, Charts
from sinssim.experiments.ensembles import ensemble_exhibits as ensemble
from sinssim.recording.figures import figure_of
from sinssim.recording.style import COLORS, INK, SOFT, css
from sinssim.statistics.requirements import parse_requirement
from tests.recording.by_hand import ARCMIN
from tests.recording.drawn import check_band, check_line, legend, limits, words

ELAPSED = np.array([600.0, 1200.0, 3000.0])
MINUTES = [10.0, 20.0, 50.0]
KNOT = 1852.0 / 3600.0


def curve(*values: float, low: float = 0.75, high: float = 1.5) -> SimpleNamespace:
    found = np.array(values)
    return SimpleNamespace(value=found, low=low * found, high=high * found)


def spread(size: float) -> SimpleNamespace:
    """Return σ, its standard error and the mean at three epochs, all different by epoch and axis."""
    rows = size * np.outer([1.0, 2.0, 5.0], [1.0, 1.1, 1.3])
    return SimpleNamespace(sigma=rows, standard_error=0.1 * rows, mean=-0.25 * rows)


class Result(SimpleNamespace):
    """An ensemble of forty runs: errors of 300, 400 and 500 m at the end, others far less; the last run failed."""

    def __len__(self) -> int:
        return 40

    def spread(self, quantity: str) -> SimpleNamespace:
        return {"position_ned": spread(30.0), "velocity_ned": spread(0.2), "attitude": spread(2.0 * ARCMIN)}[quantity]

    def stated(self, quantity: str) -> np.ndarray | None:
        return 3.0 * self.spread(quantity).sigma if self.plan.filtered else None


def made(filtered: bool = False, verdicts: tuple[Any, ...] = (), **changes: Any) -> Result:
    final = np.zeros((40, 9))
    final[0, :2], final[1, :2], final[2, :2], final[39, :2] = (30.0, -40.0), (60.0, 80.0), (-5.0, 12.0), (nan, nan)
    horizontal = np.hypot(final[:, 0], final[:, 1])
    failed = np.arange(40) == 39
    kept = {
        "plan": SimpleNamespace(filtered=filtered), "elapsed": ELAPSED, "errors": SimpleNamespace(final=final),
        "failed": failed, "cep": curve(100.0, 200.0, 600.0), "r95": curve(250.0, 500.0, 1600.0),
        "final_horizontal": np.where(failed, inf, horizontal), "verdicts": verdicts,
        "mean_rates": np.where(failed, inf, np.arange(40.0) * 0.1 * KNOT),
        "end_rates": np.where(failed, inf, np.arange(40.0) * 0.2 * KNOT),
    }  # fmt: skip
    return Result(**(kept | changes))


def judged(text: str, verdict: str) -> SimpleNamespace:
    return SimpleNamespace(requirement=parse_requirement(text), verdict=verdict)


def drawn(chart: Chart) -> Any:
    """Return the panel of one chart."""
    (panel,) = figure_of(Charts("one", ((chart,),), (5.0, 4.0))).axes
    return panel


def growth(result: Any) -> Any:
    return drawn(ensemble._growth(result, ensemble.scales_of(result)[0]))


def cloud(result: Any) -> Any:
    return drawn(ensemble._final(result, ensemble.scales_of(result)[0]))


def test_growth() -> None:
    """The label has the value at the end; 2 nmi/h are 1543 m after 50 min; bands from 0.75 to 1.5 times the value."""
    panel = growth(made(verdicts=(judged("r95(end) <= 1 km", "not met"),)))
    blue, green, red = (css(COLORS[name]) for name in ("r95", "cep", "limit"))
    check_line(panel.lines[0], "R95, at the end 1600 m", MINUTES, [250.0, 500.0, 1600.0], blue)
    check_line(panel.lines[1], "CEP, at the end 600 m", MINUTES, [100.0, 200.0, 600.0], green)
    at = 2.0 * KNOT * ELAPSED
    assert at[-1] == pytest.approx(3086.7, abs=0.1)
    check_line(panel.lines[2], "2 nmi/h, limit of R95 (14 CFR 121 App. G)", MINUTES, at, red, "--")
    check_line(panel.lines[3], "r95(end) <= 1 km: not met", [50.0], [1000.0])
    check_band(panel.collections[0], MINUTES, [187.5, 375.0, 1200.0], [375.0, 750.0, 2400.0])
    check_band(panel.collections[1], MINUTES, [75.0, 150.0, 450.0], [150.0, 300.0, 900.0])
    assert [to_hex(one.get_facecolor()[0]) for one in panel.collections] == [blue, green]
    assert words(panel) == ("40 runs, 95 % bands", "time [min]", "horizontal error [m]")
    assert limits(panel) == ((10.0, 50.0), (0.0, pytest.approx(1.25 * at[-1])))


def test_growth_with_failed_runs_and_without_the_regulation() -> None:
    """It does not apply to a filter, beyond ten hours, and far above; the axis reaches the finite end of a band."""
    filtered = growth(made(filtered=True))
    assert len(filtered.lines) == 2
    assert filtered.get_ylim()[1] == pytest.approx(1.25 * 2400.0)
    small = made(cep=curve(1.0, 2.0, 3.0), r95=curve(4.0, 5.0, 3086.0 / 3.01))
    assert len(growth(small).lines) == 2
    assert len(growth(made(elapsed=np.array([1.0, 2.0, 36_001.0]))).lines) == 2
    open_above = made(r95=curve(250.0, 500.0, inf), cep=curve(100.0, 200.0, 600.0, high=inf), filtered=True)
    panel = growth(open_above)
    assert panel.lines[0].get_label() == "R95 is infinite: too many runs failed"
    assert np.asarray(panel.lines[0].get_ydata())[:2].tolist() == [250.0, 500.0]
    assert panel.get_ylim()[1] == pytest.approx(1.25 * 750.0)


def test_the_cloud_of_final_errors() -> None:
    """East to the right; R95 and CEP of forty runs, and the ellipse of the second moments of 39 about zero."""
    panel = cloud(made())
    final = made().errors.final[:39, :2]
    dots = panel.collections[0]
    np.testing.assert_allclose(dots.get_offsets(), final[:, ::-1])
    assert to_hex(dots.get_facecolor()[0]) == css(COLORS["run"])
    # 13, 50, 100, ∞ are the largest of 40; at (N + 1/3) p + 1/3 = 38.65 between the 38th, 50, and the 39th, 100
    radius = 50.0 + 0.65 * 50.0
    angle = 2.0 * pi * np.arange(361) / 360.0
    circle = panel.lines[0]
    assert circle.get_label() == f"R95 {radius:.1f} m"
    np.testing.assert_allclose(circle.get_xdata(), radius * np.sin(angle), atol=1e-9)
    np.testing.assert_allclose(circle.get_ydata(), radius * np.cos(angle), atol=1e-9)
    assert to_hex(circle.get_color()) == css(COLORS["r95"])
    assert panel.lines[1].get_label() == "CEP 0 m"
    p = np.array([[900.0 + 3600.0 + 25.0, -1200.0 + 4800.0 - 60.0], [0.0, 1600.0 + 6400.0 + 144.0]]) / 39.0
    p[1, 0] = p[0, 1]
    ellipse = panel.lines[2]
    assert ellipse.get_label() == "95 % ellipse of the covariance"
    points = np.array([ellipse.get_ydata(), ellipse.get_xdata()])  # north, east
    np.testing.assert_allclose(np.einsum("ik,ij,jk->k", points, np.linalg.inv(p), points), 2.0 * log(20.0), rtol=1e-9)
    mean, apart = 0.5 * (p[0, 0] + p[1, 1]), sqrt(0.25 * (p[0, 0] - p[1, 1]) ** 2 + p[0, 1] ** 2)
    half = sqrt(2.0 * log(20.0) * (mean + apart))
    assert np.hypot(*points).max() == pytest.approx(half, rel=1e-3)
    assert half < 80.0 < radius  # so that the circle decides the limits of both axes
    reach = pytest.approx(1.05 * radius)
    assert [(-low, high) for low, high in limits(panel)] == [(reach, reach), (reach, reach)]
    # the circle that holds 95 % of a normal distribution with these variances: a count of many draws is 0.3 % off
    draws = np.random.default_rng(1).multivariate_normal((0.0, 0.0), p, 200_000)
    expected = np.quantile(np.hypot(*draws.T), 0.95)
    shown = np.hypot(panel.lines[3].get_xdata(), panel.lines[3].get_ydata())
    assert shown.max() == pytest.approx(shown.min()) == pytest.approx(expected, rel=0.02)
    assert panel.lines[3].get_label() == f"95 % circle of the covariance {shown[0]:.1f} m"
    assert words(panel) == ("errors at the end", "east [m]", "north [m]")


def test_a_cloud_without_runs() -> None:
    every = np.ones(40, bool)
    panel = cloud(made(failed=every, final_horizontal=np.full(40, inf)))
    assert words(panel)[0] == "errors at the end: every run failed, or too many for a circle"


def test_the_rates_of_the_runs() -> None:
    """0, 0.1, …, 3.8 nmi/h, and the last infinite: CEP at the place 20.5 of 40, R95 at 38.65, at the end twice that."""
    left, right = figure_of(ensemble._rates(made())).axes
    for panel, size, title in ((left, 1.0, "line through the origin, Σ t r / Σ t²"),
                               (right, 2.0, "at the end, r(T) / T")):  # fmt: skip
        *counted, over_cep, over_r95 = panel.patches
        assert sum(patch.get_height() for patch in counted) == 39
        assert (counted[0].get_x(), counted[-1].get_x() + counted[-1].get_width()) == (0.0, pytest.approx(3.8 * size))
        middle, far = 1.95 * size, (3.7 + 0.065) * size
        check_line(panel.lines[0], f"CEP {middle:.2f} nmi/h", [middle] * 2, [0.0, 1.0], css(COLORS["cep"]))
        check_line(panel.lines[1], f"R95 {far:.2f} nmi/h", [far] * 2, [0.0, 1.0], css(COLORS["r95"]))
        assert words(panel)[:2] == (title, "rate [nmi/h]")
        assert panel.get_xlim()[0] == 0.0
        low, high = over_cep.get_x(), over_cep.get_x() + over_cep.get_width()
        assert 1.0 * size < low < middle < high < 3.0 * size
        # the band of R95 has no upper end: up to the largest finite rate
        assert over_r95.get_x() + over_r95.get_width() == pytest.approx(3.8 * size)
    assert left.get_ylabel() == "runs"


def test_components() -> None:
    """σ of 30, 0.2 and 2′ times 1, 1.1 and 1.3 by axis, and times 1, 2 and 5 by epoch; the budget's are seven times."""
    predicted = 7.0 * np.concatenate([made().spread(q).sigma for q in ("position_ned", "velocity_ned", "attitude")], 1)
    asked = (judged("velocity_east <= 1.2 m/s", "met"), judged("heading(20 min) <= 5 arcmin", "undecided"))
    result = made(filtered=True, verdicts=asked)
    figure = figure_of(ensemble._components(result, ensemble.scales_of(result), predicted))
    rows = (("position", "m", 30.0), ("velocity", "m/s", 0.2), ("attitude φ", "arcmin", 2.0))
    grown = np.array([1.0, 2.0, 5.0])
    for number, panel in enumerate(figure.axes):
        title, unit, size = rows[number // 3]
        axis = ("north", "east", "down")[number % 3]
        sigma = size * (1.0, 1.1, 1.3)[number % 3] * grown
        color = css(COLORS[axis])
        check_band(panel.collections[0], MINUTES, (1.0 - 0.196) * sigma, (1.0 + 0.196) * sigma)
        check_line(panel.lines[0], "σ of the runs, ± 1.96 standard errors", MINUTES, sigma, color, "-")
        check_line(panel.lines[1], "σ stated by the filter", MINUTES, 3.0 * sigma, INK, "--")
        check_line(panel.lines[2], "σ predicted by the budget", MINUTES, 7.0 * sigma, css(COLORS["smoothed"]), ":")
        check_line(panel.lines[3], "mean of the runs", MINUTES, -0.25 * sigma, SOFT)
        name = "time [min]" if number > 5 else ""
        assert words(panel)[:2] == (f"{title}, {axis}", name)
        assert panel.get_ylabel() == unit
    check_line(figure.axes[4].lines[-1], "velocity_east <= 1.2 m/s: met", [0.0, 1.0], [1.2, 1.2])
    check_line(figure.axes[8].lines[4], "heading(20 min) <= 5 arcmin: undecided", [20.0], [5.0])
    assert [len(panel.lines) for panel in figure.axes] == [4, 4, 4, 4, 5, 4, 4, 4, 5]
    assert legend(figure) == ["σ of the runs, ± 1.96 standard errors", "σ stated by the filter",
                              "σ predicted by the budget", "mean of the runs", "velocity_east <= 1.2 m/s: met",
                              "heading(20 min) <= 5 arcmin: undecided"]  # fmt: skip
    plain = figure_of(ensemble._components(made(), ensemble.scales_of(made()), predicted)).axes[0]
    check_line(plain.lines[1], "σ predicted by the budget", MINUTES, 7.0 * 30.0 * grown, INK, ":")


def test_the_units_of_an_ensemble() -> None:
    """Circles count among the lengths, at any epoch."""
    assert ensemble.scales_of(made()) == [
        (("m", 1.0, inf),), (("m/s", 1.0, inf),), (("arcmin", pytest.approx(ARCMIN), inf),)
    ]  # fmt: skip
    for large in (made(r95=curve(1.0, 2e5, 3.0)), made(cep=curve(2e5, 2.0, inf))):
        assert ensemble.scales_of(large)[0] == (("km", 1e3, inf),)


def test_consistency() -> None:
    """The band is drawn where there are values; a name in the table of colours has its colour."""
    band = SimpleNamespace(low=np.array([0.8, 0.7, 0.6]), high=np.array([1.2, 1.3, 1.4]))
    one = SimpleNamespace(name="position", value=np.array([0.5, nan, 1.5]), band=band)
    two = SimpleNamespace(name="velocity", value=np.array([2.0, 3.0, 4.0]), band=SimpleNamespace(low=0.9, high=1.1))
    third = SimpleNamespace(name="attitude", value=np.array([2.0, 3.0, 4.0]), band=SimpleNamespace(low=0.9, high=1.1))
    page, recording = ensemble._squares(made(), "nees", {"a": one, "b": two, "c": third}, "NEES / n")
    assert [(mark.label, mark.y.tolist()) for mark in next(iter(recording)).marks][1:] == [  # type: ignore[union-attr]
        ("velocity", [2.0, 3.0, 4.0]), ("attitude", [2.0, 3.0, 4.0])
    ]  # fmt: skip
    assert ([chart.key for chart in recording], recording.on) == (["nees"], ("recording",))
    figure = figure_of(page)
    assert len(figure.axes) == 3
    for panel, own, name in zip(figure.axes, (one, two, third), ("position", "velocity", "attitude"), strict=True):
        assert (words(panel)[0], words(panel)[2]) == (name, "NEES / n")
        assert panel.get_ylim()[0] == 0.0
        assert to_hex(panel.lines[0].get_color()) == css(COLORS[name])
        check_line(panel.lines[1], "", [0.0, 1.0], [1.0, 1.0])
        assert own.name == name
    check_line(figure.axes[0].lines[0], "", [10.0, 50.0], [0.5, 1.5])
    check_band(figure.axes[0].collections[0], [10.0, 50.0], [0.8, 0.6], [1.2, 1.4])
    check_line(figure.axes[1].lines[0], "", MINUTES, [2.0, 3.0, 4.0])
    check_band(figure.axes[1].collections[0], MINUTES, [0.9] * 3, [1.1] * 3)
    assert [words(panel)[1] for panel in figure.axes] == ["", "", "time [min]"]


def test_the_overview_is_both() -> None:
    left, right = figure_of(ensemble._overview(made(), ensemble.scales_of(made())[0])).axes
    assert words(left)[0] == "40 runs, 95 % bands"
    assert words(right)[0] == "errors at the end"
