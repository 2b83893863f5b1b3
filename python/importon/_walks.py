# SPDX-License-Identifier: Apache-2.0
"""Recorded walks: evaluated at other parameters without a ray."""
from __future__ import annotations

import ctypes
from typing import Any, Optional

import numpy as np

from . import _c
from ._array import address, numbers
from ._context import Handle, context, failure, warn_said
from ._errors import ArgumentError
from ._library import decode, lib, make, memory_bytes, text
from ._problem import check_scene, push, run_options
from ._run import not_inside, run
from ._scene import Scene


class Walks:
    """Walks whose decisions are kept: see `keep`.

    Attributes
    ----------
    scene : Scene
    spp : int
        Walks of a pixel.
    seed : int
    n_walks, n_vertices, bytes : float
    survival : float
        Least probability with which roulette let a walk go on; 0: none.

    Examples
    --------
    >>> walks = importon.keep(importon.load_dict(importon.cornell_box(res=8)), spp=16)
    >>> walks.spp, walks.n_walks
    (16, 1024.0)
    """

    def __init__(self, _scene: Scene, _handle: Handle) -> None:
        self.scene, self._handle = _scene, _handle
        info = make(_c.imp_walks_info)
        lib.imp_walks_get_info(_handle.pointer, ctypes.byref(info))
        self.spp: int = info.spp
        self.seed: int = info.seed
        self.n_walks: float = info.n_walks
        self.n_vertices: float = info.n_vertices
        self.bytes: float = info.bytes
        self.survival: float = info.survival

    def _walks_pointer(self, scene: Scene) -> int:
        if scene is not self.scene:
            raise ArgumentError("recorded walks of another scene")
        scene.pointer
        return self._handle.pointer

    def __repr__(self) -> str:
        return "%.4g recorded walks, %.3g MB" % (self.n_walks, self.bytes / 1e6)

    def weigh(self, params: Any = None, *, sensor: Any = 0, mask: Any = None) -> tuple[float, float, Optional[str]]:
        """What the walks are worth at the scene's present parameters.

        Parameters
        ----------
        params : SceneParameters, optional
            Arrays of it that were changed in place go to the scene first.
        sensor : int or str
        mask : array, optional
            [height][width]: pixels with 0 are left out.

        Returns
        -------
        tuple
            The effective sample size as a fraction of the walks; the growth of the second
            moment from step to step of roulette (0: no roulette); and why the walks are not
            evaluated at these parameters, or None.

        Raises
        ------
        ArgumentError
            There are no walks of this sensor, or the mask is not finite.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> ess, growth, refused = importon.keep(scene, spp=16).weigh()
        >>> ess, refused
        (1.0, None)
        """
        scene, weight = self.scene, make(_c.imp_walks_weight)
        not_inside()
        index = scene.sensor_index(sensor) if sensor else 0
        with scene.lock:
            push(scene, params)
            shape = (scene.sensors[index].height, scene.sensors[index].width)
            picture = None if mask is None else numbers(mask, "mask", dtype=np.float32, shape=shape)
            status = lib.imp_walks_weigh(self._walks_pointer(scene), index, address(picture), ctypes.byref(weight))
            if status:
                raise failure(status, decode(lib.imp_last_error(scene._context.pointer)))
            refused = None if weight.refused is None else decode(weight.refused)
        return weight.ess, weight.growth, refused

    def write(self, path: Any) -> None:
        """Write the walks to a file, with all that evaluating them takes but meshes: see
        `read_walks`. It is written whole or not at all.

        Parameters
        ----------
        path : str or PathLike

        Raises
        ------
        FileError
        UnsupportedError
            Materials need triangles, a graded index bends rays, or instances stand in
            instances.

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> importon.keep(scene, spp=16, losses=True).write("room.walks")
        >>> walks = importon.read_walks("room.walks")
        >>> params = importon.traverse(walks.scene)
        >>> params["white.reflectance.value"] = 0.5
        >>> picture = importon.render(walks.scene, params, walks=walks)
        """
        not_inside()
        with self.scene.lock:
            status = lib.imp_walks_write(self._walks_pointer(self.scene), text(path, "path"))
            if status:
                raise failure(status, decode(lib.imp_last_error(self.scene._context.pointer)))


def read_walks(path: Any, scene: Optional[Scene] = None, *, memory: float = 0, ess: float = 0) -> Walks:
    """Read walks that `Walks.write` or ``importon record`` has written.

    Parameters
    ----------
    path : str or PathLike
    scene : Scene, optional
        The scene that they were drawn in. Without it ``Walks.scene`` is what the file holds:
        all parameters and no geometry, so that walks are evaluated in it and none are traced.
    memory : float
        Bytes that the walks may take; 0: 2^30.
    ess : float
        Least effective sample size, as a fraction, with which they are evaluated; 0: the file's.

    Returns
    -------
    Walks

    Raises
    ------
    FileError
        The file is missing or damaged.
    SceneError
        It is of another version, byte order or build.
    ArgumentError
        They are walks of another scene; the message says what differs.
    OutOfMemoryError

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> importon.keep(scene, spp=16, losses=True).write("room.walks")
    >>> walks = importon.read_walks("room.walks")
    >>> walks.weigh()[0]
    1.0
    """
    not_inside()
    ctx = context() if scene is None else check_scene(scene)._context
    options = make(_c.imp_walks_options, memory=memory_bytes(memory), ess=float(ess))
    out = ctypes.c_void_p()
    status = lib.imp_walks_read(ctx.pointer, None if scene is None else scene.pointer, text(path, "path"),
                                ctypes.byref(options), ctypes.byref(out))
    ctx.check(status)
    warn_said()
    assert out.value
    handle = Handle(out.value, lib.imp_walks_destroy)
    if scene is None:  # which lives as long as its walks
        scene = Scene(Handle(lib.imp_walks_scene(out.value), lambda _, owner=handle: None), ctx, decode(text(path, "path")))
    return Walks(scene, handle)


def keep(scene: Scene, params: Any = None, sensor: Any = 0, seed: int = 0, spp: int = 0, *, memory: float = 0,
         losses: bool = False, survival: float = 0, ess: float = 0, headroom: float = 0, guide: Any = None,
         wavelengths: str = "stratified", wavelength_set: int = 0, points: str = "scene",
         progress: Any = None) -> Walks:
    """Draw walks at the scene's present parameters and keep what rays and random numbers have
    settled of them. `render`, `loss` and `functional` with ``walks=`` then evaluate them at
    other parameters, without a ray: unbiased, with less and less of them that count.

    Parameters
    ----------
    scene : Scene
    params : SceneParameters, optional
        Arrays of it that were changed in place go to the scene first.
    sensor, seed, spp, guide, wavelengths, wavelength_set, points, progress
        As `render`'s.
    memory : float
        Bytes that the walks may take; 0: 2^30.
    losses : bool
        Walks of losses and gradients, of which pictures can be made too. With Sobol's points
        they are in sets for losses of all kinds; a loss that is traced may have other sets.
    survival : float
        Least probability with which roulette lets a walk go on; 0: 0.8; negative: what the
        integrator decides.
    ess : float
        Least effective sample size, as a fraction, with which they are evaluated; 0: 0.5.
    headroom : float
        By which factor extinctions of grids may grow, also from 0, so that walks have the
        derivative with respect to them; 0 or 1: none.

    Returns
    -------
    Walks

    Raises
    ------
    OutOfMemoryError
        They need more than `memory`; the message says how much.
    UnsupportedError
        Walks of this scene or integrator are not kept.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> walks = importon.keep(scene, spp=16)
    >>> params = importon.traverse(scene)
    >>> params["light.emitter.radiance.value"] *= 2
    >>> picture = importon.render(scene, params, walks=walks)
    >>> walks.weigh()[0]
    1.0
    """
    scene = check_scene(scene)
    options = run_options(scene, sensor=sensor, seed=seed, spp=spp, guide=guide, wavelengths=wavelengths,
                          wavelength_set=wavelength_set, points=points)
    wanted = make(_c.imp_walks_options, memory=memory_bytes(memory), losses=bool(losses), survival=float(survival),
                  ess=float(ess), headroom=float(headroom))
    not_inside()
    with scene.lock:
        push(scene, params)
        out = ctypes.c_void_p()
        status, message = run(scene._context, options, progress, lib.imp_walks_keep, scene.pointer,
                              ctypes.byref(options), ctypes.byref(wanted), ctypes.byref(out))
        if status:
            raise failure(status, message)
        assert out.value
        return Walks(scene, Handle(out.value, lib.imp_walks_destroy))
