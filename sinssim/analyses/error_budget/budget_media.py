"""What a covariance budget shows and writes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from sinssim.analyses.error_budget.limits import Answer
from sinssim.analyses.error_budget.result import BudgetResult
from sinssim.exhibits import Exhibits
from sinssim.recording.result import Media
from sinssim.recording.streams import Stream
from sinssim.statistics.requirements.requirement import Requirement


class BudgetMedia(Media[BudgetResult]):
    """Numbers, streams, figure and files of a covariance budget."""

    def summary(self, result: BudgetResult) -> dict[str, Any]:
        from sinssim.analyses.error_budget.budget_files import to_json as of_budget

        return of_budget(result, result.answers(), result.times)

    def streams(self, result: BudgetResult) -> Iterator[Stream]:
        from sinssim.analyses.error_budget.budget_files import streams

        yield from streams(result)

    def exhibits(self, result: BudgetResult) -> Exhibits:
        from sinssim.analyses.error_budget.budget_exhibits import exhibits_of

        return exhibits_of(result, result.answers(), result.times)

    def save(self, result: BudgetResult, directory: Path, *, overwrite: bool) -> Path:
        from sinssim.analyses.error_budget.budget_files import write_budget

        return write_budget(result, result.answers(), directory, times=result.times, overwrite=overwrite)

    def answers(
        self, result: BudgetResult, requirements: str | Requirement | Iterable[str | Requirement], free: Sequence[str]
    ) -> tuple[Answer, ...]:
        from sinssim.analyses.error_budget.limits import answers

        return answers(result, requirements, free)


BudgetResult.media = BudgetMedia()
