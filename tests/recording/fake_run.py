"""A short run whose every number is made up: what recording is tested on, without flying or navigating."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np

import sinssim.scenario.true_motion
import sinssim.sensors
import sinssim.sensors.imu.emulation
import sinssim.strapdown.measured_attitude
from sinssim.data import ImuData, NavSolution, NavState, SingularityEvent
from sinssim.earth import WGS84
from sinssim.scenario.schema import Scenario
from sinssim.sensors.imu.emulation import digital
from sinssim.truth.sampling import Channel, FlightEvent

ALGORITHMS = ("quaternion", "poisson", "euler")


class FakeTrajectory:
    """Half a circle over the antimeridian, with arrays to compare recordings with."""

    start = 0.0
    gravity = "normal"
    ellipsoid = WGS84
    events = (FlightEvent(0.0, "begins"), FlightEvent(12.5, "turns |left|"))

    def __init__(self, count: int) -> None:
        rng = np.random.default_rng(5)
        self.time = np.arange(count + 1) / 100.0
        self.end = float(self.time[-1])
        turn = np.pi * self.time / self.end
        self.truth = NavState(
            np.radians(60.0) + 0.01 * np.sin(turn),
            (np.radians(179.9) + 0.02 * (1.0 - np.cos(turn)) + np.pi) % (2.0 * np.pi) - np.pi,
            5000.0 + 100.0 * turn,
            rng.standard_normal((count + 1, 3)) * 100.0,
            _unit(rng.standard_normal((count + 1, 4))),
        )
        ideal = ImuData(self.time, 1e-3 * rng.standard_normal((count, 3)), rng.standard_normal((count, 3)))
        self.ideal = digital(ideal)
        self.measured = ImuData(self.time, self.ideal.dtheta + 1e-7, self.ideal.dvel + 1e-5)
        self.solutions = {name: self._solution(name, 1e-6 * (i + 1)) for i, name in enumerate(ALGORITHMS)}
        knots = np.arange(0.0, self.end, 1.0 / 30.0)
        self.channels = {
            "airspeed_mps": Channel(knots, 100.0 + np.sin(knots), "m/s"),
            "wind_ned": Channel(knots, rng.standard_normal((len(knots), 3)), "m/s"),
            "fuel": Channel(np.array([0.0, 1.0]), np.array([9.0, 8.0]), "kg"),
        }

    def _solution(self, name: str, size: float) -> NavSolution:
        t, drift = self.truth, size * self.time / self.end
        events = (SingularityEvent(3.0, 3.5, 1e-4, "euler: pitch went through 90°"),) if name == "euler" else ()
        return NavSolution(
            self.time, t.latitude + drift, t.longitude - drift, t.height + 1e6 * drift, t.velocity_ned + drift[:, None],
            _unit(t.q_nb + drift[:, None]), 1e-16 * np.arange(len(drift)), name, events,
        )  # fmt: skip

    def increments(self, rate_hz: float) -> ImuData:
        return self.ideal

    def state(self, t: object) -> NavState:
        if np.ndim(t):
            return self.truth
        s = self.truth
        return NavState(s.latitude[0], s.longitude[0], s.height[0], s.velocity_ned[0], s.q_nb[0])


def _unit(rows):
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def scenario(algorithms: tuple[str, ...] = ALGORITHMS, keep: str = "all", detail: str = "light") -> Scenario:
    return Scenario.model_validate(
        {
            "name": "fake",
            "seed": 3,
            "parked": {"latitude_deg": 60.0, "duration_s": 30.0},
            "navigation": {"algorithms": algorithms},
            "recording": {"keep": keep, "detail": detail},
        }
    )


def install(count: int, replace=setattr) -> FakeTrajectory:
    """Put made-up numbers in place of flying, sensing and navigating."""
    fake = FakeTrajectory(count)
    replace(sinssim.scenario.true_motion, "fly", lambda scenario, progress=None, meanwhile=None: fake)
    replace(sinssim.sensors.imu.emulation, "emulate", lambda ideal, spec, seed=0, **_: fake.measured)
    replace(
        sinssim.strapdown.measured_attitude,
        "navigate",
        lambda imu, initial, of, **_: fake.solutions[of.algorithm],
    )
    return fake


def run_until(how: str, directory: Path, count: int) -> None:
    """Run, to be called in a process of its own, and interrupt it in the middle or limit the size of its files."""
    install(count)
    if how == "disk":
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))
    if how in ("interrupt", "kill"):

        def navigate(*_, **__):
            os.kill(os.getpid(), signal.SIGINT if how == "interrupt" else signal.SIGKILL)
            time.sleep(2.0)  # the main thread of a loaded machine takes a while to see the signal

        sinssim.strapdown.measured_attitude.navigate = navigate
    from sinssim.experiments.run.run_execution import run

    run(scenario(detail="full"), directory, overwrite=True)
