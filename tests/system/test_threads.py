"""A pool whose work is left alone when it is no longer wanted."""

from __future__ import annotations

import threading
from concurrent.futures import Future

import pytest

from sinssim.system.process import thread_pool


def test_work_is_waited_for() -> None:
    go, done = threading.Event(), threading.Event()

    def work() -> None:
        go.wait(10.0)
        done.set()

    with thread_pool(1) as pool:
        pool.submit(work)
        threading.Timer(0.05, go.set).start()
    assert done.is_set()


def test_an_interruption_waits_for_nothing_and_begins_nothing() -> None:
    go, begun, done = threading.Event(), threading.Event(), threading.Event()

    def work() -> None:
        begun.set()
        go.wait(10.0)
        done.set()

    futures: list[Future[None]] = []

    def interrupted() -> None:
        with thread_pool(1) as pool:
            futures.extend((pool.submit(work), pool.submit(work)))
            begun.wait(10.0)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert not done.is_set()
    assert futures[1].cancelled()
    go.set()
    futures[0].result(10.0)
    assert done.is_set()
