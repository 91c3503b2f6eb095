"""Views: units in every title, the whole run on every axis, and nothing shown that is not recorded."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rerun.blueprint as rrb
from rerun.chunk import RrdReader

from sinssim import content
from sinssim.errors import InputError
from sinssim.experiments.run.run_execution import run
from sinssim.recording.rerun_viewer import find_recording, find_run_info
from sinssim.recording.rerun_views import RunInfo, all_views, load_view, view_names
from tests.recording import fake_run
from tests.slow import slow

OWN = ("flight", "navigation", "sensors")


@pytest.fixture(scope="module", params=[fake_run.ALGORITHMS, ("poisson",)], ids=["three", "one"])
def recording(request, tmp_path_factory) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        fake_run.install(3000, patch.setattr)
        directory = tmp_path_factory.mktemp("views") / "run"
        return run(fake_run.scenario(request.param), directory).directory / "recording.rrd"


def views(part) -> list[rrb.View]:
    if isinstance(part, rrb.View):
        return [part]
    return [view for child in part.contents for view in views(child)]


def test_the_packages_own_views_come_first():
    assert tuple(view_names()[:3]) == OWN


@pytest.mark.parametrize("name", OWN)
def test_plots_name_their_unit_show_the_whole_run_and_only_what_is_recorded(recording, name):
    info = find_run_info(recording)
    entities = {chunk.entity_path for chunk in RrdReader(recording).stream()}
    plots = 0
    for view in views(load_view(name, info).root_container):
        paths = [view.origin] if view.contents == "$origin/**" else view.contents
        for path in (p for p in paths if not p.startswith("-")):
            under = str(path).removesuffix("/**")
            assert any(e == under or e.startswith(under + "/") for e in entities), path
        if not isinstance(view, rrb.TimeSeriesView):
            continue
        plots += 1
        assert re.search(r"\[(deg|deg/h|deg/s|arcmin|arcsec|m|mm|nmi|m/s|mm/s|m/s²|µg)\]", view.name), view.name
        span = view.properties["TimeAxis"].view_range.as_arrow_array().to_pylist()[0]
        bounds = [span["start"], span["end"]]
        assert bounds == [0, 30_000_000_000]
    assert plots >= 5


def test_all_views_become_tabs_with_the_asked_one_in_front(recording):
    info = find_run_info(recording)
    tabs = all_views(info, "sensors").root_container
    names = list(OWN)  # those of a study are left out, and those of what this run did not have
    assert [tab.name for tab in tabs.contents] == names
    assert tabs.active_tab == names.index("sensors")


VIEW = """import rerun.blueprint as rrb
def blueprint(run):
    return rrb.Blueprint(rrb.TimeSeriesView(origin='/flight/height', axis_x=run.axis_x()))
"""
MARKED = "from pathlib import Path\nPath(__file__).with_suffix('.ran').touch()\n"


def own_view(folder: Path, name: str, text: str = VIEW) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.py").write_text(text)
    return folder / f"{name}.py"


def tab_names(info: RunInfo, *arguments, **options) -> list[str]:
    return [tab.name for tab in all_views(info, *arguments, **options).root_container.contents]


def test_a_view_of_ones_own_is_found_where_the_user_said(recording, tmp_path, monkeypatch):
    info = find_run_info(recording)
    own = own_view(tmp_path / "views", "speeds")
    assert "speeds" in tab_names(info, str(own))
    assert tab_names(replace(info, views=(str(own),))) == [*OWN, "speeds"]
    assert tab_names(info) == list(OWN)
    own_view(tmp_path / "other", "speeds", VIEW.replace("height", "other"))
    monkeypatch.setenv("SINSSIM_VIEWS", f"{tmp_path / 'views'}{os.pathsep}{tmp_path / 'other'}{os.pathsep}")
    tabs = all_views(info, "speeds").root_container
    assert tabs.contents[tabs.active_tab].name == "speeds"
    (view,) = views(tabs.contents[tabs.active_tab])
    assert view.origin == "/flight/height"  # the folder that is named first wins
    assert view_names().count("speeds") == 1


def test_two_views_of_one_name_are_named_with_their_paths(recording, tmp_path, monkeypatch, caplog):
    info = find_run_info(recording)
    one, other = own_view(tmp_path / "one", "twice"), own_view(tmp_path / "other", "twice")
    assert tab_names(replace(info, views=(str(one), str(other)))) == [*OWN, "twice"]
    said = f"There are two views named twice: {other} is used, {one} is ignored."
    assert [record.message for record in caplog.records] == [said]
    caplog.clear()
    monkeypatch.setenv("SINSSIM_VIEWS", f"{one.parent}{os.pathsep}{other.parent}")
    assert view_names().count("twice") == 1
    assert [record.message for record in caplog.records] == [
        f"There are two views named twice: {one} is used, {other} is ignored."
    ]


def test_no_code_is_run_from_the_folder_that_one_stands_in(recording, tmp_path, monkeypatch, caplog):
    content.warn_once.cache_clear()
    info = find_run_info(recording)
    for folder in (tmp_path, tmp_path / "viz"):
        own_view(folder, "plot", MARKED + VIEW)
        own_view(folder, "flight", MARKED + VIEW)
    monkeypatch.chdir(tmp_path)
    assert tab_names(info) == list(OWN)
    monkeypatch.setenv("SINSSIM_VIEWS", f"viz{os.pathsep}.{os.pathsep}{tmp_path / 'nowhere'}")
    assert tab_names(info, "flight") == list(OWN)
    assert {path.name for path in tmp_path.rglob("*")} == {"plot.py", "flight.py", "viz"}
    assert [record.message.split(", which ")[1] for record in caplog.records] == [
        "is not an absolute path: the folder is ignored.",
        "is not an absolute path: the folder is ignored.",
        "does not exist: the folder is ignored.",
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("import sys\nsys.exit('bye')", "SystemExit: bye"),
        ("1 / 0", "ZeroDivisionError"),
        ("def blueprint(run)", "SyntaxError"),
        ("import rerun.blueprint as rrb\ndef blueprint(run):\n    return rrb.Blueprint(rrb.Tabs(3))", "AttributeError"),
        *slow(
            ("def blueprint(run):\n    raise SystemExit(3)", "SystemExit: 3"),
            ("import matplotlib.no_such_thing", "ModuleNotFoundError"),
            ("def blueprint(run):\n    return None", "AttributeError"),
            ("", "AttributeError"),
        ),
    ],
)
def test_a_view_that_fails_costs_its_view_and_not_the_run(tmp_path, monkeypatch, caplog, text, said):
    fake_run.install(300, monkeypatch.setattr)
    broken = own_view(tmp_path / "views", "broken", text)
    good = own_view(tmp_path / "views", "good")
    scenario = fake_run.scenario(("quaternion",)).model_copy(update={"views": (str(broken), str(good))})
    result = run(scenario, tmp_path / "run")
    assert result.summary["status"] == "finished"
    (warning,) = [record.message for record in caplog.records]  # one, however often the layout is made
    assert f"the view {broken} does not work: {said}" in warning
    assert warning.endswith("It is left out.")
    names = set()
    reader = RrdReader(result.directory / "recording.rrd")
    for store in reader.blueprints():
        for chunk in reader.stream(store=store):
            batch = chunk.to_record_batch()
            for column in (c for c in batch.schema.names if c.endswith(":display_name")):
                names |= {name for row in batch.column(column).to_pylist() for name in row or ()}
    assert "good" in names
    assert "broken" not in names


def test_a_view_that_does_not_work_says_which_and_why(recording, tmp_path):
    broken = tmp_path / "broken.py"
    broken.write_text("def blueprint(run):\n    return run.no_such_thing\n")
    with pytest.raises(InputError, match=r"broken\.py does not work: AttributeError.*no_such_thing"):
        all_views(find_run_info(recording), str(broken))
    with pytest.raises(InputError, match="unknown view 'sensor'"):
        all_views(find_run_info(recording), "sensor")
    with pytest.raises(InputError, match="the view 'filter' needs a run with a filter; fake has none"):
        all_views(find_run_info(recording), "filter")


def test_what_views_know_about_a_run_survives_its_recording(recording):
    info = find_run_info(recording)
    assert RunInfo.from_json(info.to_json()) == info
    known = {"navigation/position_north", "navigation/tilt_north", "sensors/gyro/sum", "sensors/gyro/sum title"}
    assert known | {"height_scale"} <= set(info.labels)


@pytest.mark.parametrize(
    ("low", "high"),
    [
        (-9.0, 9.0),
        (0.0, 1.0),
        (500.0, 9000.0),
        (-48.0, 48.0),
        (-0.95, 1.1),
        (-1e-9, 4e-9),
        (228.9, 229.4),
        (-3.0, -1.1),
    ],
)
def test_every_axis_has_two_numbers_that_the_viewer_writes(low, high):
    info = RunInfo("x", 0.0, 1.0, ("quaternion",), ranges={"a": (low, 0.5 * (low + high)), "b": (low, high)})
    axis = info.axis_y("a", "b")
    first, last = axis.range.as_arrow_array().to_pylist()[0]
    assert first < low < high < last
    span = last - first
    numbers = {}
    for decade in 10.0 ** np.arange(np.floor(np.log10(span)) - 1, np.ceil(np.log10(span)) + 1):
        steps = np.arange(np.ceil(first / decade), np.floor(last / decade) + 1)
        numbers[decade] = len(steps) if span / decade < 10.5 else 0
    assert max(numbers.values()) >= 2
    assert span < 2.5 * (high - low)


def test_an_axis_without_any_range_is_left_to_the_viewer():
    info = RunInfo("x", 0.0, 1.0, ("quaternion",), ranges={"flat": (2.0, 2.0)})
    assert info.axis_y("flat") is None
    assert info.axis_y("unknown") is None


def test_paths_that_are_no_recording_are_refused(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        find_recording(tmp_path / "nothing")
    with pytest.raises(InputError, match=r"contains no recording\.rrd"):
        find_recording(tmp_path)
    (tmp_path / "recording.rrd").write_bytes(b"RRF2 not really")
    assert find_recording(tmp_path) == tmp_path / "recording.rrd"
    with pytest.raises(InputError, match="is not a recording by sinssim"):
        find_run_info(tmp_path / "recording.rrd")


@pytest.mark.parametrize(("labels", "shown"), [({"events": "no"}, False), ({"events": "yes"}, True), ({}, True)])
def test_a_run_without_events_has_no_panel_of_them(labels, shown):
    info = RunInfo("x", 0.0, 1.0, ("quaternion",), labels=labels)
    assert any(isinstance(view, rrb.TextLogView) for view in views(load_view("flight", info).root_container)) == shown


def test_a_run_says_whether_it_has_events(recording):
    entities = {chunk.entity_path for chunk in RrdReader(recording).stream()}
    assert (find_run_info(recording).label("events") == "yes") == ("/events" in entities)
