# SPDX-License-Identifier: Apache-2.0
"""What goes wrong in calls of the C library, as exceptions."""
from __future__ import annotations

import re
from typing import Any, Optional

from . import _c


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
