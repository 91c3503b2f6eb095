"""A recorded run: every stream exactly as computed, in Parquet and in the recording, and both valid however it ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import rerun_cli
from rerun.chunk import RrdReader
from scipy.stats import chi2

from sinssim.data import NavSolution, NavState
from sinssim.errors import InputError, RunError
from sinssim.experiments.run.finished_runs import load_streams
from sinssim.experiments.run.run_execution import run
from sinssim.experiments.studies.algorithm_comparison import compare
from sinssim.experiments.study import load_study
from sinssim.recording import rerun_file
from sinssim.recording.rerun_viewer import find_recording, find_run_info
from sinssim.recording.result import RunDirectory
from sinssim.scenario.navigation_section import InitialErrorSection, initial_state_with_errors
from sinssim.strapdown.navigation_error import navigation_error
from tests.fork import Fork
from tests.recording import fake_run

ROWS = 32_768  # of a chunk; a longer run would only take longer
COUNT = ROWS + 4_000
STATE = [
    "time_s", "latitude_rad", "longitude_rad", "height_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps",
    "q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z",
]  # fmt: skip
IMU = ["time_s", "dtheta_x_rad", "dtheta_y_rad", "dtheta_z_rad", "dvel_x_mps", "dvel_y_mps", "dvel_z_mps"]
STAGES = ("flight", "truth", "imu", "navigate", "budget", "filter", "record", "total")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """One recorded run, the numbers it was made from, and the progress that it told."""
    with pytest.MonkeyPatch.context() as patch:
        fake = fake_run.install(COUNT, patch.setattr)
        patch.setattr(rerun_file, "CHUNK_ROWS", ROWS)
        told: list[tuple[str, float]] = []
        directory = tmp_path_factory.mktemp("runs") / "deep" / "fake"
        scenario = fake_run.scenario(detail="full")
        result = run(scenario, directory, progress=lambda stage, fraction: told.append((stage, fraction)))
    return fake, result, told


@pytest.fixture
def short(monkeypatch):
    """A short run, whose report takes longer than the rest of it and is left out."""
    monkeypatch.setattr("sinssim.experiments.run.run_execution.page_of", lambda _: "")
    monkeypatch.setattr("sinssim.experiments.run.run_execution.first_sections", lambda *_: [])
    monkeypatch.setattr("sinssim.experiments.run.run_execution.run_exhibits", lambda *_: None)
    return fake_run.install(300, monkeypatch.setattr)


def verify(recording: Path) -> subprocess.CompletedProcess[str]:
    binary = Path(rerun_cli.__file__).parent / "rerun"
    return subprocess.run([binary, "rrd", "verify", recording], capture_output=True, text=True, check=False)


def read_recording(path: Path) -> dict[str, tuple[np.ndarray, np.ndarray, list[str]]]:
    """Return times (ns), values and series' names of every exact stream's entity."""
    parts: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    names: dict[str, list[str]] = {}
    for chunk in RrdReader(path).stream():
        batch, entity = chunk.to_record_batch(), chunk.entity_path
        if not entity.startswith("/streams/"):
            continue
        if "SeriesLines:names" in batch.schema.names:
            names[entity] = batch.column("SeriesLines:names")[0].as_py()
        else:
            times = batch.column("sim_time").to_numpy(zero_copy_only=False).astype(np.int64)
            scalars = batch.column("Scalars:scalars")
            parts.setdefault(entity, []).append((times, scalars.flatten().to_numpy().reshape(len(times), -1)))
    out = {}
    for entity, chunks in parts.items():
        chunks.sort(key=lambda part: part[0][0])
        out[entity] = (*(np.concatenate(column) for column in zip(*chunks, strict=True)), names[entity])
    return out


def state_columns(s) -> list[np.ndarray]:
    return [s.latitude, s.longitude, s.height, *s.velocity_ned.T, *s.q_nb.T]


def test_parquet_holds_exactly_what_was_computed(recorded):
    fake, result, _ = recorded
    expected = {
        "truth": (STATE, [fake.time, *state_columns(fake.truth)]),
        "imu_ideal": (IMU, [fake.time[1:], *fake.ideal.dtheta.T, *fake.ideal.dvel.T]),
        "imu_measured": (IMU, [fake.time[1:], *fake.measured.dtheta.T, *fake.measured.dvel.T]),
    }
    for name, solution in fake.solutions.items():
        error = navigation_error(fake.truth, solution)
        expected[f"nav_{name}"] = ([*STATE, "defect"], [fake.time, *state_columns(solution), solution.defect])
        expected[f"error_{name}"] = (
            ["time_s", "position_n_m", "position_e_m", "position_d_m", "velocity_n_mps", "velocity_e_mps",
             "velocity_d_mps", "phi_n_rad", "phi_e_rad", "phi_d_rad"],
            [fake.time, *error.position_ned.T, *error.velocity_ned.T, *error.attitude.T],
        )  # fmt: skip
    streams = load_streams(result.directory)
    for name, (columns, arrays) in expected.items():
        file = result.directory / "streams" / f"{name}.parquet"
        assert file.exists() == (not name.startswith("error_")), "errors follow from truth and solution"
        table = pq.read_table(file) if file.exists() else streams[name].arrow()
        assert table.column_names == columns
        for column, array in zip(columns, arrays, strict=True):
            assert str(table.schema.field(column).type) == "double"
            np.testing.assert_array_equal(table[column].to_numpy(), array, strict=True)


def test_a_light_recording_has_exact_rows_with_all_extremes(recorded, tmp_path, monkeypatch):
    _, full, _ = recorded
    fake_run.install(COUNT, monkeypatch.setattr)
    light = run(fake_run.scenario(), tmp_path / "light")
    assert verify(light.directory / "recording.rrd").returncode == 0
    of_full, of_light = (read_recording(r.directory / "recording.rrd") for r in (full, light))
    assert set(of_full) == set(of_light)
    for entity, (all_times, every, names) in of_full.items():
        times, values, same_names = of_light[entity]
        assert same_names == names
        assert len(times) <= min(len(all_times), 2 * 4000 * len(names) + 200)
        rows = np.searchsorted(all_times, times)
        np.testing.assert_array_equal(all_times[rows], times)
        np.testing.assert_array_equal(every[rows], values)
        assert rows[0] == 0
        assert rows[-1] == len(all_times) - 1
        np.testing.assert_array_equal(values.min(0), every.min(0))
        np.testing.assert_array_equal(values.max(0), every.max(0))
        event = np.abs(all_times - 12_500_000_000) < 95_000_000  # "turns" at 12.5 s
        assert set(all_times[event]) <= set(times)
    for file in (full.directory / "streams").iterdir():
        assert pq.read_table(file).equals(pq.read_table(light.directory / "streams" / file.name)), file.name


@pytest.mark.parametrize(
    ("keep", "detail", "files"),
    [
        ("summary", "light", {"scenario.toml", "summary.json"}),
        ("report", "light", {"scenario.toml", "summary.json", "report.html"}),
        ("streams", "light", {"scenario.toml", "summary.json", "report.html", "streams"}),
        ("all", "none", {"scenario.toml", "summary.json", "report.html", "streams"}),
        ("all", "light", {"scenario.toml", "summary.json", "report.html", "streams", "recording.rrd"}),
    ],
)
def test_a_run_keeps_what_the_scenario_says(short, tmp_path, keep, detail, files):
    result = run(fake_run.scenario(keep=keep, detail=detail), tmp_path / "run")
    assert {path.name for path in result.directory.iterdir()} == files | {".sinssim.json"}
    again = run(fake_run.scenario(), tmp_path / "all")
    assert result.summary["algorithms"] == again.summary["algorithms"]


@pytest.mark.parametrize("keep", ["summary", "streams"])
def test_what_is_kept_of_a_run_that_failed(short, tmp_path, monkeypatch, keep):
    def fail(*_, **__):
        raise RunError("no navigation today")

    monkeypatch.setattr("sinssim.strapdown.measured_attitude.navigate", fail)
    with pytest.raises(RunError, match="no navigation today"):
        run(fake_run.scenario(keep=keep), tmp_path / "run")
    files = {path.name for path in (tmp_path / "run").iterdir()}
    assert {"scenario.toml", "summary.json"} <= files
    assert ("streams" in files) == (keep == "streams")
    assert "recording.rrd" not in files
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["status"] == "failed"


def test_flight_channels_keep_their_own_times_and_units(recorded):
    fake, result, _ = recorded
    flight = pq.read_table(result.directory / "streams" / "flight.parquet")
    assert flight.column_names == ["time_s", "airspeed_mps", "wind_ned_mps_0", "wind_ned_mps_1", "wind_ned_mps_2"]
    np.testing.assert_array_equal(flight["wind_ned_mps_1"].to_numpy(), fake.channels["wind_ned"].values[:, 1])
    fuel = pq.read_table(result.directory / "streams" / "flight_2.parquet")
    assert fuel.to_pydict() == {"time_s": [0.0, 1.0], "fuel_kg": [9.0, 8.0]}


def test_events_are_in_the_order_of_time_with_the_singularities_among_them(recorded):
    _, result, _ = recorded
    events = pq.read_table(result.directory / "streams" / "events.parquet").to_pydict()
    assert events["time_s"] == [0.0, 3.0, 12.5]
    assert events["text"] == ["begins", "euler: pitch went through 90°", "turns |left|"]
    # the motion's events come with the motion, and the viewer sorts its table by time
    chunks = list(RrdReader(result.directory / "recording.rrd").stream().filter(content="/events"))
    said = [[text[0] for text in chunk.to_record_batch().column("TextLog:text").to_pylist()] for chunk in chunks]
    assert said == [["0.000 s  begins", "12.500 s  turns |left|"], ["3.000 s  euler: pitch went through 90°"]]


def test_recording_equals_parquet_in_every_double(recorded):
    _, result, _ = recorded
    entities = read_recording(result.directory / "recording.rrd")
    tables = {name: table.arrow() for name, table in load_streams(result.directory).items()}
    seen: dict[str, list[str]] = {}
    for entity, (times, values, names) in entities.items():
        stream = entity.split("/")[2]
        table = tables[stream]
        np.testing.assert_array_equal(times, np.rint(table["time_s"].to_numpy() * 1e9).astype(np.int64))
        np.testing.assert_array_equal(values, np.column_stack([table[name].to_numpy() for name in names]))
        seen.setdefault(stream, []).extend(names)
    files = {path.stem for path in (result.directory / "streams").glob("*.parquet")} - {"events"}
    assert set(seen) == set(tables) == files | {f"error_{name}" for name in fake_run.ALGORITHMS}
    for stream, names in seen.items():
        assert sorted(["time_s", *names]) == sorted(tables[stream].column_names)


def test_recording_is_valid_and_says_what_it_is(recorded):
    _, result, _ = recorded
    recording = result.directory / "recording.rrd"
    assert verify(recording).returncode == 0
    reader = RrdReader(recording)
    assert [store.application_id for store in reader.recordings()] == ["sinssim fake"]
    assert {store.application_id for store in reader.blueprints()} == {"sinssim fake"}
    info = find_run_info(find_recording(result.directory))
    assert (info.name, info.start, info.end, info.algorithms) == ("fake", 0.0, COUNT / 100.0, fake_run.ALGORITHMS)
    documents = {
        chunk.entity_path: chunk.to_record_batch().column("TextDocument:text")[0].as_py()[0]
        for chunk in reader.stream().filter(content="/about/**")
    }
    assert result.scenario.to_toml() in documents["/about/scenario"]
    assert "| algorithm | horizontal, final, " in documents["/about/summary"]


def test_summary_has_the_numbers_in_numpys_own_words(recorded):
    fake, result, _ = recorded
    summary = json.loads((result.directory / "summary.json").read_text())
    assert summary == json.loads(json.dumps(result.summary))
    assert list(summary["algorithms"]) == list(fake_run.ALGORITHMS)
    assert (summary["seed"], summary["status"], summary["rate_hz"]) == (3, "finished", 100.0)
    assert set(summary["timing"]) == {f"{stage}_s" for stage in STAGES}
    assert summary["timing"]["total_s"] > 0.0
    assert {"sinssim", "jsbsim", "numpy", "rerun-sdk"} <= set(summary["versions"])
    assert [event["start_s"] for event in summary["singularities"]["euler"]] == [3.0]
    for name, numbers in summary["algorithms"].items():
        error = result.errors[name]
        arcsec = np.degrees(np.linalg.norm(error.attitude, axis=1)) * 3600.0
        for quantity, values in (
            ("horizontal_error_m", np.hypot(*error.position_ned[:, :2].T)),
            ("height_error_m", -error.position_ned[:, 2]),
            ("velocity_error_mps", np.linalg.norm(error.velocity_ned, axis=1)),
            ("attitude_error_arcsec", arcsec),
        ):
            assert numbers[f"final_{quantity}"] == pytest.approx(values[-1], rel=1e-12)
            assert numbers[f"rms_{quantity}"] == pytest.approx(np.sqrt(np.mean(values**2)), rel=1e-12)
            assert numbers[f"max_{quantity}"] == pytest.approx(np.abs(values).max(), rel=1e-12)
        assert numbers["final_height_error_m"] == pytest.approx(fake.solutions[name].height[-1] - fake.truth.height[-1])


def test_progress_goes_through_the_stages_and_ends_each_at_one(recorded):
    _, _, told = recorded
    stages = list(dict.fromkeys(stage for stage, _ in told))
    assert stages == ["flight", "truth", "record", "imu", "navigate"]
    assert all(0.0 <= fraction <= 1.0 for _, fraction in told)
    assert {dict(told)[stage] for stage in stages} == {1.0}


def test_directory_holds_what_it_should_and_nothing_else(recorded):
    _, result, _ = recorded
    directory = result.directory
    files = {".sinssim.json", "recording.rrd", "report.html", "scenario.toml", "streams", "summary.json"}
    assert {p.name for p in directory.iterdir()} == files
    assert [p.name for p in directory.parent.iterdir()] == ["fake"]
    assert not list(directory.rglob("*.part"))
    assert (directory / "scenario.toml").read_text() == result.scenario.to_toml()


def in_process(how: str, directory: Path, count: int = 2_000) -> Fork:
    process = Fork(lambda: fake_run.run_until(how, directory, count))
    process.wait()
    return process


def check_what_is_left(directory: Path, status: str) -> None:
    """A run that broke off while navigating: valid, complete up to there, and saying so."""
    assert verify(directory / "recording.rrd").returncode == 0
    assert json.loads((directory / "summary.json").read_text())["status"] == status
    report = (directory / "report.html").read_text()
    assert f"The run {'was interrupted' if status == 'interrupted' else 'failed'}" in report
    assert "<h2>Motion</h2>" in report
    assert "<h2>Navigation errors</h2>" not in report
    entities = read_recording(directory / "recording.rrd")
    streams = {entity.split("/")[2] for entity in entities}
    assert streams == {"truth", "imu_ideal", "imu_measured", "flight", "flight_2"}
    for entity, (_, values, names) in entities.items():
        table = pq.read_table(directory / "streams" / f"{entity.split('/')[2]}.parquet")
        np.testing.assert_array_equal(values, np.column_stack([table[name].to_numpy() for name in names]))


def test_an_interrupted_run_keeps_a_valid_recording(tmp_path):
    ended = in_process("interrupt", tmp_path / "run")
    assert ended.returncode != 0
    assert "KeyboardInterrupt" in ended.stderr()
    check_what_is_left(tmp_path / "run", "interrupted")
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_failed_run_keeps_a_valid_recording_and_replaces_none(tmp_path, monkeypatch):
    fake_run.install(300, monkeypatch.setattr)

    def navigate(*_, **__):
        raise RuntimeError("the engine broke")

    monkeypatch.setattr("sinssim.strapdown.measured_attitude.navigate", navigate)
    for name in ("run", "run-failed", "run-failed"):
        with pytest.raises(RuntimeError, match="the engine broke") as caught:
            run(fake_run.scenario(), tmp_path / "run", overwrite=True)
        assert caught.value.__notes__ == [f"The recording up to that time is in {tmp_path / name}."]
        check_what_is_left(tmp_path / name, "failed")
    assert {p.name for p in tmp_path.iterdir()} == {"run", "run-failed"}


def test_a_full_disk_leaves_nothing_and_loses_nothing(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "summary.json").write_text("{}")
    (tmp_path / "run" / ".sinssim.json").write_text('{"files": ["summary.json"]}')
    ended = in_process("disk", tmp_path / "run", 20_000)
    assert "InputError" in ended.stderr()
    assert "could not be written" in ended.stderr()
    assert [p.name for p in tmp_path.iterdir()] == ["run"]
    assert {p.name for p in (tmp_path / "run").iterdir()} == {"summary.json", ".sinssim.json"}


def contents(folder: Path) -> dict[str, str]:
    """Return what a folder holds: files by name, with their contents, and links by their targets."""
    return {
        str(path.relative_to(folder)): f"-> {path.readlink()}" if path.is_symlink() else path.read_text()
        for path in folder.rglob("*")
        if path.is_symlink() or path.is_file()
    }


def test_a_run_that_is_there_is_replaced_only_when_asked(tmp_path, short):
    directory = tmp_path / "run"
    run(fake_run.scenario(), directory)
    with pytest.raises(InputError, match=r"already contains a run.*--overwrite"):
        run(fake_run.scenario(), directory)
    assert list(json.loads((directory / "summary.json").read_text())["algorithms"]) == list(fake_run.ALGORITHMS)
    run(fake_run.scenario(("euler",)), directory, overwrite=True)
    assert list(json.loads((directory / "summary.json").read_text())["algorithms"]) == ["euler"]
    streams = {path.name for path in (directory / "streams").iterdir()}
    assert "nav_euler.parquet" in streams
    assert "nav_poisson.parquet" not in streams  # the former run's
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_files_of_ones_own_beside_a_run_survive(tmp_path, short):
    directory = tmp_path / "run"
    run(fake_run.scenario(), directory)
    mine = {"notes.txt": "mine", "thesis/chapter.tex": "mine", "streams/mine.parquet": "mine", ".hidden": "mine"}
    (directory / "thesis").mkdir()
    for name, text in mine.items():
        (directory / name).write_text(text)
    for _ in range(2):
        run(fake_run.scenario(("euler",)), directory, overwrite=True)
        assert {name: (directory / name).read_text() for name in mine} == mine
    assert json.loads((directory / "summary.json").read_text())["status"] == "finished"
    assert verify(directory / "recording.rrd").returncode == 0
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ({"photo.jpg": "x"}, r"not empty and holds no run: it lacks the file \.sinssim\.json"),
        ({"summary.json": '{"scenario": "climate"}', "thesis.tex": "years"}, "holds no run"),  # another program's
        (
            {"summary.json": "{}", "recording.rrd": "x", "streams/truth.parquet": "x"},
            "of an older sinssim, move or rem",
        ),
        ({".sinssim.json": "{}", "thesis.tex": "years"}, "holds no run"),
        ({".sinssim.json": "no json", "thesis.tex": "years"}, "holds no run"),
        ({".sinssim.json": '{"files": ["../thesis.tex"]}'}, "holds no run"),
        ({".sinssim.json": '{"files": ["/etc/hosts"]}'}, "holds no run"),
        ({".sinssim.json": '{"files": ["summary.json"]}', "summary.json/thesis.tex": "x"}, "is a folder, but sinssim"),
    ],
)
@pytest.mark.parametrize(
    ("write", "kind"),
    [
        (lambda place: run(fake_run.scenario(), place, overwrite=True), "run"),
        (lambda place: compare(load_study("coning"), place, overwrite=True), "study"),
    ],
    ids=["run", "compare"],
)
def test_what_is_not_known_as_a_run_is_left_alone(tmp_path, monkeypatch, files, said, write, kind):
    monkeypatch.setattr("sinssim.scenario.true_motion.fly", lambda *_: pytest.fail("flew"))
    place = tmp_path / "place"
    for name, text in files.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_text(text)
    with pytest.raises(InputError, match=said if kind == "run" else "holds no study: it lacks a readable comparison"):
        write(place)
    assert contents(tmp_path) == {f"place/{name}": text for name, text in files.items()}


def test_the_home_folder_and_the_current_one(tmp_path, short, monkeypatch):
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "summary.json").write_text("mine")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path / "home")
    for place in (Path("~").expanduser(), Path()):
        with pytest.raises(InputError, match="holds no run"):
            run(fake_run.scenario(), place, overwrite=True)
    assert contents(tmp_path) == {"home/summary.json": "mine"}
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    inode = here.stat().st_ino
    for _ in range(2):  # the folder that a shell stands in stays the same folder
        run(fake_run.scenario(), Path(), overwrite=True)
        assert (here.stat().st_ino, (here / "summary.json").is_file()) == (inode, True)


def test_links(tmp_path, short):
    """A link to a run directory stays one; links within were not written by sinssim, and nothing is written through."""
    run(fake_run.scenario(), tmp_path / "disk" / "run")
    (tmp_path / "link").symlink_to("disk/run")
    (tmp_path / "disk" / "run" / "mine.txt").write_text("mine")
    run(fake_run.scenario(("euler",)), tmp_path / "link", overwrite=True)
    assert (tmp_path / "link").is_symlink()
    summary = json.loads((tmp_path / "disk" / "run" / "summary.json").read_text())
    assert list(summary["algorithms"]) == ["euler"]
    assert (tmp_path / "disk" / "run" / "mine.txt").read_text() == "mine"
    (tmp_path / "disk" / "run" / "streams").rename(tmp_path / "elsewhere")
    (tmp_path / "disk" / "run" / "streams").symlink_to(tmp_path / "elsewhere")
    before = sorted(path.name for path in (tmp_path / "elsewhere").iterdir())
    with pytest.raises(InputError, match="streams is a link, but sinssim writes"):
        run(fake_run.scenario(), tmp_path / "link", overwrite=True)
    assert sorted(path.name for path in (tmp_path / "elsewhere").iterdir()) == before


def test_a_file_of_ones_own_by_the_name_of_a_new_one_stays_and_the_run_is_not_lost(tmp_path, short):
    directory = tmp_path / "run"
    run(fake_run.scenario(("euler",)), directory)
    (directory / "streams" / "nav_poisson.parquet").write_text("mine")
    before = {path: path.stat().st_mtime_ns for path in directory.rglob("*")}
    with pytest.raises(InputError, match=r"nav_poisson\.parquet was not written by sinssim.* kept in .*run-new\."):
        run(fake_run.scenario(), directory, overwrite=True)
    assert {path: path.stat().st_mtime_ns for path in directory.rglob("*")} == before
    assert json.loads((tmp_path / "run-new" / "summary.json").read_text())["status"] == "finished"
    assert {p.name for p in tmp_path.iterdir()} == {"run", "run-new"}


def test_a_run_that_cannot_be_put_in_its_place_changes_nothing_there(tmp_path, short, monkeypatch):
    directory = tmp_path / "run"
    run(fake_run.scenario(), directory)
    before = {path: path.read_bytes() for path in directory.rglob("*") if path.is_file()}
    replace = os.replace

    def full(here, there):
        if Path(there) == directory / "streams" / "truth.parquet" and ".replaced-" not in str(here):
            raise OSError(28, "No space left on device")
        replace(here, there)

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(InputError, match="No space left"):
        run(fake_run.scenario(("euler",)), directory, overwrite=True)
    assert {path: path.read_bytes() for path in directory.rglob("*") if path.is_file()} == before
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_recording_that_cannot_be_opened_gives_its_reason_and_leaves_nothing(tmp_path, short, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("sinssim.recording.rerun_file.Recording", full)
    with pytest.raises(InputError, match="No space left"):
        run(fake_run.scenario(("euler",)), tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


def test_a_failed_run_does_not_go_where_somebody_elses_files_are(tmp_path, short, monkeypatch):
    monkeypatch.setattr("sinssim.strapdown.measured_attitude.navigate", lambda *_, **__: 1 / 0)
    for name in ("run", "run-failed"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine").write_text("mine")
    (tmp_path / "run" / ".sinssim.json").write_text('{"files": []}')
    with pytest.raises(ZeroDivisionError) as caught:
        run(fake_run.scenario(), tmp_path / "run", overwrite=True)
    assert caught.value.__notes__ == [f"The recording up to that time is in {tmp_path / 'run-failed-2'}."]
    assert [p.name for p in (tmp_path / "run-failed").iterdir()] == ["mine"]


def test_what_a_killed_run_left_is_removed_by_the_next(tmp_path, short):
    """And what one that goes on has written is not, nor a hidden folder of somebody else's."""
    killed = in_process("kill", tmp_path / "run")
    assert killed.returncode == -signal.SIGKILL
    (left,) = tmp_path.iterdir()
    assert left.name.startswith(".run-")
    (tmp_path / ".other-folder").mkdir()
    (tmp_path / ".other-folder" / "mine").write_text("mine")
    goes_on = RunDirectory(tmp_path / "third")
    run(fake_run.scenario(), tmp_path / "second")
    assert {p.name for p in tmp_path.iterdir()} == {"second", ".other-folder", goes_on.path.name}
    assert goes_on.keep() == tmp_path / "third"


def test_an_interruption_as_the_folder_is_made_leaves_nothing(tmp_path, monkeypatch):
    def interrupted(path):
        raise KeyboardInterrupt

    monkeypatch.setattr("sinssim.system.files.open_own", interrupted)
    with pytest.raises(KeyboardInterrupt):
        RunDirectory(tmp_path / "new" / "out")
    assert list(tmp_path.iterdir()) == []


def test_the_run_directory_has_the_permissions_of_any_new_folder(tmp_path, short):
    before = os.umask(0o027)
    try:
        place = run(fake_run.scenario(("poisson",)), tmp_path / "out").directory
    finally:
        os.umask(before)
    assert place.stat().st_mode & 0o777 == 0o750


def test_an_empty_folder_is_used(tmp_path, short):
    (tmp_path / "run").mkdir()
    assert run(fake_run.scenario(), tmp_path / "run").directory == tmp_path / "run"
    assert (tmp_path / "run" / "recording.rrd").is_file()


def test_places_that_cannot_be_written_are_refused_before_the_flight(tmp_path, monkeypatch):
    monkeypatch.setattr("sinssim.scenario.true_motion.fly", lambda *_: pytest.fail("flew"))
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="is a file"):
        run(fake_run.scenario(), tmp_path / "file")
    with pytest.raises(InputError, match="cannot be made"):
        run(fake_run.scenario(), tmp_path / "file" / "below")
    with pytest.raises(InputError, match="cannot be made"):
        run(fake_run.scenario(), Path("/proc/nowhere/run"))
    with pytest.raises(InputError, match="cannot be made: File name too long"):
        run(fake_run.scenario(), tmp_path / ("x" * 300))
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_a_flight_that_fails_leaves_no_trace(tmp_path, monkeypatch):
    def fly(scenario, progress, meanwhile):
        raise KeyboardInterrupt

    monkeypatch.setattr("sinssim.scenario.true_motion.fly", fly)
    with pytest.raises(KeyboardInterrupt):
        run(fake_run.scenario(), tmp_path / "new" / "run")
    assert not list(tmp_path.iterdir())


def test_without_a_directory_nothing_is_written(tmp_path, short, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(fake_run.scenario())
    assert result.directory is None
    assert set(result.errors) == set(fake_run.ALGORITHMS)
    assert not list(tmp_path.iterdir())


def test_initial_errors_are_added_to_the_true_state(short):
    truth = short.state(0.0)
    untouched = initial_state_with_errors(truth, InitialErrorSection(), short.ellipsoid)
    assert untouched.longitude == truth.longitude
    assert untouched.q_nb is truth.q_nb
    section = InitialErrorSection(north_m=100.0, east_m=-50.0, height_m=3.0, velocity_down_mps=0.5, heading_arcmin=2.0)
    wrong = initial_state_with_errors(truth, section, short.ellipsoid)
    s2 = 0.00669437999014 * np.sin(truth.latitude) ** 2  # e² of WGS 84
    r1, r2 = 6378137.0 * (1.0 - 0.00669437999014) / (1.0 - s2) ** 1.5, 6378137.0 / np.sqrt(1.0 - s2)
    assert wrong.latitude - truth.latitude == pytest.approx(100.0 / (r1 + truth.height), rel=1e-8)
    assert wrong.longitude - truth.longitude == pytest.approx(
        -50.0 / ((r2 + truth.height) * np.cos(truth.latitude)), rel=1e-8
    )
    assert wrong.height - truth.height == pytest.approx(3.0)
    np.testing.assert_allclose(wrong.velocity_ned - truth.velocity_ned, [0.0, 0.0, 0.5])
    # A heading error alone turns the body about down: q = (cos, 0, 0, sin) ⊗ q_true.
    c, s = np.cos(np.radians(1.0 / 60.0)), np.sin(np.radians(1.0 / 60.0))
    w, x, y, z = truth.q_nb
    expected = np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])
    assert abs(np.dot(wrong.q_nb, expected)) == pytest.approx(1.0, abs=1e-14)


def test_initial_errors_are_drawn_from_their_sigma(short):
    """Seen through the error definitions, over 2000 seeds: the sums of squares lie in bands of 1e-5."""
    truth = NavState(*(np.array([v]) for v in vars(short.state(0.0)).values()))
    one = NavState(*(v[0] for v in vars(truth).values()))
    section = InitialErrorSection(
        north_m=40.0, position_sigma_m=20.0, height_sigma_m=5.0, velocity_sigma_mps=0.3, tilt_sigma_arcmin=2.0,
        heading_sigma_arcmin=30.0,
    )  # fmt: skip
    found = []
    for seed in range(2000):
        s = initial_state_with_errors(one, section, short.ellipsoid, seed)
        rows = (np.atleast_1d(s.latitude), np.atleast_1d(s.longitude), np.atleast_1d(s.height))
        error = navigation_error(
            truth, NavSolution(np.zeros(1), *rows, s.velocity_ned[None], s.q_nb[None], np.zeros(1)), short.ellipsoid
        )
        found.append(np.concatenate([error.position_ned[0], error.velocity_ned[0], error.attitude[0]]))
    drawn = np.array(found) - 40.0 * np.eye(9)[0]
    arcmin = np.radians(1.0 / 60.0)
    sigma = np.array([20.0, 20.0, 5.0, 0.3, 0.3, 0.3, 2.0 * arcmin, 2.0 * arcmin, 30.0 * arcmin])
    low, high = chi2.ppf([0.5e-5, 1.0 - 0.5e-5], 2000)
    squares = np.sum((drawn / sigma) ** 2, axis=0)
    assert np.all((low < squares) & (squares < high))
    pairs = np.corrcoef(drawn.T)[np.triu_indices(9, 1)]
    assert np.max(np.abs(pairs)) < 4.5 / np.sqrt(2000.0)
