# SPDX-License-Identifier: Apache-2.0
"""The C library: found and loaded; keywords, strings, structs and numbers for its functions."""
from __future__ import annotations

import ctypes
import functools
import os
import re
import sys
from collections.abc import Callable
from typing import Any, Optional, TypeVar, cast

from . import _c
from ._errors import ArgumentError

_HERE = os.path.dirname(os.path.abspath(__file__))


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
