"""Loads views: each is one Python file of the folder `viz/` with a function `blueprint(run)`."""

from __future__ import annotations

import importlib.util
import json
import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from sinssim.content import find_content, list_content, package_content, warn_once
from sinssim.errors import InputError, unknown_name
from sinssim.system.files import Draft

if TYPE_CHECKING:
    import rerun.blueprint as rrb

logger = logging.getLogger(__name__)

_FIRST = ("flight", "navigation", "sensors", "filter")


@dataclass(frozen=True)
class RunInfo:
    """Information about a run for the views that show it."""

    name: str  # the scenario's name
    start: float  # first instant, s
    end: float  # last instant, s
    algorithms: tuple[str, ...]  # navigation algorithms, in the scenario's order
    # units and other words chosen for the run's numbers, for titles: `position`, `velocity`, `attitude`, `height_scale`
    # and so on
    labels: Mapping[str, str] = field(default_factory=dict)
    # smallest and largest number of every plotted entity
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    # viewpoint of the 3D view and the point it looks at, m in the scene, or () before they are known
    eye: tuple[tuple[float, float, float], tuple[float, float, float]] | tuple[()] = ()
    map_zoom: float | None = None  # zoom level of the map
    views: tuple[str, ...] = ()  # files of the run's own views

    @property
    def application(self) -> str:
        """Application identifier of the run's recordings."""
        return f"sinssim {self.name}"

    def label(self, key: str, otherwise: str = "") -> str:
        """Return one of the labels.

        Args:
            otherwise: text to return if the label is not known yet.
        """
        return self.labels.get(key, otherwise)

    def axis_x(self, room: float = 0.0) -> rrb.TimeAxis:
        """Return a time axis that shows the whole run (by default, a plot shows ±30 s around the cursor).

        Args:
            room: space after the run for a legend, as a fraction of the run.

        Returns:
            The axis, for `rerun.blueprint.TimeSeriesView(axis_x=…)`.
        """
        import rerun as rr
        import rerun.blueprint as rrb

        last = self.end + room * (self.end - self.start)
        start, end = (rrb.TimeRangeBoundary.absolute(seconds=t) for t in (self.start, last))
        return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))

    def range_of(self, *entities: str) -> tuple[float, float]:
        """Return the smallest and the largest number of some plotted entities."""
        known = [self.ranges[entity] for entity in entities if entity in self.ranges]
        return min((r[0] for r in known), default=0.0), max((r[1] for r in known), default=0.0)

    def axis_y(self, *entities: str) -> rrb.ScalarAxis | None:
        """Return a vertical axis with at least two labelled values.

        The viewer labels only multiples of powers of ten, none if they would be denser than about nine per plot, and
        none at the very edges. By default, a plot from -9 to 9 shows the label 0 alone.

        Returns:
            The axis, or None if the default axis is suitable.
        """
        import rerun.blueprint as rrb

        low, high = self.range_of(*entities)
        if not (high > low and math.isfinite(high - low)):
            return None
        step = 10.0 ** math.floor(math.log10(high - low))
        if high - low > 9.4 * step:
            step *= 10.0
        numbers = [k * step for k in range(math.floor(low / step) - 1, math.ceil(high / step) + 2)]
        numbers.sort(key=lambda n: max(low - n, n - high, 0.0))  # those in the range, then the nearest outside
        low, high = min(low, *numbers[:2]), max(high, *numbers[:2])
        margin = 0.05 * (high - low)
        return rrb.ScalarAxis(range=(low - margin, high + margin))

    def corner(self, *entities: str) -> rrb.Corner2D:
        """Return the corner for the legend of lines that begin near zero at the left."""
        import rerun.blueprint as rrb

        low, high = self.range_of(*entities)
        return rrb.Corner2D.LeftTop if high >= -low else rrb.Corner2D.LeftBottom

    def to_json(self) -> str:
        """Return the information as text, in the form of the recording."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> RunInfo:
        """Return the information that `to_json` wrote."""
        values = json.loads(text)
        values["algorithms"] = tuple(values["algorithms"])
        values["ranges"] = {entity: tuple(r) for entity, r in values["ranges"].items()}
        values["eye"] = tuple(tuple(point) for point in values["eye"])
        values["views"] = tuple(values.get("views", ()))
        return cls(**values)


def view_names() -> list[str]:
    """Return the names of all views, the package's own first: names, as for `load_view`."""
    names = list(list_content("viz"))
    return [name for name in _FIRST if name in names] + [name for name in names if name not in _FIRST]


def load_view(name: str, run: RunInfo) -> Any:
    """Return one view's layout, a `rerun.blueprint.Blueprint`. `name`: name of a view, or path of a Python file."""
    file = find_content("viz", name)
    return _layout(file, _module(file), run)


def _module(file: Path) -> ModuleType:
    """Run a view's file.

    The module has two optional constants: `KIND`, the kind of recording that it shows ("run" by default, "ensemble",
    "budget", "trade", "score" or "study"), and `NEEDS`, a label that a run must have for the view, for example
    "filter" or "redundancy".
    """
    spec = importlib.util.spec_from_file_location(f"sinssim_view_{file.stem}", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # a user's file may fail in any way
        raise _broken(file, error) from error
    return module


def _layout(file: Path, module: ModuleType, run: RunInfo) -> Any:
    """Return the layout that a view's module makes, after checking that it can be recorded."""
    try:
        layout = module.blueprint(run)
        if package_content("viz") not in file.parents:
            with Draft() as folder:
                layout.save(run.application, folder.path / "view.rbl")
        layout.root_container.name = file.stem
    except (Exception, SystemExit) as error:
        raise _broken(file, error) from error
    return layout


def _broken(file: Path, error: BaseException) -> InputError:
    return InputError(
        f"the view {file} does not work: {type(error).__name__}: {error}. A view is a Python file with a function "
        "blueprint(run) that returns a rerun.blueprint.Blueprint."
    )


def _by_name(views: Sequence[str]) -> dict[str, Path]:
    """Return the files of a user's own views by name; if two have the same name, the last one."""
    files: dict[str, Path] = {}
    for file in map(Path, views):
        if file.stem in files and files[file.stem] != file:
            warn_once(f"There are two views named {file.stem}: {file} is used, {files[file.stem]} is ignored.")
        files[file.stem] = file
    return files


def all_views(run: RunInfo, active: str | None = None, *, menu: bool = True) -> Any:
    """Return a `rerun.blueprint.Blueprint` with a tab for every view of a run or of a study; `active`, the name of a
    view or the path of a further one, is in front. A view that does not work is left out, with a warning, unless it is
    the one in front. The menu of the viewer has its notices about the machine, too."""
    import rerun.blueprint as rrb

    files = {name: find_content("viz", name) for name in view_names()}
    files |= _by_name(run.views)  # one with the name of another replaces it
    front = active
    if active is not None and active not in files and Path(active).is_file():
        front = Path(active).stem
        files[front] = find_content("viz", active)
    tabs: dict[str, Any] = {}
    for name, file in files.items():
        try:
            module = _module(file)
            if str(getattr(module, "KIND", "run")) != run.label("kind", "run"):
                continue
            need = str(getattr(module, "NEEDS", ""))
            if need and not run.label(need):
                if name == front:
                    raise InputError(f"the view {active!r} needs a run with a {need}; {run.name} has none.")
                continue
            tabs[name] = _layout(file, module, run).root_container
        except InputError as error:
            if name == front:
                raise
            warn_once(f"{error} It is left out.")
    if front is not None and front not in tabs:
        raise unknown_name("view", front, tabs)
    return rrb.Blueprint(
        rrb.Tabs(*tabs.values(), active_tab=0 if front is None else list(tabs).index(front)),
        rrb.TopPanel(state="expanded" if menu else "hidden"),
        rrb.TimePanel(state="collapsed", timeline="sim_time", play_state="paused"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )
