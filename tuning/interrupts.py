"""Ctrl-C that is not lost."""

import signal
import sys
from typing import Any

MOMENT = 0.05  # [s]


def keep_interrupts() -> None:
    """Raise a KeyboardInterrupt anew, a moment later, that came while Python was in a callback of its own.

    What is raised in a callback of the garbage collector, of which JAX has one, is printed and dropped: a Ctrl-C
    during a compilation, which makes much garbage, would often do nothing. For the main thread of a command.
    """
    before = sys.unraisablehook

    def hook(dropped: Any) -> None:
        if issubclass(dropped.exc_type, KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, MOMENT)
        else:
            before(dropped)

    signal.signal(signal.SIGALRM, signal.default_int_handler)
    sys.unraisablehook = hook
