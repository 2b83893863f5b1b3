# SPDX-License-Identifier: Apache-2.0
"""The C library: found, loaded and called.

A call that takes long runs on a thread of its own while the main thread waits, so that
Ctrl-C and other signals are handled at once; it is then asked to stop, through the
progress callback that every such call has, and ends at its next tile.
"""
from __future__ import annotations

import _thread
import contextlib
import ctypes
import functools
import os
import re
import sys
import threading
import warnings
import weakref
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, Optional, TypeVar, cast

from . import _c

_HERE = os.path.dirname(os.path.abspath(__file__))


# ---- Errors ------------------------------------------------------------------------


class Error(RuntimeError):
    """A call of the library failed; the classes below say how.

    Attributes
    ----------
    status : str
        The word of the status: "e_scene".
    file : str or None
        The scene file that the message is about.
    line, column : int or None
        The place in that file, from 1.
    result : object
        Of `Cancelled`: what was reached, where that is valid.
    """

    status = ""

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message)
        place = re.match(r"(.+?):(\d+):(\d+): ", message)
        self.file: Optional[str] = place[1] if place else None
        self.line: Optional[int] = int(place[2]) if place else None
        self.column: Optional[int] = int(place[3]) if place else None
        self.result = result


class Cancelled(Error):
    """Cancelled by the caller: a progress callback returned True, or time ran out.
    `result` has what was reached, where that is valid."""


class Part(Error):
    """A part is kept; there is no whole result."""


class ArgumentError(Error, ValueError):
    """An argument is outside its documented range."""


class ParameterError(ArgumentError, KeyError):
    """There is no parameter of this name; the message has the nearest ones."""

    def __str__(self) -> str:
        return str(self.args[0])


class SceneError(Error):
    """A scene or input file is not valid."""


class UnsupportedError(Error, NotImplementedError):
    """Valid, but not available in this version."""


class BiasError(Error):
    """A derivative that cannot be computed without bias."""


class FileError(Error, OSError):
    """A file cannot be read or written."""

    def __init__(self, message: str, result: Any = None) -> None:
        Error.__init__(self, message, result)

    def __str__(self) -> str:
        return str(self.args[0])


class OutOfMemoryError(Error, MemoryError):
    """Out of memory, or over a memory limit."""


class PathsError(Error):
    """More paths were dropped than the budget allows."""


class NumericError(Error, ArithmeticError):
    """A computation did not converge or is singular."""


class ImportonWarning(UserWarning):
    """What the library warns of: a property that is normalised, clipped targets, ..."""


ERRORS: dict[int, type[Error]] = {
    _c.IMP_CANCELLED: Cancelled,
    _c.IMP_PART: Part,
    _c.IMP_E_ARG: ArgumentError,
    _c.IMP_E_SCENE: SceneError,
    _c.IMP_E_UNSUPPORTED: UnsupportedError,
    _c.IMP_E_BIAS: BiasError,
    _c.IMP_E_IO: FileError,
    _c.IMP_E_NOMEM: OutOfMemoryError,
    _c.IMP_E_PATHS: PathsError,
    _c.IMP_E_NUMERIC: NumericError,
}
for _word, _value in _c.WORDS["imp_status"].items():
    if _value in ERRORS:
        ERRORS[_value].status = _word


# ---- The shared library ------------------------------------------------------------


_LEVELS = {  # what processors must have for builds beside the one for all, the fastest first
    "v4": {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"},
    "v3": {"avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "xsave"}}


def _levels() -> list[str]:
    """The builds that this processor can run beside the one for all, the fastest first."""
    try:
        with open("/proc/cpuinfo", encoding="ascii", errors="replace") as info:
            for line in info:
                if line.startswith("flags"):
                    has = set(line.split())
                    return [level for level, wanted in _LEVELS.items()
                            if _LEVELS["v3"] <= has and wanted <= has]
    except OSError:
        pass
    return []


def _candidates() -> list[str]:
    """The library asked for; the one in the wheel; the build folder's around it; the
    system's. The first two folders hold several builds, of which results are the same."""
    asked = os.environ.get("IMPORTON_LIBRARY")
    if asked:
        return [asked]
    found = []
    wheel = ["libimporton-%s.so.0" % level for level in _levels()] + ["libimporton.so.0"]
    found += [os.path.join(_HERE, "..", ".importon.mesonpy.libs", f) for f in wheel]
    found += [os.path.join(_HERE, "..", "..", "lib", f) for f in
              ["glibc-hwcaps/x86-64-%s/libimporton.so.0" % level for level in _levels()] + ["libimporton.so.0"]]
    for folder in sys.path:  # where machine code is installed apart from Python's
        found += [os.path.join(folder, ".importon.mesonpy.libs", f) for f in wheel]
    return [os.path.normpath(f) for f in found if os.path.exists(f)] + ["libimporton.so.0"]


def _load() -> ctypes.CDLL:
    reasons = []
    for path in _candidates():
        try:
            library = ctypes.CDLL(path)
        except OSError as error:
            reasons.append(str(error))
            continue
        library.imp_version.restype = ctypes.c_char_p
        version = library.imp_version().decode()
        if version.split(".")[:2] == _c.VERSION.split(".")[:2]:
            _c.declare(library)
            return library
        reasons.append("%s is version %s, this package is for %s" % (path, version, _c.VERSION))
    raise ImportError("importon: the library cannot be loaded: " + "; ".join(reasons))


lib = _load()


def library_path() -> str:
    """The file of the C library that is in use.

    Returns
    -------
    str

    Examples
    --------
    >>> "libimporton" in importon.library_path()
    True
    """
    return str(lib._name)


# ---- Keywords ----------------------------------------------------------------------

F = TypeVar("F", bound=Callable[..., Any])


def explained(function: F) -> F:
    """The function; its error for a keyword that it does not have says what was meant."""
    @functools.wraps(function)
    def call(*arguments: Any, **keywords: Any) -> Any:
        try:
            return function(*arguments, **keywords)
        except TypeError as error:
            said = re.match(r".*\(\) got an unexpected keyword argument '(\w+)'", str(error))
            trace = error.__traceback__
            if said is None or trace is None or trace.tb_next is not None:  # raised further inside
                raise
        import difflib
        import inspect
        names = [n for n in inspect.signature(function).parameters if n != "self" and not n.startswith("_")]
        near = difflib.get_close_matches(said[1], names, 1)
        raise TypeError("%s() has no keyword '%s'%s" % (
            function.__qualname__.replace(".__init__", "").split(".")[-1], said[1], "; did you mean '%s'?" % near[0] if near else "; it has: " + ", ".join(names)))

    return cast(F, call)


# ---- Structs -----------------------------------------------------------------------


def make(struct: Any, **values: Any) -> Any:
    """A struct with its size and its initial values, and then those given."""
    s = struct()
    if struct._fields_[0][0] == "size":
        s.size = ctypes.sizeof(struct)
    for name, value in {**getattr(struct, "initial", {}), **values}.items():
        setattr(s, name, value)
    return s


def rows_of(struct: Any, address: Optional[int], n: int) -> list[Any]:
    """Rows that the library handed out, each as long as its own size says (IMP_ROW)."""
    if not n or not address:
        return []
    size = ctypes.c_size_t.from_address(address).value
    return [struct.from_address(address + k * size) for k in range(n)]


def decode(value: Optional[bytes]) -> str:
    """A string of C; NULL: empty."""
    return (value or b"").decode(errors="replace")


def word(enum: str, value: int) -> str:
    for name, number in _c.WORDS[enum].items():
        if number == value:
            return name
    return str(value)


ALIASES = {"imp_loss": {"relative": "relative_l2"},
           "imp_bend_target_type": {"far-field": "farfield"}}


def choice(enum: str, value: Any, name: str) -> int:
    """The number of an enum's word."""
    words = _c.WORDS[enum]
    if isinstance(value, str):
        found = words.get(ALIASES.get(enum, {}).get(value, value))
        if found is not None:
            return found
    raise ArgumentError("%s is %r; it may be %s" % (name, value, ", ".join(words)))


def text(value: Any, name: str) -> bytes:
    """A string for C."""
    if hasattr(value, "__fspath__"):
        try:
            value = os.fspath(value)
        except Exception as error:  # the code of another package, which may raise anything
            raise ArgumentError("%s is no path: %r" % (name, error)) from error
    if isinstance(value, bytes):
        data = value
    elif isinstance(value, str):
        try:
            data = os.fsencode(value)
        except UnicodeEncodeError as error:
            raise ArgumentError("%s: %s" % (name, error)) from None
    else:
        raise TypeError("%s is a %s, not a string" % (name, type(value).__name__))
    if b"\0" in data:
        raise ArgumentError("%s has a zero byte" % name)
    return data


def integer(value: Any, name: str, lo: int = -2**31, hi: int = 2**31 - 1) -> int:
    """An int in [lo, hi], from anything that is a whole number."""
    try:
        n = value.__index__()
    except AttributeError:
        raise TypeError("%s is %r, not a whole number" % (name, value)) from None
    if not lo <= n <= hi:
        raise ArgumentError("%s = %d is outside [%d, %d]" % (name, n, lo, hi))
    return int(n)


def memory_bytes(value: Any) -> int:
    """A limit of memory; 0: the default."""
    n = float(value)
    if not 0 <= n <= 2.0**63:
        raise ArgumentError("memory = %g is outside [0, 2^63] bytes" % n)
    return int(n)


# ---- Context and messages ----------------------------------------------------------

_inside = threading.local()
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


# ---- Progress and long calls -------------------------------------------------------


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
    global _context_lock
    _context_lock = threading.Lock()
    _calls.clear()
    _inside.__dict__.clear()
    for owner in list(_locked):
        owner.lock = threading.RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
