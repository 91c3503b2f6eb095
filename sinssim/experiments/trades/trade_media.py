"""What a trade study shows and writes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from sinssim.exhibits import Exhibits
from sinssim.experiments.trades.result import TradeResult
from sinssim.recording.result import Media


class TradeMedia(Media[TradeResult]):
    """Numbers, streams, figure and files of a trade study."""

    def __init__(self, write: Callable[..., Path]) -> None:
        self._write = write

    def summary(self, result: TradeResult) -> dict[str, Any]:
        from sinssim.experiments.trades.running.write import to_json as of_trade

        return of_trade(result)

    def exhibits(self, result: TradeResult) -> Exhibits:
        from sinssim.experiments.trades.trade_exhibits import exhibits_of

        return exhibits_of(result)

    def figure(self, result: TradeResult, quantity: str | None = None) -> Any:
        from sinssim.experiments.trades.trade_charts import curves
        from sinssim.recording.figures.charts import figure_of
        from sinssim.statistics.requirements.quantity import parse_quantity

        if quantity is not None:
            result.values(quantity)  # refuses a quantity that the study does not have
        return figure_of(curves(result, result.study.drawn[0] if quantity is None else parse_quantity(quantity)))

    def save(self, result: TradeResult, directory: Path, *, overwrite: bool) -> Path:
        return self._write(result, directory, overwrite=overwrite)
