# SPDX-License-Identifier: Apache-2.0
"""Samples until the wanted error is reached."""
from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np

from . import _c
from ._array import address
from ._gradient import Estimate, _adjoint
from ._library import integer, lib, make
from ._picture import Picture
from ._problem import Problem, check_scene, run_options
from ._render import make_picture
from ._scene import Scene
from ._values import Gradient


class Reached(NamedTuple):
    """How a sequence of looks ended."""

    reached: bool
    """The wanted error was; False: the samples or the time were up."""
    looks: int
    spp: int
    """Samples per pixel of all looks."""
    relative: float
    """Bound of the error, as a part of the answer."""


def _options(relative: float, risk: float, most_spp: int) -> Any:
    return make(_c.imp_until_options, relative=float(relative), risk=float(risk), most_spp=integer(most_spp, "most_spp"))


def _end(end: Any) -> Reached:
    return Reached(bool(end.reached), int(end.looks), int(end.spp), float(end.relative))


def render_until(scene: Scene, relative: float = 0.05, *, params: Any = None, risk: float = 0.05, most_spp: int = 0,
                 sensor: Any = 0, seed: int = 0, spp: int = 0, time_limit: float = 0, drop_budget: float = 0,
                 guide: Any = None, wavelengths: str = "stratified", wavelength_set: int = 0, points: str = "scene",
                 walks_from: str = "scene", progress: Any = None) -> tuple[Picture, Reached]:
    """A picture that is as close to the true one as is asked for.

    Parameters
    ----------
    scene : Scene
    relative : float
        The wanted error: the root of the sum of squared errors over that of the squared picture.
    params : SceneParameters or mapping, optional
        As `render`'s.
    risk : float
        Probability, at most, that the error is larger, wherever the samples end.
    most_spp : int
        Samples per pixel, at most; 0: 65536.
    spp : int
        Samples per pixel before the first look; 0: 16. Each look doubles them.
    time_limit : float
        In seconds: no look is begun that would not end in time; 0: none.
    sensor, seed, drop_budget, guide, wavelengths, wavelength_set, points, walks_from, progress
        As `render`'s.

    Returns
    -------
    Picture, Reached

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> picture, end = importon.render_until(scene, 0.5)
    >>> end.reached, end.relative <= 0.5, picture.spp == end.spp
    (True, True, True)
    """
    scene = check_scene(scene)
    options = run_options(scene, sensor=sensor, seed=seed, spp=spp, time_limit=time_limit, drop_budget=drop_budget,
                          guide=guide, wavelengths=wavelengths, wavelength_set=wavelength_set, points=points,
                          walks_from=walks_from)
    wanted, end = _options(relative, risk, most_spp), make(_c.imp_until_end)
    picture = make_picture(scene, params, options, progress, lambda out: (
        lib.imp_render_until, scene.pointer, ctypes.byref(options), ctypes.byref(wanted), out, ctypes.byref(end)))
    return picture, _end(end)


def functional_until(scene: Scene, relative: float = 0.05, params: Any = None, adjoint: Any = None, *, risk: float = 0.05,
                     most_spp: int = 0, sensor: Any = 0, seed: int = 0, spp: int = 0, time_limit: float = 0,
                     drop_budget: float = 0, guide: Any = None, wavelengths: str = "stratified", wavelength_set: int = 0,
                     points: str = "scene", walks_from: str = "scene", progress: Any = None) -> tuple[Estimate, Reached]:
    """`functional`, until the gradient of each parameter is known to a part `relative` of its length.

    Parameters
    ----------
    scene, params, adjoint
        As `functional`'s.
    relative, risk, most_spp, spp, time_limit
        As `render_until`'s. A parameter whose gradient is 0 never gets there.
    sensor, seed, drop_budget, guide, wavelengths, wavelength_set, points, walks_from, progress
        As `render`'s.

    Returns
    -------
    Estimate, Reached

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> mean, end = importon.functional_until(scene, 0.5, "light.*")
    >>> end.reached, end.spp >= 16
    (True, True)
    """
    with Problem(scene, params) as p:
        s = p.scene.sensors[p.scene.sensor_index(sensor)]
        size = s.height * s.width * p.scene.channels
        image = (np.full(size, 1 / size, np.float32) if adjoint is None
                 else _adjoint(p.scene, adjoint, sensor, "adjoint"))
        options = run_options(p.scene, sensor=sensor, seed=seed, spp=spp, time_limit=time_limit, drop_budget=drop_budget,
                              guide=guide, wavelengths=wavelengths, wavelength_set=wavelength_set, points=points,
                              walks_from=walks_from)
        wanted, end = _options(relative, risk, most_spp), make(_c.imp_until_end)
        value, (g, se) = _c.imp_estimate(), p.gradient()
        p.run(options, progress, lib.imp_problem_until, p.pointer, address(image), ctypes.byref(options),
              ctypes.byref(wanted), ctypes.byref(value), address(g) if p.n else None, address(se) if p.n else None,
              ctypes.byref(end))
        return Estimate(value, Gradient(p.scene, p.split(g), p.split(se))), _end(end)
