# SPDX-License-Identifier: Apache-2.0
"""Objects of the C library: the context that they are made from, its messages, and what owns them."""
from __future__ import annotations

import contextlib
import ctypes
import os
import sys
import threading
import warnings
from collections.abc import Iterator
from typing import Any, Optional

from . import _c
from ._errors import ERRORS, ArgumentError, Error, ImportonWarning
from ._library import integer, lib, make

_said: list[str] = []


def _log(level: int, message: bytes, payload: Any) -> None:
    if level == _c.IMP_LOG_WARNING:
        _said.append(message.decode(errors="replace"))


_LOG = ctypes.CFUNCTYPE(None, ctypes.c_int, ctypes.c_char_p, ctypes.c_void_p)(_log)


def warn_said() -> None:
    """Pass on what the library has warned of since the last call, at the place of the caller of
    this package."""
    if not _said:
        return
    level, frame = 1, sys._getframe(0)
    while frame.f_back is not None and os.path.dirname(frame.f_code.co_filename) == os.path.dirname(__file__):
        level, frame = level + 1, frame.f_back
    while _said:
        warnings.warn(_said.pop(0), ImportonWarning, stacklevel=level)


class Handle:
    """An object of the library, destroyed with its last reference. `close` of an owner
    waits for calls that use it, since both take its lock."""

    __slots__ = ("_pointer", "_destroy", "__weakref__")

    def __init__(self, pointer: int, destroy: Any) -> None:
        self._pointer: Optional[int] = pointer
        self._destroy = destroy

    @property
    def pointer(self) -> int:
        if self._pointer is None:
            raise ArgumentError("this object is closed")
        return self._pointer

    def take(self) -> int:
        """The pointer, which now belongs to somebody else."""
        pointer, self._pointer = self.pointer, None
        return pointer

    def close(self) -> None:
        pointer, self._pointer = self._pointer, None
        if pointer is not None:
            self._destroy(pointer)

    @property
    def closed(self) -> bool:
        return self._pointer is None

    __del__ = close


class Context:
    """Threads and messages; objects made from it keep it alive."""

    def __init__(self, threads: int = 0) -> None:
        options = make(_c.imp_context_options, threads=threads,
                       log=ctypes.cast(_LOG, ctypes.c_void_p))
        out = ctypes.c_void_p()
        status = lib.imp_context_create(ctypes.byref(options), ctypes.byref(out))
        if status:
            raise ERRORS[status](lib.imp_last_error(None).decode(errors="replace"))
        self.handle = Handle(out.value or 0, lib.imp_context_destroy)
        self.pointer = self.handle.pointer

    def message(self) -> str:
        said = lib.imp_last_error(self.pointer) or lib.imp_last_error(None)
        return (said or b"").decode(errors="replace")

    def check(self, status: int, result: Any = None) -> None:
        """Raise what a status means."""
        if status:
            raise failure(status, self.message(), result)


def failure(status: int, message: str, result: Any = None) -> Error:
    return ERRORS.get(status, Error)(
        message or lib.imp_status_text(status).decode(), result)


_context: Optional[Context] = None
_context_lock = threading.Lock()


_own = threading.local()


@contextlib.contextmanager
def own_context() -> Iterator[Context]:
    """In this block and thread, new objects are made from a context of their own."""
    before, made = getattr(_own, "context", None), Context(threads())
    _own.context = made
    try:
        yield made
    finally:
        _own.context = before


def context() -> Context:
    """The context that new objects are made from."""
    global _context
    own: Optional[Context] = getattr(_own, "context", None)
    if own is not None:
        return own
    with _context_lock:
        if _context is None:
            _context = Context()
        return _context


def set_threads(threads: int) -> None:
    """Number of threads for scenes loaded from now on.

    Results are the same to the last bit for any number.

    Parameters
    ----------
    threads : int
        0: all cores.

    Examples
    --------
    >>> importon.set_threads(1)
    >>> importon.threads()
    1
    >>> importon.set_threads(0)
    """
    global _context
    made = Context(integer(threads, "threads"))
    with _context_lock:
        _context = made


def threads() -> int:
    """Number of threads that scenes loaded now use.

    Returns
    -------
    int

    Examples
    --------
    >>> importon.threads() >= 1
    True
    """
    return int(lib.imp_context_threads(context().pointer))


def _after_fork() -> None:
    global _context_lock
    _context_lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
