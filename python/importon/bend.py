# SPDX-License-Identifier: Apache-2.0
"""Rays that bend in a graded refractive index, and the exact derivative of their bending.

Rays are fixed, so values and gradients are exact: no standard error belongs to them.
"""
from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _c
from ._array import address, copy_doubles, copy_points, numbers, view
from ._check import Check, check_rows
from ._field import Field, _taken
from ._library import (ArgumentError, Handle, choice, context, explained, failure, integer, lib, make, not_inside,
                       PROGRESS_ADDRESS, register_lock, run, text, warn_said, word)
from ._rays import EXIT, Exits, Options, RayGradient, Rays, adjoint, exits_of, path, stats_of, tangent, trace
from ._scene import _load_options
from .elements import _struct

_ARRIVAL = np.dtype([("x", "<f8", 3), ("d", "<f8", 3), ("path", "<f8"), ("weight", "<f8"), ("ray", "<u4"), ("", "<u4")])
assert _ARRIVAL.itemsize == ctypes.sizeof(_c.imp_bend_arrival)


def _dispersion(material: Any) -> Any:
    d, _ = _struct(_c.imp_dispersion, material, "a dispersion", {"model": "imp_dispersion_model"})
    return d


def dispersion_index(material: Mapping[str, Any], um: float) -> float:
    """The index of a material at a wavelength.

    Parameters
    ----------
    material : dict
        model: "cauchy" (c0 + c1/l^2 + c2/l^4) or "sellmeier" (n^2 = 1 + sum of c_k l^2 / (l^2 -
        c_{3+k})); coefficient: six numbers; reference: the wavelength at which a field is the
        index. Wavelengths l are in micrometres.
    um : float
        Wavelength in micrometres.

    Returns
    -------
    float

    Examples
    --------
    >>> round(importon.bend.dispersion_index({"model": "cauchy", "coefficient": [1.5, 0.004, 0, 0, 0, 0]}, 0.5), 6)
    1.516
    """
    return float(lib.imp_dispersion_index(ctypes.byref(_dispersion(material)), float(um)))


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


class Arrivals(NamedTuple):
    """Where rays meet a target's plane, as `Bend.arrivals` gives them.

    Attributes
    ----------
    x, d : ndarray
        [m][3]: positions and directions.
    path, weight : ndarray
        [m]: optical path lengths, and shares of the target's power.
    ray : ndarray
        [m]: number of the ray.
    """

    x: Any
    d: Any
    path: Any
    weight: Any
    ray: Any


class Bend:
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
            ctx.check(lib.imp_bend_create(ctx.pointer, _taken(field), ctypes.byref(out)))
            field._owner = self
            _handle, _context = Handle(out.value or 0, lib.imp_bend_destroy), ctx
        self._handle, self._context = _handle, _context
        self.lock = threading.RLock()
        self._kept: list[Any] = []
        register_lock(self)
        lib.imp_bend_set_progress(self.pointer, PROGRESS_ADDRESS, id(self))

    @property
    def pointer(self) -> int:
        return self._handle.pointer

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

    @property
    def field(self) -> Field:
        """The field, which a fit changes."""
        return Field(self._handle, self._context, self)

    def _run(self, progress: Any, function: Any, *arguments: Any) -> None:
        with self.lock:
            options = make(_c.imp_bend_options, progress_payload=id(self))
            status, message = run(self._context, options, progress, function, self.pointer, *arguments)
            if status:
                raise failure(status, message)

    @property
    def n_rays(self) -> int:
        """How many rays there are."""
        return int(lib.imp_bend_n_rays(self.pointer))

    @property
    def n_bundles(self) -> int:
        """How many bundles of rays there are."""
        return int(lib.imp_bend_n_bundles(self.pointer))

    @property
    def n_targets(self) -> int:
        """How many targets there are."""
        return int(lib.imp_bend_n_targets(self.pointer))

    def _check(self, status: int) -> None:
        self._context.check(status)

    # ---- What it is made of ----

    def add_rays(self, origins: Any, directions: Any, power: Any = None) -> int:
        """Add a bundle: rays that share surfaces, taps and targets by its number.

        Parameters
        ----------
        origins, directions : array
            [n][3]; directions need not be unit.
        power : array, optional
            [n]; None: 1/n each.

        Returns
        -------
        int
            The bundle's number.

        Raises
        ------
        ArgumentError
            An array has another shape, or numbers that are not finite.

        Examples
        --------
        >>> bend = importon.bend.Bend(importon.bend.Field.grid([4, 4, 4], [-1] * 3, [1] * 3, 1.5))
        >>> bend.add_rays([[0, 0, -0.9], [0.1, 0, -0.9]], [[0, 0, 1], [0, 0, 1]])
        0
        """
        rays = Rays(origins, directions)
        p = None if power is None else numbers(power, "power", shape=(rays.n,))
        bundle = ctypes.c_int()
        with self.lock:
            self._check(lib.imp_bend_add_rays(self.pointer, rays.n, address(rays.x), address(rays.d), address(p),
                                              ctypes.byref(bundle)))
        return bundle.value

    def set_options(self, *, surfaces: Sequence[Any] = (), taps: Sequence[Any] = (), **options: Any) -> None:
        """Set surfaces, taps and options of all rays.

        Parameters
        ----------
        surfaces, taps, **options
            As `trace`'s.

        Raises
        ------
        TypeError
            There is no such option.

        Examples
        --------
        >>> bend = importon.bend.Bend(importon.bend.Field.grid([4, 4, 4], [-1] * 3, [1] * 3, 1.5))
        >>> bend.set_options(step=0.05, scheme="yoshida4")
        >>> bend.options["step"], bend.options["scheme"]
        (0.05, 'yoshida4')
        """
        o = Options(surfaces, taps, options)
        o.struct.progress, o.struct.progress_payload = PROGRESS_ADDRESS, id(self)
        with self.lock:
            self._check(lib.imp_bend_set_options(self.pointer, ctypes.byref(o.struct)))
            self._kept.append(o)

    @property
    def options(self) -> dict[str, Any]:
        """The options in use, with the step that rays take."""
        o = make(_c.imp_bend_options)
        self._check(lib.imp_bend_get_options(self.pointer, ctypes.byref(o)))
        made = {f[0]: getattr(o, f[0]) for f in o._fields_ if f[0] not in (
            "size", "surfaces", "taps", "progress", "progress_payload")}
        return {**made, "scheme": word("imp_bend_scheme", o.scheme), "way": word("imp_bend_way", o.way)}

    def set_step(self, cells: float, most: float = 0) -> None:
        """Set the step that the option step = 0 means.

        Parameters
        ----------
        cells : float
            In spacings of the grid.
        most : float
            At most; 0: no limit.

        Examples
        --------
        >>> bend = importon.bend.Bend(importon.bend.Field.grid([4, 4, 4], [-1] * 3, [1] * 3, 1.5))
        >>> bend.set_step(0.5, 0.1)
        >>> bend.options["step"]
        0.1
        """
        self._check(lib.imp_bend_set_step(self.pointer, float(cells), float(most)))

    def set_wavelength(self, bundle: int, material: Mapping[str, Any], um: float) -> None:
        """Give a bundle a wavelength: its rays see the index 1 + k (eta - 1), with k = (n(um) -
        1) / (n(reference) - 1).

        Parameters
        ----------
        bundle : int
        material : dict
            As `dispersion_index`'s.
        um : float
            In micrometres.

        Raises
        ------
        ArgumentError
            There is no such bundle, or k is not positive.

        Examples
        --------
        >>> bend = importon.bend.load_file("rod.xml", count=4)
        >>> bend.set_wavelength(0, {"model": "cauchy", "coefficient": [1.5, 0.004, 0, 0, 0, 0]}, 0.4861)
        >>> bend.wavelength(0)
        0.4861
        """
        with self.lock:
            self._check(lib.imp_bend_set_wavelength(self.pointer, integer(bundle, "bundle"),
                                                    ctypes.byref(_dispersion(material)), float(um)))

    def wavelength(self, bundle: int) -> float:
        """The wavelength of a bundle.

        Parameters
        ----------
        bundle : int

        Returns
        -------
        float
            In micrometres; 0: it was given none.

        Examples
        --------
        >>> importon.bend.load_file("rod.xml", count=4).wavelength(0)
        0.0
        """
        return float(lib.imp_bend_wavelength(self.pointer, integer(bundle, "bundle")))

    def add_target(self, type: str, *, data: Any = None, pixels: Any = None, sdf: Any = None, **fields: Any) -> None:
        """Add a target.

        Parameters
        ----------
        type : str
            "focus", "spot", "points", "direction", "directions", "deflection", "path",
            "wavefront", "image", "farfield" or "shape".
        data : array, optional
            Of "points", "directions" and "deflection": [n][3]; of "path": [n].
        pixels : array, optional
            Of "image" and "farfield": [height][width].
        sdf : Field, optional
            Of "shape": the distance.
        **fields
            bundle, tap (-1: all rays, their exits), weight, at_plane, normal, offset, outside,
            point, origin, u, v: as in `struct imp_bend_target`.

        Raises
        ------
        ArgumentError
            There is no such type, or arrays do not fit the rays.

        Examples
        --------
        >>> bend = importon.bend.Bend(importon.bend.Field.grid([4, 4, 4], [-1] * 3, [1] * 3, 1.5))
        >>> bend.add_rays([[0.2, 0, -0.9]], [[0, 0, 1]])
        0
        >>> bend.add_target("focus", point=[0, 0, 1])
        >>> round(bend.objective()[0], 4)
        0.02
        """
        t, kept = _struct(_c.imp_bend_target, {"type": type, **fields}, "a target", {"type": "imp_bend_target_type"})
        if data is not None:
            bundle = fields.get("bundle", -1)
            wanted = (-1,) if t.type == _c.IMP_BEND_PATH else (-1, 3)
            data = numbers(data, "data", shape=wanted)
            if bundle == -1 and len(data) != self.n_rays:
                raise ArgumentError("%d data for %d rays" % (len(data), self.n_rays))
            rays = make(_c.imp_bend_rays)
            lib.imp_bend_get_rays(self.pointer, ctypes.byref(rays))
            if bundle != -1 and rays.group:
                n = int(np.sum(view(self, rays.group, (rays.n,), "<u2") == bundle))
                if len(data) != n:
                    raise ArgumentError("%d data for %d rays of bundle %d" % (len(data), n, bundle))
            t.data = address(data)
        if pixels is not None:
            pixels = numbers(pixels, "pixels", np.float32, ndim=2)
            t.height, t.width, t.pixels = pixels.shape[0], pixels.shape[1], address(pixels)
        if sdf is not None:
            t.sdf = sdf.pointer
            self._kept.append(sdf)
        if data is None and t.type in (_c.IMP_BEND_POINTS, _c.IMP_BEND_DIRECTIONS, _c.IMP_BEND_DEFLECTION, _c.IMP_BEND_PATH):
            raise ArgumentError("a target of type '%s' needs data" % type)
        with self.lock:
            self._check(lib.imp_bend_add_target(self.pointer, ctypes.byref(t)))
        del kept

    def add_smoothness(self, weight: float, order: int = 2, edge: float = 0) -> None:
        """Add weight/2 times the sum of squared differences of grid coefficients along each axis.

        Parameters
        ----------
        weight : float
        order : int
            Of the differences, 1 or 2.
        edge : float
            Above 0: the sum of sqrt(D^2 + edge^2) instead.

        Examples
        --------
        >>> grid = importon.bend.Field.grid([4, 4, 4], [-1] * 3, [1] * 3, 1.5)
        >>> grid.theta = grid.theta + 0.01 * (np.arange(len(grid.theta)) % 2)
        >>> bend = importon.bend.Bend(grid)
        >>> bend.add_rays([[0, 0, -0.9]], [[0, 0, 1]])
        0
        >>> bend.add_target("wavefront")
        >>> before = bend.objective()[0]
        >>> bend.add_smoothness(1.0)
        >>> bend.objective()[0] > before
        True
        """
        with self.lock:
            self._check(lib.imp_bend_add_smoothness(self.pointer, float(weight), integer(order, "order"), float(edge)))

    def set_bounds(self, lo: float, hi: float) -> None:
        """Bound every number of the field.

        Parameters
        ----------
        lo, hi : float
            May be infinite. Default for grids of the index: 1 and infinity.

        Examples
        --------
        >>> bend = importon.bend.load_file("rod.xml", count=4)
        >>> bend.set_bounds(0, float("inf"))
        """
        with self.lock:
            self._check(lib.imp_bend_set_bounds(self.pointer, float(lo), float(hi)))

    def hold_rim(self, layers: int, value: float = float("nan")) -> None:
        """Hold the grid coefficients of the outermost layers: a fit does not change them.

        Parameters
        ----------
        layers : int
        value : float
            They are set to it; NaN: they stay as they are.

        Examples
        --------
        >>> bend = importon.bend.Bend(importon.bend.Field.grid([4, 4, 4], [-1] * 3, [1] * 3, 1.5))
        >>> bend.hold_rim(1, 1.4)
        >>> bool(np.isclose(bend.field.theta, 1.4).any())
        True
        """
        with self.lock:
            self._check(lib.imp_bend_hold_rim(self.pointer, integer(layers, "layers"), float(value)))

    def hold_outside(self, centre: Any, radius: float, value: float = float("nan")) -> None:
        """Hold the grid coefficients whose node is outside a sphere.

        Parameters
        ----------
        centre : three floats
        radius : float
        value : float
            As `hold_rim`'s.

        Examples
        --------
        >>> bend = importon.bend.Bend(importon.bend.Field.grid([4, 4, 4], [-1] * 3, [1] * 3, 1.5))
        >>> bend.hold_outside([0, 0, 0], 0.9, 1.0)
        """
        c = numbers(centre, "centre", shape=(3,))
        with self.lock:
            self._check(lib.imp_bend_hold_outside(self.pointer, address(c), float(radius), float(value)))

    def hold_number(self, i: int, value: float = float("nan")) -> None:
        """Hold one number of the field.

        Parameters
        ----------
        i : int
            Its place in `field.theta`.
        value : float
            As `hold_rim`'s.

        Raises
        ------
        ArgumentError
            There is no such number.

        Examples
        --------
        >>> bend = importon.bend.load_file("rod.xml", count=4)
        >>> bend.hold_number(0)
        >>> float(bend.objective()[1][0])
        0.0
        """
        with self.lock:
            self._check(lib.imp_bend_hold_number(self.pointer, integer(i, "i", 0), float(value)))

    # ---- What is computed ----

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

    def ray(self, ray: int) -> Any:
        """One ray as points, for drawing.

        Parameters
        ----------
        ray : int

        Returns
        -------
        ndarray
            [m][4]: x, y, z, optical path length.

        Raises
        ------
        ArgumentError
            There is no such ray.

        Examples
        --------
        >>> importon.bend.load_file("rod.xml", count=16).ray(3).shape[1]
        4
        """
        points, n = ctypes.c_void_p(), ctypes.c_size_t()
        with self.lock:
            self._check(lib.imp_bend_ray(self.pointer, integer(ray, "ray", 0), ctypes.byref(points), ctypes.byref(n)))
            return copy_points(self._context, points, n.value)

    def arrivals(self, target: int, progress: Any = None) -> Arrivals:
        """Where rays meet a target's plane, and with which share of its power.

        Parameters
        ----------
        target : int
        progress : bool or callable, optional

        Returns
        -------
        Arrivals

        Raises
        ------
        ArgumentError
            There is no such target.

        Examples
        --------
        >>> arrivals = importon.bend.load_file("rod.xml", count=16).arrivals(0)
        >>> arrivals.x.shape, bool(abs(arrivals.weight.sum() - 1) < 1e-9)
        ((16, 3), True)
        """
        records, n = np.zeros(max(self.n_rays, 1), _ARRIVAL), ctypes.c_size_t()
        self._run(progress, lib.imp_bend_arrivals, integer(target, "target", 0), address(records), ctypes.byref(n))
        there = records[:n.value]
        return Arrivals(*(there[f] for f in ("x", "d", "path", "weight", "ray")))

    def image(self, target: int, progress: Any = None) -> Any:
        """The irradiance that an image target sees.

        Parameters
        ----------
        target : int
        progress : bool or callable, optional

        Returns
        -------
        ndarray
            float32 [height][width]; mean 1 when all power arrives.

        Raises
        ------
        ArgumentError
            There is no such target, or it has no pixels.

        Examples
        --------
        >>> bend = importon.bend.Bend(importon.bend.Field.grid([2, 2, 2], [-1] * 3, [1] * 3, 1.5))
        >>> bend.add_rays([[0.1, 0.2, -0.9]], [[0, 0, 1]])
        0
        >>> bend.add_target("image", pixels=np.ones((4, 4)), origin=[-1, -1, 1], u=[2, 0, 0], v=[0, 2, 0],
        ...                 at_plane=True, normal=[0, 0, 1], offset=1.0, outside=1.5)
        >>> bend.image(0).shape
        (4, 4)
        """
        t = make(_c.imp_bend_target)
        with self.lock:
            self._check(lib.imp_bend_get_target(self.pointer, integer(target, "target", 0), ctypes.byref(t)))
            pixels = np.zeros((max(t.height, 1), max(t.width, 1)), np.float32)
            self._run(progress, lib.imp_bend_image, target, address(pixels))
        return pixels

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


for _thing in (Arrivals, Exits, Field, RayGradient, adjoint, path, tangent, trace):
    _thing.__module__ = __name__  # known by the name that users import
del _thing

__all__ = ["Arrivals", "Bend", "BendFit", "EXIT", "Exits", "Field", "RayGradient", "adjoint", "dispersion_index",
           "load_file", "load_string", "path", "tangent", "trace"]
