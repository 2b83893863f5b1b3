# SPDX-License-Identifier: Apache-2.0
"""What is traced and what is wanted of bent rays: rays and their wavelengths, options, targets, what is held."""
from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _c
from ._array import address, numbers, view
from ._context import Handle, failure
from ._errors import ArgumentError
from ._field import Field
from ._library import integer, lib, make, word
from ._rays import Options, Rays
from ._run import PROGRESS_ADDRESS, run
from ._struct import struct_of


def _dispersion(material: Any) -> Any:
    d, _ = struct_of(_c.imp_dispersion, material, "a dispersion", {"model": "imp_dispersion_model"})
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


class BendProblem:
    """The part of `Bend` that is set before it is computed."""

    _handle: Handle
    _context: Any
    lock: Any
    _kept: list[Any]

    @property
    def pointer(self) -> int:
        return self._handle.pointer

    @property
    def field(self) -> Field:
        """The field, which a fit changes."""
        return Field(self._handle, self._context, self)

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
        t, kept = struct_of(_c.imp_bend_target, {"type": type, **fields}, "a target", {"type": "imp_bend_target_type"})
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

    def _run(self, progress: Any, function: Any, *arguments: Any) -> None:
        with self.lock:
            options = make(_c.imp_bend_options, progress_payload=id(self))
            status, message = run(self._context, options, progress, function, self.pointer, *arguments)
            if status:
                raise failure(status, message)
