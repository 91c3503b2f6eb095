"""A comparison of algorithms that is continued: the same numbers as at once, and only what is missing is computed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.errors import InputError
from sinssim.experiments.studies import algorithm_comparison as running
from sinssim.experiments.studies.algorithm_comparison import compare
from sinssim.experiments.studies.study_directory import StudyDirectory, digests
from sinssim.experiments.studies.study_results import NAN, Case, CoordinateError, ErrorGrowth, Row, StudyResult
from sinssim.experiments.studies.study_schema import Study

pytestmark = pytest.mark.usefixtures("hardly_counted")

PARKED = {"parked": {"latitude_deg": 50.0, "duration_s": 5.0}}
CONE = {"motion": {"type": "coning", "half_angle_deg": 1.0, "frequency_hz": 1.0, "duration_s": 5.0}}
OWN = {"parked": {"latitude_deg": 89.9, "duration_s": 5.0}, "name": "north"}


def study(**part: Any) -> Study:
    whole = {"title": "p", "rates_hz": (20.0, 40.0), "sensors": ("ideal", "tactical"),
             "coordinates": ("earth-fixed",), "algorithms": ("quaternion", "poisson"),
             "motions": (PARKED, CONE), **part}  # fmt: skip
    return Study.model_validate({"name": "small", "parts": (whole,)})


def numbers(result: StudyResult) -> tuple[Any, ...]:
    """Return everything that does not depend on the speed of the machine, exactly."""
    rows = [repr(replace(row, ns_per_step=0.0, attitude_ns_per_step=0.0)) for row in result.rows]
    growth = [(repr(case), h.time.tobytes(), h.horizontal.tobytes(), h.attitude.tobytes())
              for case, h in result.histories.items()]  # fmt: skip
    return rows, growth, list(map(repr, result.coordinate_errors)), result.motions, result.orders


@pytest.fixture
def navigations(monkeypatch: pytest.MonkeyPatch) -> list[Case]:
    """The cases that are navigated, in order."""
    begun, whole = list[Case](), running._navigated
    monkeypatch.setattr(running, "_navigated", lambda case, *rest: begun.append(case) or whole(case, *rest))
    return begun


@pytest.mark.parametrize("after", [1, 5])
def test_continued_to_the_bit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, navigations: list[Case], after: int):
    """Interrupted after one and after five of sixteen navigations, in the first and in the second block."""
    at_once, place = compare(study()), tmp_path / "s"
    keep, count = running._Block.keep, iter(range(100))

    def interrupted(block: Any, *case: Any) -> None:
        keep(block, *case)
        if next(count) == after - 1:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(running._Block, "keep", interrupted)
        with pytest.raises(KeyboardInterrupt) as stop:
            compare(study(), place)
    assert f"{after} of 16 navigations are finished" in stop.value.__notes__[0]
    navigations.clear()
    continued = compare(study(), place, resume=True)
    assert numbers(continued) == numbers(at_once)
    assert len(navigations) == 16 - after
    navigations.clear()
    assert numbers(sinssim.compare(study(), place, resume=True)) == numbers(at_once)
    assert navigations == []


def test_a_study_that_has_changed_goes_on_with_what_it_has(tmp_path: Path, navigations: list[Case]) -> None:
    """A further motion and rate below the highest are computed, another highest rate or seed computes everything."""
    compare(study(), tmp_path / "s")
    more = study(title="renamed", rates_hz=(20.0, 40.0, 10.0), motions=(PARKED, OWN, CONE))
    navigations.clear()
    continued = compare(more, tmp_path / "s", resume=True)
    assert sorted({(case.motion, case.rate_hz) for case in navigations}) == [
        ("coning", 10.0), ("north", 10.0), ("north", 20.0), ("north", 40.0), ("parked", 10.0),
    ]  # fmt: skip
    assert numbers(continued) == numbers(compare(more))
    for other in (study(rates_hz=(20.0, 80.0)), study().model_copy(update={"seed": 3})):
        navigations.clear()
        compare(other, tmp_path / "s", resume=True)
        assert len(navigations) == 16


def test_what_the_name_of_a_navigation_depends_on() -> None:
    def names(**part: Any) -> set[str]:
        plan = study(**part)
        return set(digests(plan, plan.parts[0], plan.parts[0].motions[0]).values())

    base = {"motions": (PARKED,), "rates_hz": (20.0,), "sensors": ("tactical",), "algorithms": ("quaternion",)}
    first = names(**base)
    assert len(first) == 1
    assert names(**{**base, "title": "another", "motions": ({**PARKED, "name": "other"},)}) == first
    for change in (
        {"motions": ({"parked": {"latitude_deg": 50.1, "duration_s": 5.0}},)},
        {"motions": ({**PARKED, "duration_s": 4.0},)},
        {"sensors": ("ideal",)}, {"algorithms": ("euler",)}, {"frames": ("inertial",)}, {"vertical": "free"},
        {"coordinates": ()}, {"gravities": ("j2",)}, {"ellipsoids": ("chapter",)},
        {"curvatures": ("spherical",)},
        {"variants": ("six-accelerometers-1m",)}, {"rates_hz": (40.0,)},
        {"rates_hz": (), "schedules_hz": ((20.0, 10.0, 5.0),)},
    ):  # fmt: skip
        assert not names(**{**base, **change}) & first, change


def test_a_damaged_file_is_named_and_computed_again(tmp_path: Path, navigations: list[Case]) -> None:
    first = compare(study(), tmp_path / "s")
    file = sorted((tmp_path / "s" / "navigations").iterdir())[3]
    file.write_text(file.read_text(encoding="utf-8").replace("0", "1", 1), encoding="utf-8")
    navigations.clear()
    said: list[str] = []
    again = compare(study(), tmp_path / "s", resume=True, say=said.append)
    assert [text for text in said if "damaged" in text] == [
        f"{file} is damaged (its contents are not those that were written). It is computed again."
    ]
    assert len(navigations) == 1
    assert numbers(again) == numbers(first)


def test_another_study_is_refused(tmp_path: Path) -> None:
    compare(study(), tmp_path / "s")
    with pytest.raises(InputError, match="it is the study small, not other"):
        compare(study().model_copy(update={"name": "other"}), tmp_path / "s", resume=True)


def test_begun_in_vain_it_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="would take too long"):
        compare(study(motions=({"parked": {"latitude_deg": 1.0, "duration_s": 3e7}},)), tmp_path / "deep" / "s")
    assert list(tmp_path.iterdir()) == []


def test_a_result_that_is_saved_can_be_continued(tmp_path: Path, navigations: list[Case]) -> None:
    first = compare(study())
    first.save(tmp_path / "s")
    navigations.clear()
    assert numbers(compare(study(), tmp_path / "s", resume=True)) == numbers(first)
    assert navigations == []


def test_every_number_comes_back_in_its_place(tmp_path: Path) -> None:
    """All different and none finite by chance: NaN and infinity stay what they are."""
    plan = study()
    case, digest = next(iter(digests(plan, plan.parts[0], plan.parts[0].motions[0]).items()))
    given = {name: 0.5 + number for number, name in enumerate(Row.__dataclass_fields__) if name not in vars(case)}
    given |= {"status": "failed", "message": "It fell.", "passages": 3, "samples": 7, "max_defect": float("inf"),
              "velocity_drift_ug": NAN}  # fmt: skip
    row = Row(**vars(case), **given)
    growth = ErrorGrowth(np.array([1.0, 1.0 / 3.0]), np.array([2.0, 5e-324]), np.array([NAN, 4.0]))
    error = CoordinateError(case, "earth-fixed", "x_m", 0.1, 0.2)
    with StudyDirectory(tmp_path / "s", plan) as folder:
        folder.write(digest, running.Navigated(row, growth, [error]))
        kept = folder.read(case, digest, pytest.fail)
        failed = running.Navigated(row, None, [])
        folder.write(digest, failed)
        assert repr(folder.read(case, digest, pytest.fail)) == repr(failed)
    assert kept is not None
    assert repr(kept) == repr(running.Navigated(row, growth, [error]))
