# SPDX-License-Identifier: Apache-2.0
"""Rays through a field of refractive index, and the exact derivative of their bending."""
from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from . import _c
from ._array import address, copy_points, numbers
from ._context import failure
from ._errors import ArgumentError
from ._field import Field
from ._library import integer, lib, make
from ._run import run
from ._struct import struct_of

#: One end of a ray, or its crossing of a tap (`struct imp_bend_exit`).
EXIT = np.dtype([("x", "<f8", 3), ("v", "<f8", 3), ("path", "<f8"), ("tau", "<f8"), ("norm2", "<f8"),
                 ("steps", "<u4"), ("surface", "<u2"), ("flags", "u1"), ("segments", "u1")])
_COTANGENT = np.dtype([("x", "<f8", 3), ("v", "<f8", 3), ("path", "<f8")])
assert EXIT.itemsize == ctypes.sizeof(_c.imp_bend_exit) and _COTANGENT.itemsize == ctypes.sizeof(_c.imp_bend_cotangent)


def _stats(s: Any) -> dict[str, Any]:
    return {f[0]: getattr(s, f[0]) for f in s._fields_ if f[0] != "size"}


class Exits(NamedTuple):
    """Where rays end.

    Attributes
    ----------
    x, v : ndarray
        [n][3]: positions; momenta, after refraction.
    path : ndarray
        [n]: optical path lengths.
    ok : ndarray
        [n]: False for rays that were lost, which have no derivative.
    stats : dict
        How many rays were lost in which way.
    records : ndarray
        [n] of `EXIT`.
    taps : ndarray or None
        [n][n_taps] of `EXIT`: crossings of the taps.
    """

    x: Any
    v: Any
    path: Any
    ok: Any
    stats: dict[str, Any]
    records: Any
    taps: Any = None


_WORDS = {"scheme": "imp_bend_scheme", "way": "imp_bend_way"}
_SURFACE = {"type": "imp_bend_surface_type", "event": "imp_bend_event"}


class Options:
    """imp_bend_options and what they point to."""

    def __init__(self, surfaces: Sequence[Any], taps: Sequence[Any], options: Mapping[str, Any]) -> None:
        allowed = dict(options)
        for name in ("surfaces", "n_surfaces", "taps", "n_taps", "progress", "progress_payload"):
            if name in allowed:
                raise TypeError("a trace has no option '%s'" % name)
        self.struct, self.kept = struct_of(_c.imp_bend_options, allowed, "a trace", _WORDS)
        rows = []
        for s in surfaces:
            s = dict(s)
            extra = {k: s.pop(k) for k in ("sdf", "scene") if k in s}
            row, kept = struct_of(_c.imp_bend_surface, s, "a surface", _SURFACE)
            for k, v in extra.items():
                setattr(row, k, v.pointer)
            rows.append(row)
            self.kept += [kept, list(extra.values())]
        self.surfaces = (_c.imp_bend_surface * max(len(rows), 1))(*rows)
        self.struct.n_surfaces = len(rows)
        self.struct.surfaces = ctypes.addressof(self.surfaces) if rows else None
        planes = [struct_of(_c.imp_bend_tap, t, "a tap")[0] for t in taps]
        self.taps = (_c.imp_bend_tap * max(len(planes), 1))(*planes)
        self.n_taps = self.struct.n_taps = len(planes)
        self.struct.taps = ctypes.addressof(self.taps) if planes else None


class Rays:
    """imp_bend_rays and its arrays."""

    def __init__(self, origins: Any, directions: Any, groups: Any = None) -> None:
        self.x = numbers(origins, "origins", shape=(-1, 3))
        self.d = numbers(directions, "directions", shape=(-1, 3))
        if len(self.x) != len(self.d):
            raise ArgumentError("%d origins and %d directions" % (len(self.x), len(self.d)))
        for name, a in (("origins", self.x), ("directions", self.d)):
            if not np.isfinite(a).all():
                raise ArgumentError("%s has numbers that are not finite" % name)
        self.n = len(self.x)
        self.group = None
        if groups is not None:
            whole = numbers(groups, "groups", shape=(self.n,))
            if not np.array_equal(whole, whole.astype(np.uint16)):
                raise ArgumentError("groups has numbers that are not whole, or outside [0, 65535]")
            self.group = whole.astype(np.uint16)
        self.struct = make(_c.imp_bend_rays, n=self.n, x=address(self.x), d=address(self.d), group=address(self.group))


def stats_of(s: Any) -> dict[str, Any]:
    return {f[0]: getattr(s, f[0]) for f in s._fields_ if f[0] != "size"}


def exits_of(records: Any, stats: Any, taps: Any = None) -> Exits:
    return Exits(records["x"], records["v"], records["path"], (records["flags"] & _c.IMP_BEND_DROPPED) == 0,
                 stats_of(stats), records, taps)


def trace(field: Field, origins: Any, directions: Any, *, surfaces: Sequence[Any] = (), taps: Sequence[Any] = (),
          groups: Any = None, progress: Any = None, **options: Any) -> Exits:
    """Trace rays through a field.

    Parameters
    ----------
    field : Field
    origins, directions : array
        [n][3]; directions need not be unit.
    surfaces : sequence of dict, optional
        Where rays end: type ("plane", "sphere", "cylinder", "disc", "box", "sdf",
        "approach", "mesh"), event ("end", "refract", "mirror", "stop"), group, normal, offset,
        centre, radius, lo, hi, index, sdf (a Field), scene (a Scene). None: the field's box.
    taps : sequence of dict, optional
        Planes whose crossings are recorded and end no ray: normal, offset, group; at most 16.
    groups : array of int, optional
        [n]: surfaces and taps with a group of 0 or more act on rays of this group alone.
    progress : bool or callable, optional
        See `importon.set_progress`.
    **options
        scheme ("leapfrog", "euler", "verlet", "yoshida4", "arc", "arc_index"), way, step,
        max_steps, outside, outside_index, grazing, reversal: as in `struct imp_bend_options`.

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
    o, rays = Options(surfaces, taps, options), Rays(origins, directions, groups)
    records, stats = np.zeros(rays.n, EXIT), make(_c.imp_bend_stats)
    crossings = np.zeros((rays.n, o.n_taps), EXIT) if o.n_taps else None
    status, message = run(field._context, o.struct, progress, lib.imp_bend_trace, field.pointer,
                          ctypes.byref(o.struct), ctypes.byref(rays.struct), address(records), address(crossings),
                          ctypes.byref(stats))
    if status:
        raise failure(status, message)
    return exits_of(records, stats, crossings)


def path(field: Field, origins: Any, directions: Any, ray: int = 0, *, surfaces: Sequence[Any] = (),
         groups: Any = None, **options: Any) -> Any:
    """One ray as points, for drawing.

    Parameters
    ----------
    field, origins, directions, surfaces, groups, **options
        As `trace`'s.
    ray : int
        Which of the rays.

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
    >>> field = importon.bend.Field.profile("luneburg", [1, 0, 0, 0])
    >>> points = importon.bend.path(field, [[0, 0.3, -0.9539]], [[0, 0, 1]], step=0.01,
    ...                             surfaces=[{"type": "sphere", "radius": 1}])
    >>> points.shape[1], bool(abs(points[-1, :3] - [0, 0, 1]).max() < 1e-2)
    (4, True)
    """
    o, rays = Options(surfaces, (), options), Rays(origins, directions, groups)
    points, n, end = ctypes.c_void_p(), ctypes.c_size_t(), _c.imp_bend_exit()
    context = field._context
    context.check(lib.imp_bend_path(field.pointer, ctypes.byref(o.struct), ctypes.byref(rays.struct),
                                    integer(ray, "ray", 0), ctypes.byref(points), ctypes.byref(n), ctypes.byref(end)))
    return copy_points(context, points, n.value)


class RayGradient(NamedTuple):
    """Derivatives of an objective of rays: what `adjoint` returns.

    Attributes
    ----------
    theta : ndarray
        [n_theta], with respect to the field's numbers.
    origins, directions : ndarray
        [n][3]; directions as given: a ray depends on d/|d| alone, so this is across d.
    surfaces : ndarray
        [n_surfaces][8]: 0-2 normal (plane) or centre, 3 offset or radius, 4 index outside; not
        of boxes, distance fields and meshes.
    """

    theta: Any
    origins: Any
    directions: Any
    surfaces: Any = None


def _cotangents(shape: tuple[int, ...], x: Any, v: Any, path: Any, what: str = "") -> Any:
    bars = np.zeros(shape, _COTANGENT)
    for name, value, more in (("x", x, (3,)), ("v", v, (3,)), ("path", path, ())):
        if value is not None:
            bars[name] = numbers(value, what + name + "_bar", shape=shape + more)
    return bars


def adjoint(field: Field, origins: Any, directions: Any, exits: Exits, x_bar: Any = None, v_bar: Any = None,
            path_bar: Any = None, *, tap_bars: Any = None, surfaces: Sequence[Any] = (), taps: Sequence[Any] = (),
            groups: Any = None, progress: Any = None, **options: Any) -> RayGradient:
    """The exact derivative of `trace`, with the same arguments: reverse mode.

    Parameters
    ----------
    field, origins, directions, surfaces, taps, groups, progress, **options
        As `trace`'s.
    exits : Exits
        What it returned. Lost rays give nothing.
    x_bar, v_bar : array, optional
        [n][3]: derivative of an objective with respect to positions and momenta.
    path_bar : array, optional
        [n]: to optical path lengths.
    tap_bars : mapping, optional
        "x", "v": [n][n_taps][3]; "path": [n][n_taps]: to crossings of taps.

    Returns
    -------
    RayGradient

    Raises
    ------
    BiasError
        The scheme "arc_index" cannot be reversed.
    ArgumentError
        The exits are not of these rays, or an array has another shape.

    Examples
    --------
    >>> field = importon.bend.Field.profile("luneburg", [1, 0, 0, 0])
    >>> o, d, s = [[0, 0.3, -0.9539]], [[0, 0, 1]], [{"type": "sphere", "radius": 1}]
    >>> exits = importon.bend.trace(field, o, d, surfaces=s, step=0.01)
    >>> importon.bend.adjoint(field, o, d, exits, path_bar=[1.0], surfaces=s, step=0.01).theta.shape
    (4,)
    """
    o, rays = Options(surfaces, taps, options), Rays(origins, directions, groups)
    if not isinstance(exits, Exits) or len(exits.records) != rays.n:
        raise ArgumentError("exits are not of these rays")
    crossings = None if exits.taps is None else np.ascontiguousarray(exits.taps)
    if (0 if crossings is None else crossings.shape[1]) != o.n_taps:
        raise ArgumentError("exits are not of these taps")
    bars, across = _cotangents((rays.n,), x_bar, v_bar, path_bar), None
    if tap_bars is not None:
        given = dict(tap_bars)
        for name in given:
            if name not in ("x", "v", "path"):
                raise TypeError("tap_bars has no '%s'; it has: x, v, path" % name)
        across = _cotangents((rays.n, o.n_taps), given.get("x"), given.get("v"), given.get("path"), "tap_")
    theta = np.zeros(lib.imp_field_n_theta(field.pointer))
    gx, gd = np.zeros((rays.n, 3)), np.zeros((rays.n, 3))
    walls = np.zeros((max(int(o.struct.n_surfaces), 1), 8))
    out = make(_c.imp_bend_gradient, theta=address(theta), x=address(gx), d=address(gd), surfaces=address(walls))
    records = np.ascontiguousarray(exits.records)
    status, message = run(field._context, o.struct, progress, lib.imp_bend_adjoint, field.pointer,
                          ctypes.byref(o.struct), ctypes.byref(rays.struct), address(records), address(crossings),
                          address(bars), address(across), ctypes.byref(out), None)
    if status:
        raise failure(status, message)
    return RayGradient(theta, gx, gd, walls[:int(o.struct.n_surfaces)])


def tangent(field: Field, origins: Any, directions: Any, theta_dot: Any = None, origins_dot: Any = None,
            directions_dot: Any = None, *, surfaces: Sequence[Any] = (), taps: Sequence[Any] = (), groups: Any = None,
            progress: Any = None, **options: Any) -> Any:
    """The derivative of `trace` along a direction: forward mode.

    Parameters
    ----------
    field, origins, directions, surfaces, taps, groups, progress, **options
        As `trace`'s.
    theta_dot : array, optional
        [n_theta]
    origins_dot, directions_dot : array, optional
        [n][3]

    Returns
    -------
    x, v, path : ndarray
        [n][3], [n][3], [n]; with `taps` a fourth, their crossings: a dictionary of "x", "v"
        [n][n_taps][3] and "path" [n][n_taps].

    Examples
    --------
    >>> field = importon.bend.Field.profile("luneburg", [1, 0, 0, 0])
    >>> x, v, path = importon.bend.tangent(field, [[0, 0.3, -0.9539]], [[0, 0, 1]], [1.0, 0, 0, 0], step=0.01,
    ...                                    surfaces=[{"type": "sphere", "radius": 1}])
    >>> x.shape, path.shape
    ((1, 3), (1,))
    """
    o, rays = Options(surfaces, taps, options), Rays(origins, directions, groups)
    t = None if theta_dot is None else numbers(theta_dot, "theta_dot", shape=(lib.imp_field_n_theta(field.pointer),))
    x = None if origins_dot is None else numbers(origins_dot, "origins_dot", shape=(rays.n, 3))
    d = None if directions_dot is None else numbers(directions_dot, "directions_dot", shape=(rays.n, 3))
    dots = np.zeros(rays.n, _COTANGENT)
    across = np.zeros((rays.n, o.n_taps), _COTANGENT) if o.n_taps else None
    status, message = run(field._context, o.struct, progress, lib.imp_bend_tangent, field.pointer,
                          ctypes.byref(o.struct), ctypes.byref(rays.struct), address(t), address(x), address(d),
                          address(dots), address(across))
    if status:
        raise failure(status, message)
    made = dots["x"], dots["v"], dots["path"]
    return made if across is None else (*made, {k: across[k] for k in ("x", "v", "path")})
