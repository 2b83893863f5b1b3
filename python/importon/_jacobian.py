# SPDX-License-Identifier: Apache-2.0
"""Derivative pictures by every parameter, and their sums."""
from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from . import _c
from ._array import address
from ._context import failure
from ._errors import ArgumentError
from ._gradient import Estimate, _adjoint
from ._library import lib
from ._params import ParameterInfo
from ._picture import Picture, from_film
from ._problem import Problem, run_options
from ._run import run
from ._scene import Scene
from ._values import Gradient, Values


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
