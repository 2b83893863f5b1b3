# SPDX-License-Identifier: Apache-2.0
"""Pictures and losses as functions of arrays, for torch and JAX: the numbers of all named
parameters lie one after the other in one array x, in the scene's order."""
from __future__ import annotations

import ctypes
import itertools
import weakref
from collections.abc import Iterable
from typing import Any

import numpy as np

from . import _c
from ._array import address, numbers
from ._errors import ArgumentError
from ._library import lib
from ._params import find
from ._picture import Picture
from ._problem import Problem, check_scene, run_options
from ._render import make_picture

_keys = itertools.count(1)
_known: weakref.WeakValueDictionary[int, Any] = weakref.WeakValueDictionary()


def other_seed(seed: int) -> int:
    """The seed of a derivative: other random numbers than the picture's, from which its
    adjoint image is made; an adjoint made from the same walks would give a bias."""
    return (int(seed) ^ 0x9E3779B97F4A7C15) & (2**64 - 1)


def rest_of(drop_budget: float, guide: Any, wavelengths: str, wavelength_set: int, points: str) -> dict[str, Any]:
    """What is the same of all runs of a Function."""
    return {"drop_budget": drop_budget, "guide": guide, "wavelengths": wavelengths, "wavelength_set": wavelength_set,
            "points": points}


class Function:
    """A picture, and where there is a target a loss, as a function of x [n]."""

    def __init__(self, scene: Any, names: Iterable[str], sensor: Any, spp: int, spp_grad: int,
                 rest: dict[str, Any], target: Any = None, **loss: Any) -> None:
        self.scene = check_scene(scene)
        self.infos = sorted({find(self.scene, n) for n in names}, key=lambda i: i.position)
        if not self.infos:
            raise ArgumentError("values: no parameter is named")
        self.names = [i.name for i in self.infos]
        self.n = sum(i.size for i in self.infos)
        self.sensor = self.scene.sensor_index(sensor)
        s = self.scene.sensors[self.sensor]
        self.shape = (s.height, s.width, self.scene.channels)
        self.spp, self.spp_grad = spp, spp_grad or spp
        self.rest = rest  # of run_options
        self.target, self.loss_options = target, loss
        self.key = next(_keys)
        _known[self.key] = self
        with self._problem():
            pass  # refuses what has no unbiased derivative, before anything is computed

    def _problem(self) -> Problem:
        return Problem(self.scene, self.names)

    def _set(self, p: Problem, x: Any) -> Any:
        x = numbers(x, "values", shape=(self.n,))
        p.check(lib.imp_problem_set_x(p.pointer, address(x)))
        return x

    def picture(self, x: Any, seed: int) -> Picture:
        """[height][width][channels]"""
        with self._problem() as p:
            self._set(p, x)
            options = run_options(self.scene, sensor=self.sensor, seed=int(seed), spp=self.spp, **self.rest)
            picture = make_picture(self.scene, None, options, False, lambda out: (
                lib.imp_render, self.scene.pointer, ctypes.byref(options), out))
        if picture.channels == (("R", "G", "B") if self.shape[2] == 3 else ("Y",)):
            return picture
        # A film of another pixel format: derivatives are of the scene's channels.
        with Problem(self.scene, []) as p:
            return make_picture(self.scene, None, options, False, lambda out: (
                lib.imp_problem_jacobian, p.pointer, ctypes.byref(options), out, None))

    def backward(self, x: Any, image: Any, seed: int) -> Any:
        """J^T image [n]"""
        image = numbers(image, "gradient", np.float32, shape=self.shape)
        with self._problem() as p:
            self._set(p, x)
            options = run_options(self.scene, sensor=self.sensor, seed=int(seed), spp=self.spp_grad, **self.rest)
            g, se = p.gradient()
            p.run(options, False, lib.imp_problem_reverse, p.pointer, address(image), ctypes.byref(options), address(g),
                  address(se))
            return g

    def forward(self, x: Any, x_dot: Any, seed: int) -> Picture:
        """J x_dot [height][width][channels]"""
        dot = numbers(x_dot, "tangent", shape=(self.n,))
        with self._problem() as p:
            self._set(p, x)
            options = run_options(self.scene, sensor=self.sensor, seed=int(seed), spp=self.spp_grad, **self.rest)
            return make_picture(self.scene, None, options, False, lambda out: (
                lib.imp_problem_forward, p.pointer, address(dot), ctypes.byref(options), out), True)

    def loss(self, x: Any, seed: int, gradient: bool = True) -> tuple[float, Any]:
        """Value and gradient [n], from the same walks."""
        with self._problem() as p:
            p.add_targets(self.target, sensor=self.sensor, **self.loss_options)
            x = numbers(x, "values", shape=(self.n,))
            options = run_options(self.scene, seed=int(seed), spp=self.spp, **self.rest)
            value, (g, se) = _c.imp_estimate(), p.gradient()
            p.run(options, False, lib.imp_problem_objective, p.pointer, address(x), ctypes.byref(options),
                  ctypes.byref(value), address(g) if gradient else None, address(se) if gradient else None)
            return value.value, g


def known(key: int) -> Any:
    """A function by its number, which goes through graphs where objects cannot."""
    function = _known.get(int(key))
    if function is None:
        raise ArgumentError("the scene of this function is gone")
    return function


class RayFunction:
    """Where rays end, as a function of field, origins and directions."""

    def __init__(self, field: Any, options: dict[str, Any]) -> None:
        if options.get("taps"):
            raise ArgumentError("taps are not among what this function returns: importon.bend.trace has them")
        self.field, self.options = field, options
        self.n = len(field.theta)
        self.key = next(_keys)
        _known[self.key] = self

    def trace(self, theta: Any, origins: Any, directions: Any) -> Any:
        from . import bend
        self.field.theta = theta
        return bend.trace(self.field, origins, directions, progress=False, **self.options)

    def backward(self, theta: Any, origins: Any, directions: Any, x_bar: Any, v_bar: Any, path_bar: Any) -> Any:
        from . import bend
        exits = self.trace(theta, origins, directions)
        g = bend.adjoint(self.field, origins, directions, exits, x_bar, v_bar, path_bar, progress=False, **self.options)
        return g.theta, g.origins, g.directions
