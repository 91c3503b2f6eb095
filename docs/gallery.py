"""Draw the pictures of docs/gallery.md from shipped scenarios: `python docs/gallery.py` writes docs/images/gallery.

It flies some scenarios and takes about three minutes; flights that are kept are not flown again. With --reports, it
writes the reports that the site shows, to build/reports.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import sinssim

FOLDER = Path(__file__).with_name("images") / "gallery"
REPORTS_FOLDER = Path(__file__).parents[1] / "build" / "reports"


def errors_of_a_flight() -> Any:
    """Errors of `first_flight` over one Schuler period."""
    return sinssim.run(sinssim.load_scenario("first_flight", ['navigation.algorithms=["quaternion"]'])).plot()


def aided_uav() -> Any:
    """A MEMS unit with satellites, and an outage of a minute."""
    return sinssim.run(sinssim.load_scenario("mems_uav")).plot()


def rotating_unit() -> Any:
    """The same gyros turning and at rest, in a ship."""
    return sinssim.run(sinssim.load_scenario("rotating_unit", ["imu.rate_hz=10"])).plot()


def gravity() -> Any:
    """Perfect sensors in the true gravity field along the Himalaya."""
    return sinssim.run(sinssim.load_scenario("gravity_disturbance")).plot()


def ensemble() -> Any:
    """A hundred flights with other random numbers."""
    return sinssim.ensemble(sinssim.load_scenario("first_flight", ["imu.rate_hz=10"]), runs=100).plot()


def budget() -> Any:
    """Shares of the sources in the mean square error."""
    return sinssim.budget(sinssim.load_scenario("first_flight")).plot()


def spoofed_airliner() -> Any:
    """The planned, the believed and the true path of a flight whose receiver is dragged off."""
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(10.0, 4.5), layout="constrained")
    for settings, colour, name in ((["filter.gate=0"], "C3", "without gate"), ([], "C0", "with gate")):
        run = sinssim.run(sinssim.load_scenario("spoofed_airliner", settings))
        errors, fault = run.parts["planned_path"].errors, run.summary["filter"]["faults"][0]
        axes.plot(errors.time, errors.tse[:, 0], colour, label=f"true path, {name}")
        axes.plot(errors.time, errors.fte[:, 0], colour, linestyle="--", label=f"believed path, {name}")
        if (seen := fault["first_refused_s"]) is not None:
            row = int(abs(errors.time - seen).argmin())
            text = f"the gate rejects the first forged fix, at {seen:.0f} s"
            axes.plot(seen, errors.tse[row, 0], "o", color=colour, label=text)
    axes.axhline(0.0, color="black", linewidth=1.0, label="planned path")
    axes.axvline(400.0, color="grey", linestyle=":", label="the drag-off begins, at 400 s")
    axes.set(title="spoofed_airliner: 2 m/s along and across", xlabel="time, s", ylabel="right of the planned path, m")
    axes.legend(fontsize="small")
    return figure


PICTURES: dict[str, Callable[[], Any]] = {
    draw.__name__: draw
    for draw in (errors_of_a_flight, aided_uav, rotating_unit, gravity, ensemble, budget, spoofed_airliner)
}
"""The pictures by the name of their file."""


REPORTS: dict[str, Callable[[], Any]] = {
    "first_flight": lambda: sinssim.run(sinssim.load_scenario("first_flight")),
    "mems_uav": lambda: sinssim.run(sinssim.load_scenario("mems_uav")),
    "rotating_unit": lambda: sinssim.run(sinssim.load_scenario("rotating_unit", ["imu.rate_hz=10"])),
    "gravity_disturbance": lambda: sinssim.run(sinssim.load_scenario("gravity_disturbance")),
    "spoofed_airliner": lambda: sinssim.run(sinssim.load_scenario("spoofed_airliner")),
    "one_component": lambda: sinssim.run(sinssim.load_scenario("one_component")),
    "ensemble": lambda: sinssim.ensemble(sinssim.load_scenario("first_flight", ["imu.rate_hz=10"]), runs=100),
    "budget": lambda: sinssim.budget(sinssim.load_scenario("first_flight")),
    "gyro_trade": lambda: sinssim.compare("gyro_trade"),
}
"""The results whose reports the site has, by the name of their file."""


def write_reports(names: Sequence[str], folder: Path) -> None:
    """Write some reports, all without names, and say their sizes."""
    from sinssim.recording.page import page_of
    from sinssim.system.files import write_text

    for name in names or REPORTS:
        page = folder / f"{name}.html"
        write_text(page, page_of(REPORTS[name]().exhibits))
        print(f"{page}: {page.stat().st_size / 1e6:.1f} MB", flush=True)


def main() -> None:
    """Draw the pictures, or write the reports."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    choices = sorted({*PICTURES, *REPORTS})
    parser.add_argument("names", nargs="*", choices=[*choices, []], help="pictures or reports to make; all without")
    parser.add_argument("--reports", action="store_true", help="write the reports of the site instead")
    parser.add_argument("-o", "--out", type=Path, help=f"folder to write (default: {FOLDER}, {REPORTS_FOLDER})")
    options = parser.parse_args()
    folder = options.out or (REPORTS_FOLDER if options.reports else FOLDER)
    folder.mkdir(parents=True, exist_ok=True)
    if options.reports:
        write_reports(options.names, folder)
        return
    for name in options.names or PICTURES:
        PICTURES[name]().savefig(folder / f"{name}.png", dpi=80)


if __name__ == "__main__":
    main()
