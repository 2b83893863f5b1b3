# SPDX-License-Identifier: Apache-2.0
"""What arrives of bent rays: the way of one, and at targets."""
from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np

from . import _c
from ._array import address, copy_points
from ._bend_problem import BendProblem
from ._library import integer, lib, make

_ARRIVAL = np.dtype([("x", "<f8", 3), ("d", "<f8", 3), ("path", "<f8"), ("weight", "<f8"), ("ray", "<u4"), ("", "<u4")])
assert _ARRIVAL.itemsize == ctypes.sizeof(_c.imp_bend_arrival)


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


class BendArrivals(BendProblem):
    """The part of `Bend` about single rays and what targets receive."""

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
