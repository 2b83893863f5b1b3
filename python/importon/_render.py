# SPDX-License-Identifier: Apache-2.0
"""Pictures and walks."""
from __future__ import annotations

import ctypes
import json as _json
from collections.abc import Mapping
from typing import Any, Union

from ._context import failure
from ._library import integer, lib
from ._params import SceneParameters
from ._picture import Picture, from_film
from ._problem import check_scene, push, run_options
from ._run import not_inside, run
from ._scene import Scene


def render(scene: Scene, params: Any = None, sensor: Any = 0, integrator: None = None, seed: int = 0,
           seed_grad: int = 0, spp: int = 0, spp_grad: int = 0, *, time_limit: float = 0,
           drop_budget: float = 0, guide: Any = None, wavelengths: str = "stratified", wavelength_set: int = 0, points: str = "scene", walks_from: str = "scene",
           walks: Any = None, progress: Any = None) -> Picture:
    """Render a picture, with the standard error of every number.

    Parameters
    ----------
    scene : Scene
    params : SceneParameters or mapping, optional
        Arrays of it that were changed in place go to the scene first; a mapping sets values.
    sensor : int or str
        Number or name.
    integrator : None
        The scene's is used; others are refused.
    seed : int
        The same seed and samples give the same bits, on any number of threads.
    seed_grad, spp_grad : int
        Taken as Mitsuba's are: a picture has no gradient here (`loss`, `render_backward`,
        `importon.torch` and `importon.jax` have).
    spp : int
        Samples per pixel; 0: what the scene asks for.
    time_limit : float
        In seconds: samples are taken until then, at most `spp`; 0: none.
    drop_budget : float
        Part of the walks that may be dropped; 0: 1e-4.
    guide : Guide, optional
        From `importon.guide`.
    wavelengths : str
        Of scenes in a spectral mode: "stratified" (within a pixel), "independent" or
        "importance" (by response times light).
    wavelength_set : int
        Independent walks of a pixel among which wavelengths are stratified; 0: a quarter of the samples
        per pixel, at most 16.
    points : str
        Random numbers of a pixel's walks: "scene" (its sampler's; where that is "independent", or
        there is none, those of least noise), "independent", "sobol" (sets of scrambled points), or
        "whole": sobol in as few sets of a pixel as hold its samples, with less noise, and no `se` up to
        192 samples.
    walks_from : str
        The end at which walks begin: "scene" (what its integrator says), "sensor" or
        "lights".
    walks : Walks, optional
        From `keep`: recorded walks that are evaluated in place of tracing; seed, samples, points
        and wavelengths are theirs.
    progress : bool or callable, optional
        See `set_progress`.

    Returns
    -------
    Picture
        float32 [height][width][channels], with `se`.

    Raises
    ------
    Cancelled
        By the callback; `result` is the picture with the samples taken so far.
    PathsError
        More walks were dropped than the budget allows.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> picture = importon.render(scene, spp=64)
    >>> bool(abs(picture.mean() - 0.14) < 0.03 and picture.se.mean() < 0.05)
    True
    """
    scene = check_scene(scene)
    if integrator is not None:
        raise TypeError("integrator: the scene's own is used; write it into the scene")
    options = run_options(scene, sensor=sensor, seed=seed, spp=spp, time_limit=time_limit,
                          drop_budget=drop_budget, guide=guide, wavelengths=wavelengths,
                          wavelength_set=wavelength_set, points=points, walks_from=walks_from, walks=walks)
    integer(seed_grad, "seed_grad", 0, 2**64 - 1)
    integer(spp_grad, "spp_grad", 0)
    return make_picture(scene, params, options, progress,
                        lambda out: (lib.imp_render, scene.pointer, ctypes.byref(options), out))


def make_picture(scene: Scene, params: Any, options: Any, progress: Any, call: Any, signed: bool = False) -> Picture:
    not_inside()
    with scene.lock:
        if isinstance(params, Mapping) and not isinstance(params, SceneParameters):
            SceneParameters(scene).update(params)
        elif params is not None:
            push(scene, params)
        out = ctypes.c_void_p()
        try:
            status, message = run(scene._context, options, progress, *call(ctypes.byref(out)))
        except BaseException:
            if out.value:
                lib.imp_film_destroy(out.value)
            raise
        picture = from_film(out.value, signed) if out.value else None
        if status:
            raise failure(status, message, picture)
        assert picture is not None
        return picture


def denoise(scene: Scene, picture: Picture, *, sensor: Any = 0, seed: int = 0, progress: Any = None) -> Picture:
    """A picture without its noise, by Intel's Open Image Denoise, to look at: how far it is off
    nobody knows, so it has no standard errors.

    Parameters
    ----------
    scene : Scene
        As it was when the picture was made: its first surfaces' albedos and normals help.
    picture : Picture
        From `render`.
    sensor : int or str
        The picture's.
    seed : int
        Of the samples of first surfaces.
    progress : bool or callable, optional
        See `set_progress`.

    Returns
    -------
    Picture
        With the same channels; those that are no colours are copied.

    Raises
    ------
    UnsupportedError
        There is no such library; the message says what to do.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> picture = importon.render(scene, spp=16)
    >>> try:
    ...     picture = importon.denoise(scene, picture)
    ... except importon.UnsupportedError:
    ...     pass  # this machine has no Open Image Denoise
    """
    scene = check_scene(scene)
    if not isinstance(picture, Picture) or picture._film is None:
        raise TypeError("picture: a Picture as render returns it")
    options, film = run_options(scene, sensor=sensor, seed=seed), picture._film.pointer
    return make_picture(scene, None, options, progress,
                        lambda out: (lib.imp_denoise, scene.pointer, ctypes.byref(options), film, out))


def walk(scene: Scene, x: int, y: int, sample: int = 0, *, seed: int = 0, spp: int = 0, sensor: Any = 0,
         guide: Any = None, wavelengths: str = "stratified", wavelength_set: int = 0, points: str = "scene", walks_from: str = "scene",
         json: bool = False) -> Union[str, dict[str, Any]]:
    """One random walk, vertex by vertex: the same one that pictures and gradients of this
    seed use.

    Parameters
    ----------
    scene : Scene
    x, y : int
        Pixel of the picture, from the left and from the top.
    sample : int
        Number of the sample in the pixel.
    seed, spp, sensor, guide, wavelengths, wavelength_set, points, walks_from
        As `render`'s, of the picture that the walk belongs to.
    json : bool
        A dictionary in place of text.

    Returns
    -------
    str or dict

    Raises
    ------
    ArgumentError
        The pixel is outside the picture.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> importon.walk(scene, 4, 4, json=True)["pixel"]
    [4, 4]
    """
    scene = check_scene(scene)
    not_inside()
    options = run_options(scene, sensor=sensor, seed=seed, spp=spp, guide=guide, wavelengths=wavelengths,
                          wavelength_set=wavelength_set, points=points, walks_from=walks_from)
    with scene.lock:
        out, context = ctypes.c_void_p(), scene._context
        context.check(lib.imp_walk_describe(scene.pointer, ctypes.byref(options), integer(x, "x"), integer(y, "y"),
                                            integer(sample, "sample", -2**63, 2**63 - 1), bool(json), ctypes.byref(out)))
        said = ctypes.string_at(out.value or 0).decode()
        lib.imp_free(context.pointer, out)
    if not json:
        return said
    made: dict[str, Any] = _json.loads(said)
    return made
