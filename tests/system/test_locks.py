"""Locks of folders: one holder at a time, freed when it ends."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from sinssim.system.files import try_hold

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no such locks")


def test_a_second_holder_is_refused_until_the_first_ends(tmp_path) -> None:
    first = try_hold(tmp_path)
    assert first is not None
    assert try_hold(tmp_path) is None
    os.close(first)
    again = try_hold(tmp_path)
    assert again is not None
    os.close(again)


def test_a_process_that_ends_frees_its_folder(tmp_path) -> None:
    held = f"from pathlib import Path; from sinssim.system.files import try_hold; try_hold(Path({str(tmp_path)!r}))"
    code = f"import os; {held}; os._exit(1)"
    subprocess.run([sys.executable, "-c", code], check=False)
    lock = try_hold(tmp_path)
    assert lock is not None
    os.close(lock)
