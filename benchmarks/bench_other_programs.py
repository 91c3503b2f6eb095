"""Free inertial navigation by PSINS, NaveGo and gnss-ins-sim on an hour of S-turns: largest error, samples per second.

    python -m benchmarks.bench_other_programs [--psins DIR] [--navego DIR] [--gnss-ins-sim DIR] [--hours 1] [--rate 100]

The directories are those of the programs, which are not a part of this project; PSINS and NaveGo run in GNU Octave
(octave-cli). Each program gets exact increments of the same motion on its own Earth, with its own gravity formula, so
that the error is that of its integration. The vertical channel is free. Seconds are processor time of one core, without
the reading and writing of files. sinssim runs first, on the Earth of pyins, as in bench_navigate.
"""

from __future__ import annotations

import argparse
import importlib
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, savemat

import sinssim
from benchmarks.bench_navigate import measure
from sinssim import rotation
from tests.oracles.other_gravity import EARTH
from tests.oracles.s_turn import Flight, STurn

PSINS = """
words = argv(); addpath(genpath(words{1})); global glv; glvf;
s = load(words{2}); axes = [0 1 0; 1 0 0; 0 0 -1];
imu = [s.dtheta*axes', s.dvel*axes', s.time(2:end)'];
start = [s.euler(2); s.euler(1); -s.euler(3); axes*s.velocity'; s.place'];
clock = cputime(); avp = inspure(imu, start, 'f', 0); seconds = cputime() - clock;
row = 2:2:rows(imu); place = avp(:, 7:9);
save('-v7', words{3}, 'seconds', 'row', 'place');
"""
NAVEGO = """
words = argv(); addpath(genpath(words{1})); s = load(words{2});
imu.t = s.time'; step = s.time(2) - s.time(1);
imu.wb = [s.dtheta(1, :); s.dtheta]/step; imu.fb = [s.dvel(1, :); s.dvel]/step; imu.ini_align = s.euler;
imu.gb_dyn = [0 0 0]; imu.ab_dyn = [0 0 0]; imu.gb_sta = [0 0 0]; imu.ab_sta = [0 0 0];
gnss.t = 0; gnss.vel = s.velocity; gnss.lat = s.place(1); gnss.lon = s.place(2); gnss.h = s.place(3);
gnss.zupt_th = 0; gnss.zupt_win = 0.5; gnss.eps = step/2;
clock = cputime(); nav = ins(imu, gnss, 'quaternion'); seconds = cputime() - clock;
row = 0:length(imu.t)-1; place = [nav.lat nav.lon nav.h];
save('-v7', words{3}, 'seconds', 'row', 'place');
"""


def in_octave(script: str, program: Path, flight: Flight) -> tuple[float, Any, Any]:
    """Return seconds, rows of the truth, and latitude, longitude and height that a script computed."""
    with tempfile.TemporaryDirectory() as place:
        given, made = Path(place) / "given.mat", Path(place) / "made.mat"
        (Path(place) / "navigate.m").write_text(script)
        first = [flight.latitude[0], flight.longitude[0], flight.height[0]]
        savemat(
            given,
            {
                "time": flight.time, "dtheta": flight.dtheta, "dvel": flight.dvel, "place": first,
                "velocity": flight.velocity_ned[0], "euler": np.array(rotation.euler_from_quaternion(flight.q_nb[0])),
            },
        )  # fmt: skip
        command = ["octave-cli", str(Path(place) / "navigate.m"), str(program), str(given), str(made)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        found = loadmat(made, squeeze_me=True)
    return float(found["seconds"]), found["row"].astype(int), found["place"].T


def in_gnss_ins_sim(program: Path, flight: Flight) -> tuple[float, Any, Any]:
    """Return the same three of FreeIntegration."""
    sys.path.insert(0, str(program))
    free = importlib.import_module("demo_algorithms.free_integration").FreeIntegration
    attitude = importlib.import_module("gnss_ins_sim.attitude.attitude")
    roll, pitch, heading = (float(angle) for angle in rotation.euler_from_quaternion(flight.q_nb[0]))
    angles = np.array([heading, pitch, roll])
    step = flight.time[1]
    start = np.concatenate(
        [
            [flight.latitude[0], flight.longitude[0], flight.height[0]],
            attitude.euler2dcm(angles) @ flight.velocity_ned[0],
            angles,
        ]
    )
    gyro, accel = (np.vstack([rows, rows[-1:]]) / step for rows in (flight.dtheta, flight.dvel))
    engine = free(start)
    clock = time.process_time()
    engine.run([0, 1 / step, gyro, accel])  # the rates of a row lead to the next row
    return time.process_time() - clock, np.arange(len(flight.time)), engine.pos.T


def main() -> None:
    """Print one line per program."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in EARTH:
        parser.add_argument(f"--{name}", type=Path, metavar="DIR", help="its directory")
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--rate", type=float, default=100.0, help="samples a second")
    options = parser.parse_args()
    flight = STurn(duration=3600 * options.hours).fly(options.rate)
    count = len(flight.dtheta)
    _, seconds, error = measure(flight, "quaternion", "somigliana", 3)
    print(f"{'sinssim ' + sinssim.__version__:14s} {count / seconds:12.0f} samples/s  {error:10.4g} m")
    for name, earth in EARTH.items():
        program = getattr(options, name.replace("-", "_"))
        if program is None:
            print(f"{name:14s} no directory given")
            continue
        flight = STurn(duration=3600 * options.hours, **earth).fly(options.rate)
        if name == "gnss-ins-sim":
            seconds, rows, place = in_gnss_ins_sim(program, flight)
        else:
            seconds, rows, place = in_octave(PSINS if name == "psins" else NAVEGO, program, flight)
        truth = Flight(
            flight.time[rows], flight.dtheta, flight.dvel, flight.latitude[rows], flight.longitude[rows],
            flight.height[rows], flight.velocity_ned[rows], flight.q_nb[rows],
        )  # fmt: skip
        error = float(truth.horizontal_error(place[0], place[1]).max())
        print(f"{name:14s} {count / seconds:12.0f} samples/s  {error:10.4g} m")


if __name__ == "__main__":
    main()
