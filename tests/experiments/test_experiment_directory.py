"""What is said and written of an experiment that ends, stops, or cannot be written, by one that counts to seven."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import pytest

from sinssim.errors import RunError
from sinssim.experiments.experiment_directory import Experiment, Kind, Store
from sinssim.system.files import write_text


class Counting(Store):
    KIND = Kind("counting.json", (), "numbers", "sinssim counting", "a", "count", "number", "finished numbers")

    def manifest(self) -> dict[str, Any]:
        return {}

    def difference(self, there: dict[str, Any]) -> str:
        return ""

    @classmethod
    def computed(cls, path: Path) -> list[str]:
        return []


class Count(Experiment):
    def __init__(self, count: int, error: BaseException | None = None) -> None:
        self.count, self.error, self.statuses = count, error, list[str]()

    @property
    def finished(self) -> str:
        return f"{self.count} of 7 numbers" if self.count else ""

    def conclude(self, status: str) -> None:
        self.statuses.append(status)

    def write(self, place: Path) -> None:
        if self.error is not None:
            raise self.error
        write_text(place / "report.html", self.statuses[-1])


def stopped(place: Path | None, count: Count, stop: BaseException) -> list[str]:
    """Stop an experiment, and return what is said."""
    not_finished = partial(pytest.fail, "it was not finished")
    with (
        pytest.raises(type(stop)), Counting.opened(place, overwrite=place is not None) as store,
        store.reported(count, lambda *_: not_finished()),
    ):  # fmt: skip
        raise stop
    return getattr(stop, "__notes__", [])


@pytest.mark.parametrize(
    ("stop", "status"), [(KeyboardInterrupt(), "interrupted"), (RunError("It fell."), "failed")]
)  # fmt: skip
def test_one_that_stops_has_a_report_of_what_is_finished(tmp_path: Path, stop: BaseException, status: str) -> None:
    place, count = tmp_path / "there", Count(3)
    assert stopped(place, count, stop) == [
        f"3 of 7 numbers are finished, in {place}; --resume continues.", f"Their report is {place / 'report.html'}.",
    ]  # fmt: skip
    assert count.statuses == [status]
    assert (place / "report.html").read_text() == status


def test_one_that_stops_before_its_first_part_leaves_nothing(tmp_path: Path) -> None:
    count = Count(0)
    assert stopped(tmp_path / "there", count, RunError("It fell.")) == ["No number had finished."]
    assert (count.statuses, list(tmp_path.iterdir())) == ([], [])


def test_why_there_is_no_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = tmp_path / "there"
    monkeypatch.setattr(Counting, "free", lambda self: 234.4)
    said = stopped(place, Count(3, ZeroDivisionError("by nothing")), RunError("It fell."))
    assert said[1] == "Their report could not be written: by nothing"
    said = stopped(place, Count(3, OSError(28, "no space")), RunError("It fell."))
    assert said[1] == (
        f"The report of the count could not be written to {place}: no space (234 MB are free). All finished numbers "
        "are kept; --resume writes it."
    )


def test_one_that_ends(tmp_path: Path) -> None:
    """In a directory its report is written; without one its result is completed all the same."""
    for place in (tmp_path / "there", None):
        count, said = Count(7), list[str]()
        with Counting.opened(place) as store, store.reported(count, lambda text, share, said=said: said.append(text)):
            assert store.is_draft == (place is None)
            kept = store.path
        assert (count.statuses, said) == (["finished"], ["Writing the report"])
        assert kept.exists() == (place is not None)
    assert (tmp_path / "there/report.html").read_text() == "finished"
    count = Count(3)
    assert stopped(None, count, RunError("It fell.")) == []
    assert count.statuses == []
