"""Statistics of navigation errors over many runs or flights; every function takes arrays of any origin."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.system import on_first_use

if TYPE_CHECKING:
    from sinssim.statistics.chi_square import Band as Band
    from sinssim.statistics.chi_square import mean_square_band as mean_square_band
    from sinssim.statistics.chi_square import share_inside as share_inside
    from sinssim.statistics.circular_error import circle_radius as circle_radius
    from sinssim.statistics.circular_error import end_rate as end_rate
    from sinssim.statistics.circular_error import mean_rate as mean_rate
    from sinssim.statistics.circular_error import share_in_circle as share_in_circle
    from sinssim.statistics.circular_error import to_nmi_h as to_nmi_h
    from sinssim.statistics.percentiles import Percentile as Percentile
    from sinssim.statistics.percentiles import Spread as Spread
    from sinssim.statistics.percentiles import cep as cep
    from sinssim.statistics.percentiles import percentile as percentile
    from sinssim.statistics.percentiles import r95 as r95
    from sinssim.statistics.percentiles import runs_for_band as runs_for_band
    from sinssim.statistics.percentiles import spread as spread

__getattr__, __dir__, __all__ = on_first_use(__name__)
