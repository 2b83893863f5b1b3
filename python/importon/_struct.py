# SPDX-License-Identifier: Apache-2.0
"""Structs of C from dictionaries."""
from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

from ._array import numbers
from ._library import choice, integer, make, text


def struct_of(kind: Any, given: Any, what: str, words: Mapping[str, str] = {}) -> tuple[Any, list[Any]]:
    """A struct from a dictionary of its fields, and what it points to."""
    if not isinstance(given, Mapping):
        raise TypeError("%s is a %s: a dictionary is wanted" % (what, type(given).__name__))
    s, kept = make(kind), []
    known = dict((f[0], f[1]) for f in kind._fields_ if f[0] != "size")
    for name, value in given.items():
        if name not in known:
            raise TypeError("%s has no '%s'; it has: %s" % (what, name, ", ".join(known)))
        if name in words:
            value = choice(words[name], value, name)
        elif known[name] is ctypes.c_char_p:
            value = text(value, name)
            kept.append(value)
        elif hasattr(known[name], "_length_"):
            value = known[name](*[known[name]._type_(v) if known[name]._type_ is ctypes.c_int else v for v in (
                [integer(x, name) for x in value] if known[name]._type_ is ctypes.c_int
                else numbers(value, name, shape=(known[name]._length_,)).tolist())])
        elif known[name] is ctypes.c_bool:
            value = bool(value)
        elif known[name] is ctypes.c_int:
            value = integer(int(value) if isinstance(value, bool) else value, name)
        elif known[name] is ctypes.c_double:
            value = float(value)
        setattr(s, name, value)
    return s, kept


def structs_of(kind: Any, given: Sequence[Any], what: str, words: Mapping[str, str] = {}) -> tuple[Any, list[Any]]:
    pairs = [struct_of(kind, g, what, words) for g in given]
    return (kind * max(len(pairs), 1))(*[p[0] for p in pairs]), [p[1] for p in pairs]
