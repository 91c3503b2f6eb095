"""What each kind of recording holds: documents, pictures and the run that its views are made for."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.charts import Axis, Chart, Charts, Line
from sinssim.exhibits import Exhibits, Section, Sentence
from sinssim.experiments.run import one_component_exhibits as one_component
from sinssim.recording import rerun_exhibits, rerun_file, rerun_views
from sinssim.recording.rerun_viewer import RUN_ENTITY
from sinssim.units import LENGTH_SCALE


class Kept:
    """Stands in for a recording, for the class of recordings, and for one that replaces a file when it is complete."""

    def __init__(self) -> None:
        self.opened: list[Any] = []
        self.texts: dict[str, str] = {}
        self.fixed: dict[str, Any] = {}
        self.streams: list[tuple[str, bool]] = []
        self.views: list[Any] = []
        self.ranges = {"an entity": (1.5, 2.5)}

    def __call__(self, path: Path, application: str, views: Any = None, viewer: Any = None) -> Any:
        self.opened = [path.name, application, views]
        return self

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def document(self, entity: str, text: str) -> None:
        self.texts[entity] = text

    def static(self, entity: str, archetype: Any) -> None:
        self.fixed[entity] = archetype

    def stream(self, stream: Any, *, thin: bool) -> None:
        self.streams.append((stream.name, thin))

    def blueprint(self, views: Any) -> None:
        self.views.append(views)

    @property
    def run(self) -> dict[str, Any]:
        return dict(json.loads(self.texts[RUN_ENTITY]))


@pytest.fixture
def kept(monkeypatch: pytest.MonkeyPatch) -> Kept:
    found = Kept()
    monkeypatch.setattr(rerun_file, "Recording", found)
    for module in (rerun_exhibits, rerun_views):
        monkeypatch.setattr(module, "all_views", lambda run: ("views", run.name, dict(run.labels)))

    @contextmanager
    def whole(path: Path, application: str) -> Iterator[Any]:
        yield found(path, application)

    monkeypatch.setattr(rerun_exhibits, "whole_recording", whole)
    monkeypatch.setattr(rerun_exhibits, "to_png", lambda figure: figure)
    monkeypatch.setattr(rerun_exhibits.rr, "EncodedImage", lambda contents, media_type: (contents, media_type))
    return found


def scenario(**more: Any) -> Any:
    return SimpleNamespace(**{"name": "short", "to_toml": lambda: "seed = 3", "views": ("own.py",), **more})


def test_exhibits(kept: Kept, monkeypatch: pytest.MonkeyPatch) -> None:
    """Charts over time as curves, a chosen group as a picture, all words in one document."""
    curves: list[tuple[str, float]] = []
    monkeypatch.setattr(
        rerun_exhibits, "record_chart", lambda recording, entity, chart, start: curves.append((entity, start))
    )
    monkeypatch.setattr(rerun_exhibits, "figure_of", lambda charts: f"picture of {charts.key}")
    y = Axis(label="error", units=LENGTH_SCALE)
    line = Line(label="a", x=np.array([0.0, 300.0]), y=np.array([0.0, 2e5]))
    of_number = Chart(key="other", x=Axis(label="number"), y=y, marks=(line,))
    groups = [Charts(key, ((Chart(key=f"{key}/curve", y=y, marks=(line,)), of_number),), (4.0, 3.0), on=on)
              for key, on in (("one", ("page", "recording")), ("two", ("page",)))]  # fmt: skip
    shown = Exhibits("A title", [Section("Part", groups), Sentence("Words.")], name="short", kind="budget",
                     root="root", span=(50.0, 350.0), pictures=("one", "two"))  # fmt: skip
    rerun_exhibits.record(shown, Path("x/recording.rrd"))
    assert kept.opened[:2] == ["recording.rrd", "sinssim short"]
    assert kept.views == [("views", "short", {"kind": "budget", "one/curve": "km"})]
    assert curves == [("root/one/curve", 50.0)]
    assert kept.fixed == {"root/figures/one": ("picture of one", "image/png")}
    assert kept.texts["root/tables"] == "# A title\n\nWords.\n"
    run = kept.run
    assert (run["name"], run["start"], run["end"]) == ("short", 50.0, 350.0)
    assert run["labels"] == {"kind": "budget", "one/curve": "km"}
    assert run["ranges"] == {"an entity": [1.5, 2.5]}
    assert kept.views == [("views", "short", run["labels"])]


def test_exhibits_without_views_of_their_kind(kept: Kept, monkeypatch: pytest.MonkeyPatch) -> None:
    """A tab for each group of charts over time, one for the tables, one for each picture; each plot names its unit."""
    monkeypatch.setattr(rerun_exhibits, "record_chart", lambda *_: None)
    monkeypatch.setattr(rerun_exhibits, "figure_of", lambda charts: charts.key)
    line = Line(x=np.array([0.0, 300.0]), y=np.array([0.0, 2e5]))
    of_time = Chart(key="curve", title="way", y=Axis(units=LENGTH_SCALE), marks=(line,))
    of_number = Chart(key="other", x=Axis(label="number"), y=Axis(), marks=(line,))
    groups = [Charts("the_session", ((of_time, of_number),), (4.0, 3.0)), Charts("bars", ((of_number,),), (4.0, 3.0))]
    shown = Exhibits("A title", groups, name="log", root="root", span=(50.0, 350.0), pictures=("bars",))
    rerun_exhibits.record(shown, Path("a.rrd"))
    assert kept.opened[:2] == ["a.rrd", "sinssim log"]
    root = kept.views[0].root_container
    tabs = root.contents if len(root.contents) > 1 else root.contents[0].contents
    assert [tab.name for tab in tabs] == ["The session", "Summary", "Bars"]
    (plot,) = tabs[0].contents
    assert plot.name == "way [km]"
    span = plot.properties["TimeAxis"].view_range.as_arrow_array().to_pylist()[0]
    assert (span["start"], span["end"]) == (50 * 10**9, 350 * 10**9)


def test_a_run_of_one_component(kept: Kept, monkeypatch: pytest.MonkeyPatch) -> None:
    recorded: list[Any] = []
    monkeypatch.setattr(rerun_exhibits, "record_charts",
                        lambda recording, charts, root: recorded.append((charts, root)) or {charts: "km"})  # fmt: skip
    monkeypatch.setattr(one_component, "_draw_pendulum", lambda recording, result: {"pendulum": "deg"})
    monkeypatch.setattr(one_component, "error_table", lambda numbers: numbers)
    monkeypatch.setattr(rerun_exhibits, "markdown_of", lambda items: f"# {items}")
    result: Any = SimpleNamespace(truth=SimpleNamespace(time=np.array([50.0, 60.0, 350.0])),
                                  section=SimpleNamespace(variant="level"))  # fmt: skip
    shown = ["position", "pitch"]
    monkeypatch.setattr(one_component, "plane_charts", lambda result: shown)
    monkeypatch.setattr(one_component, "numbers", lambda result: {"n": 1})
    for detail, thin in (("light", True), ("full", False)):
        own = scenario(recording=SimpleNamespace(detail=detail))
        streams: Any = [SimpleNamespace(name="motion")]
        one_component.record(Path("recording.rrd"), own, result, streams)
        assert kept.streams.pop() == ("motion", thin)
    assert recorded == [(one, "one_component/") for one in shown] * 2
    assert kept.texts["about/summary"] == "# [{'n': 1}]"
    assert kept.texts["about/scenario"] == "```toml\nseed = 3\n```"
    run = kept.run
    assert (run["name"], run["start"], run["end"], run["algorithms"]) == ("short", 50.0, 350.0, ["level"])
    assert run["labels"] == {"kind": "one-component", "position": "km", "pitch": "km", "pendulum": "deg"}
    assert (run["ranges"], run["views"]) == ({"an entity": [1.5, 2.5]}, ["own.py"])
    assert kept.views[-1] == ("views", "short", run["labels"])
