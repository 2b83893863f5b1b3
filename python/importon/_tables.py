# SPDX-License-Identifier: Apache-2.0
"""Arrays in place of the files of curves, luminaires and measured materials.

They are written in the file's own format, so that the library's reader checks them as it
checks files."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Callable, Optional

import numpy as np

from ._array import numbers
from ._errors import ArgumentError
from ._objects import is_array

# Reflectances of MERL's files are in these units, 1/sr (Matusik et al. 2003).
_MERL_UNIT = np.array([1 / 1500, 1.15 / 1500, 1.66 / 1500])


def _finite(value: Any, key: str, shape: tuple[int, ...]) -> Any:
    array = numbers(value, key, shape=shape)
    if not np.isfinite(array).all():
        raise ArgumentError("%s: not every number is finite" % key)
    return array


def _lines(table: Any) -> str:
    return "".join(" ".join(map(repr, row)) + "\n" for row in np.asarray(table, float).tolist())


def _rank(value: Any) -> int:
    """Dimensions of an array; -1 where its rows have several lengths, or it is no array."""
    try:
        return int(np.ndim(value))
    except Exception:  # __array__ of another package may raise anything
        return -1


def curves(d: dict[str, Any], name: str) -> Optional[bytes]:
    """`control_points`: [n][4], x, y, z and radius; or a sequence of these, a curve each."""
    value = d.get("control_points")
    if not is_array(value):
        return None
    key = "%s: control_points" % name
    del d["control_points"]
    rank = _rank(value)
    several = isinstance(value, (list, tuple)) and rank != 2 or rank == 3
    each = list(value) if several else [value]
    return "\n".join(_lines(_finite(c, key, (-1, 4))) for c in each).encode()


def luminaire(d: dict[str, Any], name: str) -> Optional[bytes]:
    """`candela` [horizontal][vertical] in cd with `vertical_angles` and `horizontal_angles` in degrees: LM-63."""
    if not is_array(d.get("candela")):
        return None
    candela = _finite(d.pop("candela"), "%s: candela" % name, (-1, -1))
    angles = []
    for key, n in (("vertical_angles", candela.shape[1]), ("horizontal_angles", candela.shape[0])):
        if key not in d:
            if key == "vertical_angles" or n > 1:
                raise ArgumentError("%s: candela of shape %s wants %s, %d angles in degrees" % (name, candela.shape, key, n))
            d[key] = [0.0]
        angles.append(_finite(d.pop(key), "%s: %s" % (name, key), (n,)))
    head = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 %d %d 1 2 0 0 0\n1 1 0\n" % (candela.shape[1], candela.shape[0])
    return (head + _lines(angles[0][:, None]) + _lines(angles[1][:, None]) + _lines(candela)).encode()


def merl(d: dict[str, Any], name: str) -> Optional[bytes]:
    """`data` [half angles][difference angles][azimuths][3], values of the BSDF in 1/sr; negative: not measured."""
    if not is_array(d.get("data")):
        return None
    table = _finite(d.pop("data"), "%s: data" % name, (-1, -1, -1, 3)) / _MERL_UNIT
    planes = np.ascontiguousarray(np.moveaxis(table, 3, 0), "<f8")
    return np.array(table.shape[:3], "<i4").tobytes() + planes.tobytes()


# By type: what makes the file's bytes, and the file's ending.
TABLES: Mapping[str, tuple[Callable[[dict[str, Any], str], Optional[bytes]], str]] = {
    "bsplinecurve": (curves, ".txt"), "linearcurve": (curves, ".txt"), "ies": (luminaire, ".ies"), "merl": (merl, ".binary")}
