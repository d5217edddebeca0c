"""An interrupt that falls into a callback of the garbage collector."""

import gc
import signal
import sys
import time

import pytest

from tuning.interrupts import keep_interrupts


@pytest.fixture
def kept():
    hook, alarm = sys.unraisablehook, signal.getsignal(signal.SIGALRM)
    keep_interrupts()
    yield
    sys.unraisablehook = hook
    signal.signal(signal.SIGALRM, alarm)


@pytest.fixture
def interrupted_collection():
    def callback(phase, _):
        if phase == "start" and callbacks:
            gc.callbacks.remove(callbacks.pop())
            raise KeyboardInterrupt

    callbacks = [callback]
    gc.callbacks.append(callback)
    yield
    if callbacks:
        gc.callbacks.remove(callback)


def test_what_a_callback_of_the_garbage_collector_would_swallow_comes_a_moment_later(kept, interrupted_collection):
    gc.collect()
    with pytest.raises(KeyboardInterrupt):
        time.sleep(5.0)


def test_other_errors_in_callbacks_go_where_they_went(kept, monkeypatch):
    seen = []
    monkeypatch.setattr(sys, "unraisablehook", seen.append)
    keep_interrupts()

    class Fails:
        def __del__(self):
            raise ValueError("of a finaliser")

    Fails()
    gc.collect()
    assert [str(dropped.exc_value) for dropped in seen] == ["of a finaliser"]
