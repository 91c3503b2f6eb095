"""The memory and disk space of an ensemble; a too large ensemble is refused."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from sinssim.errors import InputError
from sinssim.experiments.ensembles.run_errors import AT_ONCE, bytes_of
from sinssim.experiments.ensembles.stored_errors import IN_MEMORY
from sinssim.formatting import size_text
from sinssim.system.memory import machine_memory

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.plan import Plan

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
    kept = whole if whole <= IN_MEMORY else 0.0
    return kept + _COPIES * part + _RUN_BYTES * runs + _OF_FILE * _bytes(plan, min(plan.chunk, runs), epochs)


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
    return bytes_of(runs, epochs or len(plan.epochs), len(plan.blocks), len(plan.sensors))


def _memory() -> float:
    return _OF_MEMORY * machine_memory()


def _disk(folder: Path) -> float:
    return float(shutil.disk_usage(folder).free)
