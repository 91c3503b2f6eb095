"""One figure of a result, for its method `plot`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.recording.figures.canvas import to_png

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sinssim.ensembles.result import EnsembleResult
    from sinssim.error_budget.result import BudgetResult
    from sinssim.simulation.result import Run
    from sinssim.trades.result import TradeResult


def plot_run(run: Run) -> Figure:
    """Draw the errors of a run's solutions over time."""
    from sinssim.recording.figures.run import run_figure

    return _shown(run_figure(run))


def plot_ensemble(result: EnsembleResult) -> Figure:
    """Draw the growth of CEP and R95 of an ensemble, and the errors at the end."""
    from sinssim.recording.figures.ensemble import overview

    return _shown(overview(result))


def plot_budget(result: BudgetResult) -> Figure:
    """Draw the growth of CEP and R95 of a budget, and the shares of its sources."""
    from sinssim.recording.figures.budget import growth_figure

    return _shown(growth_figure(result))


def plot_trade(result: TradeResult, quantity: str | None) -> Figure:
    """Draw a quantity of a trade study over its grid; by default the first that its report draws."""
    from sinssim.recording.figures.studies.trade import trade_figure
    from sinssim.requirements.quantity import parse_quantity

    if quantity is not None:
        result.values(quantity)  # refuses a quantity that the study does not have
    return _shown(trade_figure(result, result.study.drawn[0] if quantity is None else parse_quantity(quantity)))


def _shown(figure: Figure) -> Figure:
    """Return a figure that a notebook shows without pyplot."""
    figure._repr_png_ = lambda: to_png(figure)  # type: ignore[attr-defined]
    return figure
