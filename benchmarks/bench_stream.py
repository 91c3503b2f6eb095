"""Measures how late the packets of `sinssim stream` are.

    python -m benchmarks.bench_stream [--seconds 60] [--rate 100] [--as mavlink]

Samples of a parked vehicle go to a port of this machine that another process reads. The load of the machine is printed
with the figures, because they are those of an idle one.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import socket
from multiprocessing.connection import Connection

from sinssim.experiments.run.paced_stream import LATE_S, exchange, place_of
from sinssim.experiments.run.stream_packets import FORMS, readings_of


def receive(pipe: Connection) -> None:
    """Count packets until nothing comes for two seconds."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        pipe.send(link.getsockname()[1])
        link.recv(65536)
        count = 1
        link.settimeout(2.0)
        try:
            while link.recv(65536):
                count += 1
        except TimeoutError:
            pipe.send(count)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rate", type=float, default=100.0)
    parser.add_argument("--as", dest="form", choices=sorted(FORMS), default="mavlink")
    options = parser.parse_args()
    here, there = multiprocessing.Pipe()
    receiver = multiprocessing.Process(target=receive, args=(there,), daemon=True)
    receiver.start()
    place = place_of(f"udp://127.0.0.1:{here.recv()}", "--to", ("udp",))
    settings = [f"parked.duration_s={options.seconds}", f"imu.rate_hz={options.rate}"]
    with readings_of("parked", settings, None, None) as readings:
        load = os.getloadavg()[0]
        tally, _ = exchange(FORMS[options.form](readings, 1.0), place, None, 1.0, print)
    numbers = tally.numbers
    print(f"{options.form} at {options.rate:g} Hz for {options.seconds:g} s, load {load:.1f} on {os.cpu_count()} cores")
    print(f"packets sent {numbers['packets']}, received {here.recv()}")
    print(f"within {1e3 * LATE_S:g} ms of their time   {100.0 * numbers['within_1_ms']:.3f} %   (bar: 99 %)")
    print(
        f"lateness of 99 %, largest    {numbers['lateness_99_percent_ms']:.3f} ms, {numbers['lateness_max_ms']:.3f} ms"
    )
    print(f"lost deadlines               {numbers['lost_deadlines']}")


if __name__ == "__main__":
    main()
