# SPDX-License-Identifier: Apache-2.0
"""Derivatives of pictures, and losses."""
from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any, Optional

import numpy as np

from . import _c
from ._array import address, numbers
from ._library import ArgumentError, failure, lib, run
from ._params import Gradient, ParameterInfo, Values
from ._picture import Picture, from_film
from ._problem import Problem, run_options
from ._render import make_picture
from ._scene import Scene


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


# ---- Jacobians ---------------------------------------------------------------------


class Jacobian(Values):
    """Derivative pictures by parameter: name -> float32 [*shape][height][width][channels],
    `se` likewise; `picture` is the picture itself, `pictures` has each as a `Picture`."""

    def __init__(self, scene: Scene, values: dict[str, Any], se: dict[str, Any], picture: Picture,
                 pictures: dict[str, list[Picture]], made: dict[str, Any], x: Any) -> None:
        super().__init__(scene, values)
        self.se = Values(scene, se)
        self.picture = picture
        self.pictures = Values(scene, pictures)
        self._made, self._x = made, x

    def sums(self, adjoint: Any = None, *, progress: Any = None) -> Estimate:
        """F = sum(adjoint * picture) of the picture and of each derivative picture, with
        standard errors taken sample by sample; a part of the walks is made again.

        Parameters
        ----------
        adjoint : array, optional
            [height][width][channels]; None: 1/(pixels channels), so that the sums are means.
        progress : bool or callable, optional
            See `set_progress`.

        Returns
        -------
        Estimate

        Raises
        ------
        ArgumentError
            The parameters' values are no longer those of the pictures.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> means = importon.jacobian(scene, "red.*", spp=16).sums()
        >>> means.grad["red.reflectance"].shape, means.se > 0
        ((3,), True)
        """
        with Problem(self._scene, list(self)) as p:
            if not np.array_equal(p.x(), self._x):
                raise ArgumentError("the scene's parameters were changed since the pictures were made")
            image = None if adjoint is None else _adjoint(p.scene, adjoint, self._made["sensor"], "adjoint")
            options = run_options(p.scene, **self._made)
            films = [q._film.pointer for info, _ in p.blocks for q in self.pictures[info.name]]
            value, sums = _c.imp_estimate(), (_c.imp_estimate * max(p.n, 1))()
            assert self.picture._film is not None
            p.run(options, progress, lib.imp_problem_jacobian_sums, p.pointer, address(image), ctypes.byref(options),
                  self.picture._film.pointer, (ctypes.c_void_p * len(films))(*films), None, 0, ctypes.byref(value), sums)
            g, se = (np.array([getattr(s, f) for s in sums]) for f in ("value", "se"))
            return Estimate(value, Gradient(p.scene, p.split(g), p.split(se)))


def jacobian(scene: Scene, params: Any = None, sensor: Any = 0, seed: int = 0, spp: int = 0, *,
             time_limit: float = 0, drop_budget: float = 0, guide: Any = None, wavelengths: str = "stratified",
             wavelength_set: int = 0, points: str = "scene", walks_from: str = "scene", progress: Any = None) -> Jacobian:
    """A derivative picture for each active number (at most 256), from one set of walks.

    Parameters
    ----------
    scene, params, sensor, seed, spp, time_limit, drop_budget, guide, wavelengths, wavelength_set, points, walks_from, progress
        As `render_forward`'s.

    Returns
    -------
    Jacobian
        name -> [*shape of the parameter][height][width][channels]; `se`, `picture`, `sums`, and
        `pictures` (lists of `Picture`, to show and to write).

    Raises
    ------
    ArgumentError
        More than 256 numbers are active.
    BiasError
        An active parameter has no unbiased derivative; the message says why.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> j = importon.jacobian(scene, "red.*", spp=4)
    >>> j["red.reflectance"].shape, j.picture.shape
    ((3, 8, 8, 3), (8, 8, 3))
    """
    with Problem(scene, params) as p:
        if p.n > 256:
            raise ArgumentError("%d numbers are active; derivative pictures are for at most 256" % p.n)
        made = {"sensor": sensor, "seed": seed, "spp": spp, "drop_budget": drop_budget, "guide": guide,
                "wavelengths": wavelengths, "wavelength_set": wavelength_set, "points": points, "walks_from": walks_from}
        options = run_options(p.scene, time_limit=time_limit, **made)
        films, primal = (ctypes.c_void_p * (p.n + 1))(), ctypes.c_void_p()
        try:
            status, message = run(p.context, options, progress, lib.imp_problem_jacobian, p.pointer,
                                  ctypes.byref(options), ctypes.byref(primal), films)
        except BaseException:
            for film in (primal.value, *films):
                if film:
                    lib.imp_film_destroy(film)
            raise
        pictures = [from_film(f, True) for f in films[:p.n] if f]
        picture = from_film(primal.value) if primal.value else None
        if status and not (status == _c.IMP_CANCELLED and picture is not None):
            raise failure(status, message)
        assert picture is not None
        shape = picture.shape

        def stack(info: ParameterInfo, arrays: list[Any]) -> Any:
            return np.stack(arrays).reshape(info.shape + shape)

        answer = Jacobian(p.scene,
                          {info.name: stack(info, [np.asarray(q) for q in pictures[at]]) for info, at in p.blocks},
                          {info.name: stack(info, [q.se for q in pictures[at]]) for info, at in p.blocks},
                          picture, {info.name: pictures[at] for info, at in p.blocks}, made, p.x())
        if status:
            raise failure(status, message, answer)
        return answer


# ---- Losses ------------------------------------------------------------------------


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
