"""Summary of a redundant set's monitoring: numbers for `summary.json`, and sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sinssim.data import Array
from sinssim.formatting import number_text

NAMES = {"gyro": "gyro", "accel": "accelerometer"}


def redundancy_sentences(numbers: Mapping[str, Any], algorithms: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Yield the results of the monitoring in words.

    Args:
        numbers: result of `redundancy_numbers`.
        algorithms: errors of the algorithms, of which the first is compared.

    Yields:
        Sentences.
    """
    if numbers["monitoring"] == "none":
        yield "The sensors of the redundant set are not monitored: all of them are always used."
        return
    quiet = True
    for kind, name in NAMES.items():
        for alarm in numbers[kind]["alarms"]:
            quiet = False
            over = f"by sums over {alarm['window_s']:g} s"
            if alarm["window_s"] == numbers[kind]["windows_s"][0]:
                over = "by a single sample"
            if alarm["sensor"] is None:
                why = "" if numbers["monitoring"] == "detect" else ", but the faulty sensor could not be identified"
                yield (
                    f"A fault of the {name}s was detected at {alarm['detected_s']:.8g} s {over}{why}; the last test "
                    f"over the threshold was at {alarm['last_s']:.8g} s."
                )
                continue
            when = "at once" if alarm["excluded_s"] == alarm["detected_s"] else f"at {alarm['excluded_s']:.8g} s"
            yield (
                f"A fault of {name} {alarm['sensor']} was detected at {alarm['detected_s']:.8g} s {over}; the sensor "
                f"was isolated and excluded {when}."
            )
    if quiet:
        yield "The monitoring of the redundant set found no fault."
    without = numbers.get("without_monitoring")
    if without and algorithms:
        name, own = next(iter(algorithms.items()))
        end, most = own["final_horizontal_error_m"], own["max_horizontal_error_m"]
        if end is not None and without["final_horizontal_error_m"] is not None:
            alone = (without[f"{when}_horizontal_error_m"] for when in ("final", "max"))
            own_end, own_most, end, most = (number_text(value, 4) for value in (end, most, *alone))
            yield (
                f"Horizontal error of {name} with monitoring: {own_end} m at the end, {own_most} m at most; without "
                f"monitoring: {end} m at the end, {most} m at most."
            )


def window_names(windows: Array) -> list[str]:
    """Return the names of the windows of a test.

    Args:
        windows: their lengths, s, of which the first is one sample.

    Returns:
        "sample", "1 s", ….
    """
    return ["sample", *(f"{window:.6g} s" for window in windows[1:])]
