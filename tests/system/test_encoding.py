"""Output into files and pipes whose encoding lacks characters: other words for them, and never an error."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sinssim.cli import app as cli
from sinssim.cli.command_line import encode_everything, holds_everything
from tests.fork import Fork
from tests.slow import slow


@pytest.mark.parametrize(
    ("encoding", "text", "written"),
    [
        ("ascii", "3σ ±0.1° √Hz m/s² µg", b"3sigma +-0.1deg sqrtHz m/s^2 ug"),
        ("cp1252", "3σ ±0.1° √Hz m/s² µg – …", b"3sigma \xb10.1\xb0 sqrtHz m/s\xb2 \xb5g \x96 \x85"),
        ("latin-1", "−1 → Ω, φ, Gauß–Markov …", b"-1 -> Omega, phi, Gau\xdf-Markov ..."),
        ("ascii", "é ₂ Δ ∞ 飛 \udcff", b"e 2 Delta inf ? \xff"),
        ("ascii", "m³ ‰ ≈ ≠ ∝ ∑ ∫ ∂ ⊗ ✓ ✗ × ÷ · • ‑", b"m^3 permille ~ != ~ sum int d * ok no x / . * -"),
        ("ascii", "← ⇒ ≤ ≥ ′ ″ ’ ‘ “ ” „ « » μ ß −", b'<- => <= >= \' " \' \' " " " " " u ss -'),
        ("utf-8", "σ 飛 \udcff", "σ 飛 ".encode() + b"\xff"),
    ],
)
def test_characters_that_an_encoding_lacks(encoding: str, text: str, written: bytes) -> None:
    buffer = io.BytesIO()
    stream = io.TextIOWrapper(buffer, encoding=encoding)
    encode_everything(stream)
    stream.write(text)
    stream.flush()
    assert buffer.getvalue() == written
    assert holds_everything(stream) == (encoding == "utf-8")


def test_a_treatment_that_the_user_chose_stays() -> None:
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii", errors="replace")
    encode_everything(stream)
    assert stream.errors == "replace"
    encode_everything(io.StringIO())  # no stream of the system: it holds everything as it is


@pytest.mark.parametrize(
    ("command", "encoding"),
    [(("sensors", "tactical"), "cp1252"), (("sensors", "tactical"), "ascii"), (("list", "grades"), "latin-1"),
     (("run", "σ"), "ascii")],
)  # fmt: skip
def test_commands_with_streams_of_an_encoding(encoding: str, command: tuple[str, ...]) -> None:
    def program() -> None:
        for stream in (sys.stdout, sys.stderr):
            stream.reconfigure(encoding=encoding)  # type: ignore[union-attr]
        cli.main(command)

    process = Fork(program)
    text = process.stdout.read().decode(encoding) + process.stderr()
    assert process.returncode == (2 if command[0] == "run" else 0), text
    assert "Error" not in text
    if command[0] == "sensors":
        assert "1sigma" in text
    if command[0] == "run":
        assert "unknown scenario 'sigma'" in text


@pytest.mark.parametrize(
    ("command", "encoding"),
    [(("--help",), "cp1252"),
     *slow((("sensors", "tactical"), "cp1252"), (("sensors", "tactical"), "ascii"), (("list", "grades"), "latin-1"),
           (("run", "σ"), "ascii"))],
)  # fmt: skip
def test_commands_into_a_file_and_a_pipe(tmp_path: Path, encoding: str, command: tuple[str, ...]) -> None:
    arguments = [sys.executable, "-m", "sinssim", *command]
    env = {**os.environ, "PYTHONIOENCODING": encoding}
    piped = subprocess.run(arguments, env=env, capture_output=True, check=False)
    assert piped.returncode == (2 if command[0] == "run" else 0), piped.stderr
    assert b"Error" not in piped.stderr
    text = (piped.stdout + piped.stderr).decode(encoding)
    with open(tmp_path / "out", "wb") as out:
        subprocess.run(arguments, env=env, stdout=out, stderr=subprocess.STDOUT, check=False)
    assert sorted((tmp_path / "out").read_bytes().split()) == sorted((piped.stdout + piped.stderr).split())
    if command[0] == "sensors":
        assert "1sigma" in text
    if command[0] == "run":
        assert "unknown scenario 'sigma'" in text


def test_json_loses_nothing() -> None:
    arguments = [sys.executable, "-m", "sinssim", "list", "grades", "--json"]
    plain, utf = (
        json.loads(
            subprocess.run(
                arguments, env={**os.environ, "PYTHONIOENCODING": name}, capture_output=True, check=True
            ).stdout.decode(name)
        )
        for name in ("ascii", "utf-8")
    )
    assert plain == utf
