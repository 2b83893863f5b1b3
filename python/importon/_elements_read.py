# SPDX-License-Identifier: Apache-2.0
"""What a finite-element solution says: measurements and their derivatives, elements, what arrives at them."""
from __future__ import annotations

import ctypes
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _c
from ._array import copy_doubles
from ._context import Handle
from ._errors import ArgumentError
from ._library import integer, lib, make, rows_of
from ._run import not_inside
from ._scene import Scene


class Sensitivity(NamedTuple):
    """A derivative of the measurement; `share` is value x derivative / measurement."""

    name: str
    param: int
    element: int
    emission: bool
    value: float
    derivative: float
    share: float
    share_error: float


class ElementsRead:
    """The part of `Elements` that only reads."""

    scene: Scene
    _context: Any
    _handle: Optional[Handle]

    @property
    def pointer(self) -> int:
        self.scene.pointer  # it must be there, too
        if self._handle is None:
            raise ArgumentError("there is no solution")
        return self._handle.pointer

    @property
    def info(self) -> dict[str, Any]:
        """Sizes, memory, measurements and the schedule's log: what `struct imp_elements_info` has."""
        with self.scene.lock:
            i = make(_c.imp_elements_info)
            self._context.check(lib.imp_elements_get_info(self.pointer, ctypes.byref(i)))
            made = {f[0]: getattr(i, f[0]) for f in i._fields_ if f[0] not in ("size", "steps", "n_steps")}
            made["measures"] = copy_doubles(i.measures, (i.n_measures,))
            made["reason"] = (i.reason or b"").decode(errors="replace")
            steps = rows_of(_c.imp_elements_step, i.steps, i.n_steps)
            made["steps"] = [{f[0]: getattr(s, f[0]) for f in s._fields_ if f[0] != "size"} for s in steps]
            return made

    @property
    def measures(self) -> Any:
        """[n_sources]: each measurement by itself, without its weight."""
        return self.info["measures"]

    @property
    def measure(self) -> float:
        """The weighted measurements together."""
        return float(self.info["measure"])

    def sensitivity(self, errors: bool = False) -> list[Sensitivity]:
        """Derivatives of the measurement to every light and material number, the largest
        |value x derivative| first.

        Parameters
        ----------
        errors : bool
            Also the error of each share that the directional order makes; takes the time of
            another solution.

        Returns
        -------
        list of Sensitivity

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> rows = importon.elements.Elements(scene, stop=0.2).sensitivity()
        >>> round(sum(r.share for r in rows if r.emission), 6)  # linear in the lights
        1.0
        """
        not_inside()
        function = lib.imp_elements_share_errors if errors else lib.imp_elements_sensitivity
        with self.scene.lock:
            rows, n = ctypes.c_void_p(), ctypes.c_size_t()
            self._context.check(function(self.pointer, ctypes.byref(rows), ctypes.byref(n)))
            found = rows_of(_c.imp_elements_row, rows.value, n.value)
            return [Sensitivity(r.name.decode(errors="replace"), r.param, r.element, bool(r.emission), r.value,
                                r.derivative, r.share, r.share_error) for r in found]

    def element(self, index: int) -> dict[str, Any]:
        """One element of the hierarchy, to be drawn.

        Parameters
        ----------
        index : int
            Below ``info["elements"]``.

        Returns
        -------
        dict
            What `struct imp_elements_element` has; `corner` as an array [corners][3], `parent` None
            for whole polygons, `shape` None for measuring planes.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> solution = importon.elements.Elements(scene, stop=0.2)
        >>> solution.element(0)["level"], solution.element(0)["parent"]
        (0, None)
        """
        not_inside()
        with self.scene.lock:
            x = make(_c.imp_elements_element)
            self._context.check(lib.imp_elements_get_element(self.pointer, integer(index, "index", 0, 2**64 - 1), ctypes.byref(x)))
            made = {f[0]: getattr(x, f[0]) for f in x._fields_ if f[0] != "size"}
            made["shape"] = None if x.shape is None else x.shape.decode(errors="replace")
            made["parent"] = None if x.parent == 2 ** (8 * ctypes.sizeof(ctypes.c_size_t)) - 1 else x.parent
            made["corner"] = np.array(x.corner).reshape(4, 3)[:x.corners].copy()
            for name in ("radiance", "irradiance"):
                made[name] = np.array(made[name])
            made["leaf"] = bool(x.leaf)
            return made

    def arrivals(self, index: int) -> Any:
        """What arrives at an element, link by link, the brightest first.

        Parameters
        ----------
        index : int

        Returns
        -------
        ndarray
            A structured array: `from` (an element), `irradiance` [3], `illuminance`, `measure` (of the
            measurement: what passes here).

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> solution = importon.elements.Elements(scene, stop=0.2)
        >>> rows, element = solution.arrivals(0), solution.element(0)
        >>> bool(abs(rows["illuminance"].sum() - element["illuminance"]) < 1e-3 * element["illuminance"])
        True
        """
        kind = np.dtype([("from", np.uintp), ("irradiance", float, 3), ("illuminance", float), ("measure", float)])
        not_inside()
        with self.scene.lock:
            rows, n = ctypes.c_void_p(), ctypes.c_size_t()
            self._context.check(lib.imp_elements_arrivals(self.pointer, integer(index, "index", 0, 2**64 - 1),
                                                          ctypes.byref(rows), ctypes.byref(n)))
            found = rows_of(_c.imp_elements_arrival, rows.value, n.value)
            made = np.array([(getattr(r, "from"), tuple(r.irradiance), r.illuminance, r.measure) for r in found], kind)
            lib.imp_free(self._context.pointer, rows)
            return made

    def illuminance(self, index: int, width: int, height: int) -> Any:
        """Illuminance at points of the polygon of an element, each with its own visibility.

        Parameters
        ----------
        index : int
        width, height : int
            Of cells along the polygon's first edge and along its last.

        Returns
        -------
        ndarray
            [height][width]; NaN outside a triangle.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> solution = importon.elements.Elements(scene, [{"kind": "shape", "shape": "floor"}], stop=0.2)
        >>> solution.illuminance(0, 4, 4).shape
        (4, 4)
        """
        not_inside()
        cells = (integer(width, "width", 1, 4096), integer(height, "height", 1, 4096))
        out = np.empty((cells[1], cells[0]))
        with self.scene.lock:
            self._context.check(lib.imp_elements_illuminance(self.pointer, integer(index, "index", 0, 2**64 - 1), *cells, out.ctypes.data))
        return out
