"""Speed of navigation with gravity compensation and with a rotating IMU, in pairs with plain navigation.

    python -m benchmarks.bench_compensated [--hours 1] [--rate 100] [--repeat 7] [--degree 36 --degree 120]

All cases use increments of the same great circle at 10 km and 240 m/s and the quaternion algorithm, on one core:

    plain      normal gravity
    degree n   the same with EGM2008 to degree n at the computed position (`navigation.gravity_degree`)
    turning    increments of an IMU that rotates by the 16-position sequence, without and with the attitude of the
               vehicle from the encoder angles

Each case alternates with plain navigation, and the smallest processor times of the pairs are compared. For a degree,
the parts of the smallest time are also printed: the navigations of all passes and their number, the field along the
path, and the integral of the disturbance in body axes with the speed of its kernel.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import sinssim.strapdown.navigate as navigation
from sinssim import block_of, load_scenario
from sinssim.data import ImuData, NavSolution, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.earth.gravity_disturbance import DisturbingField
from sinssim.sensors.imu.rotation_encoder import encoders_of
from sinssim.strapdown.navigate import navigate
from sinssim.truth.motion import TrueGravity
from sinssim.truth.motions.parked_and_great_circle import GreatCircle


@dataclass
class Parts:
    """Seconds of the parts of one compensated navigation, and how often each was called."""

    seconds: dict[str, float] = field(default_factory=dict)
    calls: dict[str, int] = field(default_factory=dict)

    def timed(self, name: str, work: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that adds its processor time to the part of this name."""

        def run(*arguments: Any) -> Any:
            begin = time.process_time()
            found = work(*arguments)
            self.seconds[name] = self.seconds.get(name, 0.0) + time.process_time() - begin
            self.calls[name] = self.calls.get(name, 0) + 1
            return found

        return run


def in_field(imu: ImuData, known: DisturbingField, on: Callable[[ImuData], NavSolution]) -> Parts:
    """Navigate with a field and return the parts of the time."""
    parts = Parts()
    names = ("disturbance_along", "disturbance_in_body", "_felt_rows")
    before = {name: getattr(navigation, name) for name in names}
    try:
        for name in names:
            setattr(navigation, name, parts.timed(name, before[name]))
        parts.timed("whole", navigation.navigate_in_field)(imu, known, WGS84, parts.timed("navigate", on))
    finally:
        for name, work in before.items():
            setattr(navigation, name, work)
    return parts


def seconds(work: Callable[[], object]) -> float:
    """Return the processor time of a call, s."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


class Cases:
    """Navigation with the increments of a great circle, plain and in the other cases.

    Args:
        hours: duration.
        rate_hz: samples a second.
        repeat: number of pairs.
    """

    def __init__(self, hours: float, rate_hz: float, repeat: int) -> None:
        self.circle = GreatCircle(0.6, 1.26, 10_000.0, 2.06, 240.0, 3600.0 * hours)
        self.imu = self.circle.increments(rate_hz)
        self.start = self.circle.state(0.0)
        self.heights = np.full(len(self.imu) + 1, 10_000.0)
        self.rate_hz, self.repeat = rate_hz, repeat
        self.on(self.imu)  # compiles, or loads what is compiled

    def on(self, imu: ImuData, start: NavState | None = None) -> NavSolution:
        """Navigate by the quaternion algorithm with the baro loop."""
        return navigate(imu, start or self.start, vertical="baro-loop", height=self.heights)

    def show(self, name: str, pairs: list[tuple[float, float]], more: str = "") -> None:
        """Print the rates of the smallest times."""
        plain, own = (min(times) for times in zip(*pairs, strict=True))
        count = len(self.imu) / 1e6
        print(f"{name:24s} {count / own:5.1f}   plain {count / plain:5.1f}   time x{own / plain:.2f}{more}")

    def in_field_of_degree(self, degree: int) -> None:
        """Print the line of a gravity compensation."""
        known = TrueGravity(model="egm2008").field(WGS84, degree)
        assert known is not None
        in_field(self.imu, known, self.on)
        found = [(seconds(lambda: self.on(self.imu)), in_field(self.imu, known, self.on)) for _ in range(self.repeat)]
        best = min((parts for _, parts in found), key=lambda parts: parts.seconds["whole"])
        share = {name: 100.0 * spent / best.seconds["whole"] for name, spent in best.seconds.items()}
        kernel = len(self.imu) * best.calls["_felt_rows"] / best.seconds["_felt_rows"] / 1e6
        self.show(
            f"degree {degree}",
            [(plain, parts.seconds["whole"]) for plain, parts in found],
            f"   {best.calls['navigate']} navigations {share['navigate']:.0f} %, field "
            f"{share['disturbance_along']:.0f} %, in the body {share['disturbance_in_body']:.0f} % "
            f"(its kernel {kernel:.1f})",
        )

    def turning(self) -> None:
        """Print the lines of a rotating IMU."""
        unit = load_scenario("rotating_unit").imu
        block = block_of(self.circle, unit)
        turned, begin = block.increments(self.rate_hz), block.state(0.0)
        encoders = encoders_of(block, None, self.imu.time)
        assert encoders is not None
        solution = self.on(turned, begin)
        encoders.turned_out(solution)
        for name, work in (
            ("turning, navigation", lambda: self.on(turned, begin)),
            ("turning, with encoders", lambda: encoders.turned_out(self.on(turned, begin))),
        ):
            self.show(name, [(seconds(lambda: self.on(self.imu)), seconds(work)) for _ in range(self.repeat)])
        truths = [
            (seconds(lambda: self.circle.increments(self.rate_hz)), seconds(lambda: block.increments(self.rate_hz)))
            for _ in range(min(self.repeat, 3))
        ]
        base, own = (len(self.imu) / min(times) / 1e6 for times in zip(*truths, strict=True))
        print(f"{'ideal increments':24s} {own:5.2f}   great circle alone {base:5.2f}")


def main() -> None:
    """Print a line for each case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--rate", type=float, default=100.0, help="samples a second")
    parser.add_argument("--repeat", type=int, default=7, help="number of pairs")
    parser.add_argument("--degree", type=int, action="append", help="36 and 120 by default")
    options = parser.parse_args()
    cases = Cases(options.hours, options.rate, options.repeat)
    print(f"{len(cases.imu)} samples; million samples per second from the smallest times of {options.repeat} pairs")
    for degree in options.degree or (36, 120):
        cases.in_field_of_degree(degree)
    cases.turning()


if __name__ == "__main__":
    main()
