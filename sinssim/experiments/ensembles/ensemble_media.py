"""What an ensemble shows and writes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from sinssim.exhibits import Exhibits
from sinssim.experiments.ensembles.result import EnsembleResult
from sinssim.recording.result import Media
from sinssim.recording.streams import Stream, Vector


class EnsembleMedia(Media[EnsembleResult]):
    """Numbers, streams, figure and files of an ensemble."""

    def __init__(self, write: Callable[..., Path]) -> None:
        self._write = write

    def summary(self, result: EnsembleResult) -> dict[str, Any]:
        from sinssim.experiments.ensembles.ensemble_files import to_json as of_ensemble

        return of_ensemble(result)

    def streams(self, result: EnsembleResult) -> Iterator[Stream]:
        circles = {"cep": result.cep, "r95": result.r95}
        columns = {f"{name}_m": one.value for name, one in circles.items()}
        columns |= {f"{name}_low_m": one.low for name, one in circles.items()}
        columns |= {f"{name}_high_m": one.high for name, one in circles.items()}
        yield Stream("circles", result.time, tuple(Vector(k, (k,), v[:, None]) for k, v in columns.items()))

    def exhibits(self, result: EnsembleResult) -> Exhibits:
        from sinssim.experiments.ensembles.ensemble_exhibits import exhibits_of
        from sinssim.experiments.ensembles.summary import ensemble_numbers

        return exhibits_of(result, ensemble_numbers(result))

    def save(self, result: EnsembleResult, directory: Path, *, overwrite: bool) -> Path:
        return self._write(result, directory, overwrite=overwrite)
