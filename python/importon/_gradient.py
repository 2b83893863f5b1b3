# SPDX-License-Identifier: Apache-2.0
"""Derivatives of pictures, and losses."""
from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any, Optional

import numpy as np

from . import _c
from ._array import address, numbers
from ._errors import ArgumentError
from ._library import lib
from ._picture import Picture
from ._problem import Problem, run_options
from ._render import make_picture
from ._scene import Scene
from ._values import Gradient


def render_forward(scene: Scene, params: Any, dot: Any, sensor: Any = 0, seed: int = 0, spp: int = 0, *,
                   time_limit: float = 0, drop_budget: float = 0, guide: Any = None, wavelengths: str = "stratified",
                   wavelength_set: int = 0, points: str = "scene", walks_from: str = "scene", progress: Any = None) -> Picture:
    """Forward derivative: the picture J dot, J = d picture / d parameters.

    Parameters
    ----------
    scene : Scene
    params : SceneParameters, names or patterns
        The active parameters; None: all that have a gradient.
    dot : mapping or array
        Of each parameter, its part of the direction, in its unit; parameters that are not
        named stay. Or an array of all active numbers.
    sensor, seed, spp, time_limit, drop_budget, guide, wavelengths, wavelength_set, points, walks_from, progress
        As `render`'s.

    Returns
    -------
    Picture
        Signed, with `se`.

    Raises
    ------
    BiasError
        An active parameter has no unbiased derivative; the message says why.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> name = "light.emitter.radiance.value"
    >>> dot = importon.render_forward(scene, [name], {name: 1}, spp=4)
    >>> bool(dot.mean() > 0)
    True
    """
    with Problem(scene, params) as p:
        x = p.join(dot, "dot")
        options = run_options(p.scene, sensor=sensor, seed=seed, spp=spp, time_limit=time_limit,
                              drop_budget=drop_budget, guide=guide, wavelengths=wavelengths,
                              wavelength_set=wavelength_set, points=points, walks_from=walks_from)
        return make_picture(p.scene, None, options, progress, lambda out: (
            lib.imp_problem_forward, p.pointer, address(x), ctypes.byref(options), out), True)


def _adjoint(scene: Scene, image: Any, sensor: Any, name: str) -> Any:
    s = scene.sensors[scene.sensor_index(sensor)]
    image = numbers(image, name, np.float32)
    image = image[..., None] if image.ndim == 2 else image
    if image.shape != (s.height, s.width, scene.channels):
        raise ArgumentError("%s has shape %s, the picture (%d, %d, %d)" % (
            name, image.shape, s.height, s.width, scene.channels))
    return image


def render_backward(scene: Scene, params: Any, grad_in: Any, sensor: Any = 0, seed: int = 0, spp: int = 0, *,
                    drop_budget: float = 0, guide: Any = None, wavelengths: str = "stratified",
                    wavelength_set: int = 0, points: str = "scene", walks_from: str = "scene", progress: Any = None) -> Gradient:
    """Reverse derivative: J^T grad_in, J = d picture / d parameters.

    Parameters
    ----------
    scene : Scene
    params : SceneParameters, names or patterns
        The active parameters; None: all that have a gradient.
    grad_in : array
        [height][width][channels]: the derivative of an objective with respect to the
        picture. It must come from other random numbers than `seed`: an adjoint image made
        from the same walks is correlated with J, and the gradient then has a bias. `loss`
        has none.
    sensor, seed, spp, drop_budget, guide, wavelengths, wavelength_set, points, walks_from, progress
        As `render`'s.

    Returns
    -------
    Gradient
        By parameter, with `se`.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> g = importon.render_backward(scene, "red.*", np.ones((8, 8, 3)), spp=4)
    >>> g["red.reflectance"].shape, g.se["red.reflectance"].shape
    ((3,), (3,))
    """
    with Problem(scene, params) as p:
        image = _adjoint(p.scene, grad_in, sensor, "grad_in")
        options = run_options(p.scene, sensor=sensor, seed=seed, spp=spp, drop_budget=drop_budget, guide=guide,
                              wavelengths=wavelengths, wavelength_set=wavelength_set, points=points, walks_from=walks_from)
        g, se = p.gradient()
        p.run(options, progress, lib.imp_problem_reverse, p.pointer, address(image), ctypes.byref(options),
              address(g), address(se))
        return Gradient(p.scene, p.split(g), p.split(se))


class Estimate:
    """A number with its standard error, and its gradient: what `functional` and
    `Jacobian.sums` return.

    Attributes
    ----------
    value, se : float
    grad : Gradient
        By parameter.
    grad_se : Values
        One standard error of each number of `grad`.
    bias_order : int
        0: no bias; 1: O(1/N), 2: O(1/N^2) in the samples per pixel.
    """

    def __init__(self, estimate: Any, grad: Gradient) -> None:
        self.value: float = estimate.value
        self.se: float = estimate.se
        self.bias_order: int = estimate.bias_order
        self.grad = grad
        self.grad_se = grad.se

    def __float__(self) -> float:
        return self.value

    def __repr__(self) -> str:
        bias = "" if not self.bias_order else ", bias of order 1/spp%s" % ("^2" if self.bias_order == 2 else "")
        return "%.6g +- %.2g%s" % (self.value, self.se, bias)

    def _repr_html_(self) -> str:
        from ._html import gradient
        return gradient(self)


def functional(scene: Scene, params: Any = None, adjoint: Any = None, sensor: Any = 0, seed: int = 0,
               spp: int = 0, *, drop_budget: float = 0, guide: Any = None, wavelengths: str = "stratified",
               wavelength_set: int = 0, points: str = "scene", walks_from: str = "scene", walks: Any = None,
               progress: Any = None) -> Estimate:
    """A number made of the picture, F = sum(adjoint * picture), and its gradient J^T adjoint.

    Parameters
    ----------
    scene : Scene
    params : SceneParameters, names or patterns
        The active parameters; None: all that have a gradient.
    adjoint : array, optional
        [height][width][channels], from other random numbers than `seed`; None: 1/(pixels
        channels), so that F is the mean of the picture.
    sensor, seed, spp, drop_budget, guide, wavelengths, wavelength_set, points, walks_from, walks, progress
        As `render`'s.

    Returns
    -------
    Estimate
        ``float(f)``, ``f.se``, ``f.grad[name]``, ``f.grad_se[name]``. Errors are taken sample
        by sample, so they are right where filters make pixels share samples.

    Raises
    ------
    BiasError
        An active parameter has no unbiased derivative; the message says why.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> mean = importon.functional(scene, "red.*", spp=16)
    >>> mean.se > 0, mean.grad["red.reflectance"].shape
    (True, (3,))
    """
    with Problem(scene, params) as p:
        image = None if adjoint is None else _adjoint(p.scene, adjoint, sensor, "adjoint")
        options = run_options(p.scene, sensor=sensor, seed=seed, spp=spp, drop_budget=drop_budget, guide=guide,
                              wavelengths=wavelengths, wavelength_set=wavelength_set, points=points, walks_from=walks_from, walks=walks)
        value, (g, se) = _c.imp_estimate(), p.gradient()
        p.run(options, progress, lib.imp_problem_functional, p.pointer, address(image), ctypes.byref(options),
              ctypes.byref(value), address(g) if p.n else None, address(se) if p.n else None)
        return Estimate(value, Gradient(p.scene, p.split(g), p.split(se)))


class Loss(Estimate):
    """The value of a loss, its gradient, and standard errors of both: what `loss` returns.

    Attributes
    ----------
    value, se : float
    grad : Gradient
        By parameter.
    grad_se : Values
        One standard error of each number of `grad`.
    bias_order : int
        0: no bias; 1: O(1/N), 2: O(1/N^2) in the samples per pixel.
    spp : tuple of int
        Samples per pixel that were taken for each target: replicates have one size, so it
        may be a few more than were asked for.
    """

    def __init__(self, estimate: Any, grad: Gradient, spp: tuple[int, ...]) -> None:
        super().__init__(estimate, grad)
        self.spp = spp


def loss(scene: Scene, target: Any, params: Any = None, *, spp: int = 0, seed: int = 0, sensor: Any = 0,
         loss: str = "l2", epsilon: float = 0, weights: Any = None, clip: Any = None, tikhonov: Optional[Mapping[str, float]] = None,
         stay: Optional[Mapping[str, float]] = None, smooth: Optional[Mapping[str, float]] = None,
         drop_budget: float = 0, guide: Any = None, wavelengths: str = "stratified", wavelength_set: int = 0, points: str = "scene", walks_from: str = "scene", walks: Any = None,
         progress: Any = None) -> Loss:
    """A loss between scene and target, and its gradient, from the same walks.

    For quadratic losses through box filters, value and gradient have no bias: each walk is
    compared with the mean of the others (leave one out).

    Parameters
    ----------
    scene : Scene
    target : array, Picture, path; list, or dictionary by sensor
        [height][width][channels] of the sensor. A list has one for each sensor, in order.
    params : SceneParameters, names or patterns
        The active parameters; None: all that have a gradient.
    spp : int
        Samples per pixel; 0: what the scene asks for.
    seed : int
        Another one in each step of an optimiser.
    sensor : int or str
        Of a single target.
    loss : str
        "l2": 1/2 w (I - T)^2, summed over pixels and channels; "relative": divided by
        T^2 + epsilon; "l1"; "log".
    epsilon : float
        Of the relative and log losses; 0: 0.01.
    weights : array or path, optional
        [height][width], >= 0.
    clip : "auto" or (low, high), optional
        Numbers at these levels of the file were clipped there (None: not at this end): they
        have no weight where the scene agrees, which pictures of four times the samples
        decide. "auto": by the file, PNG or JPEG.
    tikhonov, stay, smooth : mapping, optional
        Pattern -> weight W: W/2 |x|^2, W/2 |x - x now|^2, W/2 |grad x|^2 (of textures).
    drop_budget, guide, wavelengths, wavelength_set, points, walks_from, walks, progress
        As `render`'s.

    Returns
    -------
    Loss
        ``float(e)``, ``e.se``, ``e.grad[name]``, ``e.grad_se[name]``.

    Raises
    ------
    ArgumentError
        The target's size is not the sensor's, or a number is not finite.
    BiasError
        An active parameter has no unbiased derivative; the message says why.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> target = importon.render(scene, spp=64, seed=1)
    >>> params = importon.traverse(scene)
    >>> params.keep("red.*")
    >>> params["red.reflectance"] = 0.5
    >>> e = importon.loss(scene, target, params, spp=16)
    >>> e.grad["red.reflectance"].shape, e.se > 0
    ((3,), True)
    """
    with Problem(scene, params) as p:
        options = run_options(p.scene, seed=seed, spp=spp, drop_budget=drop_budget, guide=guide,
                              wavelengths=wavelengths, wavelength_set=wavelength_set, points=points, walks_from=walks_from, walks=walks)
        n = p.add_targets(target, clip, sensor=sensor, weights=weights, loss=loss, epsilon=epsilon)
        p.add_regularisers(tikhonov, stay, smooth)
        if clip is not None:
            p.run(options, None, lib.imp_problem_censor, p.pointer, ctypes.byref(options))
        value, (g, se) = _c.imp_estimate(), p.gradient()
        p.run(options, progress, lib.imp_problem_objective, p.pointer, None, ctypes.byref(options),
              ctypes.byref(value), address(g), address(se))
        spp_taken = tuple(p.spp(i, options) for i in range(n))
        return Loss(value, Gradient(p.scene, p.split(g), p.split(se)), spp_taken)
