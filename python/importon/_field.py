# SPDX-License-Identifier: Apache-2.0
"""Fields of refractive index."""
from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any, Optional

import numpy as np

from . import _c
from ._array import address, numbers
from ._library import ArgumentError, Handle, context, decode, lib, make, not_inside, text, warn_said, word
from .elements import _struct

_GRID = {"interp": "imp_field_interp", "param": "imp_field_param"}


class Field:
    """An index field: `theta` are its numbers.

    Made by `grid`, `profile`, `radial`, `rz`, `tied`, `scaled`, `sum` and `read`; a field that is
    given to `Bend`, or is taken over by another, belongs to that.

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
        warn_said()
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

        Returns
        -------
        Field
            Its `theta` is [z][y][x], flat: cells + 3 along an axis for splines (the first node
            lies one spacing before `lo`), cells + 1 for trilinear.

        Raises
        ------
        ArgumentError
            An empty box, absurd sizes, or an index that is not positive.

        Examples
        --------
        >>> importon.bend.Field.grid([4, 4, 4], [0, 0, 0], [1, 1, 1], 1.5).theta.shape
        (343,)
        """
        g, _ = _struct(_c.imp_field_grid, {"cells": cells, "lo": lo, "hi": hi, "interp": interp, "param": param,
                                           "single": bool(single), "gladstone_dale": gladstone_dale}, "a grid",
                       _GRID)
        return cls._make(lib.imp_field_grid_create, ctypes.byref(g), float(index))

    @classmethod
    def profile(cls, kind: str, params: Any, axis: Any = None) -> Field:
        """A profile by name (docs/bend.md).

        Parameters
        ----------
        kind : str
            "constant", "luneburg", "maxwell", "rod", "rod-vendor", "rod-power", "sech", "plume",
            "polynomial", "axial" or "linear".
        params : array
            Its numbers, in the order of `names`.
        axis : three floats, optional
            Of kinds that have one; None: z.

        Returns
        -------
        Field
            `names` tells the order of its numbers.

        Raises
        ------
        ArgumentError
            There is no such kind, or it has another number of parameters.

        Examples
        --------
        >>> importon.bend.Field.profile("rod", [1.6, 0.4, 0, 0, 0]).names
        ('n0', 'g', 'x', 'y', 'z')
        """
        name = text(kind, "kind")
        n = lib.imp_field_profile_count(name)
        p = numbers(params, "params", shape=(n,)) if n else numbers(params, "params", ndim=1)
        p = np.append(p, 0.0)  # of a kind that there is not, none
        a = None if axis is None else numbers(axis, "axis", shape=(3,))
        return cls._make(lib.imp_field_profile_create, name, address(p), address(a))

    @classmethod
    def radial(cls, index: float = 1.0, **options: Any) -> Field:
        """A cubic spline in r^2, with the same index everywhere.

        Parameters
        ----------
        index : float
        **options
            cylinder (r is the distance from an axis), centre, axis, radius (of the last cell),
            cells: `theta` has cells + 3 coefficients.

        Returns
        -------
        Field

        Raises
        ------
        TypeError
            It has no such option.

        Examples
        --------
        >>> importon.bend.Field.radial(1.5, cylinder=True, radius=2.0, cells=8).theta.shape
        (11,)
        """
        r, _ = _struct(_c.imp_field_radial, options, "a radial field")
        return cls._make(lib.imp_field_radial_create, ctypes.byref(r), float(index))

    @classmethod
    def rz(cls, index: float = 1.0, **options: Any) -> Field:
        """A tensor cubic spline in r^2 and z, symmetric about an axis, the same everywhere.

        Parameters
        ----------
        index : float
        **options
            centre, axis, radius (of the last cell across the axis), lo, hi (along the axis, from
            the centre), cells_r, cells_z.

        Returns
        -------
        Field
            Its `theta` is [cells_z + 3][cells_r + 3], flat.

        Raises
        ------
        TypeError
            It has no such option.

        Examples
        --------
        >>> importon.bend.Field.rz(1.5, radius=1.0, lo=-1, hi=1, cells_r=2, cells_z=4).theta.shape
        (35,)
        """
        r, _ = _struct(_c.imp_field_rz, options, "an rz field")
        return cls._make(lib.imp_field_rz_create, ctypes.byref(r), float(index))

    @classmethod
    def tied(cls, grid: Field, *, mirror: Any = (0, 0, 0), axis: int = 2, fold: Any = 0) -> Field:
        """A grid that keeps a symmetry: nodes that are taken into each other have one number.

        Parameters
        ----------
        grid : Field
            Taken over: it belongs to the new field then.
        mirror : three bools
            Across the middle planes of x, y, z.
        axis : int
            0, 1 or 2: of turns about the middle.
        fold : int or str
            2: halves; 4: quarters; "axial": nodes at one distance from the axis; 0: no turns.

        Returns
        -------
        Field

        Raises
        ------
        ArgumentError
            It is no grid, or not square about the axis.

        Examples
        --------
        >>> grid = importon.bend.Field.grid([4, 4, 4], [-1] * 3, [1] * 3, 1.5)
        >>> importon.bend.Field.tied(grid, mirror=(1, 1, 1)).theta.shape
        (64,)
        """
        s, _ = _struct(_c.imp_field_symmetry, {"mirror": [int(bool(m)) for m in mirror], "axis": axis,
                                               "fold": _c.IMP_FIELD_AXIAL if fold == "axial" else fold}, "a symmetry")
        return cls._make(lib.imp_field_tie_create, _taken(grid), ctypes.byref(s))

    @classmethod
    def scaled(cls, field: Field, k: float) -> Field:
        """1 + k (eta - 1): a field at another wavelength. Its `theta` is the field's.

        Parameters
        ----------
        field : Field
            Taken over: it belongs to the new field then.
        k : float

        Returns
        -------
        Field

        Raises
        ------
        ArgumentError
            k is not finite, or the field belongs to somebody else.

        Examples
        --------
        >>> field = importon.bend.Field.scaled(importon.bend.Field.profile("constant", [1.5, 0, 0, 0]), 1.02)
        >>> round(float(field.eval([[0, 0, 0]])[0][0]), 6)
        1.51
        """
        return cls._make(lib.imp_field_scaled_create, _taken(field), float(k))

    @classmethod
    def sum(cls, parts: Sequence[Field]) -> Field:
        """The sum of fields. Its `theta` is theirs, one after the other.

        Parameters
        ----------
        parts : sequence of Field
            Taken over: they belong to the new field then.

        Returns
        -------
        Field

        Raises
        ------
        ArgumentError
            There is no part, or one belongs to somebody else.

        Examples
        --------
        >>> parts = [importon.bend.Field.profile("constant", [n, 0, 0, 0]) for n in (1.0, 0.5)]
        >>> importon.bend.Field.sum(parts).theta
        array([1. , 0. , 0. , 0. , 0.5, 0. , 0. , 0. ])
        """
        parts = list(parts)
        for p in parts:
            _free(p)
        if len({id(p) for p in parts}) != len(parts):
            raise ArgumentError("parts: a field is there twice")
        taken = (ctypes.c_void_p * max(len(parts), 1))(*[_taken(p) for p in parts])
        return cls._make(lib.imp_field_sum_create, len(parts), taken)

    @classmethod
    def read(cls, path: Any, **grid: Any) -> Field:
        """Read a field: .vol, .npy ([z][y][x]) or a profile as text.

        Parameters
        ----------
        path : str or PathLike
        **grid
            lo, hi (the box of a .npy), interp, param, single, gladstone_dale: as `grid`'s.

        Returns
        -------
        Field

        Raises
        ------
        FileError
            It cannot be read.
        SceneError
            It is no such file, or damaged.

        Examples
        --------
        >>> importon.bend.Field.grid([2, 2, 2], [-1] * 3, [1] * 3, 1.5).write("block.npy")
        >>> importon.bend.Field.read("block.npy", lo=[-1] * 3, hi=[1] * 3).grid_info["cells"]
        (2, 2, 2)
        """
        g, _ = _struct(_c.imp_field_grid, grid, "a grid", _GRID)
        return cls._make(lib.imp_field_read, text(path, "path"), ctypes.byref(g))

    @property
    def pointer(self) -> int:
        if self._owner is not None:
            return int(lib.imp_bend_field(self._owner.pointer))
        return self._handle.pointer

    def write(self, path: Any) -> None:
        """Write samples at the cells' corners (.vol, .npy), or a radial profile (.txt).

        Parameters
        ----------
        path : str or PathLike

        Raises
        ------
        ArgumentError
            The extension and the field do not go together.
        FileError
            The file cannot be written.

        Examples
        --------
        >>> importon.bend.Field.grid([2, 2, 2], [-1] * 3, [1] * 3, 1.5).write("block.vol")
        """
        self._context.check(lib.imp_field_write(self.pointer, text(path, "path")))

    @property
    def kind(self) -> str:
        """"spline", "trilinear", "radial", "rz", "tied grid", "scaled", "sum", or the profile's name."""
        return str(lib.imp_field_kind(self.pointer).decode())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers; () for grids."""
        pointer, n = self.pointer, lib.imp_field_n_theta(self.pointer)
        if not n or lib.imp_field_param_name(pointer, 0) is None:
            return ()
        return tuple(decode(lib.imp_field_param_name(pointer, i)) for i in range(n))

    @property
    def grid_info(self) -> Optional[dict[str, Any]]:
        """Of a grid: cells, lo, hi, interp, param, single, gladstone_dale; else None."""
        g = make(_c.imp_field_grid)
        if lib.imp_field_get_grid(self.pointer, ctypes.byref(g)):
            return None
        return {"cells": tuple(g.cells), "lo": tuple(g.lo), "hi": tuple(g.hi), "interp": word("imp_field_interp", g.interp),
                "param": word("imp_field_param", g.param), "single": bool(g.single), "gladstone_dale": g.gladstone_dale}

    @property
    def rz_info(self) -> Optional[dict[str, Any]]:
        """Of an rz field: centre, axis, radius, lo, hi, cells_r, cells_z; else None."""
        r = make(_c.imp_field_rz)
        if lib.imp_field_get_rz(self.pointer, ctypes.byref(r)):
            return None
        return {f[0]: tuple(v) if hasattr(v, "_length_") else v for f in r._fields_ if f[0] != "size"
                for v in [getattr(r, f[0])]}

    @property
    def theta(self) -> Any:
        """The field's numbers [n]; assigning sets them."""
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
        """Lowest and highest corner of where it is defined; infinite for profiles."""
        lo, hi = (ctypes.c_double * 3)(), (ctypes.c_double * 3)()
        lib.imp_field_get_bounds(self.pointer, lo, hi)
        return tuple(lo), tuple(hi)

    def eval(self, x: Any, hessian: bool = False) -> Any:
        """Index and its derivatives at points.

        Parameters
        ----------
        x : array
            [n][3]
        hessian : bool
            Also the second derivatives.

        Returns
        -------
        eta, gradient : ndarray
            [n], [n][3]; with `hessian` a third: [n][6], xx yy zz xy xz yz.

        Examples
        --------
        >>> field = importon.bend.Field.profile("rod", [1.6, 0.4, 0, 0, 0])
        >>> eta, gradient, second = field.eval([[0, 0, 1]], hessian=True)
        >>> eta.shape, gradient.shape, second.shape
        ((1,), (1, 3), (1, 6))
        """
        points = numbers(x, "x", shape=(-1, 3))
        n, pointer = len(points), self.pointer
        eta, gradient, second = np.empty(n), np.empty((n, 3)), np.empty((n, 6) if hessian else (n, 0))
        for i in range(n):
            lib.imp_field_eval(pointer, points[i].ctypes.data, eta[i:].ctypes.data, gradient[i].ctypes.data,
                               second[i].ctypes.data if hessian else None)
        return (eta, gradient, second) if hessian else (eta, gradient)

    def eval_adjoint(self, x: Any, eta_bar: Any, gradient_bar: Any) -> Any:
        """The transpose of the derivative of `eval` with respect to `theta`.

        Parameters
        ----------
        x : array
            [n][3]
        eta_bar, gradient_bar : array
            [n], [n][3]: derivatives of an objective.

        Returns
        -------
        ndarray
            [n_theta]: sum of eta_bar d eta / d theta + gradient_bar . d grad eta / d theta.

        Examples
        --------
        >>> field = importon.bend.Field.profile("constant", [1.5, 0, 0, 0])
        >>> field.eval_adjoint([[0, 0, 0], [1, 0, 0]], [1.0, 2.0], np.zeros((2, 3)))
        array([3., 0., 0., 0.])
        """
        points = numbers(x, "x", shape=(-1, 3))
        n, pointer = len(points), self.pointer
        a, b = numbers(eta_bar, "eta_bar", shape=(n,)), numbers(gradient_bar, "gradient_bar", shape=(n, 3))
        theta_bar = np.zeros(lib.imp_field_n_theta(pointer))
        for i in range(n):
            lib.imp_field_splat(pointer, points[i].ctypes.data, float(a[i]), b[i].ctypes.data, address(theta_bar))
        return theta_bar

    def eval_tangent(self, x: Any, theta_dot: Any) -> tuple[Any, Any]:
        """The derivative of `eval` along a direction of `theta`.

        Parameters
        ----------
        x : array
            [n][3]
        theta_dot : array
            [n_theta]

        Returns
        -------
        eta, gradient : ndarray
            [n], [n][3]

        Examples
        --------
        >>> field = importon.bend.Field.profile("constant", [1.5, 0, 0, 0])
        >>> field.eval_tangent([[0, 0, 0]], [2.0, 0, 0, 0])[0]
        array([2.])
        """
        points, pointer = numbers(x, "x", shape=(-1, 3)), self.pointer
        dot = numbers(theta_dot, "theta_dot", shape=(lib.imp_field_n_theta(pointer),))
        eta, gradient = np.empty(len(points)), np.empty((len(points), 3))
        for i in range(len(points)):
            lib.imp_field_tangent(pointer, points[i].ctypes.data, address(dot), eta[i:].ctypes.data, gradient[i].ctypes.data)
        return eta, gradient

    def _corners(self) -> tuple[int, int, int]:
        info = self.grid_info
        if info is None:
            raise ArgumentError("a %s field has no samples: a grid is wanted" % self.kind)
        x, y, z = info["cells"]
        return z + 1, y + 1, x + 1

    def set_samples(self, samples: Any) -> None:
        """Set a grid by samples of the index (or of density) at the corners of its cells. A
        spline passes through them.

        Parameters
        ----------
        samples : array
            [z][y][x], cells + 1 along an axis.

        Raises
        ------
        ArgumentError
            The field is no grid, or the samples have another shape.

        Examples
        --------
        >>> field = importon.bend.Field.grid([2, 2, 2], [-1] * 3, [1] * 3)
        >>> field.set_samples(np.full((3, 3, 3), 1.25))
        >>> round(float(field.eval([[0.3, 0.1, 0]])[0][0]), 6)
        1.25
        """
        not_inside()
        v = numbers(samples, "samples", shape=self._corners())
        self._context.check(lib.imp_field_set_samples(self.pointer, address(v)))

    def samples_adjoint(self, theta_bar: Any) -> Any:
        """The transpose of `set_samples`, of grids whose numbers are the index.

        Parameters
        ----------
        theta_bar : array
            [n_theta]: derivative of an objective.

        Returns
        -------
        ndarray
            [z][y][x]: its derivative with respect to samples.

        Examples
        --------
        >>> field = importon.bend.Field.grid([2, 2, 2], [-1] * 3, [1] * 3, interp="trilinear")
        >>> float(field.samples_adjoint(np.ones(27)).sum())
        27.0
        """
        shape = self._corners()
        bar = numbers(theta_bar, "theta_bar", shape=(lib.imp_field_n_theta(self.pointer),))
        samples_bar = np.zeros(shape)
        self._context.check(lib.imp_field_samples_vjp(self.pointer, address(bar), address(samples_bar)))
        return samples_bar

    def refined(self) -> Field:
        """The same function on twice as many cells along each axis.

        Returns
        -------
        Field

        Raises
        ------
        ArgumentError
            The field is no grid.

        Examples
        --------
        >>> importon.bend.Field.grid([2, 2, 2], [-1] * 3, [1] * 3).refined().grid_info["cells"]
        (4, 4, 4)
        """
        out = ctypes.c_void_p()
        self._context.check(lib.imp_field_refine(self.pointer, ctypes.byref(out)))
        return Field(Handle(out.value or 0, lib.imp_field_destroy), self._context)

    def refined_adjoint(self, fine_bar: Any) -> Any:
        """The transpose of `refined`: a derivative with respect to the fine numbers, to one with
        respect to this field's.

        Parameters
        ----------
        fine_bar : array
            [n_theta of the refined field]

        Returns
        -------
        ndarray
            [n_theta]

        Examples
        --------
        >>> field = importon.bend.Field.grid([2, 2, 2], [-1] * 3, [1] * 3)
        >>> field.refined_adjoint(np.ones(len(field.refined().theta))).shape == field.theta.shape
        True
        """
        bar = numbers(fine_bar, "fine_bar", shape=(len(self.refined().theta),))
        coarse_bar = np.zeros(lib.imp_field_n_theta(self.pointer))
        self._context.check(lib.imp_field_refine_vjp(self.pointer, address(bar), address(coarse_bar)))
        return coarse_bar

    def __repr__(self) -> str:
        return "<importon.bend.Field '%s', %d numbers>" % (self.kind, lib.imp_field_n_theta(self.pointer))


def _free(field: Any) -> None:
    if not isinstance(field, Field):
        raise TypeError("a field is wanted, not a %s" % type(field).__name__)
    if field._owner is not None:
        raise ArgumentError("this field belongs to a problem")
    field.pointer  # refuses one that was taken over


def _taken(field: Any) -> int:
    """The field, which the library takes over."""
    _free(field)
    return int(field._handle.take())
