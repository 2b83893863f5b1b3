# SPDX-License-Identifier: Apache-2.0
"""Long calls of the C library.

Such a call runs on a thread of its own while the main thread waits, so that
Ctrl-C and other signals are handled at once; it is then asked to stop, through the
progress callback that every such call has, and ends at its next tile.
"""
from __future__ import annotations

import _thread
import ctypes
import os
import threading
import weakref
from collections.abc import Callable
from typing import Any, NamedTuple, Optional

from . import _c
from ._context import Context, warn_said
from ._errors import ArgumentError
from ._library import decode

_inside = threading.local()


class Progress(NamedTuple):
    """What a progress callback is given; it may return True to stop the call."""

    stage: str
    fraction: float  # of the work, 0 to 1
    elapsed_s: float
    eta_s: float  # still to go; negative: unknown
    rate: float
    rate_unit: str
    note: str


ProgressCallback = Callable[[Progress], Optional[bool]]


class _Call:
    def __init__(self, progress: Optional[ProgressCallback]) -> None:
        self.progress = progress
        self.stop = False
        self.error: Optional[BaseException] = None

    def report(self, p: Any) -> int:
        if self.stop or self.progress is None:
            return int(self.stop)
        s = p.contents
        _inside.callback = True
        try:
            said = self.progress(Progress(decode(s.stage), s.fraction, s.elapsed_s, s.eta_s, s.rate,
                                          decode(s.rate_unit), decode(s.note)))
            self.stop = self.stop or bool(said)
        except BaseException as error:
            self.error, self.stop = error, True
        finally:
            _inside.callback = False
        return int(self.stop)


_calls: dict[int, _Call] = {}


def _on_progress(p: Any, payload: Any) -> int:
    call = _calls.get(payload)
    return call.report(p) if call else 0


PROGRESS = _c.imp_progress_fn(_on_progress)
PROGRESS_ADDRESS = ctypes.cast(PROGRESS, ctypes.c_void_p)


def not_inside() -> None:
    """A callback may read parameters, and nothing else: it runs inside a call."""
    if getattr(_inside, "callback", False):
        raise ArgumentError("a progress callback called the library: it runs inside a call")


def run(ctx: Context, options: Any, progress: Any, function: Any, *arguments: Any) -> tuple[int, str]:
    """Call `function`, with `options` (a struct with progress and progress_payload, which
    are set). Returns status and message. What a callback or a signal handler raised is
    raised here, after the call has ended."""
    from ._progress import callback_of

    not_inside()
    call = _Call(callback_of(progress))
    key = options.progress_payload or id(call)  # of objects that keep their options: their own
    options.progress, options.progress_payload = PROGRESS_ADDRESS, key
    _calls[key] = call
    outcome: list[Any] = []

    def work() -> None:
        try:
            status = function(*arguments)
            outcome.append((status, ctx.message() if status else ""))
        except BaseException as error:  # a wrong type of argument
            outcome.append(error)

    interruption: Optional[BaseException] = None
    try:
        if threading.current_thread() is threading.main_thread():
            done = _thread.allocate_lock()
            done.acquire()

            def work_and_tell() -> None:
                try:
                    work()
                finally:
                    done.release()

            _thread.start_new_thread(work_and_tell, ())
            while True:
                try:
                    done.acquire()
                    break
                except BaseException as error:  # KeyboardInterrupt, or a handler's own
                    call.stop, interruption = True, error
        else:
            work()
    finally:
        del _calls[key]
        close = getattr(call.progress, "close", None)
        if close:
            close()
    if interruption:
        raise interruption
    if call.error:
        raise call.error
    if isinstance(outcome[0], BaseException):
        raise outcome[0]
    status, message = outcome[0]
    warn_said()
    return status, message


# ---- Fork --------------------------------------------------------------------------

_locked: weakref.WeakSet[Any] = weakref.WeakSet()


def register_lock(owner: Any) -> None:
    """`owner.lock` is made new in a child after a fork: the parent's may be held."""
    _locked.add(owner)


def _after_fork() -> None:
    _calls.clear()
    _inside.__dict__.clear()
    for owner in list(_locked):
        owner.lock = threading.RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
