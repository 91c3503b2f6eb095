"""Public objects are shown in a few lines on the console and as tables in notebooks; results draw themselves."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.data import described, short_repr
from sinssim.recording import streams
from sinssim.toml_section import Section
from tests.experiments.ensembles.examples import AIDED, PARKED, scenario


@pytest.fixture(scope="module")
def aided(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A short run with a filter, recorded."""
    return sinssim.run(scenario(AIDED), tmp_path_factory.mktemp("run") / "aided")


@pytest.fixture(scope="module")
def results(aided: Any) -> dict[str, Any]:
    """A result of each kind."""
    return {
        "run": aided,
        "ensemble": sinssim.ensemble(scenario(PARKED), 8, threads=1),
        "budget": sinssim.budget(scenario(PARKED, parked={"latitude_deg": 50.0, "duration_s": 2.0})),
    }


def inside(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Yield an object of sinssim and those that its public attributes hold, with their paths."""
    module = type(value).__module__ or ""
    if isinstance(value, tuple | list | dict) and depth < 4:
        for k, one in value.items() if isinstance(value, dict) else enumerate(value):
            yield from inside(f"{name}[{k!r}]", one, depth + 1)
    elif module.startswith("sinssim."):
        yield name, value
        if depth < 4 and not module.startswith("sinssim.scenario"):
            for field in dataclasses.fields(value) if dataclasses.is_dataclass(value) else ():
                yield from inside(f"{name}.{field.name}", getattr(value, field.name), depth + 1)


def test_reprs_are_short(results: dict[str, Any]) -> None:
    """Whatever a user reaches from a result takes at most ten lines and 1200 characters."""
    shown = [pair for name, result in results.items() for pair in inside(name, result)]
    shown += [("streams", results["run"].streams), ("truth", results["run"].streams["truth"])]
    assert len(shown) > 20
    long = {
        name: len(text)
        for name, value in shown
        if not isinstance(value, Section)
        and ((text := repr(value)).count("\n") >= 10 or len(text) > 1200 or " object at 0x" in text)
    }
    assert not long


class _Tags(HTMLParser):
    """Checks that tags are closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_tables_for_notebooks(results: dict[str, Any]) -> None:
    run = results["run"]
    shown = [*results.values(), run.streams, run.streams["truth"], run.aided, run.aided.estimate.innovations[0],
             next(iter(run.errors.values()))]  # fmt: skip
    for one in shown:
        tags = _Tags()
        tags.feed(one._repr_html_())
        assert not tags.open
        assert "<table>" in one._repr_html_()
    final = run.summary["algorithms"]["quaternion"]["final_horizontal_error_m"]
    assert f"{final:.4g}" in run._repr_html_()
    assert f"{results['budget'].r95[-1]:.4g}" in results["budget"]._repr_html_()
    assert f"{results['ensemble'].r95.value[-1]:.4g}" in results["ensemble"]._repr_html_()


def test_a_table_says_what_its_attributes_are(aided: Any) -> None:
    """The meanings, with shapes and units, are those of the docstring."""
    text = next(iter(aided.errors.values()))._repr_html_()
    assert "solution minus truth, (N, 3) m; down is exactly minus the difference of the heights." in text
    assert "801 × 3 array" in text


def test_described() -> None:
    assert described(np.arange(6.0).reshape(2, 3)) == "2 × 3 array, 0 … 5"
    assert described(np.array([np.nan] * 5)) == "5 array, no finite number"
    assert described(np.array([1.0, 2.5])) == "[1, 2.5]"
    assert described({"a": 1}) == "{'a'}"
    assert described(tuple(range(9))) == "(0, 1, 2, 3, … 9 in all)"

    @short_repr
    @dataclasses.dataclass
    class Many:
        """Many values.

        Attributes:
            values: all of them,
                (N,) m.
        """

        values: np.ndarray

    assert repr(Many(np.arange(1e6))) == "Many(values=1000000 array, 0 … 999999)"
    assert "all of them, (N,) m." in Many(np.zeros(1))._repr_html_()  # type: ignore[attr-defined]


def test_results_draw_themselves(results: dict[str, Any]) -> None:
    """Axes have labels with units; the picture is a PNG without a display."""
    for result in results.values():
        figure = result.plot()
        assert any(re.search(r"\[.+\]", panel.get_ylabel()) for panel in figure.axes)
    figure = results["run"].plot()
    assert figure._repr_png_().startswith(b"\x89PNG")
    lines = {line.get_label(): line for line in figure.axes[0].get_lines()}
    assert set(lines) == {"quaternion", "aided"}
    error = results["run"].errors["quaternion"].horizontal
    drawn = lines["quaternion"].get_ydata()
    assert drawn[-1] / drawn[len(drawn) // 2] == pytest.approx(error[-1] / error[len(drawn) // 2])


def test_streams_are_the_files_of_the_run(aided: Any) -> None:
    """Every stream in memory equals the one of its name in the run directory, bit for bit."""
    stored = sinssim.load_streams(aided.directory)
    assert {"truth", "imu_ideal", "imu_measured", "nav_quaternion", "error_quaternion", "nav_aided"} <= set(
        aided.streams
    )
    for name, table in aided.streams.items():
        assert table.arrow().equals(stored[name].arrow()), name
    truth = aided.streams["truth"]
    np.testing.assert_array_equal(truth["height_m"], aided.truth.state.height)
    np.testing.assert_array_equal(truth["time_s"], aided.truth.time)
    assert len(truth) == len(aided.truth.time)


def test_wrong_streams_and_columns(aided: Any) -> None:
    with pytest.raises(sinssim.InputError, match="truth"):
        aided.streams["thruth"]
    with pytest.raises(sinssim.InputError, match="height_m"):
        aided.streams["truth"]["height"]
    assert "nothing" not in aided.streams


def test_pandas_and_polars_are_used_if_they_are_there(aided: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without them the error names the command that installs them."""
    truth = aided.streams["truth"]
    for library in ("pandas", "polars"):
        monkeypatch.setitem(__import__("sys").modules, library, None)
        with pytest.raises(sinssim.InputError, match=rf"pip install 'sinssim\[{library}\]'"):
            getattr(truth, library)()
    assert "importlib.import_module(library)" in inspect.getsource(streams._needed)
