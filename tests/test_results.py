"""What `run`, `ensemble`, `compare`, `budget`, `calibrate` and `align` return is one family of results."""

from __future__ import annotations

import inspect
import json
import pickle
import re
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import sinssim
from sinssim.errors import InputError
from sinssim.logs.formats.export_streams import export

pytestmark = pytest.mark.usefixtures("hardly_counted")

SHORT = ["parked.duration_s=20", "imu.rate_hz=10", "seed=5"]
STUDY = """
name = "small"
description = "one motion"
[[parts]]
title = "coning"
algorithms = ["quaternion"]
rates_hz = [50.0]
[[parts.motions]]
[parts.motions.motion]
type = "coning"
half_angle_deg = 1.0
frequency_hz = 1.0
duration_s = 5.0
"""
TRADE = """
name = "small"
scenario = "parked"
set = ["parked.duration_s=20", "imu.rate_hz=10"]
[[axes]]
key = "imu.gyro_bias_sigma_deg_h"
values = [0.01, 0.1]
"""


def _study(name: str, text: str, folder: Path, directory: Path | None, **options: Any) -> Any:
    (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return sinssim.compare(folder / f"{name}.toml", directory, **options)


MADE: dict[str, tuple[Callable[..., Any], str, tuple[str, ...]]] = {
    "run": (
        lambda folder, directory, **options: sinssim.run("parked", directory, overrides=SHORT, **options),
        "summary.json",
        ("truth", "imu_measured", "nav_quaternion", "error_quaternion"),
    ),
    "ensemble": (
        lambda folder, directory, **options: sinssim.ensemble(
            "parked", 3, directory, overrides=SHORT, threads=1, **options
        ),
        "summary.json",
        ("circles",),
    ),
    "trade": (
        lambda folder, directory, **options: _study("trade", TRADE, folder, directory, **options),
        "results.json",
        (),
    ),
    "study": (
        lambda folder, directory, **options: _study("study", STUDY, folder, directory, **options),
        "results.json",
        (),
    ),
    "budget": (
        lambda folder, directory, **options: sinssim.budget(
            "parked", directory, overrides=SHORT, require="r95(end) <= 1 km", times=[7.0], **options
        ),
        "budget.json",
        ("total", "gyro_bias"),
    ),
    "calibrate": (
        lambda folder, directory, **options: sinssim.calibrate(
            "calibration_table", directory, overrides=["turntable.dwell_s=5", "imu.rate_hz=10"], **options
        ),
        "calibration.json",
        (),
    ),
    "align": (
        lambda folder, directory, **options: sinssim.align(
            "parked", directory, overrides=["parked.duration_s=30", "imu.rate_hz=5"], **options
        ),
        "alignment.json",
        ("imu_measured",),
    ),
}  # fmt: skip
"""How each kind is computed in a folder and a directory, the JSON file of its directory, and some of its streams."""


@pytest.fixture(scope="module", params=MADE)
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def result(kind: str, tmp_path_factory: pytest.TempPathFactory, hardly_counted: None) -> sinssim.Result:
    """The result of a computation that writes nothing."""
    made: sinssim.Result = MADE[kind][0](tmp_path_factory.mktemp(kind), None)
    return made


def same(a: Any, b: Any, path: str = "") -> None:
    """Compare the contents of two JSON files; durations and versions of programs do not count."""
    if isinstance(a, dict):
        assert list(a) == list(b), path
        for key in a:
            if not re.fullmatch(r"timing|seconds|computed|.*costs|.*ns_per_step", key):
                same(a[key], b[key], f"{path}.{key}")
    elif isinstance(a, list):
        assert len(a) == len(b), path
        for number, (one, other) in enumerate(zip(a, b, strict=True)):
            same(one, other, f"{path}.{number}")
    else:
        assert a == b, path


def test_every_result_has_the_same_five(kind: str, result: sinssim.Result) -> None:
    _, _, streams = MADE[kind]
    assert isinstance(result, sinssim.Result)
    assert result.directory is None
    assert isinstance(result.summary, dict)
    assert json.loads(json.dumps(result.summary, allow_nan=False))  # plain numbers and words
    assert isinstance(result.streams, Mapping)
    assert set(streams) <= set(result.streams)
    assert bool(result.streams) == bool(streams)
    for name in streams:
        table = result.streams[name]
        assert table["time_s"].shape == (len(table),)
        assert table.arrow().num_rows == len(table)
    figure = result.plot()
    assert isinstance(figure, Figure)
    assert figure.axes or figure.subfigs
    html = result._repr_html_()
    assert html.startswith("<b>")
    assert "<table>" in html
    assert len(repr(result)) < 1500


def test_what_is_saved_is_what_the_computation_writes(kind: str, result: sinssim.Result, tmp_path: Path) -> None:
    make, file, _ = MADE[kind]
    direct = make(tmp_path, tmp_path / "direct")
    saved = result.save(tmp_path / "saved")
    copied = direct.save(tmp_path / "copied")
    assert (direct.directory, saved, copied) == tuple(tmp_path / name for name in ("direct", "saved", "copied"))

    def files(folder: Path) -> set[str]:
        return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}

    assert files(saved) == files(copied) == files(tmp_path / "direct")
    numbers = [json.loads((folder / file).read_text(encoding="utf-8")) for folder in (direct.directory, saved, copied)]
    same(numbers[0], numbers[1])
    same(numbers[0], numbers[2])
    same(numbers[0], json.loads(json.dumps(direct.summary)))
    for folder in (saved, copied):
        with pytest.raises(InputError, match="already"):
            result.save(folder)
    assert result.save(copied, overwrite=True) == copied
    with pytest.raises(InputError, match="already"):
        make(tmp_path, saved)
    assert make(tmp_path, saved, overwrite=True).directory == saved


def test_a_run_in_a_plane_is_of_the_family(tmp_path: Path) -> None:
    run = sinssim.run("one_component", overrides=["one_component.duration_s=60"])
    assert isinstance(run, sinssim.PlaneRun)
    assert isinstance(run, sinssim.Result)
    place = run.save(tmp_path / "saved")
    same(json.loads((place / "summary.json").read_text(encoding="utf-8")), json.loads(json.dumps(run.summary)))
    for what in (lambda: run.streams, run.plot):
        with pytest.raises(InputError, match=r"report|directory"):
            what()


def test_every_result_is_exported_by_its_name() -> None:
    exported = {name: getattr(sinssim, name) for name in sinssim.__all__}
    kinds = {kind for kind in sinssim.Result.__subclasses__() if kind.__module__.startswith("sinssim.")}
    assert len(kinds) == 9
    for kind in kinds:
        assert exported[kind.__name__] is kind


def test_the_functions_take_the_same() -> None:
    for function in (sinssim.run, sinssim.ensemble, sinssim.compare, sinssim.budget, sinssim.calibrate, sinssim.align):
        names = inspect.signature(function).parameters
        assert {"directory", "overrides", "overwrite", "progress"} <= set(names), function.__name__
        assert names["directory"].default is None


def test_overwrite_without_a_directory_is_refused() -> None:
    for function in (sinssim.budget, sinssim.align):
        with pytest.raises(InputError, match="overwrite needs the directory"):
            function("parked", overwrite=True)


def test_a_saved_ensemble_is_extended(tmp_path: Path) -> None:
    """The runs of an ensemble in memory are those that its directory holds."""
    first = sinssim.ensemble("parked", 3, overrides=SHORT, threads=1)
    first.save(tmp_path / "e")
    more = sinssim.ensemble("parked", 5, tmp_path / "e", overrides=SHORT, resume=True, threads=1)
    assert (len(more), more.computed) == (5, 2)
    np.testing.assert_array_equal(more.errors.position_ned[:3], first.errors.position_ned)


def test_a_saved_trade_study_is_continued(tmp_path: Path) -> None:
    first = _study("trade", TRADE, tmp_path, None)
    first.save(tmp_path / "t")
    again = _study("trade", TRADE.replace("0.1]", "0.1, 1.0]"), tmp_path, tmp_path / "t", resume=True)
    assert (len(again), again.computed) == (3, 1)
    np.testing.assert_array_equal(again.values("r95(end)")[:2], first.values("r95(end)"))


def test_the_streams_of_a_budget_are_its_radii() -> None:
    budget = sinssim.budget("parked", overrides=SHORT)
    total = budget.streams["total"]
    np.testing.assert_array_equal(total["r95_m"], budget.r95)
    np.testing.assert_array_equal(total["sigma_heading_rad"], budget.sigma()[:, 8])


def test_a_log_is_loaded_by_its_scenario_or_its_file(tmp_path: Path) -> None:
    text = Path(__file__).parent / "data" / "drive" / "drive.toml"
    log = sinssim.load_log(text)
    assert log.reference is not None
    np.testing.assert_array_equal(sinssim.load_log(sinssim.load_scenario(text)).imu.dtheta, log.imu.dtheta)
    shorter = sinssim.load_log(text, ["log.to_s=10"])
    assert len(shorter.imu) < len(log.imu)
    with pytest.raises(InputError, match="the scenario parked has no recorded sensors"):
        sinssim.load_log("parked")
    run = sinssim.run("parked", tmp_path / "run", overrides=SHORT)
    assert run.directory is not None
    (file,) = (name for name in export(run.directory, "kf-gins", tmp_path / "own").files if "imu" in name.name.lower())
    again = sinssim.load_log(tmp_path / file)
    assert again.imu.dvel.sum(axis=0) == pytest.approx(run.sensed.measured.dvel.sum(axis=0), abs=1e-6)
    with pytest.raises(InputError, match="is a log; overrides change a scenario"):
        sinssim.load_log(tmp_path / file, "seed=1")


@pytest.mark.slow
def test_a_pickled_result_is_drawn_by_another_program(tmp_path: Path) -> None:
    result = sinssim.budget("parked", overrides=SHORT)
    (tmp_path / "result").write_bytes(pickle.dumps(result))
    code = f"import pickle; print(type(pickle.load(open({str(tmp_path / 'result')!r}, 'rb')).plot()).__name__)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "Figure\n"


def test_a_program_that_only_asks_for_a_result_has_its_media() -> None:
    """In a process of its own: no result is made without what draws and writes it, whatever has been imported."""
    code = (
        "import inspect, sinssim; kinds = sinssim.Run, sinssim.PlaneRun, sinssim.EnsembleResult, sinssim.StudyResult, "
        "sinssim.TradeResult, sinssim.BudgetResult, sinssim.CalibrationResult, sinssim.AlignmentResult; "
        "media = [inspect.signature(kind).parameters['media'].default for kind in kinds]; "
        "print([kind.__name__ for kind, default in zip(kinds, media) if default is None]); "
        "print(len(sinssim.budget('parked', overrides=['parked.duration_s=20']).exhibits.items) > 1)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\nTrue\n"
