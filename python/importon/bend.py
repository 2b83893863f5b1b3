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
from ._array import address, copy_doubles, numbers, view
from ._library import (ArgumentError, Handle, choice, context, failure, integer, lib, make, not_inside,
                       PROGRESS_ADDRESS, register_lock, run, text, warn_said)
from ._render import Check, check_rows
from ._scene import _load_options
from .elements import _struct

#: One exit of a ray (`struct imp_bend_exit`): position, momentum, optical path length, ...
EXIT = np.dtype([("x", "<f8", 3), ("v", "<f8", 3), ("path", "<f8"), ("tau", "<f8"), ("norm2", "<f8"),
                 ("steps", "<u4"), ("surface", "<u2"), ("flags", "u1"), ("segments", "u1")])
_COTANGENT = np.dtype([("x", "<f8", 3), ("v", "<f8", 3), ("path", "<f8")])
assert EXIT.itemsize == ctypes.sizeof(_c.imp_bend_exit) and _COTANGENT.itemsize == ctypes.sizeof(_c.imp_bend_cotangent)


def _stats(s: Any) -> dict[str, Any]:
    return {f[0]: getattr(s, f[0]) for f in s._fields_ if f[0] != "size"}


class Field:
    """An index field: `theta` are its numbers.

    Made by `grid`, `profile`, `radial`, `read`; a field that is given to `Bend` belongs to it.

    Attributes
    ----------
    kind : str
    theta : ndarray
        [n]; assigning sets them.
    bounds : tuple
        Lowest and highest corner of where it is defined.

    Examples
    --------
    >>> field = importon.bend.Field.profile("luneburg", [1, 0, 0, 0])
    >>> field.kind, len(field.theta)
    ('luneburg', 4)
    >>> eta, gradient = field.eval([[0, 0, 0]])
    >>> round(float(eta[0]), 6)
    1.414214
    """

    def __init__(self, handle: Handle, ctx: Any, owner: Any = None) -> None:
        self._handle, self._context, self._owner = handle, ctx, owner

    @classmethod
    def _make(cls, function: Any, *arguments: Any) -> Field:
        not_inside()
        ctx, out = context(), ctypes.c_void_p()
        ctx.check(function(ctx.pointer, *arguments, ctypes.byref(out)))
        warn_said(4)
        return cls(Handle(out.value or 0, lib.imp_field_destroy), ctx)

    @classmethod
    def grid(cls, cells: Any, lo: Any, hi: Any, index: float = 1.0, *, interp: str = "spline", param: str = "eta",
             single: bool = False, gladstone_dale: float = 0) -> Field:
        """A grid with the same index everywhere.

        Parameters
        ----------
        cells : three ints
            Along x, y, z.
        lo, hi : three floats
            The box that they fill.
        index : float
        interp : str
            "spline" (cubic B-spline) or "trilinear".
        param : str
            What the numbers are: "eta", or "eta2" for eta^2/2.
        single : bool
            Trace with float samples.
        gladstone_dale : float
            K: samples are densities rho, the index 1 + K rho; 0: samples are the index.

        Examples
        --------
        >>> importon.bend.Field.grid([4, 4, 4], [0, 0, 0], [1, 1, 1], 1.5).theta.shape
        (343,)
        """
        g, _ = _struct(_c.imp_field_grid, {"cells": cells, "lo": lo, "hi": hi, "interp": interp, "param": param,
                                           "single": bool(single), "gladstone_dale": gladstone_dale}, "a grid",
                       {"interp": "imp_field_interp", "param": "imp_field_param"})
        return cls._make(lib.imp_field_grid_create, ctypes.byref(g), float(index))

    @classmethod
    def profile(cls, kind: str, params: Any, axis: Any = None) -> Field:
        """A profile by name: "luneburg", "maxwell", "rod", "sech", ... (docs/curved-rays.md)."""
        name = text(kind, "kind")
        n = lib.imp_field_profile_count(name)
        p = numbers(params, "params", shape=(n,)) if n else numbers(params, "params", ndim=1)
        p = np.append(p, 0.0)  # of a kind that there is not, none
        a = None if axis is None else numbers(axis, "axis", shape=(3,))
        return cls._make(lib.imp_field_profile_create, name, address(p), address(a))

    @classmethod
    def radial(cls, index: float = 1.0, **options: Any) -> Field:
        """A cubic spline in r^2: cylinder, centre, axis, radius, cells."""
        r, _ = _struct(_c.imp_field_radial, options, "a radial field")
        return cls._make(lib.imp_field_radial_create, ctypes.byref(r), float(index))

    @classmethod
    def read(cls, path: Any, **grid: Any) -> Field:
        """Read .vol, .npy ([z][y][x]) or a profile as text; lo and hi give the box of a .npy."""
        g, _ = _struct(_c.imp_field_grid, grid, "a grid", {"interp": "imp_field_interp", "param": "imp_field_param"})
        return cls._make(lib.imp_field_read, text(path, "path"), ctypes.byref(g))

    @property
    def pointer(self) -> int:
        if self._owner is not None:
            return int(lib.imp_bend_field(self._owner.pointer))
        return self._handle.pointer

    def write(self, path: Any) -> None:
        """Write samples (.vol, .npy), or a radial profile (.txt)."""
        self._context.check(lib.imp_field_write(self.pointer, text(path, "path")))

    @property
    def kind(self) -> str:
        return str(lib.imp_field_kind(self.pointer).decode())

    @property
    def theta(self) -> Any:
        theta = np.empty(lib.imp_field_n_theta(self.pointer))
        lib.imp_field_get_theta(self.pointer, address(theta))
        return theta

    @theta.setter
    def theta(self, values: Any) -> None:
        not_inside()
        v = numbers(values, "theta", shape=(lib.imp_field_n_theta(self.pointer),))
        self._context.check(lib.imp_field_set_theta(self.pointer, address(v)))

    @property
    def bounds(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        lo, hi = (ctypes.c_double * 3)(), (ctypes.c_double * 3)()
        lib.imp_field_bounds(self.pointer, lo, hi)
        return tuple(lo), tuple(hi)

    def eval(self, x: Any) -> tuple[Any, Any]:
        """Index [n] and its gradient [n][3] at points x [n][3]."""
        points = numbers(x, "x", shape=(-1, 3))
        eta, gradient = np.empty(len(points)), np.empty((len(points), 3))
        for i in range(len(points)):
            lib.imp_field_eval(self.pointer, points[i].ctypes.data, eta[i:].ctypes.data, gradient[i:].ctypes.data, None)
        return eta, gradient

    def __repr__(self) -> str:
        return "<importon.bend.Field '%s', %d numbers>" % (self.kind, lib.imp_field_n_theta(self.pointer))


class Exits(NamedTuple):
    """Where rays end: positions and momenta [n][3], optical path lengths [n], `ok` [n]
    (rays that were lost have no derivative), and how many were lost in which way."""

    x: Any
    v: Any
    path: Any
    ok: Any
    stats: dict[str, Any]
    records: Any


_WORDS = {"scheme": "imp_bend_scheme", "way": "imp_bend_way"}
_SURFACE = {"type": "imp_bend_surface_type", "event": "imp_bend_event"}


class _Options:
    """imp_bend_options and what they point to."""

    def __init__(self, surfaces: Sequence[Any], options: Mapping[str, Any]) -> None:
        self.struct, self.kept = _struct(_c.imp_bend_options, dict(options), "a trace", _WORDS)
        rows = []
        for s in surfaces:
            s = dict(s)
            extra = {k: s.pop(k) for k in ("sdf", "scene") if k in s}
            row, kept = _struct(_c.imp_bend_surface, s, "a surface", _SURFACE)
            for k, v in extra.items():
                setattr(row, k, v.pointer)
            rows.append(row)
            self.kept += [kept, list(extra.values())]
        self.surfaces = (_c.imp_bend_surface * max(len(rows), 1))(*rows)
        self.struct.n_surfaces = len(rows)
        self.struct.surfaces = ctypes.addressof(self.surfaces) if rows else None


class _Rays:
    def __init__(self, origins: Any, directions: Any) -> None:
        self.x = numbers(origins, "origins", shape=(-1, 3))
        self.d = numbers(directions, "directions", shape=(-1, 3))
        if len(self.x) != len(self.d):
            raise ArgumentError("%d origins and %d directions" % (len(self.x), len(self.d)))
        for name, a in (("origins", self.x), ("directions", self.d)):
            if not np.isfinite(a).all():
                raise ArgumentError("%s has numbers that are not finite" % name)
        self.n = len(self.x)
        self.struct = make(_c.imp_bend_rays, n=self.n, x=address(self.x), d=address(self.d))


def _exits(records: Any, stats: Any) -> Exits:
    return Exits(records["x"], records["v"], records["path"], (records["flags"] & _c.IMP_BEND_DROPPED) == 0,
                 _stats(stats), records)


def trace(field: Field, origins: Any, directions: Any, *, surfaces: Sequence[Any] = (), progress: Any = None,
          **options: Any) -> Exits:
    """Trace rays through a field.

    Parameters
    ----------
    field : Field
    origins, directions : array
        [n][3]; directions need not be unit.
    surfaces : sequence of dict, optional
        Where rays end: type ("plane", "sphere", "cylinder", "disc", "box", "sdf",
        "approach", "mesh"), event ("end", "refract", "mirror", "stop"), normal, offset,
        centre, radius, lo, hi, index, sdf (a Field), scene (a Scene). None: the field's box.
    progress : bool or callable, optional
        See `importon.set_progress`.
    **options
        scheme, way, step, max_steps, outside, outside_index, grazing, reversal: as in
        `struct imp_bend_options`.

    Returns
    -------
    Exits
        Same bits for any number of threads.

    Raises
    ------
    ArgumentError
        A number is not finite, or out of its range.

    Examples
    --------
    >>> field = importon.bend.Field.profile("luneburg", [1, 0, 0, 0])
    >>> exits = importon.bend.trace(field, [[0, 0.3, -0.9539]], [[0, 0, 1]], step=0.01,
    ...                             surfaces=[{"type": "sphere", "radius": 1}])
    >>> bool(abs(exits.x[0] - [0, 0, 1]).max() < 1e-2)
    True
    """
    o, rays = _Options(surfaces, options), _Rays(origins, directions)
    records, stats = np.zeros(rays.n, EXIT), make(_c.imp_bend_stats)
    status, message = run(field._context, o.struct, progress, lib.imp_bend_trace, field.pointer,
                          ctypes.byref(o.struct), ctypes.byref(rays.struct), address(records), None, ctypes.byref(stats))
    if status:
        raise failure(status, message)
    return _exits(records, stats)


class RayGradient(NamedTuple):
    """Derivatives with respect to the field's numbers [n_theta], origins and directions [n][3]."""

    theta: Any
    origins: Any
    directions: Any


def _cotangents(n: int, x: Any, v: Any, path: Any) -> Any:
    bars = np.zeros(n, _COTANGENT)
    for name, value, shape in (("x", x, (n, 3)), ("v", v, (n, 3)), ("path", path, (n,))):
        if value is not None:
            bars[name] = numbers(value, name + "_bar", shape=shape)
    return bars


def adjoint(field: Field, origins: Any, directions: Any, exits: Exits, x_bar: Any = None, v_bar: Any = None,
            path_bar: Any = None, *, surfaces: Sequence[Any] = (), progress: Any = None, **options: Any) -> RayGradient:
    """The exact derivative of `trace`, with the same arguments: reverse mode.

    Parameters
    ----------
    field, origins, directions, surfaces, progress, **options
        As `trace`'s.
    exits : Exits
        What it returned. Lost rays give nothing.
    x_bar, v_bar : array, optional
        [n][3]: derivative of an objective with respect to positions and momenta.
    path_bar : array, optional
        [n]: to optical path lengths.

    Returns
    -------
    RayGradient

    Raises
    ------
    BiasError
        The scheme "arc_index" cannot be reversed.

    Examples
    --------
    >>> field = importon.bend.Field.profile("luneburg", [1, 0, 0, 0])
    >>> o, d, s = [[0, 0.3, -0.9539]], [[0, 0, 1]], [{"type": "sphere", "radius": 1}]
    >>> exits = importon.bend.trace(field, o, d, surfaces=s, step=0.01)
    >>> importon.bend.adjoint(field, o, d, exits, path_bar=[1.0], surfaces=s, step=0.01).theta.shape
    (4,)
    """
    o, rays = _Options(surfaces, options), _Rays(origins, directions)
    if not isinstance(exits, Exits) or len(exits.records) != rays.n:
        raise ArgumentError("exits are not of these rays")
    bars = _cotangents(rays.n, x_bar, v_bar, path_bar)
    theta = np.zeros(lib.imp_field_n_theta(field.pointer))
    gx, gd = np.zeros((rays.n, 3)), np.zeros((rays.n, 3))
    out = make(_c.imp_bend_gradient, theta=address(theta), x=address(gx), d=address(gd))
    records = np.ascontiguousarray(exits.records)
    status, message = run(field._context, o.struct, progress, lib.imp_bend_adjoint, field.pointer,
                          ctypes.byref(o.struct), ctypes.byref(rays.struct), address(records), None, address(bars),
                          None, ctypes.byref(out), None)
    if status:
        raise failure(status, message)
    return RayGradient(theta, gx, gd)


def tangent(field: Field, origins: Any, directions: Any, theta_dot: Any = None, origins_dot: Any = None,
            directions_dot: Any = None, *, surfaces: Sequence[Any] = (), progress: Any = None,
            **options: Any) -> tuple[Any, Any, Any]:
    """The derivative of `trace` along a direction: forward mode.

    Parameters
    ----------
    field, origins, directions, surfaces, progress, **options
        As `trace`'s.
    theta_dot : array, optional
        [n_theta]
    origins_dot, directions_dot : array, optional
        [n][3]

    Returns
    -------
    x, v, path
        [n][3], [n][3], [n].
    """
    o, rays = _Options(surfaces, options), _Rays(origins, directions)
    t = None if theta_dot is None else numbers(theta_dot, "theta_dot", shape=(lib.imp_field_n_theta(field.pointer),))
    x = None if origins_dot is None else numbers(origins_dot, "origins_dot", shape=(rays.n, 3))
    d = None if directions_dot is None else numbers(directions_dot, "directions_dot", shape=(rays.n, 3))
    dots = np.zeros(rays.n, _COTANGENT)
    status, message = run(field._context, o.struct, progress, lib.imp_bend_tangent, field.pointer,
                          ctypes.byref(o.struct), ctypes.byref(rays.struct), address(t), address(x), address(d),
                          address(dots), None)
    if status:
        raise failure(status, message)
    return dots["x"], dots["v"], dots["path"]


class BendFit(NamedTuple):
    """An answer of `Bend.fit`."""

    iterations: int
    levels: int
    start: float
    value: float
    history: Any
    reason: str
    stats: dict[str, Any]


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
            ctx.check(lib.imp_bend_create(ctx.pointer, field._handle.take(), ctypes.byref(out)))
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
        """Free the problem and its field."""
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
        return int(lib.imp_bend_n_rays(self.pointer))

    @property
    def n_targets(self) -> int:
        return int(lib.imp_bend_n_targets(self.pointer))

    def add_rays(self, origins: Any, directions: Any, power: Any = None) -> int:
        """A bundle of rays [n][3]; returns its number."""
        rays = _Rays(origins, directions)
        p = None if power is None else numbers(power, "power", shape=(rays.n,))
        bundle = ctypes.c_int()
        with self.lock:
            self._context.check(lib.imp_bend_add_rays(self.pointer, rays.n, address(rays.x), address(rays.d), address(p),
                                                      ctypes.byref(bundle)))
        return bundle.value

    def set_options(self, *, surfaces: Sequence[Any] = (), **options: Any) -> None:
        """Surfaces and options of all rays, as `trace` takes them."""
        o = _Options(surfaces, options)
        o.struct.progress, o.struct.progress_payload = PROGRESS_ADDRESS, id(self)
        with self.lock:
            self._context.check(lib.imp_bend_set_options(self.pointer, ctypes.byref(o.struct)))
            self._kept.append(o)

    def add_target(self, type: str, *, data: Any = None, pixels: Any = None, sdf: Any = None, **fields: Any) -> None:
        """A target: type "focus", "spot", "points", "direction", "directions", "deflection",
        "path", "wavefront", "image", "farfield" or "shape"; fields as in `struct
        imp_bend_target`."""
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
            self._context.check(lib.imp_bend_add_target(self.pointer, ctypes.byref(t)))
        del kept

    def add_smoothness(self, weight: float, order: int = 2, edge: float = 0) -> None:
        """weight/2 sum of squared differences of grid coefficients, of order 1 or 2."""
        with self.lock:
            self._context.check(lib.imp_bend_add_smoothness(self.pointer, float(weight), integer(order, "order"), float(edge)))

    def set_bounds(self, lo: float, hi: float) -> None:
        """Bounds of every number of the field."""
        with self.lock:
            self._context.check(lib.imp_bend_set_bounds(self.pointer, float(lo), float(hi)))

    def objective(self, gradient: bool = True, progress: Any = None) -> tuple[float, Any]:
        """Value and gradient [n_theta] (None without)."""
        value = ctypes.c_double()
        g = np.zeros(lib.imp_field_n_theta(self.field.pointer)) if gradient else None
        self._run(progress, lib.imp_bend_objective, ctypes.byref(value), address(g), None, None)
        return value.value, g

    def run(self, progress: Any = None) -> Exits:
        """Exits of all rays with the field as it is."""
        records, stats = np.zeros(self.n_rays, EXIT), make(_c.imp_bend_stats)
        self._run(progress, lib.imp_bend_run, address(records), None, ctypes.byref(stats))
        return _exits(records, stats)

    def ray(self, ray: int) -> Any:
        """One ray as points [n][4]: x, y, z, optical path length."""
        points, n = ctypes.c_void_p(), ctypes.c_size_t()
        with self.lock:
            self._context.check(lib.imp_bend_ray(self.pointer, integer(ray, "ray", 0), ctypes.byref(points), ctypes.byref(n)))
            made = copy_doubles(points.value, (n.value, 4))
            lib.imp_free(self._context.pointer, points.value)
        return made

    def image(self, target: int, progress: Any = None) -> Any:
        """Irradiance [height][width] that an image target sees; mean 1 when all power arrives."""
        t = make(_c.imp_bend_target)
        with self.lock:
            self._context.check(lib.imp_bend_get_target(self.pointer, integer(target, "target", 0), ctypes.byref(t)))
            pixels = np.zeros((max(t.height, 1), max(t.width, 1)), np.float32)
            self._run(progress, lib.imp_bend_image, target, address(pixels))
        return pixels

    def check(self, progress: Any = None) -> Check:
        """Check reversal, energy, step and gradients: rows, false if one failed."""
        rows, n = ctypes.c_void_p(), ctypes.c_size_t()
        with self.lock:
            self._run(progress, lib.imp_bend_check, ctypes.byref(rows), ctypes.byref(n))
            return check_rows(rows.value, n.value)

    def fit(self, *, optimizer: str = "lbfgs", levels: int = 1, iterations: Any = 0, learning_rate: float = 0,
            tolerance: float = 0, scale: float = 0, checkpoint: Any = None, resume: bool = False, carry: int = 0,
            progress: Any = None) -> BendFit:
        """Change the field until rays do what the targets ask.

        Parameters
        ----------
        optimizer : str
            "lbfgs", "adam" or "mma".
        levels : int
            Grids are refined levels - 1 times.
        iterations : int or sequence
            Of each level; 0: as the level before; first 0: 50.
        learning_rate, tolerance, scale, checkpoint, resume, carry
            As in `struct imp_bend_fit_options`.
        progress : bool or callable, optional

        Returns
        -------
        BendFit
        """
        each = [iterations] if np.ndim(iterations) == 0 else list(iterations)
        if len(each) > _c.IMP_BEND_LEVELS_MAX:
            raise ArgumentError("iterations are for at most %d levels" % _c.IMP_BEND_LEVELS_MAX)
        path = None if checkpoint is None else text(checkpoint, "checkpoint")
        options = make(_c.imp_bend_fit_options, optimizer=choice("imp_optimizer", optimizer, "optimizer"),
                       levels=integer(levels, "levels"), learning_rate=float(learning_rate), tolerance=float(tolerance),
                       scale=float(scale), checkpoint=path, resume=bool(resume), carry=integer(carry, "carry"))
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
                                 (result.reason or b"").decode(errors="replace"), _stats(result.stats))
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
    warn_said(4)
    return Bend(None, Handle(out.value or 0, lib.imp_bend_destroy), ctx)


def load_file(path: Any, *, search: Sequence[Any] = (), **defaults: Any) -> Bend:
    """A problem from a file: <medium type="graded">, <rays> and <target>s (docs/curved-rays.md).

    Parameters
    ----------
    path : str or PathLike
    search : sequence of path, optional
    **defaults
        Values of the file's `<default>`s.

    Returns
    -------
    Bend

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
    """
    data = xml.encode()
    return _load(lib.imp_bend_load_string, (data, len(data), text(name, "name")), search, defaults)


__all__ = ["Bend", "BendFit", "EXIT", "Exits", "Field", "RayGradient", "adjoint", "load_file", "load_string", "tangent",
           "trace"]
