# SPDX-License-Identifier: Apache-2.0
"""Arrays in and out: anything with DLPack or the buffer protocol, NumPy out."""
from __future__ import annotations

from typing import Any, Optional

import numpy as np

from ._errors import ArgumentError, OutOfMemoryError
from ._library import lib

_CPU = (1, 3, 11)  # DLPack device types whose memory a CPU reads: kDLCPU, CUDA's pinned, ROCm's


def _import(value: Any, name: str) -> Any:
    """A NumPy array of the same memory where there is one."""
    if isinstance(value, np.ndarray):
        return value
    if hasattr(value, "__dlpack_device__"):
        try:
            device = tuple(value.__dlpack_device__())
            kind = int(device[0])
        except Exception as error:  # the code of another package, which may raise anything
            raise ArgumentError("%s does not say which device it is on: %r" % (name, error)) from error
        if kind not in _CPU:
            raise ArgumentError("%s is on device %s: copy it to the CPU first" % (name, getattr(value, "device", device)))
        if getattr(value, "requires_grad", False):  # torch exports no part of a graph
            value = value.detach()
        try:
            return np.from_dlpack(value)
        except (BufferError, RuntimeError, TypeError, AttributeError) as error:
            dtype = getattr(value, "dtype", None)
            if dtype is not None and not _numeric_name(str(dtype)):
                raise ArgumentError("%s has dtype %s" % (name, dtype)) from error
    try:
        return np.asarray(value)
    except MemoryError as error:
        raise OutOfMemoryError("%s: %s" % (name, error)) from error
    except Exception as error:  # __array__ of another package may raise anything
        raise ArgumentError("%s is no array: %s" % (name, error or repr(error))) from error


def _numeric_name(dtype: str) -> bool:
    return any(dtype.endswith(end) for end in ("float16", "float32", "float64", "int8", "int16",
                                               "int32", "int64"))


def numbers(value: Any, name: str, dtype: Any = np.float64, shape: Optional[tuple[int, ...]] = None,
            ndim: Optional[int] = None) -> Any:
    """A C-contiguous array of `dtype`: the same memory if it is one already, else a copy.

    Complex numbers, booleans, strings and objects are refused, and other shapes: -1 in
    `shape` is any size. Whether numbers are finite is for the library to say."""
    array = _import(value, name)
    if array.dtype.kind not in "fiu":
        raise ArgumentError("%s has dtype %s: real numbers are wanted" % (name, array.dtype))
    if ndim is not None and array.ndim != ndim:
        raise ArgumentError("%s has shape %s: %d dimensions are wanted" % (name, array.shape, ndim))
    if shape is not None and (array.ndim != len(shape) or
                              any(w not in (-1, n) for w, n in zip(shape, array.shape))):
        wanted = tuple("n" if w == -1 else w for w in shape)
        raise ArgumentError("%s has shape %s, not (%s%s)" % (
            name, array.shape, ", ".join(map(str, wanted)), "," if len(wanted) == 1 else ""))
    try:
        with np.errstate(over="ignore"):
            out = np.ascontiguousarray(array, dtype=dtype)
    except MemoryError as error:
        raise OutOfMemoryError("%s: %s" % (name, error)) from error
    return out if out.ndim == array.ndim else out.reshape(array.shape)


class _Memory:
    """Memory of an object of the library, which it keeps."""

    def __init__(self, owner: Any, address: int, shape: tuple[int, ...], kind: str) -> None:
        self.owner = owner
        self.__array_interface__ = {"data": (address, False), "shape": shape, "typestr": kind, "version": 3}


def view(owner: Any, address: int, shape: tuple[int, ...], kind: str = "<f4") -> Any:
    """An array over memory that lives as long as `owner`."""
    return np.asarray(_Memory(owner, address, shape, kind))


def copy_doubles(address: Optional[int], shape: tuple[int, ...]) -> Any:
    """A copy of doubles of the library; NULL: None."""
    if not address:
        return None
    return np.array(np.asarray(_Memory(None, address, shape, "<f8")))


def copy_points(context: Any, points: Any, n: int) -> Any:
    """Points [n][4] that the library has made, which are freed."""
    made = copy_doubles(points.value, (n, 4))
    lib.imp_free(context.pointer, points)
    return np.zeros((0, 4)) if made is None else made


def address(array: Any) -> Any:
    """Where an array's data is; None stays None."""
    return None if array is None else array.ctypes.data
