"""Outages as people write them on a command line, as settings of a scenario's [log.outages]."""

from __future__ import annotations

import re
from collections.abc import Sequence

from sinssim.errors import InputError, shortened

_NUMBER = r"(\d+(?:\.\d*)?)"
_SPAN = re.compile(f"{_NUMBER}:{_NUMBER}")
_REGULAR = re.compile(rf"{_NUMBER}/{_NUMBER}(?:@({_NUMBER}(?:,{_NUMBER})*))?")


def outage_settings(written: Sequence[str]) -> list[str]:
    """Return settings "key.path=value" for outages.

    Args:
        written: "40:55" from 40 s to 55 s; "15/45" for 15 s every 45 s, "15/45@60" the same, the first at 60 s,
            "15/45@30,45,60" once for each of these beginnings.

    Returns:
        Settings of `log.outages`.

    Raises:
        InputError: one has another form, or two are regular.
    """
    spans, regular = [], None
    for one in written:
        if found := _SPAN.fullmatch(one):
            spans.append(f"[{float(found[1])}, {float(found[2])}]")
        elif (found := _REGULAR.fullmatch(one)) and regular is None:
            regular = found
        else:
            why = "there is already a regular outage" if regular and _REGULAR.fullmatch(one) else "it is no outage"
            raise InputError(
                f"--outage {shortened(one)}: {why}. Write 40:55 for one from 40 s to 55 s, or once 15/45 for 15 s "
                "every 45 s, 15/45@60 if the first is at 60 s, or 15/45@30,45,60 for one pass from each of these on."
            )
    settings = [f"log.outages.at_s=[{', '.join(spans)}]"] if spans else []
    if regular is not None:
        settings += [f"log.outages.length_s={float(regular[1])}", f"log.outages.every_s={float(regular[2])}"]
        if regular[3]:
            first = [float(one) for one in regular[3].split(",")]
            settings.append(f"log.outages.first_s={first if len(first) > 1 else first[0]}")
    return settings
