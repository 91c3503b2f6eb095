"""Statistics of navigation errors over many runs or flights; every function takes arrays of any origin."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.statistics.chi_square import Band, mean_square_band, share_inside
    from sinssim.statistics.circles import circle_radius, share_in_circle
    from sinssim.statistics.order_statistics import Percentile, cep, percentile, r95, runs_for_band
    from sinssim.statistics.rates import end_rate, mean_rate, to_nmi_h
    from sinssim.statistics.standard_deviation import Spread, spread

__all__ = [
    "Band",
    "Percentile",
    "Spread",
    "cep",
    "circle_radius",
    "end_rate",
    "mean_rate",
    "mean_square_band",
    "percentile",
    "r95",
    "runs_for_band",
    "share_in_circle",
    "share_inside",
    "spread",
    "to_nmi_h",
]

__getattr__, __dir__ = on_first_use(
    __name__,
    {
        "Band": "sinssim.statistics.chi_square",
        "Percentile": "sinssim.statistics.order_statistics",
        "Spread": "sinssim.statistics.standard_deviation",
        "cep": "sinssim.statistics.order_statistics",
        "circle_radius": "sinssim.statistics.circles",
        "end_rate": "sinssim.statistics.rates",
        "mean_rate": "sinssim.statistics.rates",
        "mean_square_band": "sinssim.statistics.chi_square",
        "percentile": "sinssim.statistics.order_statistics",
        "r95": "sinssim.statistics.order_statistics",
        "runs_for_band": "sinssim.statistics.order_statistics",
        "share_in_circle": "sinssim.statistics.circles",
        "share_inside": "sinssim.statistics.chi_square",
        "spread": "sinssim.statistics.standard_deviation",
        "to_nmi_h": "sinssim.statistics.rates",
    },
)
