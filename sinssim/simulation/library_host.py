"""Loads the shared library of a navigator and passes blocks between it and its standard input and output.

It runs as a process of its own, without sinssim's modules: an end of the library, or a library that hangs, ends it and
not the run. On its input stand the sizes of each block in bytes and in samples, 64 bits each, before the messages of
the protocol; the first block is the opening. On its output stand the answers as of any program.
"""

from __future__ import annotations

import ctypes
import os
import struct
import sys

VERSION, NAMES = 1, ("sinssim_version", "sinssim_begin", "sinssim_block", "sinssim_end")
WRONG = 70
"""Exit status for a library that cannot be used, with the reason on standard error."""
_HEAD, _MOST_BYTES = 8, 8 * 28


def load(path: str) -> ctypes.CDLL:
    """Load a library; leave with a sentence if it is none, or lacks a function or the version."""
    try:
        library = ctypes.CDLL(path, mode=os.RTLD_NOW)
    except OSError as error:
        _leave(f"cannot be loaded: {error}")
    missing = [name for name in NAMES if not hasattr(library, name)]
    if missing:
        _leave(f"has no function {' and no '.join(missing)}")
    library.sinssim_version.restype = ctypes.c_uint32
    library.sinssim_block.restype = ctypes.c_int64
    library.sinssim_block.argtypes = [ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p, ctypes.c_uint64]
    library.sinssim_begin.argtypes = [ctypes.c_void_p, ctypes.c_uint64]
    if (version := library.sinssim_version()) != VERSION:
        _leave(f"has version {version} of the protocol, but this is version {VERSION}")
    return library


def _leave(why: str) -> None:
    print(why, file=sys.stderr, flush=True)
    os._exit(WRONG)


def _read(place: memoryview) -> bool:
    """Fill a place from standard input; return whether there was enough."""
    there = 0
    while there < len(place) and (more := os.readv(0, [place[there:]])):
        there += more
    return there == len(place)


def _write(data: memoryview) -> None:
    while data:
        data = data[os.write(1, data) :]


def serve(library: ctypes.CDLL) -> None:
    """Pass blocks until the input ends."""
    sizes, block, answers, begun = bytearray(16), bytearray(0), bytearray(0), False
    while _read(memoryview(sizes)):
        size, samples = struct.unpack("<QQ", sizes)
        if len(block) < size:
            block = bytearray(size)
        _read(memoryview(block)[:size])
        data = (ctypes.c_char * size).from_buffer(block)
        if not begun:
            begun = True
            if status := library.sinssim_begin(data, size):
                _leave(f"refuses to begin: sinssim_begin returns {status}")
            _write(memoryview(struct.pack("<8sII", b"SINSSIM\0", VERSION, 0)))
            continue
        most = 2 * samples + 16
        if len(answers) < most * _MOST_BYTES:
            answers = bytearray(most * _MOST_BYTES)
        out = (ctypes.c_char * len(answers)).from_buffer(answers)
        written = library.sinssim_block(data, size, out, most * _MOST_BYTES)
        if not 0 <= written <= most * _MOST_BYTES:
            _leave(f"fails: sinssim_block returns {written}")
        _write(memoryview(answers)[:written])
    library.sinssim_end()


if __name__ == "__main__":
    if (loaded := load(sys.argv[1])) and sys.argv[2:] != ["--check"]:
        serve(loaded)
