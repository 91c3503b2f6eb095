"""Runs a trade study.

Computes the cells that are missing, keeps each in the study's directory, and writes the report: `trade`.

The directory has a manifest, and a file or a folder for each finished cell. The name of a cell is the digest of its
scenario and of what is asked for. A study whose axes have got further values therefore goes on with the cells that it
has.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from sinssim.errors import InputError, RunError, SinssimError
from sinssim.exhibits import Exhibits
from sinssim.experiments.ensembles.ensemble_directory import EnsembleDirectory
from sinssim.experiments.ensembles.ensemble_plan import contents_of, truth_key
from sinssim.experiments.ensembles.ensemble_run import Workers, stored_runs
from sinssim.experiments.experiment_directory import (
    Experiment,
    Kind,
    Store,
    is_part,
    other_scenario,
    other_software,
    software,
)
from sinssim.experiments.studies.trade_cells import Cell, CellNumbers, SourceParts, cells_of, of_budget, of_ensemble
from sinssim.experiments.studies.trade_exhibits import curves, exhibits_of, to_json, write_trade
from sinssim.experiments.studies.trade_result import TradeResult
from sinssim.experiments.studies.trade_schema import TradeStudy
from sinssim.experiments.workload import LIMIT_MINUTES, TooLongError, Watch, check_limit, flight_wait
from sinssim.progress import Progress, shown
from sinssim.recording.result import Media, plain
from sinssim.scenario import Scenario
from sinssim.scenario.ensemble_section import EnsembleSection
from sinssim.scenario.load import load_scenario
from sinssim.scenario.planned_limits import check_times, warn_of_limits
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.statistics.requirements import VerdictInUnit, parse_quantity
from sinssim.system.files import MARK, remove

MANIFEST = "trade.json"
_ENSEMBLE = EnsembleDirectory.KIND.manifest


class TradeDirectory(Store):
    """The directory of a trade study: a file or a folder for each cell that is finished."""

    KIND = Kind(MANIFEST, (), "cells", "sinssim trade study", "a", "trade study", "cell", "finished cells")

    def __init__(self, path: Path, study: TradeStudy, *, resume: bool = False, overwrite: bool = False) -> None:
        """Begin the directory of a study, or continue it, as `Store` does."""
        contents = contents_of(load_scenario(study.scenario, study.set))
        self._about = {
            "name": study.name,
            "cell": study.cell,
            "versions": software(),
            "scenario": json.loads(json.dumps(contents)),
        }
        super().__init__(path, resume=resume, overwrite=overwrite)

    def manifest(self) -> dict[str, Any]:
        return self._about

    def difference(self, there: dict[str, Any]) -> str:
        about = self._about
        if there.get("name") != about["name"]:
            return f"is the study {there.get('name')}, not {about['name']}"
        if there.get("cell") != about["cell"]:
            return f"has {there.get('cell')} cells, not {about['cell']} cells"
        return other_software(there) or other_scenario(there.get("scenario"), about["scenario"])

    @classmethod
    def computed(cls, path: Path) -> list[str]:
        names = []
        for cell in (path / "cells").glob("*"):
            if not is_part(cell.name):
                continue
            if cell.suffix:
                names.append(f"cells/{cell.name}")
            elif cell.is_symlink() or (cell / _ENSEMBLE).is_file():
                inside = [] if cell.is_symlink() else [f"/{name}" for name in _files_of(cell)]
                names += [f"cells/{cell.name}{name}" for name in inside or [""]]
        return names

    def ensemble(self, digest: str, say: Callable[[str], None]) -> Path:
        """Return the folder of an ensemble; one whose manifest is damaged is named and removed."""
        folder = self.part(digest)
        if folder.is_dir():
            try:
                json.loads((folder / _ENSEMBLE).read_text(encoding="utf-8"))["digest"]
            except (OSError, ValueError, KeyError, TypeError) as error:
                say(f"{folder / _ENSEMBLE} is damaged ({error}). Its cell is computed again.")
                remove(folder, _files_of(folder))
        return folder


def _files_of(ensemble: Path) -> list[str]:
    """Return what sinssim wrote in the folder of an ensemble."""
    return [*EnsembleDirectory.all_files(ensemble), MARK]


def _contents(numbers: CellNumbers) -> dict[str, Any]:
    """Return numbers as JSON holds them; doubles keep every bit."""
    contents = asdict(numbers)
    return dict(plain(contents | {name: contents[name].tolist() for name in ("time", "cep", "r95")}))


def _numbers(contents: dict[str, Any]) -> CellNumbers:
    """Return what `_contents` was made of."""

    def known(value: Any) -> float:
        return float("nan") if value is None else float(value)

    verdicts = tuple(
        VerdictInUnit(**{**verdict, **{name: known(verdict[name]) for name in ("value", "time_s")}})
        for verdict in contents["verdicts"]
    )
    values = {name: known(value) for name, value in contents["values"].items()}
    time, cep, r95 = (np.array([known(v) for v in contents[name]]) for name in ("time", "cep", "r95"))
    sources = tuple(
        SourceParts(**{**source, "value": known(source["value"])}) for source in contents.get("sources", ())
    )
    return CellNumbers(
        values, verdicts, time, cep, r95, tuple(contents["notes"]), sources, contents.get("instants", {})
    )


Say = Callable[[str], None]


def trade(
    study: TradeStudy,
    directory: Path | str | None = None,
    *,
    resume: bool = False,
    overwrite: bool = False,
    limit_minutes: float = LIMIT_MINUTES,
    threads: int | None = None,
    progress: Progress | bool | None = None,
    say: Say | None = None,
) -> TradeResult:
    """Compute every cell of a trade study, and write its report.

    A cell has the numbers of `sinssim budget` or `sinssim ensemble` with its settings, bit for bit. Cells on the same
    true motion share it. A cell that fails is a result; the others are computed. An interrupted study keeps its
    finished cells and can be continued. The options are those of `sinssim.compare`.
    """
    check_limit(limit_minutes)
    TradeDirectory.check_options(directory, resume=resume, overwrite=overwrite)
    result = TradeResult(study, cells_of(study), media=TradeMedia())
    with (
        shown(progress) as report,
        TradeDirectory.opened(directory, study, resume=resume, overwrite=overwrite) as folder,
        Workers(threads) as hands,
    ):
        result.directory = None if folder.is_draft else folder.path
        work = _Work(result, folder, hands, report, say or (lambda text: None))
        with folder.reported(work, report):
            work.run(limit_minutes)
    if not result.finished:
        number, first = next(iter(result.failures.items()))
        where = "" if directory is None else f" See {folder.path}."
        kind = RunError if work.runs_failed else InputError
        raise kind(f"all {len(result)} cells of the study {study.name} failed; cell {number}: {first}{where}")
    return result


class _Work(Experiment):
    """The computation of the cells of a study that have no numbers."""

    def __init__(self, result: TradeResult, folder: TradeDirectory, hands: Workers, report: Progress, say: Say) -> None:
        self.result, self._folder, self._hands = result, folder, hands
        self._report, self._say_on = report, say
        self.runs_failed = False

    def say(self, text: str) -> None:
        """Say a remark, and keep it."""
        self.result.notes.append(text)
        self._say_on(text)

    @property
    def finished(self) -> str:
        return f"{self.result.finished} of {len(self.result)} cells" if self.result.finished else ""

    def conclude(self, status: str) -> None:
        self.result.status = status

    def write(self, place: Path) -> None:
        write_trade(self.result, place)

    def run(self, limit_minutes: float) -> None:
        """Compute the cells that are missing, one for each digest, those of one motion after one another."""
        begin, study = perf_counter(), self.result.study
        try:
            self._read_kept()
            todo = dict[str, Cell]()
            for cell in self._unknown():
                todo.setdefault(cell.digest, cell)
            motions = dict[str, list[Cell]]()
            for cell in todo.values():
                motions.setdefault(truth_key(_scenario(cell)), []).append(cell)
            flown = {motion: _scenario(cells[0]) for motion, cells in motions.items()}
            runs = f" of {_runs(next(iter(flown.values())), study)} runs" if todo and study.cell == "ensemble" else ""
            what = f"{len(todo)} {study.cell}{'s' if len(todo) != 1 else ''}{runs}"
            watch = Watch(study.name, what, max(len(todo), 1), limit_minutes, self._report, self._say_on)
            warn_of_limits(*flown.values())
            unflown = {motion: flight_wait(scenario) for motion, scenario in flown.items()}
            for motion, cells in motions.items():
                for cell in cells:
                    watch.flying(sum(unflown.values()))
                    self._compute(cell, watch)
                    unflown.pop(motion, None)
        finally:
            self._hands.stop()
            self._read_kept()  # Ctrl-C may have come right after a cell was written
            self.result.seconds = perf_counter() - begin

    def _unknown(self) -> list[Cell]:
        return [cell for cell in self.result.cells if cell.digest and cell.numbers is None]

    def _read_kept(self) -> None:
        """Read the budgets in the directory whose numbers are not known."""
        if self.result.study.cell == "budget":
            for digest in dict.fromkeys(cell.digest for cell in self._unknown()):
                if (kept := self._folder.read_part(digest, self.say)) is not None:
                    self._enter(digest, numbers=_numbers(kept))

    def _enter(self, digest: str, **what: Any) -> None:
        """Enter what became of the cells of a digest."""
        cells = self.result.cells
        self.result.cells = tuple(replace(cell, **what) if cell.digest == digest else cell for cell in cells)

    def _compute(self, cell: Cell, watch: Watch) -> None:
        """Compute a cell; what goes wrong in it is its result."""
        failure = ""
        try:
            check_times(_scenario(cell))
            truth = self._hands.truths.of(_scenario(cell))
            watch.begin()
            by_budget = self.result.study.cell == "budget"
            numbers = self._budget(cell, truth, watch) if by_budget else self._ensemble(cell, watch)
            self._enter(cell.digest, numbers=numbers)
            self.result.computed += 1
        except MemoryError:  # no property of the cell
            raise
        except SinssimError as error:
            if isinstance(error, TooLongError) or isinstance(error.__cause__, OSError):
                raise
            failure = str(error) or type(error).__name__
            self.runs_failed |= not isinstance(error, InputError)
        except Exception as error:  # whatever went wrong in one of many cells is a result to report
            failure = f"{type(error).__name__}: {error}"
            self.runs_failed = True
        if failure:
            self._enter(cell.digest, failure=failure)
        watch.finish(failed=bool(failure))

    def _budget(self, cell: Cell, truth: Truth, watch: Watch) -> CellNumbers:
        from sinssim.analyses.error_budget.covariance_budget import budget

        study = self.result.study
        result = budget(
            _scenario(cell), times=study.instants, solution="inertial" if study.inertial else None, truth=truth,
            progress=lambda stage, part: watch.inside(part if stage == "budget" else 0.0),
        )  # fmt: skip
        numbers = of_budget(study, result)
        self._folder.write_part(cell.digest, _contents(numbers))
        return numbers

    def _ensemble(self, cell: Cell, watch: Watch) -> CellNumbers:
        study = self.result.study
        result = stored_runs(
            _scenario(cell), _runs(_scenario(cell), study), self._folder.ensemble(cell.digest, self.say),
            times=study.instants, hands=self._hands, say=self.say,
            progress=lambda text, part: watch.inside(part, text.split(",")[0]),
        )  # fmt: skip
        numbers = of_ensemble(study, result)
        if result.failed.all():
            raise RunError(f"all {len(result)} runs failed; the first one: {result.errors.failure[0]}")
        return numbers


def _scenario(cell: Cell) -> Scenario:
    """Return the scenario of a cell that has one."""
    assert cell.scenario is not None
    return cell.scenario


def _runs(scenario: Scenario, study: TradeStudy) -> int:
    """Return the number of runs of an ensemble."""
    return study.runs or (scenario.ensemble or EnsembleSection()).runs


class TradeMedia(Media[TradeResult]):
    """Numbers, streams, figure and files of a trade study."""

    def summary(self, result: TradeResult) -> dict[str, Any]:
        return to_json(result)

    def exhibits(self, result: TradeResult) -> Exhibits:
        return exhibits_of(result)

    def figure(self, result: TradeResult, quantity: str | None = None) -> Any:
        from sinssim.recording.figures import figure_of

        if quantity is not None:
            result.values(quantity)  # refuses a quantity that the study does not have
        return figure_of(curves(result, result.study.drawn[0] if quantity is None else parse_quantity(quantity)))

    def save(self, result: TradeResult, directory: Path, *, overwrite: bool) -> Path:
        """Write the directory of a study that was kept in memory, without the runs of its ensembles.

        A study of ensembles that is continued there computes its cells again.
        """
        with TradeDirectory(directory, result.study, overwrite=overwrite) as folder:
            for cell in result.cells:
                if cell.numbers is not None and result.study.cell == "budget":
                    folder.write_part(cell.digest, _contents(cell.numbers))
            folder.keep(lambda place: write_trade(result, place))
            return folder.path
