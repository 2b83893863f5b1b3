# SPDX-License-Identifier: Apache-2.0
"""Fields of refractive index."""
from __future__ import annotations

import ctypes
from typing import Any, Optional

import numpy as np

from . import _c
from ._array import address, numbers
from ._context import Handle
from ._errors import ArgumentError
from ._field_make import FieldMade
from ._library import decode, lib, make, text, word
from ._run import not_inside

class Field(FieldMade):
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
