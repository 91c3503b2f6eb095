"""Runs an ensemble from end to end."""

from __future__ import annotations

import os
import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from sinssim.errors import InputError, RunError
from sinssim.exhibits import Exhibits
from sinssim.experiments.ensembles.ensemble_directory import EnsembleDirectory, kept_epochs, missing, write_chunk
from sinssim.experiments.ensembles.ensemble_errors import AT_ONCE, IN_MEMORY, bytes_of
from sinssim.experiments.ensembles.ensemble_execution import Cluster, Group, Processes, make_chunk
from sinssim.experiments.ensembles.ensemble_exhibits import exhibits_of, to_json, write_ensemble
from sinssim.experiments.ensembles.ensemble_plan import AIDED, LONG_CHUNK, Plan, TruthCache, make_plan, with_runs
from sinssim.experiments.ensembles.ensemble_result import EnsembleResult
from sinssim.experiments.ensembles.ensemble_summary import ensemble_numbers
from sinssim.experiments.ensembles.ensemble_verdicts import Looks, check_kept
from sinssim.experiments.experiment_directory import Experiment
from sinssim.experiments.workload import Executor, Threads, check_workers, whole_number, work_through
from sinssim.progress import Progress, shown
from sinssim.recording.result import Media
from sinssim.recording.streams import Stream, Vector
from sinssim.scenario import Scenario
from sinssim.scenario.ensemble_section import MOST_RUNS, EnsembleSection
from sinssim.scenario.load import Overrides, as_scenario
from sinssim.scenario.planned_limits import warn_of_limits
from sinssim.simulation.foreign_navigator import end_programs
from sinssim.statistics.requirements import Requirement, parse_requirements
from sinssim.system.process import give_back_memory, machine_memory
from sinssim.units import duration_text, size_text

_SAMPLE_BYTES, _OF_MEMORY = 420.0, 0.7
"""Memory of a run in progress per sample, bytes, and the share of the machine's memory that may be used."""
_RUN_BYTES = 300.0
"""Memory of what is kept of a run beside its errors at the epochs, and of its places in rankings, bytes."""
_COPIES, _OF_FILE = 10.0, 4.0
"""Arrays of the size of a part that statistics hold at a time, and of the size of a file while it is written."""
_COMPRESSED = 0.5
"""Least part of its bytes that a file of runs takes; measured are 0.65."""


def check_memory(plan: Plan, runs: int) -> None:
    """Raise for an ensemble whose statistics do not fit in the memory."""
    needed, have = memory_needed(plan, runs), _memory()
    if needed <= have:
        return
    epochs, lasts = len(plan.epochs), float(plan.epochs[-1] - plan.start)
    halved = (epochs >> times for times in range(1, epochs.bit_length() - 1))
    enough = next((number for number in halved if memory_needed(plan, runs, number) <= have), None)
    fewer = (
        "" if enough is None else f", or keep fewer epochs: ensemble.epoch_s = {lasts / (enough - 1):.3g}, for example"
    )
    raise InputError(
        f"runs = {runs}: the statistics of {runs} runs at {epochs} epochs need {size_text(needed)} of memory, and "
        f"{size_text(have)} can be used on this machine. Compute fewer runs{fewer}."
    )


def check_disk(plan: Plan, runs: int, finished: int, folder: Path) -> None:
    """Raise for an ensemble whose files do certainly not fit on the disk."""
    needed, have = disk_needed(plan, runs, finished), _disk(folder)
    if needed > have:
        raise InputError(
            f"runs = {runs}: the errors of {runs} runs at {len(plan.epochs)} epochs need at least "
            f"{size_text(needed)} more on the disk, and {size_text(have)} are free in {folder}. Compute fewer runs, "
            "keep fewer epochs with a larger ensemble.epoch_s, or give a folder on a larger disk with -o."
        )


def short_of(plan: Plan, runs: int, finished: int, folder: Path) -> str:
    """Return where an ensemble would not fit: "in the memory", "on the disk", or ""."""
    if memory_needed(plan, runs) > _memory():
        return "in the memory"
    return "on the disk" if disk_needed(plan, runs, finished) > _disk(folder) else ""


def memory_needed(plan: Plan, runs: int, epochs: int | None = None) -> float:
    """Return the memory of an ensemble's statistics and of the files that are being written, bytes.

    These are all errors if they are few, else the parts of them that are held at a time; without the runs in progress.
    """
    epochs = epochs or len(plan.epochs)
    whole = _bytes(plan, runs, epochs)
    part = 8.0 * min(max(AT_ONCE, 3 * runs), runs * epochs)
    arrays = whole if whole <= IN_MEMORY else 0.0
    return arrays + _COPIES * part + _RUN_BYTES * runs + _OF_FILE * _bytes(plan, min(plan.chunk, runs), epochs)


def disk_needed(plan: Plan, runs: int, finished: int) -> float:
    """Return the bytes that an ensemble takes on the disk at least, beside the files that exist.

    These are the further files, and the file without a name from which statistics of many runs are computed.
    """
    whole = _bytes(plan, runs)
    return _COMPRESSED * _bytes(plan, runs - finished) + (whole if whole > IN_MEMORY else 0.0)


def runs_at_a_time(plan: Plan) -> int:
    """Return the number of runs that are computed at a time: the cores, or fewer if the memory is too small."""
    samples = (plan.epochs[-1] - plan.start) * plan.scenario.imu.rate_hz
    each = _SAMPLE_BYTES * max(samples, 1.0) + _OF_FILE * _bytes(plan, plan.chunk)
    return max(1, min(os.cpu_count() or 1, int(min(_memory() / each, 1024.0))))


def _bytes(plan: Plan, runs: int, epochs: int | None = None) -> float:
    return bytes_of(runs, epochs or len(plan.epochs), len(plan.blocks), len(plan.sensors), len(plan.path))


def _memory() -> float:
    return _OF_MEMORY * machine_memory()


def _disk(folder: Path) -> float:
    return float(shutil.disk_usage(folder).free)


# Long: every option is a parameter.
def ensemble(
    scenario: Scenario | str | Path,
    runs: int | None = None,
    directory: Path | str | None = None,
    *,
    overrides: Overrides = (),
    resume: bool = False,
    overwrite: bool = False,
    threads: int | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    require: str | Requirement | Iterable[str | Requirement] = (),
    until_decided: bool = False,
    times: Iterable[float] = (),
    progress: Progress | bool | None = None,
    say: Callable[[str], None] | None = None,
) -> EnsembleResult:
    """Run an ensemble: many runs of a scenario that differ in their random numbers, and in the varied keys.

    Run i has the errors of `sinssim.run` of the scenario with the seed
    `sinssim.experiments.ensembles.run_seed(scenario.seed, i)`,
    bit for bit, for any number of threads or workers. An interrupted or failed ensemble keeps its finished runs
    and can be continued.

    Args:
        scenario: the scenario, with or without an [ensemble] section, or its file or name.
        runs: number of runs; by default that of the section, or 1000.
        directory: directory of the ensemble; by default the runs are kept only in memory.
        overrides: settings "key=value", as for `load_scenario`.
        resume: whether an ensemble in the directory is continued, or extended to more runs.
        overwrite: whether an ensemble in the directory is replaced.
        threads: number of runs computed at a time on this machine: threads, or processes for runs with a filter; by
            default the number of its cores.
        workers: number of workers of a dask cluster on this machine instead.
        scheduler: address of a dask scheduler instead, for example "tcp://10.0.0.1:8786".
        require: requirements to test, such as "r95(3600 s) <= 1852 m"; their times become epochs.
        until_decided: whether the number of runs is doubled, at most four times, until each requirement is met or not
            met. The repeated tests share the probability of error of 5 %.
        times: times since the start for further lines of the tables, s; they become epochs.
        progress: called with runs done, rate and time left in words, and the fraction done; True shows a bar.
        say: called with remarks, such as a damaged file whose runs are computed again.

    Returns:
        The errors of all runs at the epochs, their statistics, and the verdicts on the requirements.

    Raises:
        InputError: the scenario, the directory or an option cannot be used, the directory holds another ensemble, or
            the disk is full.
        RunError: every run failed, or workers died repeatedly.

    Warns:
        SinssimWarning: a leg of the flight is beyond the limits of the aircraft; once, not for each run.
    """
    scenario = as_scenario(scenario, overrides)
    section = scenario.ensemble or EnsembleSection()
    count = whole_number("runs", section.runs if runs is None else runs, MOST_RUNS)
    EnsembleDirectory.check_options(directory, resume=resume, overwrite=overwrite)
    wanted = parse_requirements(require)
    if until_decided and not wanted:
        raise InputError("until_decided (--until-decided) needs a requirement: give one with require (--require).")
    tell, instants = say or (lambda text: None), tuple(map(float, times))
    with shown(progress) as report, Workers(threads, workers, scheduler) as hands:
        if not resume:  # an ensemble that is continued may need no runs
            hands.start_early(scenario, count)
        report("Flying", 0.0)
        stored = kept_epochs(Path(directory)) if resume and directory is not None else None
        warn_of_limits(scenario)
        plan = with_runs(make_plan(scenario, hands.truths, wanted, stored, instants), count)
        check_memory(plan, count)
        looks = Looks(wanted, count, until_decided)
        with EnsembleDirectory.opened(directory, plan, resume=resume, overwrite=overwrite) as folder:
            check_kept(plan, wanted, instants)
            work = _Ensemble(folder, hands, report, tell, instants, looks=looks)
            with folder.reported(work, report):
                work.run()
            if folder.is_draft:
                return replace(work.result, directory=None)
    if work.result.failed.all():
        raise RunError(
            f"all {len(work.result)} runs of the ensemble failed; the first one: {work.result.errors.failure[0]} See "
            f"{folder.path}."
        )
    return work.result


def stored_runs(
    scenario: Scenario,
    runs: int,
    directory: Path,
    *,
    times: Iterable[float],
    hands: Workers,
    progress: Progress,
    say: Callable[[str], None],
) -> EnsembleResult:
    """Run an ensemble, or continue it, in a directory without a report: a part of something larger.

    The options are those of `ensemble`. The workers stay for the next ensemble. An interruption leaves the finished
    groups of runs in the directory.
    """
    plan = with_runs(make_plan(scenario, hands.truths, times=times), runs)
    check_memory(plan, runs)
    with EnsembleDirectory(directory, plan, resume=True) as folder:
        return _Ensemble(folder, hands, progress, say, looks=Looks((), runs, False)).continued(runs)


class Workers:
    """Computes groups of runs by threads, processes or a cluster, which stay for those of the next ensemble.

    A context manager that ends them.
    """

    def __init__(self, threads: int | None = None, workers: int | None = None, scheduler: str | None = None) -> None:
        """Begin without any: as many threads, or workers, as given, or a scheduler; by default as many as cores."""
        check_workers(threads, workers, scheduler)
        self.truths = TruthCache()
        self._threads, self._workers, self._scheduler = threads, workers, scheduler
        self._executor: Executor[Group] | None = None
        self._kind = ("", 0)

    def start_early(self, scenario: Scenario, count: int) -> None:
        """Start the processes of runs with a filter, so that they load the program while the ensemble is planned."""
        solution = None if scenario.ensemble is None else scenario.ensemble.solution
        number = self._threads or os.cpu_count() or 1
        early = min(number, -(-count // LONG_CHUNK))
        here = self._workers is None and self._scheduler is None
        if here and early > 1 and scenario.filter is not None and solution in (None, AIDED):
            self._executor, self._kind = Processes(number, self.truths, early), ("processes", number)

    def compute(self, groups: Sequence[Group], counter: _Counter) -> None:
        """Compute groups of runs of one ensemble. After an error or an interruption the others are abandoned."""
        try:
            executor = self._executor_for(groups)
            work_through(groups, executor, lambda group, _: counter.count(group.runs, len(group.runs)),
                         lambda group, finished: counter.count(group.runs, finished))  # fmt: skip
        except BaseException:
            end_programs()
            self.stop()
            raise

    def _executor_for(self, groups: Sequence[Group]) -> Executor[Group]:
        """Return the executor that suits some groups: the one of before, if it does."""
        plan, truths = groups[0].plan, self.truths
        number = self._threads or runs_at_a_time(plan)
        kind = "processes" if plan.filtered and min(number, len(groups)) > 1 else "threads"
        if self._workers is not None or self._scheduler is not None:
            kind, number = "cluster", 0
        if self._executor is None or (kind, number) != self._kind:
            self.stop()
            if kind == "cluster":
                self._executor = Cluster(self._workers, self._scheduler)
            elif kind == "processes":
                self._executor = Processes(number, truths)
            else:
                self._executor = Threads(number, lambda stop: lambda group, part: make_chunk(group, truths, part))
            self._kind = kind, number
        return self._executor

    def stop(self) -> None:
        """End the workers; others start when they are needed."""
        if self._executor is not None:
            self._executor.stop()
            self._executor = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


@dataclass
class _Ensemble(Experiment):
    """The computation of an ensemble in its directory; `times` are those of further lines of the tables, s."""

    folder: EnsembleDirectory
    hands: Workers
    report: Progress
    say: Callable[[str], None]
    times: tuple[float, ...] = ()
    looks: Looks = field(kw_only=True)
    result: EnsembleResult = field(init=False)
    status: str = "finished"

    @property
    def finished(self) -> str:
        done, looks = sum(map(len, self.folder.finished())), self.looks
        return f"{done} of {looks.numbers[min(len(looks.done), len(looks.numbers) - 1)]} runs" if done else ""

    def conclude(self, status: str) -> None:
        """Make the result of an ensemble that stops early, or free the memory for the report of the whole one."""
        self.status = status
        if status == "finished":
            self.hands.stop()
            self.hands.truths.forget()  # the budget beside the runs has its own
            give_back_memory()
            return
        self.result = self._result(self.folder.finished())
        if self.looks.verdicts:
            self.result.verdicts = self.looks.so_far(self.result)
            self.result.notes.append(
                f"The requirements are tested with the {len(self.result)} finished runs; --resume tests them with all "
                "runs."
            )

    def write(self, place: Path) -> None:
        write_ensemble(self.result, place, self.status)

    def run(self) -> None:
        """Compute the runs that are missing, and more of them until the requirements are decided, if so wanted."""
        folder, looks, computed, seconds, notes = self.folder, self.looks, 0, 0.0, list[str]()
        for number in looks.numbers:
            if looks.done:
                if lacking := short_of(folder.plan, number, looks.done[-1], folder.path):
                    notes.append(f"The errors of {number} runs do not fit {lacking}; the ensemble ends undecided.")
                    self.say(notes[-1])
                    break
                self.say(f"Undecided after {looks.done[-1]} runs; going on to {number}.")
                folder.extend(with_runs(folder.plan, number))
            result = self.continued(number)
            computed, seconds = computed + result.computed, seconds + result.seconds
            notes += [note for note in result.notes if note not in notes]
            looks.look(result, number)
            if looks.decided:
                break
        self.result = replace(
            result, computed=computed, seconds=seconds, notes=notes, looks=tuple(looks.done) if looks.several else (),
            verdicts=tuple(verdict for verdict in looks.verdicts if verdict is not None),
        )  # fmt: skip

    def continued(self, count: int) -> EnsembleResult:
        """Compute the runs that are missing in the directory, and return all."""
        folder, plan, begin = self.folder, self.folder.plan, time.perf_counter()
        notes: list[str] = []

        def tell(text: str) -> None:
            notes.append(text)
            self.say(text)

        there = folder.finished(tell)
        groups = [Group(plan, runs, folder.folder) for runs in missing(there, count, plan.chunk)]
        computed = sum(len(group.runs) for group in groups)
        if groups:
            check_disk(plan, count, count - computed, folder.path)
            with folder.writing("the runs of the ensemble could not be written to"):
                self.hands.compute(groups, _Counter(sum(map(len, there)), computed, self.report))
            there = folder.finished(tell)
        if missing(there, count, plan.chunk):
            raise RunError(
                f"files in {folder.folder} changed while they were written; --resume computes what is missing."
            )
        seconds = time.perf_counter() - begin
        result = self._result(there, seconds=seconds, computed=computed, notes=notes)
        if len(result) > count:
            tell(f"The directory contains {len(result)} runs, more than the requested {count}; all of them are used.")
        return result

    def _result(self, there: Sequence[range], **how: Any) -> EnsembleResult:
        """Return the result of finished runs."""
        folder = self.folder
        return EnsembleResult(
            folder.plan, folder.load(there), folder.path, times=self.times, media=EnsembleMedia(), **how
        )


class _Counter:
    """Counts finished runs, and reports runs done, rate and time left."""

    def __init__(self, before: int, wanted: int, report: Progress) -> None:
        """Begin with the runs that were finished `before`, and those `wanted` beside them."""
        self._begin, self._before, self._wanted, self._report = time.perf_counter(), before, wanted, report
        self._done = 0
        self._parts = Counter[range]()

    def count(self, runs: range, finished: int) -> None:
        """Count how many runs of a group are finished so far."""
        self._done += finished - self._parts[runs]
        self._parts[runs] = finished
        rate = self._done / max(time.perf_counter() - self._begin, 1e-9)
        left = duration_text((self._wanted - self._done) / rate if rate > 0.0 else 0.0)
        done, total = self._before + self._done, self._before + self._wanted
        self._report(f"{done}/{total} runs, {rate:.3g}/s, {left} left", done / total)


class EnsembleMedia(Media[EnsembleResult]):
    """Numbers, streams, figure and files of an ensemble."""

    def summary(self, result: EnsembleResult) -> dict[str, Any]:
        return to_json(result)

    def streams(self, result: EnsembleResult) -> Iterator[Stream]:
        both = {"cep": result.cep, "r95": result.r95}
        columns = {f"{name}_m": circle.value for name, circle in both.items()}
        columns |= {f"{name}_low_m": circle.low for name, circle in both.items()}
        columns |= {f"{name}_high_m": circle.high for name, circle in both.items()}
        yield Stream("circles", result.time, tuple(Vector(k, (k,), v[:, None]) for k, v in columns.items()))

    def exhibits(self, result: EnsembleResult) -> Exhibits:
        return exhibits_of(result, ensemble_numbers(result))

    def save(self, result: EnsembleResult, directory: Path, *, overwrite: bool) -> Path:
        """Write the directory of an ensemble that was kept in memory; it can be extended as any other."""
        plan = result.plan
        with EnsembleDirectory(directory, plan, overwrite=overwrite) as folder:
            for runs in missing([], len(result), plan.chunk):
                write_chunk(result.errors, plan, folder.folder, slice(runs.start, runs.stop))
            folder.keep(lambda place: write_ensemble(result, place))
            return folder.path
