"""The process that designs an aircraft: a model that hangs, crashes or writes to the terminal harms nothing else."""

from __future__ import annotations

import threading
import time
from pathlib import Path

from sinssim.errors import InputError, RunError
from sinssim.truth.aircraft_design.acceptance_flight import LegErrors, acceptance_height, fly_acceptance
from sinssim.truth.aircraft_design.aircraft_design import (
    LONGEST,
    DesignedAircraft,
    RefusedError,
    Report,
    design_aircraft,
)
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.flight_process import OtherProcess, message, served


def design_apart(model: str, folder: Path | None, report: Report) -> DesignedAircraft:
    """Design an aircraft in a separate process.

    Args:
        model: name of the flight dynamics model.
        folder: where it is; None: JSBSim's package.
        report: called with the present work and the fraction done.

    Raises:
        RefusedError: the model cannot be flown: why.
    """
    end = time.monotonic() + LONGEST
    with OtherProcess(model, "serve_design", __name__, LONGEST) as other:

        def hear(progress: tuple[str, float]) -> None:
            other.patience = max(0.0, end - time.monotonic())
            report(*progress)

        other.send((model, folder))
        try:
            answer: DesignedAircraft = other.answer(hear)  # type: ignore[arg-type]
        except RunError as error:
            what = str(error).split(":")[0].rstrip(".")  # its output is lost
            if time.monotonic() >= end:
                what = f"its design takes longer than {LONGEST / 60.0:g} minutes"
            raise RefusedError(f"the model {model} cannot be flown: {what}.") from error
    return answer


def serve_design() -> None:
    """Design the aircraft of standard input, and answer on standard output."""
    with served() as answer:
        model, folder = message()
        _silence()
        answer("flown", design_aircraft(model, folder, lambda *progress: answer("fraction", progress)))


def acceptance_apart(name: str) -> tuple[float, tuple[LegErrors, ...]]:
    """Fly the acceptance flights of an aircraft in a separate process; return their height, m, and the errors.

    Raises:
        InputError: a leg cannot be flown.
    """
    load_aircraft(name)
    with OtherProcess(name, "serve_acceptance", __name__, LONGEST) as other:
        other.send(name)
        try:
            answer: tuple[float, tuple[LegErrors, ...]] = other.answer()
        except RunError as error:
            raise InputError(f"the aircraft {name} cannot be flown: {error}") from error
    return answer


def serve_acceptance() -> None:
    """Fly the aircraft of standard input, and answer on standard output."""
    with served() as answer:
        name = message()
        _silence()
        aircraft = load_aircraft(name)
        height = acceptance_height(aircraft)
        answer("flown", (height, fly_acceptance(name, aircraft.performance, height)))


def _silence() -> None:
    """Let what a model prints beside JSBSim's log be lost; end with the parent process."""
    import os

    from sinssim.truth.flight.flight_process import end_with_the_other

    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    threading.Thread(target=end_with_the_other, daemon=True).start()
