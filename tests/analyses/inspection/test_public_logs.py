"""Public logs of many devices, where a folder with their repositories is given: inspected, and run as suggested.

`tests/data/public_logs.toml` names the repositories, commits, files and check sums, and what is known of each log. To
obtain the files, clone the repositories of GitHub into one folder, and name it:

    for each entry [[log]]:  git clone https://github.com/REPOSITORY FOLDER/REPOSITORY
                             git -C FOLDER/REPOSITORY checkout COMMIT
    SINSSIM_PUBLIC_LOGS=FOLDER pytest tests/analyses/inspection/test_public_logs.py

A log whose files are missing is skipped by its name. A failure lists what inspect said that differs from what is known.
`open` and `open_run` of a log name what is not solved; remove them with the mended cause.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import tomllib
import zipfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim import earth
from sinssim.analyses.inspection.inspected_files import Inspected, inspect
from sinssim.data import Array
from sinssim.errors import InputError

GIVEN = os.environ.get("SINSSIM_PUBLIC_LOGS")
LOGS: dict[str, dict[str, Any]] = {
    one["name"]: one
    for one in tomllib.loads((Path(__file__).parent.parent.parent / "data" / "public_logs.toml").read_text())["log"]
}
RUN = [name for name, log in LOGS.items() if log.get("run")]
"""Logs whose suggested scenario is run."""

pytestmark = pytest.mark.skipif(GIVEN is None, reason="SINSSIM_PUBLIC_LOGS names no folder with the repositories")


def files(log: dict[str, Any], folder: Path) -> list[Path]:
    """Return copies of a log's files in a folder, those of an archive unpacked; skips if one is missing."""
    root = Path(str(GIVEN)) / log["repository"]
    found = [root / one["path"] for one in log["files"]]
    for source, one in zip(found, log["files"], strict=True):
        if not source.exists():
            pytest.skip(f"{log['name']}: {source} is missing")
        assert hashlib.sha256(source.read_bytes()).hexdigest() == one["sha256"], source
    if "members" in log:
        with zipfile.ZipFile(found[0]) as archive:
            return [Path(archive.extract(name, folder)) for name in log["members"]]
    base = Path(os.path.commonpath([source.parent for source in found]))
    base = base.parent if len(found) == 1 else base  # a format may know its file by the folder
    copies = [folder / source.relative_to(base) for source in found]
    for source, copy in zip(found, copies, strict=True):
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, copy)
    return copies


@cache
def inspected(name: str, folder: Path) -> Inspected | str:
    """Return what inspect finds, or its refusal; its scenario is written into the folder."""
    (folder / name).mkdir(exist_ok=True)  # it exists if the files are missing, and the first test is skipped
    try:
        result = inspect(files(LOGS[name], folder / name), folder / name, trial=True)
    except InputError as error:
        return str(error)
    if result.scenario is not None:
        (folder / name / "suggested.toml").write_text(result.scenario)
    return result


def number(result: Inspected, subject: str, key: str) -> float | None:
    """Return the first number of that name among the findings on a subject."""
    found = (f.numbers[key] for f in result.inspection.findings if f.subject == subject and key in f.numbers)
    return next(found, None)


def judge(log: dict[str, Any], result: Inspected | str) -> list[str]:
    """Return what inspect said that differs from what is known of a log."""
    if isinstance(result, str):
        known = log.get("refused")
        return [] if known and re.search(known, result) else [f"refused: {result}"]
    if "refused" in log:
        return [f"not refused for: {log['refused']}"]
    said = [f.sentence for f in result.inspection.findings]
    faults = [
        f"says nothing of: {words}" for words in log.get("said", ()) if not any(re.search(words, s) for s in said)
    ]
    faults += [s for s in said for words in log.get("never", ()) if re.search(words, s)]
    faults += [f.sentence for f in result.inspection.findings if f.grade == "wrong" and not log.get("error")]
    units = [name for one in result.files for name in one.inertial]
    fixes = [name for one in result.files for name in one.fixes]
    if not units:
        return [*faults, "the inertial data are not found"]
    if "fixes_hz" in log and not fixes:
        return [*faults, "the fixes are not found"]
    for subjects, key, short, share in (
        (units, "rate_hz", "rate_hz", 0.05),
        (fixes, "fixes_hz", "rate_hz", 0.05),
        (fixes, "fixes_hz_at_most", "rate_hz", None),
    ):
        rates = [x for s in subjects if (x := number(result, s, short)) is not None]
        if key not in log or not rates:
            continue
        wrong = rates[0] > log[key] if share is None else abs(rates[0] / log[key] - 1.0) > share
        faults += [f"{key}: {rates[0]:g} instead of {log[key]:g}"] if wrong else []
    begin, end = (number(result, units[0], key) for key in ("start_s", "end_s"))
    if "duration_s" in log and begin is not None and end is not None and abs(end - begin - log["duration_s"]) > 0.3:
        faults.append(f"duration: {end - begin:g} s instead of {log['duration_s']:g} s")
    described = tomllib.loads(result.scenario or "").get("log", {}).get("imu", {})
    for key, triad in (("gyro", "gyro"), ("accel", "accel")):
        if key in log and described.get(triad, {}).get("unit") != log[key]:
            faults.append(f"unit of {triad}: {described.get(triad, {}).get('unit')} instead of {log[key]}")
    for key, triad in (("gyros", "gyro"), ("accelerometers", "accel")):
        if key in log and described.get(triad, {}).get("columns") != log[key]:
            faults.append(f"columns of {triad}: {described.get(triad, {}).get('columns')} instead of {log[key]}")
    if "rest_s" in log:
        rest = sum(
            float(found[1])
            for f in result.inspection.findings
            if f.subject == "standing" and (found := re.search(r"([\d.]+) s in all", f.text))
        )
        low, high = log["rest_s"]
        faults += [] if low <= rest <= high else [f"at rest: {rest:g} s instead of {low:g} to {high:g} s"]
    for key, value in (
        ("offset_s", described.get("time_offset_s", 0.0)),
        ("velocity_delay_s", number(result, "fixes", "velocity_delay_s") or 0.0),
    ):
        if key in log and not log[key][0] <= value <= log[key][1]:
            faults.append(f"{key}: {value:g} instead of {log[key][0]:g} to {log[key][1]:g}")
    tried = next((f.numbers for f in result.inspection.findings if "outage_error_m" in f.numbers), None)
    found = [] if tried is None else [tried["outage_error_m"], tried["outage_fixes_alone_m"]]
    table = [float(x) for x in re.findall(r"(?:^|; )([\d.]+) m", log.get("without_fixes", ""))]
    if found != pytest.approx(table, rel=0.02):
        faults.append(f"without_fixes: {found} instead of {table}")
    return faults


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for copies, scenarios and runs."""
    return tmp_path_factory.mktemp("public_logs")


@pytest.mark.parametrize("name", LOGS)
def test_inspect_says_what_is_known(name: str, folder: Path, request: pytest.FixtureRequest) -> None:
    if "open" in LOGS[name]:
        request.applymarker(pytest.mark.xfail(reason=LOGS[name]["open"], strict=True))
    assert judge(LOGS[name], inspected(name, folder)) == []


OUTAGE_S, EVERY_S = 5.0, 20.0
"""Fixes are withheld for the time in which an inertial unit of a phone is better than a straight line."""


def compared(name: str, folder: Path) -> dict[str, float]:
    """Run the suggested scenario without the fixes of regular outages.

    Returns:
        Medians over the outages, m: `aided`, the horizontal error at the last withheld fix; `sigma`, the filter's own
        1σ of it; `alone`, the error of the straight line through the last fixes before the outage. The number of
        `outages`, and the share of `rejected` positions. Logs too short for an outage are run with all fixes.
    """
    settings = [f"log.outages.length_s={OUTAGE_S}", f"log.outages.every_s={EVERY_S}"]
    scenario = sinssim.load_scenario(folder / name / "suggested.toml", settings)
    assert scenario.log is not None
    log = sinssim.load_log(scenario)
    fixes = log.fixes
    if not log.outages:
        scenario = sinssim.load_scenario(folder / name / "suggested.toml")
    run = sinssim.run(scenario, folder / name / "run")
    about = run.summary.get("outages", {"each": [], "median": {}})
    assert fixes is not None
    alone = []
    for one in about["each"]:
        before = np.flatnonzero(fixes.time <= one["from_s"])
        withheld = int(np.argmin(np.abs(fixes.time - one["at_s"])))
        if len(before) and before[-1] < withheld:
            alone.append(straight_line(fixes.time, place(fixes), int(before[-1]), withheld))
    position = next(s for key, s in run.summary["filter"]["sensors"].items() if key.endswith("position"))
    return {
        "aided": about["median"].get("horizontal_error_m", 0.0),
        "sigma": about["median"].get("horizontal_sigma_m", 0.0),
        "alone": float(np.median(alone)) if alone else 0.0,
        "outages": len(alone),
        "rejected": position["refused"] / max(position["readings"], 1),
    }


def place(fixes: Any) -> Array:
    """Return the horizontal place of fixes, (N, 2) m to the north and to the east."""
    middle = float(np.nanmedian(fixes.latitude))
    r1, r2 = earth.radii(middle)
    north = (fixes.latitude - middle) * float(r1)
    east = (fixes.longitude - float(np.nanmedian(fixes.longitude))) * float(r2) * np.cos(middle)
    return np.column_stack((north, east))


def straight_line(time: Array, at: Array, last: int, withheld: int) -> float:
    """Return the error of the straight line through the fixes of the last two seconds, m."""
    first = int(np.searchsorted(time, time[last] - 2.0, side="right"))
    first = min(first, last - 1) if last else last
    velocity = (at[last] - at[first]) / (time[last] - time[first]) if last > first else np.zeros(2)
    return float(np.linalg.norm(at[last] + velocity * (time[withheld] - time[last]) - at[withheld]))


@pytest.mark.parametrize("name", RUN)
def test_the_suggested_scenario_runs_and_is_not_worse_than_the_fixes_alone(
    name: str, folder: Path, request: pytest.FixtureRequest
) -> None:
    """On foot a straight line is better than the unit of a phone; the filter then has to know its error."""
    log, result = LOGS[name], inspected(name, folder)
    if "open" in log or "open_run" in log:
        request.applymarker(pytest.mark.xfail(reason=log.get("open_run", log.get("open", ""))))
    assert not isinstance(result, str), result
    if not any(one.fixes for one in result.files):
        with pytest.raises(InputError, match="no position to start from"):
            sinssim.run(sinssim.load_scenario(folder / name / "suggested.toml"), folder / name / "run")
        return
    numbers = compared(name, folder)
    if log.get("worse"):  # where the inertial data cannot help, the suggested scenario says so, and it is so
        assert re.match(r"# .*Without fixes, a straight line is better\.\n", result.scenario or "")
        assert numbers["aided"] > numbers["alone"], numbers
    assert numbers["rejected"] < 0.1, numbers
    assert numbers["aided"] <= max(numbers["alone"], 3.0 * numbers["sigma"]), numbers
