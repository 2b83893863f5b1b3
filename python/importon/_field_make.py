# SPDX-License-Identifier: Apache-2.0
"""Fields of refractive index: the ways to make one."""
from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from . import _c
from ._array import address, numbers
from ._context import Handle, context, warn_said
from ._errors import ArgumentError
from ._library import lib, text
from ._run import not_inside
from ._struct import struct_of

_GRID = {"interp": "imp_field_interp", "param": "imp_field_param"}

F = TypeVar("F", bound="FieldMade")


class FieldMade:
    """The part of `Field` by which one is made."""

    def __init__(self, handle: Handle, ctx: Any, owner: Any = None) -> None:
        self._handle, self._context, self._owner = handle, ctx, owner

    @classmethod
    def _make(cls: type[F], function: Any, *arguments: Any) -> F:
        not_inside()
        ctx, out = context(), ctypes.c_void_p()
        ctx.check(function(ctx.pointer, *arguments, ctypes.byref(out)))
        warn_said()
        return cls(Handle(out.value or 0, lib.imp_field_destroy), ctx)

    @classmethod
    def grid(cls: type[F], cells: Any, lo: Any, hi: Any, index: float = 1.0, *, interp: str = "spline", param: str = "eta",
             single: bool = False, gladstone_dale: float = 0) -> F:
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
        g, _ = struct_of(_c.imp_field_grid, {"cells": cells, "lo": lo, "hi": hi, "interp": interp, "param": param,
                                           "single": bool(single), "gladstone_dale": gladstone_dale}, "a grid",
                       _GRID)
        return cls._make(lib.imp_field_grid_create, ctypes.byref(g), float(index))

    @classmethod
    def profile(cls: type[F], kind: str, params: Any, axis: Any = None) -> F:
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
    def radial(cls: type[F], index: float = 1.0, **options: Any) -> F:
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
        r, _ = struct_of(_c.imp_field_radial, options, "a radial field")
        return cls._make(lib.imp_field_radial_create, ctypes.byref(r), float(index))

    @classmethod
    def rz(cls: type[F], index: float = 1.0, **options: Any) -> F:
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
        r, _ = struct_of(_c.imp_field_rz, options, "an rz field")
        return cls._make(lib.imp_field_rz_create, ctypes.byref(r), float(index))

    @classmethod
    def tied(cls: type[F], grid: FieldMade, *, mirror: Any = (0, 0, 0), axis: int = 2, fold: Any = 0) -> F:
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
        s, _ = struct_of(_c.imp_field_symmetry, {"mirror": [int(bool(m)) for m in mirror], "axis": axis,
                                               "fold": _c.IMP_FIELD_AXIAL if fold == "axial" else fold}, "a symmetry")
        return cls._make(lib.imp_field_tie_create, taken(grid), ctypes.byref(s))

    @classmethod
    def scaled(cls: type[F], field: FieldMade, k: float) -> F:
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
        return cls._make(lib.imp_field_scaled_create, taken(field), float(k))

    @classmethod
    def sum(cls: type[F], parts: Sequence[FieldMade]) -> F:
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
            refuse_taken(p)
        if len({id(p) for p in parts}) != len(parts):
            raise ArgumentError("parts: a field is there twice")
        owned = (ctypes.c_void_p * max(len(parts), 1))(*[taken(p) for p in parts])
        return cls._make(lib.imp_field_sum_create, len(parts), owned)

    @classmethod
    def read(cls: type[F], path: Any, **grid: Any) -> F:
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
        g, _ = struct_of(_c.imp_field_grid, grid, "a grid", _GRID)
        return cls._make(lib.imp_field_read, text(path, "path"), ctypes.byref(g))

    @property
    def pointer(self) -> int:
        if self._owner is not None:
            return int(lib.imp_bend_field(self._owner.pointer))
        return self._handle.pointer


def refuse_taken(field: Any) -> None:
    if not isinstance(field, FieldMade):
        raise TypeError("a field is wanted, not a %s" % type(field).__name__)
    if field._owner is not None:
        raise ArgumentError("this field belongs to a problem")
    field.pointer  # refuses one that was taken over


def taken(field: Any) -> int:
    """The field, which the library takes over."""
    refuse_taken(field)
    return int(field._handle.take())
