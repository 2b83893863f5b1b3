# SPDX-License-Identifier: Apache-2.0
"""Rays that bend in a graded refractive index, and the exact derivative of their bending.

Rays are fixed, so values and gradients are exact: no standard error belongs to them.
"""
from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _c
from ._array import address, copy_doubles
from ._bend_arrivals import Arrivals, BendArrivals
from ._bend_problem import dispersion_index
from ._check import Check, check_rows
from ._context import Handle, context, failure, warn_said
from ._errors import ArgumentError
from ._field import Field
from ._field_make import taken
from ._library import choice, explained, integer, lib, make, text
from ._load import _load_options
from ._rays import EXIT, Exits, RayGradient, adjoint, exits_of, path, stats_of, tangent, trace
from ._run import not_inside, PROGRESS_ADDRESS, register_lock, run

class BendFit(NamedTuple):
    """An answer of `Bend.fit`.

    Attributes
    ----------
    iterations, levels : int
        Done.
    start, value : float
        Objective before (first level) and after (last).
    history : ndarray
        Objective of every evaluation.
    reason : str
    stats : dict
        Of the final field.
    """

    iterations: int
    levels: int
    start: float
    value: float
    history: Any
    reason: str
    stats: dict[str, Any]


class Bend(BendArrivals):
    """A problem of bent rays: a field, rays, targets.

    Parameters
    ----------
    field : Field
        Taken over: it belongs to the problem then.

    Examples
    --------
    >>> bend = importon.bend.load_file("rod.xml", count=16)
    >>> value, gradient = bend.objective()
    >>> value < 1e-3, gradient.shape == bend.field.theta.shape
    (True, True)
    """

    def __init__(self, field: Any, _handle: Optional[Handle] = None, _context: Any = None) -> None:
        import threading
        if _handle is None:
            not_inside()
            if not isinstance(field, Field) or field._owner is not None:
                raise TypeError("Bend takes a field of its own")
            out = ctypes.c_void_p()
            ctx = field._context
            ctx.check(lib.imp_bend_create(ctx.pointer, taken(field), ctypes.byref(out)))
            field._owner = self
            _handle, _context = Handle(out.value or 0, lib.imp_bend_destroy), ctx
        self._handle, self._context = _handle, _context
        self.lock = threading.RLock()
        self._kept: list[Any] = []
        register_lock(self)
        lib.imp_bend_set_progress(self.pointer, PROGRESS_ADDRESS, id(self))

    def close(self) -> None:
        """Free the problem and its field. Using it afterwards is an ArgumentError.

        Examples
        --------
        >>> bend = importon.bend.load_file("rod.xml", count=4)
        >>> bend.close()
        >>> bend.n_rays
        Traceback (most recent call last):
        ...
        importon.ArgumentError: this object is closed
        """
        not_inside()
        with self.lock:
            self._handle.close()

    def objective(self, gradient: bool = True, progress: Any = None, parts: bool = False) -> Any:
        """The objective and its gradient with respect to the field's numbers.

        Parameters
        ----------
        gradient : bool
        progress : bool or callable, optional
            See `importon.set_progress`.
        parts : bool
            Also the part of each target.

        Returns
        -------
        value : float
        gradient : ndarray or None
            [n_theta]; of held numbers 0.
        parts : ndarray
            [n_targets], with `parts`.

        Raises
        ------
        NumericError
            No ray comes to its end.

        Examples
        --------
        >>> bend = importon.bend.load_file("rod.xml", count=16)
        >>> value, gradient, parts = bend.objective(parts=True)
        >>> gradient.shape == bend.field.theta.shape, bool(np.isclose(parts.sum(), value))
        (True, True)
        """
        value = ctypes.c_double()
        g = np.zeros(lib.imp_field_n_theta(self.field.pointer)) if gradient else None
        each = np.zeros(self.n_targets)
        self._run(progress, lib.imp_bend_objective, ctypes.byref(value), address(g), address(each), None)
        return (value.value, g, each) if parts else (value.value, g)

    def run(self, progress: Any = None) -> Exits:
        """Trace all rays through the field as it is.

        Parameters
        ----------
        progress : bool or callable, optional

        Returns
        -------
        Exits

        Examples
        --------
        >>> importon.bend.load_file("rod.xml", count=16).run().x.shape
        (16, 3)
        """
        n_taps = int(self.options["n_taps"])
        records, stats = np.zeros(self.n_rays, EXIT), make(_c.imp_bend_stats)
        taps = np.zeros((self.n_rays, n_taps), EXIT) if n_taps else None
        self._run(progress, lib.imp_bend_run, address(records), address(taps), ctypes.byref(stats))
        return exits_of(records, stats, taps)

    def step_error(self, pilots: int = 64, progress: Any = None) -> tuple[float, float]:
        """The error of exits by the step, from rays traced with t, t/2 and t/4.

        Parameters
        ----------
        pilots : int
            About how many rays.
        progress : bool or callable, optional

        Returns
        -------
        error, order : float
            Root mean square over rays; the order seen (0: not to be seen).

        Raises
        ------
        NumericError
            No ray comes to its end with all three steps.

        Examples
        --------
        >>> error, order = importon.bend.load_file("rod.xml", count=16).step_error()
        >>> 0 <= error < 1e-3
        True
        """
        error, order = ctypes.c_double(), ctypes.c_double()
        self._run(progress, lib.imp_bend_step_error, integer(pilots, "pilots", 1), ctypes.byref(error), ctypes.byref(order))
        return error.value, order.value

    def check(self, progress: Any = None) -> Check:
        """Check reversal, energy, step and gradients of the problem as it stands.

        Parameters
        ----------
        progress : bool or callable, optional

        Returns
        -------
        importon.Check
            Rows; false if one failed.

        Examples
        --------
        >>> bool(importon.bend.load_file("rod.xml", count=16).check())
        True
        """
        rows, n = ctypes.c_void_p(), ctypes.c_size_t()
        with self.lock:
            self._run(progress, lib.imp_bend_check, ctypes.byref(rows), ctypes.byref(n))
            return check_rows(rows.value, n.value)

    @explained
    def fit(self, *, optimizer: str = "lbfgs", levels: int = 1, iterations: Any = 0, learning_rate: float = 0,
            tolerance: float = 0, scale: float = 0, checkpoint: Any = None, resume: bool = False, carry: int = 0,
            smooth_length: float = 0, progress: Any = None) -> BendFit:
        """Change the field until rays do what the targets ask.

        Parameters
        ----------
        optimizer : str
            "lbfgs", "adam" or "mma".
        levels : int
            Grids are refined levels - 1 times.
        iterations : int or sequence
            Of each level; 0: as the level before; first 0: 50.
        learning_rate, tolerance, scale : float
            Of adam, and of the steps at which it stops, in parts of `scale`; and `scale`, a
            large change of a number. 0: 0.05, 1e-6, 0.1.
        checkpoint : path, optional
            Rewritten at every level and every few seconds.
        resume : bool
            Continue from the checkpoint, if it is there.
        carry : int
            What the optimiser learnt at a level, at the next: 1: is carried on, -1: is not, 0: of
            L-BFGS only.
        smooth_length : float
            Of "lbfgs" on grids: changes are smooth over this length as long as the rays allow it.
            0: every coefficient for itself.
        progress : bool or callable, optional

        Returns
        -------
        BendFit

        Raises
        ------
        Cancelled
            By the callback; `result` is the best field so far, which is set.
        ArgumentError
            An option is out of its range.

        Examples
        --------
        >>> bend = importon.bend.load_file("rod.xml", count=16)
        >>> bend.field.theta = 1.02 * bend.field.theta
        >>> fit = bend.fit(iterations=10)
        >>> fit.value < fit.start
        True
        """
        each = [iterations] if np.ndim(iterations) == 0 else list(iterations)
        if len(each) > _c.IMP_BEND_LEVELS_MAX:
            raise ArgumentError("iterations are for at most %d levels" % _c.IMP_BEND_LEVELS_MAX)
        path = None if checkpoint is None else text(checkpoint, "checkpoint")
        options = make(_c.imp_bend_fit_options, optimizer=choice("imp_optimizer", optimizer, "optimizer"),
                       levels=integer(levels, "levels"), learning_rate=float(learning_rate), tolerance=float(tolerance),
                       scale=float(scale), checkpoint=path, resume=bool(resume), carry=integer(carry, "carry"),
                       smooth_length=float(smooth_length))
        for i, n in enumerate(each):
            options.iterations[i] = integer(n, "iterations")
        result = make(_c.imp_bend_fit_result)
        with self.lock:
            status, message = run(self._context, options, progress, lib.imp_bend_fit, self.pointer,
                                  ctypes.byref(options), ctypes.byref(result))
            answer = None
            if status in (_c.IMP_OK, _c.IMP_CANCELLED):
                answer = BendFit(result.iterations, result.levels, result.start, result.value,
                                 copy_doubles(result.history, (result.n_history,)),
                                 (result.reason or b"").decode(errors="replace"), stats_of(result.stats))
            if status:
                raise failure(status, message, answer)
        assert answer is not None
        return answer


def _load(function: Any, arguments: tuple[Any, ...], search: Sequence[Any], defaults: dict[str, Any]) -> Bend:
    not_inside()
    ctx = context()
    options, kept = _load_options("rgb", search, defaults)
    out = ctypes.c_void_p()
    status = function(ctx.pointer, *arguments, ctypes.byref(options), ctypes.byref(out))
    del kept
    if status and "was given, but nothing uses $" in ctx.message():
        raise TypeError(ctx.message().replace("parameter", "keyword", 1))
    ctx.check(status)
    warn_said()
    return Bend(None, Handle(out.value or 0, lib.imp_bend_destroy), ctx)


def load_file(path: Any, *, search: Sequence[Any] = (), **defaults: Any) -> Bend:
    """A problem from a file: <medium type="graded">, <rays> and <target>s (docs/bend.md).

    Parameters
    ----------
    path : str or PathLike
    search : sequence of path, optional
    **defaults
        Values of the file's `<default>`s.

    Returns
    -------
    Bend

    Raises
    ------
    FileError, SceneError, UnsupportedError, TypeError
        As `importon.load_file`.

    Examples
    --------
    >>> importon.bend.load_file("rod.xml", count=16).n_rays
    16
    """
    return _load(lib.imp_bend_load, (text(path, "path"),), search, defaults)


def load_string(xml: str, *, name: str = "string", search: Sequence[Any] = (), **defaults: Any) -> Bend:
    """The same from text.

    Parameters
    ----------
    xml : str
    name : str
        Stands for the file in messages.
    search, **defaults
        As `load_file`'s.

    Returns
    -------
    Bend

    Raises
    ------
    SceneError, UnsupportedError, TypeError
        As `importon.load_string`.

    Examples
    --------
    >>> importon.bend.load_string(open("rod.xml").read(), name="rod", count=8).n_rays
    8
    """
    data = xml.encode()
    return _load(lib.imp_bend_load_string, (data, len(data), text(name, "name")), search, defaults)


for _thing in (Arrivals, Exits, Field, RayGradient, adjoint, dispersion_index, path, tangent, trace):
    _thing.__module__ = __name__  # known by the name that users import
del _thing

__all__ = ["Arrivals", "Bend", "BendFit", "EXIT", "Exits", "Field", "RayGradient", "adjoint", "dispersion_index",
           "load_file", "load_string", "path", "tangent", "trace"]
