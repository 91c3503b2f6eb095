"""What cannot be exported, and what is said of scored rows, with their numbers."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs.formats import export_streams
from sinssim.logs.recorded_streams import SolutionStream
from sinssim.logs.reference_solution import TruthAt
from sinssim.logs.solution_score import Judge

SECOND = np.pi / 648_000.0


def test_places_that_are_taken(tmp_path: Path) -> None:
    """A file cannot replace a folder, nor a folder a file; an empty folder is free, others with --overwrite."""
    folder, file, empty = tmp_path / "folder", tmp_path / "file", tmp_path / "empty"
    for one in (folder, empty):
        one.mkdir()
    for one in (file, folder / "x"):
        one.touch()
    for place, of_folder, overwrite, said in (
        (folder, False, True, "is a folder; give the name of a file with -o."),
        (file, True, True, "is a file; this format is a folder. Give another name with -o."),
        (file, False, False, "exists. Give another name with -o, or replace it with --overwrite."),
        (folder, True, False, "exists. Give another name with -o, or replace it with --overwrite."),
    ):
        with pytest.raises(InputError, match=f"^{re.escape(f'{place} {said}')}$"):
            export_streams._check_place(place, folder=of_folder, overwrite=overwrite)
    for place, of_folder, overwrite in ((file, False, True), (folder, True, True), (empty, True, False),
                                        (tmp_path / "new", True, False), (tmp_path / "new", False, False)):  # fmt: skip
        export_streams._check_place(place, folder=of_folder, overwrite=overwrite)


def test_outages_need_fixes() -> None:
    content: Any = SimpleNamespace(run=SimpleNamespace(path="run", fixes=[]), solution_name="aided")
    writer: Any = SimpleNamespace(holds="solution")
    assert export_streams._with_outages(content, (), "kml", writer) is content
    with pytest.raises(InputError, match=r"^--outage: run has no GNSS fixes that could be withheld\.$"):
        export_streams._with_outages(content, ("40:55",), "kml", writer)
    content.run.fixes = ["gnss", "second"]
    for to, holds in (("kml", "solution"), ("parquet", "run")):
        writer.holds = holds
        with pytest.raises(InputError) as refused:
            export_streams._with_outages(content, ("40:55",), to, writer)
        assert str(refused.value) == (
            f"--outage: this export to {to} contains no fixes from which any could be withheld. Export to another "
            "format, or the fixes as a solution (--solution gnss)."
        )


def test_the_default_place() -> None:
    run: Any = SimpleNamespace(path=Path("/x/runs/one"), name="one")
    assert export_streams._default_place(run, "kml", ".kml") == Path("/x/runs/one.kml")
    assert export_streams._default_place(run, "euroc", "") == Path("/x/runs/one-euroc")


def test_rows_that_are_scored() -> None:
    """Of nine rows, four are within the run, of which one lies between samples."""
    exact = np.array([True, True, True, False])
    judge: Any = SimpleNamespace(reference=None, interpolation=(0.0321, 4.4 * SECOND),
                                 truth=SimpleNamespace(at_samples=lambda time: exact))  # fmt: skip
    time, rows = np.array([1.25, 2.5, 3.0, 40.0625]), np.arange(4)
    stream: Any = range(9)
    left = "4 rows, from 1.250 s to 40.062 s; 5 outside the run or without a position are left out."
    assert Judge._about_rows(judge, stream, rows, time) == [
        left, "3 rows are at samples of the truth; between them it is interpolated, to about 0.03 m and 4 arcsec.",
    ]  # fmt: skip
    exact[3] = True
    assert Judge._about_rows(judge, range(4), rows, time) == [  # type: ignore[arg-type]
        "4 rows, from 1.250 s to 40.062 s.",
        "All rows are at samples of the truth.",
    ]
    judge.reference = "reference"
    assert Judge._about_rows(judge, stream, rows, time) == [left]


def test_a_truth_of_three_samples() -> None:
    three = np.array([1.0, 2.0, 3.0])
    truth = SolutionStream(three, three, three, three, "ellipsoid", np.ones((3, 3)), np.ones((3, 4)))
    with pytest.raises(InputError, match=r"^the truth has 3 samples; at least 4 are needed to interpolate it\.$"):
        TruthAt(truth)
