# SPDX-License-Identifier: Apache-2.0
"""Transforms, as Mitsuba writes them."""
from __future__ import annotations

from typing import Any, Optional

import numpy as np

from ._array import numbers
from ._errors import ArgumentError


class _Method:
    """Callable on the class, where it begins a transform, and on a transform, which it
    multiplies from the right: both ways of Mitsuba's."""

    def __init__(self, function: Any) -> None:
        self.function = function
        self.__doc__ = function.__doc__

    def __get__(self, instance: Any, owner: Any) -> Any:
        function = self.function

        def method(*args: Any, **kw: Any) -> Transform4f:
            made: Transform4f = owner(function(*args, **kw))
            return made if instance is None else instance @ made

        method.__name__ = function.__name__
        method.__doc__ = function.__doc__
        return method


def _three(value: Any, name: str) -> Any:
    return numbers(value, name, shape=(3,))


def _unit(v: Any, name: str) -> Any:
    length = np.sqrt(v @ v)
    if not (np.isfinite(length) and length > 0):
        raise ArgumentError("%s has no direction" % name)
    return v / length


def _translate(v: Any) -> Any:
    """Move by v [3]."""
    m = np.eye(4)
    m[:3, 3] = _three(v, "v")
    return m


def _scale(v: Any) -> Any:
    """Scale by a number, or by v [3]."""
    v = np.broadcast_to(numbers(v, "v"), 3) if np.ndim(v) == 0 else _three(v, "v")
    return np.diag([*v, 1.0])


def _rotate(axis: Any, angle: float) -> Any:
    """Turn by `angle` degrees about `axis` [3]."""
    x, y, z = _unit(_three(axis, "axis"), "axis")
    c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    m = np.eye(4)
    m[:3, :3] += s * k + (1 - c) * (k @ k)
    return m


def _look_at(origin: Any, target: Any, up: Any = (0, 1, 0)) -> Any:
    """Of a camera at `origin` that looks at `target`."""
    origin = _three(origin, "origin")
    forward = _unit(_three(target, "target") - origin, "target - origin")
    left = _unit(np.cross(_three(up, "up"), forward), "up beside the direction of view")
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = left, np.cross(forward, left), forward, origin
    return m


class Transform4f:
    """A transform of space: a matrix that is written by its parts.

    The methods may begin a transform (`Transform4f.translate(...)`) or go on with one
    (`Transform4f().translate(...).rotate(...)`, applied from right to left, as `@` is):
    ``translate(v)`` moves by v [3]; ``scale(v)`` takes a number or three; ``rotate(axis, angle)``
    turns by degrees; ``look_at(origin, target, up)`` is that of a camera.

    Parameters
    ----------
    matrix : array, optional
        [4][4]; None: the identity.

    Attributes
    ----------
    matrix : ndarray
        [4][4], local to world.

    Examples
    --------
    >>> T = importon.ScalarTransform4f
    >>> (T().translate([1, 2, 3]).scale(2)).matrix[0]
    array([2., 0., 0., 1.])
    >>> T.translate([1, 0, 0]) @ [0, 0, 0]
    array([1., 0., 0.])
    """

    def __init__(self, matrix: Any = None) -> None:
        if isinstance(matrix, Transform4f):
            matrix = matrix.matrix
        self.matrix: Any = np.eye(4) if matrix is None else numbers(matrix, "matrix", shape=(4, 4)).copy()

    translate: Any = _Method(_translate)
    scale: Any = _Method(_scale)
    rotate: Any = _Method(_rotate)
    look_at: Any = _Method(_look_at)

    def inverse(self) -> Transform4f:
        """From world to local.

        Returns
        -------
        Transform4f

        Examples
        --------
        >>> importon.Transform4f.scale(2).inverse() @ [2, 0, 0]
        array([1., 0., 0.])
        """
        return Transform4f(np.linalg.inv(self.matrix))

    def __matmul__(self, other: Any) -> Any:
        if isinstance(other, Transform4f):
            return Transform4f(self.matrix @ other.matrix)
        return self.matrix[:3, :3] @ _three(other, "point") + self.matrix[:3, 3]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Transform4f) and bool(np.array_equal(self.matrix, other.matrix))

    def __hash__(self) -> int:
        return hash(self.matrix.tobytes())

    def __repr__(self) -> str:
        return "Transform4f(%s)" % np.array2string(self.matrix, separator=", ", prefix="Transform4f(")

    def __array__(self, dtype: Optional[Any] = None, copy: Optional[bool] = None) -> Any:
        return np.array(self.matrix, dtype=dtype)


ScalarTransform4f = Transform4f
