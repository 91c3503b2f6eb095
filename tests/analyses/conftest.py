"""What the tests of recording share."""

from __future__ import annotations

from tests.recording.spies import plots

__all__ = ["plots"]
