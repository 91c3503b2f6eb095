"""Packets of a run at the pace of the clock, decoded by other programs, and the solutions that come back."""

from __future__ import annotations

import copy
import json
import math
import os
import re
import shutil
import signal
import socket
import struct
import sys
import threading
import time
from array import array
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.cli.commands.finished_runs import _scored_answers
from sinssim.data import ImuData, NavState
from sinssim.errors import InputError, RunError
from sinssim.experiments.run import paced_stream
from sinssim.experiments.run.paced_stream import columns_of_answers, pace_of, place_of, scored, send_at_pace
from sinssim.experiments.run.run_execution import run as run_scenario
from sinssim.experiments.run.stream_packets import (
    FORMS,
    Packet,
    Streamed,
    _accuracy,
    _e7,
    _fixes,
    _heartbeats,
    _hil_sensors,
    _int16,
    _logged,
    _measurements,
    _true_states,
    _uint16,
    _us,
    live_packets,
    streamed,
)
from sinssim.logs.recorded_streams import FixStream
from sinssim.logs.solution_score import Judge
from sinssim.logs.stored_run import STATE_COLUMNS, RecordedRun
from sinssim.scenario import filter_model
from sinssim.scenario.schema import Scenario
from sinssim.scenario.true_motion import true_motion
from sinssim.simulation.guided_passes import LiveFlight, closed_loop
from sinssim.simulation.navigator_protocol import BEGIN_TYPE
from tests.cli.test_cli import call
from tests.logs.short_run import CONTENTS
from tests.slow import slow

LOOPBACK = "127.0.0.1"
DURATION, RATE = 12.0, 50.0


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with GNSS and a barometer, and a navigator that keeps what it is sent, and answers nonsense."""
    folder = tmp_path_factory.mktemp("streamed")
    contents: dict[str, Any] = copy.deepcopy(CONTENTS)
    contents["great_circle"]["duration_s"] = DURATION
    contents["aiding"] = {"gnss": {"rate_hz": 5.0, "lever_arm_m": [0.5, 0.0, -1.5], "latency_s": 0.13}, "baro": {}}
    contents["navigation"]["algorithms"] = ["quaternion"]
    contents["recording"] = {"keep": "streams", "detail": "none"}
    tee = shutil.which("tee")
    contents["navigator"] = [{"name": "tee", "command": [tee, str(folder / "sent")], "inputs": ["imu", "baro", "gnss"]}]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SINSSIM_PROGRAMS", "allow")
        run_scenario(Scenario.model_validate(contents), folder / "run")
    return folder / "run"


@pytest.fixture
def of(place: Path) -> Streamed:
    return streamed(RecordedRun(place))


def packets(form: str, of: Streamed) -> list[Packet]:
    made = list(FORMS[form](of, 1.0))
    assert all(a.time <= b.time + 1e-6 for a, b in pairwise(made))
    return made


class Clock:
    """A clock that sleeping and sending advance; a sleep ends late by a tenth of a millisecond."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        self.now += 1e-6  # looking at it takes a microsecond
        return self.now

    def sleep(self, seconds: float) -> None:
        assert seconds > 0.0
        self.now += seconds + 1e-4


def sent_at(times: Iterable[float], pace: float, costs: dict[int, float]) -> tuple[list[float], paced_stream.Tally]:
    """Return when packets were sent, from the first one on, and the tally; some take long to send, s."""
    clock, sent = Clock(), list[float]()

    def send(data: bytes) -> bool:
        sent.append(clock.now)
        clock.now += costs.get(len(sent) - 1, 1e-5)
        return True

    made = (Packet(time, "a", b"x") for time in times)
    tally = send_at_pace(made, send, pace, clock=clock, sleep=clock.sleep)
    return [at - sent[0] for at in sent], tally


@pytest.mark.parametrize("pace", [0.5, 1.0, 4.0])
def test_packets_go_out_at_their_instants_and_no_delay_adds_up(pace: float) -> None:
    times = 5.0 + 0.01 * np.arange(500)
    sent, tally = sent_at(times.tolist(), pace, {})
    np.testing.assert_allclose(sent, (times - 5.0) / pace, rtol=0.0, atol=5e-6)
    assert tally.lost == 0
    assert max(tally.lateness) < 3e-5


def test_a_delay_loses_its_deadlines_and_the_pace_goes_on() -> None:
    """The send of the packet at 0.05 s takes 25 ms: its own deadline and the two of the next 20 ms are lost."""
    times = 0.01 * np.arange(20)
    sent, tally = sent_at(times.tolist(), 1.0, {5: 0.025})
    assert tally.lost == 3
    np.testing.assert_allclose(sent[8:], times[8:], rtol=0.0, atol=5e-6)
    assert tally.numbers["lateness_max_ms"] == pytest.approx(25.0, abs=0.05)
    assert tally.numbers["within_1_ms"] == pytest.approx(17 / 20)


def test_a_packet_later_than_the_next_instant_has_lost_its_deadline() -> None:
    """Half a millisecond is too late where the next packet follows after 0.2 ms, and in time elsewhere."""
    _, tally = sent_at([0.0, 0.01, 0.0102, 0.02], 1.0, {0: 5e-4, 1: 5e-4})
    assert tally.lost == 1


def test_the_tally_has_what_99_percent_do_not_exceed() -> None:
    """Of 0, 1 … 100 ms."""
    tally = paced_stream.Tally(1.0, Counter(a=101), lateness=array("d", [1e-3 * k for k in range(101)]), until=2.0)
    numbers = tally.numbers
    assert (numbers["lateness_99_percent_ms"], numbers["lateness_max_ms"]) == pytest.approx((99.0, 100.0))
    assert "99 % were at most 99 ms late, the latest 100 ms." in str(tally)


def test_packets_of_one_instant_have_one_deadline() -> None:
    _, tally = sent_at([0.0, 0.01, 0.01, 0.01, 0.02], 1.0, {1: 3e-4, 2: 3e-4})
    assert tally.lost == 0


def test_the_largest_pace_waits_for_nothing() -> None:
    sent, tally = sent_at([0.0, 100.0, 200.0], math.inf, {})
    assert sent[-1] < 1e-3
    assert tally.numbers["lateness_max_ms"] is None


def test_an_interruption_leaves_the_tally() -> None:
    def send(data: bytes) -> bool:
        if data == b"3":
            raise KeyboardInterrupt
        return True

    tally = send_at_pace((Packet(0.001 * k, "a", str(k).encode()) for k in range(9)), send)
    assert tally.interrupted
    assert tally.counts == {"a": 3}
    assert str(tally).startswith("3 packets (3 a) up to 0.002 s were sent.")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("udp://192.0.2.1:14550", "nothing was sent"),
        ("udp://sinssim.invalid:14550", "nothing was sent"),
        ("udp://[2001:db8::1]:5", "nothing was sent"),
        ("udp://0.0.0.0:5", "nothing was sent"),
        ("udp://127.0.0.1", "lacks a port"),
        ("udp://:5", "lacks a host"),
        ("127.0.0.1:5", "is none of udp://HOST:PORT, tcp://HOST:PORT, pty:"),
        ("http://127.0.0.1:5", "is none of"),
        ("udp://127.0.0.1:5/x", "is none of"),
        ("udp://127.0.0.1:70000", "out of range"),
    ],
)
def test_a_wrong_place_is_told_and_no_name_is_looked_up(
    text: str, words: str, place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: pytest.fail("a name was looked up"))
    assert call("stream", str(place), "--to", text, "--as", "json") == 2
    said = capsys.readouterr().err
    assert words in said
    assert len(said.splitlines()) == 1


def test_places_of_this_machine_and_of_others_if_allowed() -> None:
    for text in ("udp://127.0.0.1:5", "udp://[::1]:5", "udp://localhost:5"):
        assert str(place_of(text, "--to", ("udp",))) == text
    with pytest.raises(InputError, match="--allow-network allows other machines"):
        place_of("udp://192.0.2.1:5", "--to", ("udp",))
    assert place_of("udp://192.0.2.1:5", "--to", ("udp",), allow_network=True).host == "192.0.2.1"


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "fast"])
def test_a_wrong_pace(text: str) -> None:
    with pytest.raises(InputError, match="--pace"):
        pace_of(text)


def test_json_has_the_numbers_of_the_streams(of: Streamed) -> None:
    rows = [json.loads(packet.data) for packet in packets("json", of)]
    imu = of.run.table("imu_measured")
    sent = [row for row in rows if row["type"] == "imu"]
    for column in imu:
        np.testing.assert_array_equal([row[column] for row in sent], imu[column])
    np.testing.assert_allclose([row["interval_s"] for row in sent], 1.0 / RATE, rtol=1e-9)
    gnss = of.run.table("aiding_gnss_position")
    kept = gnss["arrival_s"] <= DURATION
    assert 0 < kept.sum() < len(kept)
    sent = [row for row in rows if row["type"] == "gnss_position"]
    for column in ("time_s", "longitude_rad", "sigma_d_m", "arrival_s"):
        np.testing.assert_array_equal([row[column] for row in sent], gnss[column][kept])
    assert "nis" not in sent[0]
    due = [packet.time for packet in packets("json", of) if packet.kind == "gnss_position"]
    np.testing.assert_array_equal(due, gnss["arrival_s"][kept])
    nav = of.run.table("nav_quaternion")
    assert rows[0]["type"] == "begin"
    assert rows[0]["longitude_rad"] == nav["longitude_rad"][0]
    assert rows[-1] == {"type": "end", "time_s": DURATION}


def test_a_lower_rate_adds_the_increments(place: Path) -> None:
    fewer = streamed(RecordedRun(place), rate_hz=20.0)
    imu = RecordedRun(place).table("imu_measured")
    assert len(fewer.imu) == 200
    np.testing.assert_allclose(np.diff(fewer.imu.time), 0.06, rtol=1e-9)
    opening, at = packets("binary", fewer)[0].data, BEGIN_TYPE.fields["imu_rate_hz"][1]  # type: ignore[index]
    assert np.frombuffer(opening, "<f8", 1, 24 + at) == pytest.approx(50.0 / 3.0)
    np.testing.assert_allclose(fewer.imu.dvel[:, 2].sum(), imu["dvel_z_mps"].sum(), rtol=1e-12)
    np.testing.assert_allclose(fewer.imu.dtheta[1], [imu[f"dtheta_{a}_rad"][3:6].sum() for a in "xyz"], rtol=1e-12)


def test_binary_is_what_a_navigator_of_the_run_was_sent(of: Streamed, place: Path) -> None:
    """The state at the start is that of the first solution, whose quaternion is normalised once more."""
    sent = b"".join(packet.data for packet in packets("binary", of))
    kept = (place.parent / "sent").read_bytes()
    state = slice(24 + 16, 24 + 16 + 80)
    np.testing.assert_allclose(np.frombuffer(sent[state]), np.frombuffer(kept[state]), rtol=4e-16, atol=1e-17)
    assert sent[: state.start] + sent[state.stop :] == kept[: state.start] + kept[state.stop :]


def test_mavlink_has_the_runs_numbers_to_the_resolution_of_its_messages(
    of: Streamed, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A ground station of another library receives and counts the messages, and decodes their numbers."""
    mavutil = pytest.importorskip("pymavlink.mavutil")
    station = mavutil.mavlink_connection(f"udpin:{LOOPBACK}:0", dialect="common")
    port = station.port.getsockname()[1]
    received: dict[str, list[Any]] = {}

    def receive() -> None:
        while (message := station.recv_match(blocking=True, timeout=2.0)) is not None:
            received.setdefault(message.get_type(), []).append(message)

    thread = threading.Thread(target=receive, daemon=True)
    thread.start()
    assert call("stream", str(place), "--to", f"udp://{LOOPBACK}:{port}", "--as", "mavlink", "--pace", "20") == 0
    thread.join(20.0)
    station.close()
    counts = {kind: len(messages) for kind, messages in received.items()}
    fixes = sum(of.run.table("aiding_gnss_position")["arrival_s"] <= DURATION)
    assert counts == {
        "HEARTBEAT": 1, "HIL_SENSOR": 600, "HIL_STATE_QUATERNION": 601, "HIL_GPS": fixes, "GPS_INPUT": fixes,
    }  # fmt: skip
    assert station.packet_loss() == 0.0
    assert sum(packet.kind == "HEARTBEAT" for packet in packets("mavlink", of)) == 13  # at the pace of the clock
    said = capsys.readouterr().out
    assert all(f"{count} {kind}" in said for kind, count in counts.items())

    def field(kind: str, name: str) -> np.ndarray:
        return np.array([getattr(message, name) for message in received[kind]], dtype=float)

    imu, single = of.run.table("imu_measured"), 1.0 / (1 << 23)
    np.testing.assert_array_equal(field("HIL_SENSOR", "time_usec"), np.round(1e6 * imu["time_s"]))
    for axis in "xyz":
        step = np.diff(np.concatenate(([0.0], imu["time_s"])))
        np.testing.assert_allclose(field("HIL_SENSOR", f"{axis}acc"), imu[f"dvel_{axis}_mps"] / step, rtol=single)
        np.testing.assert_allclose(field("HIL_SENSOR", f"{axis}gyro"), imu[f"dtheta_{axis}_rad"] / step, rtol=single)
    _check_barometer(of, field)
    _check_fixes(of, field)
    truth = of.run.table("truth")
    for name, column in (("lat", "latitude_rad"), ("lon", "longitude_rad")):
        np.testing.assert_allclose(field("HIL_STATE_QUATERNION", name), np.degrees(truth[column]) * 1e7, atol=0.51)
    np.testing.assert_allclose(field("HIL_STATE_QUATERNION", "alt"), 1e3 * truth["height_m"], atol=0.51)
    np.testing.assert_allclose(field("HIL_STATE_QUATERNION", "vx"), 1e2 * truth["velocity_n_mps"], atol=0.51)
    attitude = np.array([m.attitude_quaternion for m in received["HIL_STATE_QUATERNION"]])
    np.testing.assert_allclose(attitude[:, 1], truth["q_nb_x"], rtol=single, atol=1e-12)
    # along a great circle at a constant height it climbs over the curved Earth by v/R alone, nose down
    np.testing.assert_allclose(field("HIL_STATE_QUATERNION", "pitchspeed")[5:], -100.0 / 6.37e6, rtol=0.01)
    assert np.abs(field("HIL_STATE_QUATERNION", "zacc")).max() <= 1.0  # v²/R is 0.16 mG


def test_the_true_acceleration_is_in_thousandths_of_gravity(of: Streamed) -> None:
    """A level flight whose downward velocity grows by 9.80665 m/s each second."""
    level = of.content.motion
    motion = replace(level, velocity_ned=np.outer(level.time, [0.0, 0.0, 9.80665]))
    falling: Any = SimpleNamespace(content=SimpleNamespace(motion=motion), run=of.run)
    link = SimpleNamespace(hil_state_quaternion_encode=lambda *fields: fields)
    accelerations = np.array([fields[-3:] for _, fields in _true_states(link, falling)])
    np.testing.assert_allclose(accelerations[:, 2], 1000.0, atol=1.0)
    assert np.abs(accelerations[:, :2]).max() <= 10.0


def _check_barometer(of: Streamed, field: Any) -> None:
    """The pressure is that of ICAO's troposphere; only a sample with a new reading says that it is one."""
    baro = of.run.table("aiding_baro")
    new = field("HIL_SENSOR", "fields_updated").astype(int) & (1 << 9 | 1 << 11 | 1 << 12) != 0
    assert set(field("HIL_SENSOR", "fields_updated")) == {0x3F, 0x3F | 1 << 9 | 1 << 11 | 1 << 12}
    latest = baro["height_m"][np.searchsorted(baro["arrival_s"], of.imu.time[1:][new] + 1e-6) - 1]
    np.testing.assert_allclose(field("HIL_SENSOR", "pressure_alt")[new], latest, rtol=1e-6)
    geopotential = 6356766.0 * latest / (6356766.0 + latest)
    pressure = 1013.25 * (1.0 - 0.0065 * geopotential / 288.15) ** 5.255880
    np.testing.assert_allclose(field("HIL_SENSOR", "abs_pressure")[new], pressure, rtol=1e-6)
    np.testing.assert_allclose(field("HIL_SENSOR", "temperature")[new], 15.0 - 0.0065 * geopotential, rtol=1e-5)


def _check_fixes(of: Streamed, field: Any) -> None:
    """Positions are to 1e-7 deg and mm; the time of week is that of 2026-01-01, a Thursday, with 18 leap seconds."""
    gnss, moving = of.run.table("aiding_gnss_position"), of.run.table("aiding_gnss_velocity")
    rows = gnss["arrival_s"] <= DURATION
    longitude = np.degrees(gnss["longitude_rad"][rows])
    for kind in ("HIL_GPS", "GPS_INPUT"):
        np.testing.assert_allclose(field(kind, "lat"), np.degrees(gnss["latitude_rad"][rows]) * 1e7, atol=0.51)
        np.testing.assert_allclose(field(kind, "lon"), ((longitude + 180.0) % 360.0 - 180.0) * 1e7, atol=0.51)
        np.testing.assert_array_equal(field(kind, "time_usec"), np.round(1e6 * gnss["time_s"][rows]))
    north, east = (moving[f"velocity_{axis}_mps"][rows] for axis in "ne")
    np.testing.assert_allclose(field("HIL_GPS", "alt"), 1e3 * gnss["height_m"][rows], atol=0.51)
    np.testing.assert_allclose(field("HIL_GPS", "vn"), 1e2 * north, atol=0.51)
    np.testing.assert_allclose(field("HIL_GPS", "vel"), 1e2 * np.hypot(north, east), atol=0.51)
    np.testing.assert_allclose(field("HIL_GPS", "cog"), 1e2 * np.degrees(np.arctan2(east, north)), atol=0.51)
    np.testing.assert_allclose(field("HIL_GPS", "epv"), 1e2 * gnss["sigma_d_m"][rows], atol=0.51)
    np.testing.assert_allclose(field("GPS_INPUT", "alt"), gnss["height_m"][rows], rtol=1e-6)
    np.testing.assert_allclose(field("GPS_INPUT", "ve"), east, rtol=1e-6)
    np.testing.assert_allclose(field("GPS_INPUT", "vert_accuracy"), gnss["sigma_d_m"][rows], rtol=1e-6)
    assert set(field("GPS_INPUT", "ignore_flags")) == {2 | 4}
    assert set(field("GPS_INPUT", "time_week")) == {2399.0}
    ms = 4 * 86_400_000 + 18_000 + 1e3 * gnss["time_s"][rows]
    np.testing.assert_allclose(field("GPS_INPUT", "time_week_ms"), ms, atol=0.51)


def test_without_the_library_the_extra_is_named(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "pymavlink.dialects.v20", None)
    monkeypatch.setitem(sys.modules, "pymavlink", None)
    assert call("stream", str(place), "--to", f"udp://{LOOPBACK}:9", "--as", "mavlink", "--pace", "max") == 2
    assert "pip install 'sinssim[stream]'" in capsys.readouterr().err


def test_a_terminal_has_sentences_that_another_library_reads(
    place: Path, of: Streamed, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    reader = pytest.importorskip("pynmeagps").NMEAReader
    read = bytearray()

    class Reader(threading.Thread):
        def run(self) -> None:
            link = os.open(self.name, os.O_RDONLY | os.O_NOCTTY)
            while read.count(b"\n") < lines:
                read.extend(os.read(link, 4096))
            os.close(link)

    lines = 2 * sum(of.run.table("aiding_gnss_position")["arrival_s"] <= DURATION)
    threads = []

    def opened(device: str) -> None:
        threads.append(Reader(name=device, daemon=True))
        threads[0].start()

    tally, _ = paced_stream.exchange(FORMS["nmea"](of, 100.0), place_of("pty:", "--to", ("pty",)), None, 100.0, opened)
    threads[0].join(10.0)
    assert tally.refused == 0
    message = reader.parse(bytes(read).splitlines()[0])
    gnss = of.run.table("aiding_gnss_position")
    assert message.lat == pytest.approx(math.degrees(gnss["latitude_rad"][0]), abs=1e-9)
    assert message.msgID == "GGA"
    assert call("stream", str(place), "--to", "pty:", "--as", "nmea", "--pace", "max") == 0
    assert re.search(r"^Terminal: /dev/\S+$", capsys.readouterr().out, re.MULTILINE)


def test_a_connection_gets_everything_and_its_end_is_told(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server((LOOPBACK, 0)) as server:
        port = server.getsockname()[1]
        received = bytearray()

        def take(most: float) -> None:
            link, _ = server.accept()
            with link:
                while len(received) < most and (data := link.recv(1 << 16)):
                    received.extend(data)

        for most, code, pace in ((math.inf, 0, "100"), (1000, 1, "10")):  # in a second it learns of the end
            received.clear()
            thread = threading.Thread(target=take, args=(most,), daemon=True)
            thread.start()
            to = f"tcp://{LOOPBACK}:{port}"
            assert call("stream", str(place), "--to", to, "--as", "binary", "--pace", pace) == code
            thread.join(10.0)
            if not code:
                assert len(received) == len((place.parent / "sent").read_bytes())
    assert "the connection failed" in capsys.readouterr().err
    assert call("stream", str(place), "--to", to, "--as", "binary") == 1
    assert "does not take a connection" in capsys.readouterr().err


def test_a_navigators_answers_are_scored(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A navigator that answers the truth one microradian to the north is 6.36 m off, the meridian's radius there."""
    truth = RecordedRun(place).table("truth")
    navigator = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    navigator.bind((LOOPBACK, 0))
    navigator.settimeout(20.0)

    def navigate() -> None:
        count = 0
        while True:
            data, sender = navigator.recvfrom(65536)
            message = json.loads(data)
            if message["type"] == "end":
                break
            if message["type"] == "imu":
                count += 1
                if count % 50 == 0:
                    row = {column: float(values[count]) for column, values in truth.items()}
                    row["latitude_rad"] += 1e-6
                    navigator.sendto(json.dumps(row).encode(), sender)
        navigator.sendto(b"garbage", sender)

    thread = threading.Thread(target=navigate, daemon=True)
    thread.start()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind((LOOPBACK, 0))
        port = free.getsockname()[1]
    to, listen = f"udp://{LOOPBACK}:{navigator.getsockname()[1]}", f"udp://{LOOPBACK}:{port}"
    assert call("stream", str(place), "--to", to, "--as", "json", "--pace", "20", "--listen", listen, "--json") == 0
    thread.join(20.0)
    navigator.close()
    answers = json.loads(capsys.readouterr().out)["answers"]
    assert answers["rows"] == 12
    assert answers["left_out"] == 1
    assert answers["errors"]["rms_horizontal_error_m"] == pytest.approx(6.358, abs=0.005)
    assert answers["errors"]["max_attitude_error_arcsec"] < 1e-6


@pytest.mark.parametrize("back", [True, *slow(False)])
def test_answers_come_by_a_connection(place: Path, back: bool, capsys: pytest.CaptureFixture[str]) -> None:
    """By that of the packets in the binary protocol, or by one of its own in lines of JSON: 2e-6 rad of latitude
    are 12.72 m."""
    truth = RecordedRun(place).table("truth")
    navigator, other = socket.create_server((LOOPBACK, 0)), socket.create_server((LOOPBACK, 0))
    port = other.getsockname()[1]
    other.close()
    to = f"tcp://{LOOPBACK}:{navigator.getsockname()[1]}"

    def navigate() -> None:
        rows = [{column: float(values[k]) for column, values in truth.items()} for k in range(50, 601, 50)]
        with navigator.accept()[0] as link, link if back else socket.create_connection((LOOPBACK, port)) as answer:
            if back:
                answer.sendall(b"SINSSIM\0" + struct.pack("<II", 1, 0))
            for row in rows:
                row["latitude_rad"] += 2e-6
                line = json.dumps(row).encode() + b"\n"
                data = struct.pack(f"<HHI{len(row)}d", 6, 0, 8 * len(row), *row.values()) if back else line
                for part in (data[:7], data[7:]):  # as they may come
                    link.recv(1024)
                    answer.sendall(part)
            while link.recv(65536):
                pass

    thread = threading.Thread(target=navigate, daemon=True)
    thread.start()
    listen = to if back else f"tcp://{LOOPBACK}:{port}"
    assert call("stream", str(place), "--to", to, "--as", "json", "--pace", "20", "--listen", listen, "--json") == 0
    thread.join(20.0)
    navigator.close()
    answers = json.loads(capsys.readouterr().out)["answers"]
    assert (answers["rows"], answers["left_out"]) == (12, 0)
    assert answers["errors"]["rms_horizontal_error_m"] == pytest.approx(12.716, abs=0.01)


def test_binary_answers(of: Streamed) -> None:
    """Solutions of the protocol count once, in the order of their times, whatever the order of the datagrams."""
    truth = of.run.table("truth")

    def message(row: int, stated: bool) -> bytes:
        state = [float(values[row]) for values in truth.values()]
        numbers = [*state, *(0.1 * k for k in range(1, 10)), *([0.0] * 7)] if stated else state
        return struct.pack(f"<HHI{len(numbers)}d", 6, 0, 8 * len(numbers), *numbers)

    header = b"SINSSIM\0" + struct.pack("<II", 1, 0)
    answers = [header + message(0, True) + message(100, True), message(300, True), message(200, True),
               message(200, True), b"\x06", message(5, True)[:-1], b"x" * 96]  # fmt: skip
    columns, faults = columns_of_answers(answers)
    assert columns["time_s"] == [0.0, 2.0, 4.0, 6.0]
    assert columns["sigma_vd_mps"] == pytest.approx([0.6] * 4)
    assert len(faults) == 3
    result, _ = scored(Judge(of.run, of.content.start_gps_s), answers)
    assert result.numbers["answers"]["max_horizontal_error_m"] == pytest.approx(0.0, abs=1e-6)
    assert scored(Judge(of.run, of.content.start_gps_s), [message(5, False), message(105, False)])[1] == []
    with pytest.raises(RunError, match="two solutions are needed"):
        scored(Judge(of.run, of.content.start_gps_s), [message(5, False)])


def test_ctrl_c_ends_it_and_tells_what_was_sent(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind((LOOPBACK, 0))
        receiver.settimeout(60.0)
        begins = []

        def interrupt() -> None:
            for _ in range(3):
                receiver.recv(65536)
            begins.append(time.monotonic())
            signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)

        thread = threading.Thread(target=interrupt)
        thread.start()
        to = f"udp://{LOOPBACK}:{receiver.getsockname()[1]}"
        assert call("stream", str(place), "--to", to, "--as", "json", "--pace", "0.5") == 130
        thread.join()
    assert time.monotonic() - begins[0] < 10.0  # of 12 s
    said = capsys.readouterr()
    assert "packets (1 begin, " in said.out
    assert said.err.endswith("Interrupted. The rest was not sent.\n")


def test_a_scenario_is_computed_first(capsys: pytest.CaptureFixture[str]) -> None:
    settings = ("--set", "parked.duration_s=5", "--set", "imu.rate_hz=10", "--set", 'navigation.algorithms=["euler"]')
    to = ("--to", f"udp://{LOOPBACK}:9", "--as", "json", "--pace", "max", "--json")
    assert call("stream", "parked", *to, *settings) == 0
    assert json.loads(capsys.readouterr().out)["by_kind"] == Counter(begin=1, imu=50, end=1)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("one_component",), "one component"),
        (("RUN", "--set", "seed=3"), "computed already"),
        (("RUN", "--rate", "-2"), "--rate -2: the rate of samples must be positive, in hertz."),
        (("RUN", "--listen", "pty:"), "is none of udp://HOST:PORT, tcp://HOST:PORT"),
        (("RUN", "--start", "soon"), "'soon' is not a date"),
    ],
)
def test_wrong_arguments(
    arguments: tuple[str, ...], words: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [str(place) if word == "RUN" else word for word in arguments]
    assert call("stream", *given, "--to", f"udp://{LOOPBACK}:9", "--as", "json") == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (b'{"latitude_rad": 0.8}', "an answer, {\"latitude_rad\": 0.8}, is no JSON object with time_s."),
        (b'{"time_s": 1.0, "height_m": NaN}', "an answer, {\"time_s\": 1.0, \"height_m\": NaN}, is not finite."),
        (b'{"time_s": true}', "an answer, {\"time_s\": true}, is not finite."),
        (struct.pack("<HHI11d", 6, 0, 88, *[math.nan] * 11), "an answer is not finite."),
        (struct.pack("<HHI10d", 6, 0, 88, *[0.0] * 10), "an answer ends after 88 of 96 bytes."),
        (b"\x06\0\0\0", "an answer ends after 4 of 8 bytes."),
        (struct.pack("<HHI10d", 6, 0, 80, *[0.0] * 10), "it answers with a message of kind 6 and 80 bytes; a solution "
                                                        "has kind 6 and 88 or 216 bytes."),
        (b"GARBAGE", "an answer, 'GARBAGE', is neither a solution of the protocol nor JSON."),
    ],
)  # fmt: skip
def test_why_an_answer_is_left_out(answer: bytes, words: str) -> None:
    assert columns_of_answers([answer]) == ({}, [words])


def test_places_that_cannot_be_used(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind((LOOPBACK, 0))
        here = paced_stream.Place("udp", LOOPBACK, taken.getsockname()[1])
        with pytest.raises(InputError, match=rf"--listen {here}: Address already in use; another program may use it\."):
            paced_stream.Listener(here, paced_stream.Place("udp", LOOPBACK, 9))

    def unknown(*_: Any, **__: Any) -> None:
        raise socket.gaierror(-2, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    with pytest.raises(InputError, match=r"udp://a\.invalid:5: the host a\.invalid is not known \(Name or service"):
        paced_stream._address(paced_stream.Place("udp", "a.invalid", 5), socket.SOCK_DGRAM)


def test_answers_that_cannot_be_used_are_counted(of: Streamed, capsys: pytest.CaptureFixture[str]) -> None:
    truth = of.run.table("truth")
    rows = [json.dumps({name: float(values[k]) for name, values in truth.items()}).encode() for k in (0, 50, 100)]
    numbers = _scored_answers(of, [b"garbage", *rows, b"{}"], quiet=False)
    assert numbers["left_out"] == 2
    assert numbers["rows"] == 3
    assert scored(Judge(of.run, of.content.start_gps_s), rows)[0].scores[0].path == Path("3 answers")
    why = "an answer, 'garbage', is neither a solution of the protocol nor JSON."
    assert capsys.readouterr().out.endswith(f"2 answers could not be used; the first: {why}\n")


def test_what_cannot_be_streamed(of: Streamed) -> None:
    with pytest.raises(InputError, match=r"has no inertial sample of 1/0\.05 s\."):
        streamed(of.run, rate_hz=0.05)
    empty: Any = SimpleNamespace(algorithms=(), path="runs/none")
    with pytest.raises(InputError, match=r"^runs/none has no solution, whose start a navigator could begin with\.$"):
        _ = replace(of, content=SimpleNamespace(run=empty)).start  # type: ignore[arg-type]


def test_what_the_flight_has_logged_at_an_instant() -> None:
    tables = {
        "flight": {"time_s": np.zeros(1)},
        "flight_air": {"time_s": np.array([0.0, 2.0]), "k": np.array([5.0, 9.0])},
    }
    run = SimpleNamespace(streams=lambda name: ["", "_air"], table=tables.__getitem__)
    of: Any = SimpleNamespace(run=run)
    assert _logged(of, "k", np.array([0.5])) == pytest.approx([6.0])
    assert _logged(of, "other", np.array([0.5])) is None


def test_the_whole_numbers_of_mavlink() -> None:
    """They stay within their fields; what is not known is 65535."""
    assert [_int16(v) for v in (1.6, -1.6, 4e4, -4e4)] == [2, -2, 32767, -32768]
    assert [_uint16(v) for v in (1.6, -1.6, 7e4)] == [2, 0, 65534]
    assert [_accuracy(v) for v in (1.234, 1e-4, 0.0, 1e4)] == [123, 1, 65535, 65534]
    assert [_e7(math.radians(v)) for v in (45.5, 359.0, 180.0)] == [455_000_000, -10_000_000, -1_800_000_000]
    assert _us(1.2345678) == 1_234_568


def test_the_temperature_that_a_flight_has_logged(of: Streamed) -> None:
    """Kelvin that rise by one a second, at the end of the sample with a new reading of the barometer."""
    common = pytest.importorskip("pymavlink.dialects.v20.common")
    time = of.imu.time
    baro = {"arrival_s": time[[50, 100]], "height_m": np.array([100.0, 200.0])}
    tables = {"flight": {"time_s": time, "static_temperature_k": 300.0 + time}}
    run = SimpleNamespace(streams=lambda name: [""], table=tables.__getitem__)
    flown: Any = SimpleNamespace(imu=of.imu, sensors=["baro"], readings=lambda name: baro, run=run)
    link = SimpleNamespace(hil_sensor_encode=lambda *fields: fields)
    sent = [fields for _, fields in _hil_sensors(link, common, flown)]
    updated = [(fields[0], fields[13]) for fields in sent if fields[14] != 0x3F]
    assert updated == [(1_000_000, pytest.approx(301.0 - 273.15)), (2_000_000, pytest.approx(302.0 - 273.15))]


def test_the_numbers_of_a_tally() -> None:
    tally = paced_stream.Tally(
        2.0, Counter(a=3, b=1), 640, 2, array("d", [0.0005, 0.002]), 1, until=12.5, interrupted=True
    )
    assert tally.numbers == {
        "packets": 4, "by_kind": {"a": 3, "b": 1}, "bytes": 640, "refused": 2, "until_s": 12.5, "pace": 2.0,
        "lost_deadlines": 1, "within_1_ms": 0.5, "lateness_99_percent_ms": pytest.approx(1.985), "lateness_max_ms": 2.0,
        "interrupted": True,
    }  # fmt: skip
    assert str(tally) == (
        "4 packets (3 a, 1 b) up to 12.5 s were sent. 2 of them were not taken, because nobody had read those before. "
        "99 % were at most 2 ms late, the latest 2 ms. Deadlines lost, by more than 1 ms or the time until the next "
        "packet: 1."
    )
    nothing = paced_stream.Tally(math.inf)
    assert str(nothing) == "Nothing was sent."
    assert (nothing.numbers["pace"], nothing.numbers["until_s"], nothing.numbers["within_1_ms"]) == ("max", None, None)


def steered(east_m: float) -> Scenario:
    """Return a flight of half a minute to the north, whose navigator starts east of its place."""
    start = {"on": "air", "latitude_deg": 0.0, "longitude_deg": 10.0, "altitude_m": 5000.0}
    leg = {"type": "waypoint", "latitude_deg": 0.04, "longitude_deg": 10.0, "capture_radius_m": 100.0}
    return Scenario.model_validate(
        {
            "name": "north", "flight": {"aircraft": "737", "start": start, "legs": [leg]},
            "imu": {"grade": "ideal", "rate_hz": 50.0},
            "navigation": {"algorithms": ["quaternion"], "vertical": "free", "initial_error": {"east_m": east_m}},
            "aiding": {"gnss": {"rate_hz": 1.0, "latency_s": 0.3}}, "filter": {},
        }
    )  # fmt: skip


def navigating(link: socket.socket, samples: list[tuple[float, ...]], kinds: list[int]) -> None:
    """Integrate what comes, and answer every fifth sample of a second."""
    taken, _ = link.accept()
    with taken, taken.makefile("rb") as file:
        file.read(16)
        taken.sendall(struct.pack("<8sII", b"SINSSIM\0", 1, 0))
        new: list[tuple[float, ...]] = []
        while kinds[-1:] != [5]:
            kind, _, size = struct.unpack("<HHI", file.read(8))
            data = file.read(size)
            kinds.append(kind)
            if kind == 1:
                x = np.array(struct.unpack_from("<12d", data)[1:])
                state, time_s = NavState(x[1], x[2], x[3], x[4:7], x[7:11]), float(x[0])
            if kind == 3:
                new.append(struct.unpack("<8d", data))
            if len(new) == 10:
                a = np.array(new)
                samples += new
                new = []
                s = sinssim.navigate(ImuData(np.append(time_s, a[:, 0]), a[:, 2:5], a[:, 5:8]), state, vertical="free")
                time_s, state = float(s.time[-1]), s.state()
                row = (time_s, state.latitude, state.longitude, state.height, *state.velocity_ned, *state.q_nb)
                taken.sendall(struct.pack("<HHI11d", 6, 0, 88, *map(float, row)))


def test_the_answers_guide_the_flight_while_it_is_flown() -> None:
    """A navigator that believes to be 200 m east of its place passes the waypoint 200 m west of it, less what the
    autopilot has not yet corrected after 24 s; as in the flight that is repeated until it settles.

    What was sent while it flew is what the sensors read along the whole flight: GNSS at 1 Hz, position and velocity,
    0.3 s late.
    """
    samples: list[tuple[float, ...]] = []
    kinds: list[int] = []
    with socket.socket() as link:
        link.bind((LOOPBACK, 0))
        link.listen()
        navigator = threading.Thread(target=navigating, args=(link, samples, kinds))
        navigator.start()
        to = place_of(f"tcp://{LOOPBACK}:{link.getsockname()[1]}", "--to", ("tcp",))
        with LiveFlight(filter_model.with_states(steered(200.0))) as flight:
            tally, _ = paced_stream.exchange(partial(live_packets, flight, None, False), to, to, math.inf, print)
        navigator.join()
    path = true_motion(flight.scenario, errors=flight.log)
    end = path.state(path.end)
    east = 6378137.0 * (float(end.longitude) - math.radians(10.0))
    assert -200.0 < east < -170.0
    contents = flight.scenario.contents()
    contents["flight"]["guidance"] = {"source": "quaternion"}
    settled, _ = closed_loop(Scenario.model_validate(contents))
    off = path.state(20.0).longitude - settled.state(20.0).longitude
    assert abs(6378137.0 * float(off)) < 15.0  # the first answer comes after 1.5 s
    assert tally.counts["imu"] == int(50.0 * path.end)
    assert kinds.count(4) == 2 * math.floor(path.end - 0.3)
    sent, ideal = np.array(samples), path.increments(50.0)
    assert np.abs(sent[:, 2:5] - ideal.dtheta[: len(sent)]).max() < 1e-9
    assert np.abs(sent[:, 5:8] - ideal.dvel[: len(sent)]).max() < 1e-7
    run = run_scenario(flight.scenario, flown=flight.log)
    assert run.truth.time[-1] == pytest.approx(path.end, abs=0.02)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["first_flight", "--as", "binary"], "give --listen"),
        (["first_flight", "--as", "json", "--listen", "udp://127.0.0.1:9"], "give --as binary"),
        (["parked", "--as", "binary", "--listen", "udp://127.0.0.1:9"], "needs a [flight]"),
        (["spoofed_airliner", "--as", "binary", "--listen", "udp://127.0.0.1:9"], 'guidance.source = "truth"'),
        (["oceanic_crossing_aligned", "--as", "binary", "--listen", "udp://127.0.0.1:9", "--set",
          "flight.guidance.source=truth"], "remove [navigation.alignment]"),
    ],
)  # fmt: skip
def test_what_answers_cannot_guide_is_refused(
    arguments: list[str], message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert call("stream", *arguments, "--to", "udp://127.0.0.1:9", "--guide") == 2
    assert message in " ".join(capfd.readouterr().err.split())


def test_sigmas_that_are_not_all_known_are_left_out() -> None:
    numbers = [1.0, *range(2, 12), *[0.5] * 4, math.nan, *[0.0] * 11]
    columns, faults = columns_of_answers([struct.pack("<HHI27d", 6, 0, 216, *numbers)])
    assert faults == []
    assert list(columns) == ["time_s", *STATE_COLUMNS]
    assert [values[0] for values in columns.values()] == [float(k) for k in range(1, 12)]


def fixes_of(first: float = 0.0, **more: Any) -> list[tuple[float, tuple[Any, ...]]]:
    """Return the fields of both messages of a fix at 2.5 s that arrives at 3 s, at 46° N, 170° W and 1234.5 m.

    Time 0 of the run is a quarter of a second before the GPS week 2400.
    """
    common = pytest.importorskip("pymavlink.dialects.v20.common")
    fix = FixStream(np.array([2.5]), np.radians([46.0]), np.radians([190.0]), np.array([1234.5]), **more)
    of: Any = SimpleNamespace(
        fixes=lambda name: (np.array([3.0]), fix), imu=SimpleNamespace(time=np.array([first])),
        content=SimpleNamespace(start_gps_s=2400 * 604_800 - 0.25),
    )  # fmt: skip
    link = SimpleNamespace(hil_gps_encode=lambda *fields: fields, gps_input_encode=lambda *fields: fields)
    return list(_fixes(link, common, of, "gnss", 1))


def test_every_field_of_a_fix() -> None:
    """3 m/s north, 4 m/s west: 5 m/s on a course of 306.87°; 1σ of 3, 4 and 7 m are 5 m across."""
    velocity, speed = np.array([[3.0, -4.0, 0.5]]), np.array([[0.1, 0.2, 0.2]])
    (due, hil), (also, gps) = fixes_of(
        position_sigma=np.array([[3.0, 4.0, 7.0]]), velocity_ned=velocity, velocity_sigma=speed
    )
    assert due == also == 3.0
    assert hil == (2_500_000, 3, 460_000_000, -1_700_000_000, 1_234_500, 500, 700, 500, 300, -400, 50, 30_687, 255, 1)
    assert gps == (2_500_000, 1, 2 | 4, 2250, 2400, 3, 460_000_000, -1_700_000_000, 1234.5, 0.0, 0.0, 3.0, -4.0, 0.5,
                   pytest.approx(0.3), 5.0, 7.0, 255)  # fmt: skip


def test_what_a_fix_does_not_tell() -> None:
    """The flags of GPS_INPUT ignore velocity north and east, down, and the accuracies of speed and place: 8 … 128."""
    (_, hil), (_, gps) = fixes_of()
    assert hil[5:] == (65535, 65535, 65535, 0, 0, 0, 65535, 255, 1)
    assert gps[2] == 2 | 4 | 8 | 16 | 32 | 64 | 128
    assert gps[11:] == (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 255)


def test_each_accuracy_of_a_fix_that_is_not_known_is_ignored() -> None:
    """Without 1σ of the height 128 is ignored, without those of the place 64, without that of the speed 32."""
    known = np.ones((1, 3))
    for sigma, speed, flags in (([3.0, 4.0, math.nan], known, 128), ([math.nan, math.nan, 7.0], known, 64),
                                ([3.0, 4.0, 7.0], math.nan * known, 32)):  # fmt: skip
        (_, gps) = fixes_of(position_sigma=np.array([sigma]), velocity_ned=known, velocity_sigma=speed)[1]
        assert gps[2] == 2 | 4 | flags


def test_a_fix_that_arrives_before_the_first_sample_goes_out_with_it() -> None:
    assert [due for due, _ in fixes_of(4.5)] == [4.5, 4.5]


@pytest.mark.parametrize(
    ("name", "columns", "kind", "arm"),
    [
        ("gnss_position", ("latitude_rad", "longitude_rad", "height_m"), "gnss-position", [0.5, 0.0, -1.5]),
        ("gnss_2_velocity", ("velocity_n_mps", "velocity_e_mps", "velocity_d_mps"), "gnss-velocity", [7.0, 8.0, 9.0]),
        ("baro", ("height_m",), "baro-height", [0.0, 0.0, 0.0]),
        ("gnss_2_position", ("latitude_rad", "longitude_rad", "height_m"), "gnss-position", [7.0, 8.0, 9.0]),
        ("dual_antenna", ("heading_rad",), "baseline-heading", [2.0, 0.5, 0.0]),
    ],
)
def test_readings_as_the_protocol_has_them(name: str, columns: tuple[str, ...], kind: str, arm: list[float]) -> None:
    """A second receiver has its own lever arm, and the kind of the first one."""
    sigmas = tuple(f"sigma_{k}" for k in range(len(columns)))
    heads = ("time_s", *columns, *sigmas, "arrival_s")
    table = {head: np.array([10.0 * k, 10.0 * k + 1.0]) for k, head in enumerate(heads)}
    sections = {"gnss": {"lever_arm_m": [0.5, 0.0, -1.5]}, "gnss_2": {"lever_arm_m": [7.0, 8.0, 9.0]}, "baro": {},
                "dual_antenna": {"lever_arm_m": [1.0, 1.0, 1.0], "baseline_m": [2.0, 0.5, 0.0]}}  # fmt: skip
    run = SimpleNamespace(scenario={"aiding": sections}, of_log=False)
    of: Any = SimpleNamespace(readings=lambda name: table, run=run)
    m = _measurements(of, name)
    assert (m.kind, m.label, m.lever_arm.tolist()) == (kind, name.replace("_", "-"), arm)
    count = len(columns)
    assert m.value.tolist() == [[10.0 * k + r for k in range(1, count + 1)] for r in (0, 1)]
    assert m.sigma.tolist() == [[10.0 * k + r for k in range(count + 1, 2 * count + 1)] for r in (0, 1)]
    assert (m.time.tolist(), m.arrival.tolist()) == ([0.0, 1.0], [20.0 * count + 10.0, 20.0 * count + 11.0])


def test_when_messages_of_the_protocol_go_out(of: Streamed) -> None:
    """Each sample at its end, with what follows it."""
    first, *samples, last = packets("binary", of)
    assert (first.kind, first.time, last.kind, last.time) == ("begin", 0.0, "end", DURATION)
    assert {packet.kind for packet in samples} == {"imu"}
    np.testing.assert_array_equal([packet.time for packet in samples], of.run.table("imu_measured")["time_s"])


def test_when_sentences_go_out(of: Streamed) -> None:
    """Two for each fix, when it arrives: 0.13 s after its instant, 5 a second."""
    sent = packets("nmea", of)
    gnss = of.run.table("aiding_gnss_position")
    arrival = gnss["arrival_s"][gnss["arrival_s"] <= DURATION]
    np.testing.assert_allclose(arrival[:2], [0.33, 0.53], atol=1e-9)
    np.testing.assert_allclose([packet.time for packet in sent], arrival, atol=1e-9)
    assert [line[3:6] for line in sent[0].data.splitlines()] == [b"GGA", b"RMC"]


def test_what_a_heartbeat_says() -> None:
    """A generic system (0) without an autopilot (8), in a simulation (32), active (4); once a second."""
    common = pytest.importorskip("pymavlink.dialects.v20.common")
    link = SimpleNamespace(heartbeat_encode=lambda *fields: fields)
    of: Any = SimpleNamespace(imu=SimpleNamespace(time=np.array([5.0])), end=7.0)
    assert list(_heartbeats(link, common, of, 1.0)) == [(at, (0, 8, 32, 0, 4)) for at in (5.0, 6.0, 7.0)]


def answered(instant: float, *, stated: bool = False) -> bytes:
    """Return a solution of the protocol, of 96 bytes, or of 224 with what else it states."""
    numbers = [instant, *range(1, 11), *([0.5] * 16 if stated else [])]
    return struct.pack(f"<HHI{len(numbers)}d", 6, 0, 8 * len(numbers), *numbers)


HEAD = b"SINSSIM\0" + struct.pack("<II", 1, 0)


@pytest.mark.parametrize(
    ("heard", "before", "end"),
    [
        (b'{"a": 1}\n{"b": 2}\n{"c', 9, 18), (b'{"a": 1}', 0, 0),
        (HEAD, 0, 0), (HEAD[:9], 0, 0), (HEAD + answered(1.0)[:95], 0, 16), (HEAD + answered(1.0), 0, 112),
        (HEAD + answered(1.0) + answered(2.0, stated=True) + answered(3.0)[:7], 112, 336), (answered(1.0), 0, 96),
        (answered(1.0) + b"GARBAGE?", 0, 96),
    ],
)  # fmt: skip
def test_where_the_last_whole_answer_ends(heard: bytes, before: int, end: int) -> None:
    """A solution has 8 bytes of head and 11 or 27 numbers; the header has 16 bytes."""
    assert paced_stream._whole(bytearray(heard), before) == end


def heard_by(scheme: str, *heard: bytes) -> Any:
    """Return a listener that has heard something, without a socket."""
    listener = paced_stream.Listener.__new__(paced_stream.Listener)
    vars(listener).update(place=paced_stream.Place(scheme, LOOPBACK, 9), _heard=[bytearray(h) for h in heard],
                          _used=Counter(), last=0.0)  # fmt: skip
    return listener


def test_what_is_fresh_of_connections_and_datagrams() -> None:
    """Each whole answer once; what has come in part comes when it is whole."""
    one, two = answered(1.0), answered(2.0)
    listener = heard_by("tcp", HEAD + one + two[:50], b'{"a": 1}\n\n{"b')
    assert listener.fresh() == [HEAD + one, b'{"a": 1}']
    assert listener.fresh() == []
    listener._heard[0] += two[50:] + one
    listener._heard[1] += b'": 2}\n'
    assert listener.fresh() == [two + one, b'{"b": 2}']
    assert listener.answers == [HEAD + one + two + one, b'{"a": 1}', b'{"b": 2}']
    datagrams = heard_by("udp", b"a", b"b")
    assert datagrams.fresh() == [b"a", b"b"]
    datagrams._heard.append(bytearray(b"c"))
    assert datagrams.fresh() == [b"c"]
    assert datagrams.fresh() == []
    assert datagrams.answers == [b"a", b"b", b"c"]


def test_the_last_solution_is_not_of_the_future() -> None:
    """Of 2 s, then of 3 s, which is not known before samples until then were sent; an older one changes nothing."""
    listener = heard_by("udp", answered(2.0))
    last = paced_stream.LastSolution(listener, paced=True)
    found = last(2.5)
    assert found is not None
    assert found.time.tolist() == [2.0]
    assert (found.latitude.tolist(), found.longitude.tolist(), found.height.tolist()) == ([1.0], [2.0], [3.0])
    assert (found.velocity_ned.tolist(), found.q_nb.tolist()) == ([[4.0, 5.0, 6.0]], [[7.0, 8.0, 9.0, 10.0]])
    listener._heard += [bytearray(answered(3.0)), bytearray(answered(1.0)), bytearray(b'{"time_s": 9, "height_m": 1}')]
    assert last(2.5) is None
    later = last(3.0)
    assert later is not None
    assert later.time.tolist() == [3.0]
    assert paced_stream.LastSolution(heard_by("udp"), paced=True)(5.0) is None


def test_the_columns_of_answers_that_differ() -> None:
    """In order of time; of one instant the last counts; only what all of them have."""
    answers = [b'{"time_s": 3, "height_m": 30, "b": 1}\n{"time_s": 1, "height_m": 10, "c": true}',
               b'{"time_s": 3, "height_m": 31, "a": 2}', b" [1]"]  # fmt: skip
    columns, faults = columns_of_answers(answers)
    assert columns == {"time_s": [1.0, 3.0], "height_m": [10.0, 31.0]}
    assert len(faults) == 1


def test_what_a_listener_says_of_its_place() -> None:
    assert str(paced_stream.Place("udp", "::1", 5)) == "udp://[::1]:5"
    assert str(paced_stream.Place("tcp", LOOPBACK, 6)) == "tcp://127.0.0.1:6"
    assert str(paced_stream.Place("pty")) == "pty:"


def test_the_lines_of_json_by_hand() -> None:
    """Samples from 10 s on; a reading that arrives before them goes out with the beginning, the state is of 10.5 s."""
    rows = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    imu = ImuData(np.array([10.0, 10.5, 10.75]), 0.1 * rows, 0.5 * rows)
    start = NavState(1.0, 3.5, 200.0, np.array([7.0, -8.0, 9.0]), np.array([0.5, -0.5, 0.5, -0.5]))
    baro = {
        "time_s": np.array([9.0, 10.25]),
        "height_m": np.array([201.0, math.nan]),
        "arrival_s": np.array([9.5, 10.625]),
    }
    of: Any = SimpleNamespace(imu=imu, start=(10.5, start), sensors=["baro"], readings=lambda name: baro, end=10.75)
    begin, early, first, reading, second, end = FORMS["json"](of, 1.0)
    assert [p.time for p in (begin, early, first, reading, second, end)] == [10.0, 10.0, 10.5, 10.625, 10.75, 10.75]
    assert json.loads(begin.data) == {
        "type": "begin", "time_s": 10.5, "latitude_rad": 1.0, "longitude_rad": 3.5, "height_m": 200.0,
        "velocity_n_mps": 7.0, "velocity_e_mps": -8.0, "velocity_d_mps": 9.0, "q_nb_w": 0.5, "q_nb_x": -0.5,
        "q_nb_y": 0.5, "q_nb_z": -0.5,
    }  # fmt: skip
    assert json.loads(early.data) == {"type": "baro", "time_s": 9.0, "height_m": 201.0, "arrival_s": 9.5}
    assert json.loads(reading.data) == {"type": "baro", "time_s": 10.25, "height_m": None, "arrival_s": 10.625}
    numbers = [10.75, 0.25, 0.4, 0.5, 0.6, 2.0, 2.5, 3.0]
    names = [
        "time_s",
        "interval_s",
        "dtheta_x_rad",
        "dtheta_y_rad",
        "dtheta_z_rad",
        "dvel_x_mps",
        "dvel_y_mps",
        "dvel_z_mps",
    ]
    assert json.loads(second.data) == {
        "type": "imu",
        **{n: pytest.approx(v) for n, v in zip(names, numbers, strict=True)},
    }
    assert (end.kind, json.loads(end.data), first.kind) == ("end", {"type": "end", "time_s": 10.75}, "imu")
    assert end.data.endswith(b"}\n")


def test_the_true_state_by_hand() -> None:
    """At 60° N and 200° E, heading east: the Earth turns by ω/2 to the north, on the left, and by −√0.75 ω downwards.
    The speed to the east grows by 0.5 m/s², which is ahead, and the one to the north by 0.25 m/s², on the left."""
    half = math.sqrt(0.5)
    time = np.array([5.0, 5.5, 6.0])
    velocity = np.array([[1.0, -20.0, 0.5], [1.125, -19.75, 0.5], [1.25, -19.5, 0.5]])
    motion = SimpleNamespace(time=time, latitude=np.full(3, math.pi / 3), longitude=np.full(3, math.radians(200.0)),
                             height=np.full(3, 1234.5), velocity_ned=velocity,
                             q_nb=np.tile([half, 0.0, 0.0, half], (3, 1)))  # fmt: skip
    motion_of: Any = type("Motion", (SimpleNamespace,), {"__len__": lambda self: 3})(**vars(motion))
    gyro = np.array([[0.01, 0.02, 0.03], [0.04, 0.05, 0.06]])
    ideal_of = type("Ideal", (SimpleNamespace,), {"__len__": lambda self: 2})
    ideal = ideal_of(time=np.array([5.5, 5.875]), gyro=gyro, interval=np.full((2, 1), 0.5))
    asked: list[str] = []
    table = {
        "time_s": np.array([0.0, 10.0]),
        "airspeed_mps": np.array([100.0, 110.0]),
        "calibrated_airspeed_mps": np.array([80.0, 90.0]),
    }
    run = SimpleNamespace(increments=lambda name: asked.append(name) or ideal, inertial=["measured", "ideal"],
                          ellipsoid="wgs84", streams=lambda name: [""], table=lambda name: table)  # fmt: skip
    link = SimpleNamespace(hil_state_quaternion_encode=lambda *fields: fields)
    of: Any = SimpleNamespace(content=SimpleNamespace(motion=motion_of), run=run)
    first, _, last = _true_states(link, of)
    assert asked == ["ideal"]
    omega = 7.292115e-5
    for (at, fields), rates in ((first, [0.02, 0.04, 0.06]), (last, [0.08, 0.10, 0.12])):
        assert fields[0] == round(1e6 * at)
        assert list(fields[2:5]) == pytest.approx(
            [rates[0], rates[1] + 0.5 * omega, rates[2] + 0.75**0.5 * omega], rel=1e-9
        )
    assert (first[0], last[0]) == (5.0, 6.0)
    assert last[1][1] == pytest.approx([half, 0.0, 0.0, half])
    assert last[1][5:8] == (600_000_000, -1_600_000_000, 1_234_500)
    assert last[1][8:11] == (125, -1950, 50)
    assert last[1][11:13] == (8600, 10600)  # the calibrated airspeed is the indicated one
    assert last[1][13:] == (51, -25, 0)  # of 9.80665 mm/s²


def test_the_samples_of_a_sensor_by_hand() -> None:
    """Means over half a second and a quarter; ICAO's atmosphere at 1000 m of geopotential has 898.75 hPa and 8.5 °C.

    A height of 1000 · R/(R − 1000) m has that geopotential, with R = 6 356 766 m.
    """
    common = pytest.importorskip("pymavlink.dialects.v20.common")
    rows = np.array([[1.0, -2.0, 3.0], [4.0, 5.0, -6.0]])
    imu = ImuData(np.array([10.0, 10.5, 10.75]), 0.1 * rows, 0.5 * rows)
    height = 1000.0 * 6356766.0 / 6355766.0
    baro = {"arrival_s": np.array([10.5]), "height_m": np.array([height])}
    run = SimpleNamespace(streams=lambda name: [])
    of: Any = SimpleNamespace(imu=imu, sensors=["baro"], readings=lambda name: baro, run=run)
    link = SimpleNamespace(hil_sensor_encode=lambda *fields: fields)
    (at, first), (later, second) = _hil_sensors(link, common, of)
    assert (at, later, first[0], second[0]) == (10.5, 10.75, 10_500_000, 10_750_000)
    assert first[1:7] == pytest.approx((1.0, -2.0, 3.0, 0.2, -0.4, 0.6))
    assert second[1:7] == pytest.approx((8.0, 10.0, -12.0, 1.6, 2.0, -2.4))
    for fields in (first, second):
        assert fields[10:14] == pytest.approx((898.746, 0.0, height, 8.5), abs=2e-3)
    assert (first[14], second[14]) == (0x3F | 1 << 9 | 1 << 11 | 1 << 12, 0x3F)


def test_the_messages_of_a_live_flight(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two steps, of which the first is final until 1 s and the second until 2.5 s. The second is flown by the solution
    of then, and has the readings that arrive after 1 s alone."""
    from sinssim.data import Measurements
    from sinssim.simulation import foreign_navigator, navigation_stage

    edges = np.array([0.0, 0.5, 1.0, 1.75, 2.5, 3.0])
    imu = ImuData(edges, np.outer(np.arange(5.0), np.ones(3)), np.outer(10.0 * np.arange(5.0), np.ones(3)))
    told: list[Any] = []
    flight: Any = SimpleNamespace(scenario=SimpleNamespace(aiding=None), over=False, believe=told.append)

    def step() -> Any:
        flight.over = bool(told)
        return SimpleNamespace(imu=imu, truth=SimpleNamespace(ellipsoid="e")), 2.5 if told else 1.0

    flight.step = step
    begins: list[Any] = []

    def first_of(scenario: Any, ellipsoid: Any, zero: Any, new: ImuData, state: Any) -> dict[str, Any]:
        begins.append((ellipsoid, zero, new.time.tolist(), new.dtheta[:, 0].tolist(), new.dvel[:, 0].tolist(), state))
        return {name: np.zeros(BEGIN_TYPE[name].shape) for name in BEGIN_TYPE.names if name not in (
            "gravity", "rates", "stepwise", "sensors", "zero")} | {"gravity": "normal"}  # fmt: skip

    at = np.array([0.25, 0.75, 1.5])
    m = Measurements("baro-height", at, at + 0.25, np.array([[5.0], [6.0], [7.0]]), np.ones((3, 1)), name="b")
    monkeypatch.setattr(foreign_navigator, "first_message", first_of)
    monkeypatch.setattr(foreign_navigator, "readings_by_name", lambda *given: {"b": [m]})
    monkeypatch.setattr(navigation_stage, "first_state", lambda scenario, truth: "state")
    asked: list[float] = []

    def solution(sent: float) -> Any:
        asked.append(sent)
        return None if len(asked) == 1 else "solution"

    made = list(live_packets(flight, "2026-01-01T00:00:00", False, solution))
    assert [(p.time, p.kind) for p in made] == [
        (0.0, "begin"),
        (0.5, "imu"),
        (1.0, "imu"),
        (1.75, "imu"),
        (2.5, "imu"),
        (2.5, "end"),
    ]
    assert (asked, told) == ([-math.inf, 1.0], ["solution"])
    zero = 2399 * 604_800 + 4 * 86_400 + 18
    assert begins == [
        ("e", pytest.approx(zero), [0.0, 0.5, 1.0], [0.0, 1.0], [0.0, 10.0], "state"),
        ("e", pytest.approx(zero), [1.0, 1.75, 2.5], [2.0, 3.0], [20.0, 30.0], "state"),
    ]
    read = [[struct.unpack_from("<4d", p.data, 80)[2] for _ in p.data[80:81]] for p in made if p.kind == "imu"]
    assert read == [[5.0], [6.0], [7.0], []]


def test_without_a_pace_a_packet_is_sent_before_the_next_is_made() -> None:
    """The next one may be made of the answer to it; at a pace it is made before, while there is time."""
    sent: list[bytes] = []
    known: list[int] = []

    def packets() -> Iterable[Packet]:
        for k in range(4):
            known.append(len(sent))
            yield Packet(float(k), "imu", b"x")

    def send(data: bytes) -> bool:
        sent.append(data)
        return True

    send_at_pace(packets(), send, math.inf)
    assert known == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("answered", "sent", "awaited"),
    [
        ((), 1.0, True),
        ((0.4,), 1.0, True),
        ((0.4, 0.8), 1.0, False),  # the next one would be of 1.2 s
        ((0.4, 0.8), 1.2, True),
        ((0.4, 0.8, 1.2), 1.2, False),
    ],
)
def test_an_answer_is_awaited_only_if_it_is_due(
    answered: tuple[float, ...], sent: float, awaited: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    waits: list[float] = []
    monkeypatch.setattr(paced_stream.time, "sleep", waits.append)
    monkeypatch.setattr(paced_stream, "_QUIET_S", 0.01)
    names = ("time_s", *paced_stream.STATE_COLUMNS)
    rows = [json.dumps(dict.fromkeys(names, 0.5) | {"time_s": time_s}).encode() for time_s in answered]
    listener = SimpleNamespace(last=0.0, fresh=lambda: [rows.pop(0)] if rows else [])
    last = paced_stream.LastSolution(listener, paced=False)  # type: ignore[arg-type]
    for _ in answered[:-1]:
        last(0.0)
    waits.clear()
    found = last(sent)
    assert bool(waits) == awaited
    assert (found is None) == (not answered)


def test_answers_at_another_place_than_the_packets_come_by_connections_of_their_own() -> None:
    with socket.socket() as free:
        free.bind((LOOPBACK, 0))
        port = free.getsockname()[1]
    place = paced_stream.Place("tcp", LOOPBACK, port)
    with paced_stream.Listener(place, paced_stream.Place("tcp", LOOPBACK, 9)) as listener:
        assert not listener.answers_back
        with socket.create_connection((LOOPBACK, port)) as link:
            link.sendall(b'{"time_s": 1}\n')
        end = time.monotonic() + 5.0
        while not listener.answers and time.monotonic() < end:
            time.sleep(0.002)
    assert listener.answers == [b'{"time_s": 1}']
