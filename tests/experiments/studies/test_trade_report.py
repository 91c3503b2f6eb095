"""The report of a trade study."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from sinssim.experiments.studies.trade_exhibits import exhibits_of
from sinssim.experiments.studies.trade_result import TradeResult
from sinssim.experiments.studies.trade_run import TradeMedia
from sinssim.recording.page import page_of
from tests.experiments.studies.test_trade_figure import made
from tests.experiments.studies.test_trade_result import made as ensemble
from tests.experiments.studies.trade_examples import AXES


def test_the_report_is_whole(tmp_path: Path) -> None:
    result = made(tmp_path, *AXES)
    cells = list(result.cells)
    cells[4] = replace(cells[4], numbers=None, failure="it hit <the> ground.")
    result = TradeResult(result.study, tuple(cells), notes=["A file was damaged."], media=TradeMedia())
    text = page_of(exhibits_of(result))
    assert text.count('role="img"') == 5  # curves, map and growth, two with a common legend
    assert "At the end" in text
    for part in ("Requirements", "Trade-offs", "Failed cells", "Definitions", "How it was computed"):
        assert f">{part}</h" in text
    assert "met in 3 of 5 cells" in text
    assert "it hit &lt;the&gt; ground." in text
    assert "A file was damaged." in text
    assert text.count('<span class="met">met</span>') == 3
    assert text.count('<span class="missed">not met</span>') == 2
    assert text.count("sinssim budget ") == 6
    assert not re.search(r'(src|href)="(?!#|data:)', text)
    for tag in ("table", "tr", "td", "h2", "h3", "details"):
        assert len(re.findall(rf"<{tag}[ >]", text)) == text.count(f"</{tag}>"), tag


def test_verdicts_of_ensembles_have_their_own_table(tmp_path: Path) -> None:
    """Bands leave no room beside the numbers."""
    result = ensemble(tmp_path, band=True)
    text = page_of(exhibits_of(result))
    assert "10.0 (5.00 … ∞)" in text
    assert ">Verdicts</p>" in text
    assert text.count(">undecided<") == 2


def test_an_interrupted_study(tmp_path: Path) -> None:
    result = made(tmp_path, *AXES)
    cells = (*result.cells[:2], *(replace(one, numbers=None) for one in result.cells[2:]))
    left = TradeResult(result.study, cells, "interrupted", media=TradeMedia())
    text = page_of(exhibits_of(left))
    assert "The study was interrupted: 2 of 6 cells are finished." in text
    assert text.count(">open<") == 4
