# SPDX-License-Identifier: Apache-2.0
"""Scenes with active parameters and targets, for the time of a call."""
from __future__ import annotations

import ctypes
import os
from collections.abc import Mapping
from typing import Any, Optional

import numpy as np

from . import _c
from ._array import address, numbers
from ._context import Handle, failure
from ._errors import ArgumentError
from ._library import choice, integer, lib, make, text
from ._params import ParameterInfo, SceneParameters, names_of, table
from ._photograph import integers_of, is_path, is_raw, levels, srgb_decode, srgb_encode
from ._picture import Picture, read, reduce
from ._run import not_inside, run
from ._scene import Scene
from ._values import Values


def check_scene(value: Any) -> Scene:
    if not isinstance(value, Scene):
        raise TypeError("a scene is wanted, not a %s" % type(value).__name__)
    return value


def _guide(guide: Any) -> Any:
    if guide is None:
        return None
    pointer = getattr(guide, "_guide_pointer", None)
    if pointer is None:
        raise TypeError("guide is a %s: importon.guide(...) is wanted" % type(guide).__name__)
    return pointer()


def _walks(walks: Any, scene: Scene) -> Any:
    if walks is None:
        return None
    pointer = getattr(walks, "_walks_pointer", None)
    if pointer is None:
        raise TypeError("walks is a %s: importon.keep(...) is wanted" % type(walks).__name__)
    return pointer(scene)


def run_options(scene: Scene, *, sensor: Any = 0, seed: int = 0, spp: int = 0, time_limit: float = 0,
                drop_budget: float = 0, guide: Any = None, wavelengths: str = "stratified",
                wavelength_set: int = 0, points: str = "scene", walks_from: str = "scene", walks: Any = None) -> Any:
    """imp_run."""
    return make(_c.imp_run, walks=_walks(walks, scene), sensor=scene.sensor_index(sensor) if sensor else 0,
                seed=integer(seed, "seed", 0, 2**64 - 1), spp=integer(spp, "spp"),
                time_limit_s=float(time_limit), drop_budget=float(drop_budget), guide=_guide(guide),
                wavelengths=choice("imp_wavelength_sampling", wavelengths, "wavelengths"),
                wavelength_set=integer(wavelength_set, "wavelength_set"),
                points=choice("imp_points", points, "points"),
                **{"from": choice("imp_from", walks_from, "walks_from")})


def push(scene: Scene, params: Any) -> None:
    """Changes made in place to arrays of `params` go to the scene before it is used."""
    if isinstance(params, SceneParameters):
        if params.scene is not scene:
            raise ArgumentError("params are of another scene")
        if params._handed:
            params.update()


class Problem:
    """A scene with active parameters, for the time of a `with` block: holds the scene's lock."""

    def __init__(self, scene: Any, params: Any, same: Any = None, factor: Any = None, log: Any = None,
                 hold: Any = None) -> None:
        self.scene, self.params = check_scene(scene), params
        self.ties = [(glob, kind, name) for name, kind, globs in (
            ("same", _c.IMP_TIE_SAME, same), ("factor", _c.IMP_TIE_FACTOR, factor), ("log", _c.IMP_TIE_LOG, log))
            for glob in ([] if globs is None else [globs] if isinstance(globs, str) else globs)]
        self.holds = [] if hold is None else [hold] if isinstance(hold, str) else list(hold)
        self.blocks: list[tuple[ParameterInfo, slice]] = []
        self.logs: list[bool] = []
        self.handle: Optional[Handle] = None

    def __enter__(self) -> Problem:
        not_inside()
        scene = self.scene
        scene.lock.acquire()
        try:
            push(scene, self.params)
            self.context = scene._context
            out = ctypes.c_void_p()
            self.context.check(lib.imp_problem_create(scene.pointer, ctypes.byref(out)))
            self.handle = Handle(out.value or 0, lib.imp_problem_destroy)
            for name in names_of(self.params):
                self.check(lib.imp_problem_activate(self.pointer, text(name, "params")))
            for glob, kind, name in self.ties:
                self.check(lib.imp_problem_tie(self.pointer, text(glob, name), kind))
            for glob in self.holds:
                self.check(lib.imp_problem_hold(self.pointer, text(glob, "hold")))
            self.layout()
            return self
        except BaseException:
            self.__exit__()
            raise

    def layout(self) -> None:
        """Read which numbers are active."""
        self.n = lib.imp_problem_n_variables(self.pointer)
        infos = list(table(self.scene).values())
        i, variable = 0, make(_c.imp_variable_info)
        while i < self.n:
            self.check(lib.imp_problem_get_variable(self.pointer, i, ctypes.byref(variable)))
            info, log = infos[variable.param], False
            if self.ties:
                tie = make(_c.imp_tie_info)
                self.check(lib.imp_problem_get_tie(self.pointer, i, ctypes.byref(tie)))
                log = bool(tie.log)
                if tie.factor:
                    info = info._replace(name=tie.name.decode(), unit="1", shape=(), size=1)
            self.blocks.append((info, slice(i, i + info.size)))
            self.logs.append(log)
            i += info.size

    def __exit__(self, *error: Any) -> None:
        if self.handle:
            self.handle.close()
        self.scene.lock.release()

    @property
    def pointer(self) -> int:
        assert self.handle
        return self.handle.pointer

    def check(self, status: int) -> None:
        self.context.check(status)

    def run(self, options: Any, progress: Any, function: Any, *arguments: Any) -> None:
        status, message = run(self.context, options, progress, function, *arguments)
        if status:
            raise failure(status, message)

    def split(self, x: Any) -> dict[str, Any]:
        """Numbers [n] by parameter."""
        return {info.name: x[at].reshape(info.shape)[()] for info, at in self.blocks}

    def join(self, values: Any, name: str) -> Any:
        """Numbers [n] from a mapping; what it does not name is 0."""
        x = np.zeros(self.n)
        given = Values(self.scene, dict(values)) if isinstance(values, Mapping) else None
        if given is None:
            return numbers(values, name, shape=(self.n,))
        places = {info.name: (info, at) for info, at in self.blocks}
        from ._params import find
        for key in given:
            info = find(self.scene, key)
            if info.name not in places:
                raise ArgumentError("%s has %s, which is not active" % (name, info.name))
            v = numbers(given[key], key)
            if v.shape != info.shape and v.size != 1:
                raise ArgumentError("%s['%s'] has shape %s, not %s" % (name, key, v.shape, info.shape))
            x[places[info.name][1]] = v.ravel()
        return x

    def x(self) -> Any:
        """The active numbers of the scene."""
        x = np.zeros(self.n)
        if self.n:
            lib.imp_problem_get_x(self.pointer, address(x))
        return x

    def natural(self, x: Any) -> Any:
        """Numbers of x in the units of their parameters."""
        x = np.array(x)
        for (_, at), log in zip(self.blocks, self.logs):
            if log:
                x[at] = np.exp(x[at])
        return x

    def spp(self, target: int, options: Any) -> int:
        """Samples per pixel that a loss takes for a target."""
        taken = ctypes.c_int()
        self.check(lib.imp_problem_get_spp(self.pointer, target, ctypes.byref(options), ctypes.byref(taken)))
        return taken.value

    def gradient(self) -> tuple[Any, Any]:
        return np.zeros(self.n), np.zeros(self.n)

    def add_targets(self, target: Any, clip: Any = None, **options: Any) -> int:
        """How many there are."""
        made = targets(self.scene, target, **options)
        for t in made:
            self.check(lib.imp_problem_add_target(self.pointer, ctypes.byref(t[0])))
        if clip is not None:
            for i, (s, value) in enumerate(target_list(self.scene, target, options.get("sensor", 0))):
                low, high = levels(value, clip, is_photograph(self.scene, s))
                self.check(lib.imp_problem_clip(self.pointer, i, low, high))
        return len(made)

    def clipped(self) -> Optional[dict[str, int]]:
        """Of targets with levels; None: there are none."""
        c = make(_c.imp_clipped)
        self.check(lib.imp_problem_get_clipped(self.pointer, ctypes.byref(c)))
        return {"numbers": c.numbers, "clipped": c.clipped, "silent": c.silent, "against": c.against} if c.numbers else None

    def add_regularisers(self, tikhonov: Any, stay: Any, smooth: Any) -> None:
        for glob, weight in dict(tikhonov or {}).items():
            self.check(lib.imp_problem_add_tikhonov(self.pointer, text(glob, "tikhonov"), float(weight), 0))
        for glob, weight in dict(stay or {}).items():
            self.check(lib.imp_problem_add_tikhonov(self.pointer, text(glob, "stay"), float(weight), 1))
        for glob, weight in dict(smooth or {}).items():
            self.check(lib.imp_problem_add_smoothness(self.pointer, text(glob, "smooth"), float(weight)))


def _colours(picture: Picture, scene: Scene, sensor: int, path: Any) -> tuple[Any, Any]:
    """The colour channels of a picture, and their errors; of a film with response curves, its own."""
    names, channels = list(picture.channels), scene.channels
    info = make(_c.imp_sensor_info)
    scene._context.check(lib.imp_scene_get_sensor(scene._handle.pointer, sensor, ctypes.byref(info)))
    curves = ctypes.cast(info.response_names, ctypes.POINTER(ctypes.c_char_p))
    own = [curves[k].decode() for k in range(info.n_responses)] or (["R", "G", "B"] if channels == 3 else ["Y"])
    name = "target" if path is None else os.fsdecode(path)
    pair = len(names) == 2 and name.lower().endswith(".npy")  # an array, which has no names
    if info.n_responses and set(own) <= set(names):
        at = [names.index(c) for c in own]
    elif {"R", "G", "B"} <= set(names):
        at = [names.index(c) for c in "RGB"]
    elif not pair and ("Y" in names or len(names) == 1):
        at = [names.index("Y") if "Y" in names else 0]
    else:
        raise ArgumentError("%s has channels %s; the film of sensor %d has %s" % (
            name, ", ".join(names), sensor, ", ".join(own)))
    pixels, se = np.asarray(picture), picture.se
    if len(at) == 3 and channels == 1 or at == list(range(pixels.shape[2])):
        return pixels, se
    return pixels[..., at], None if se is None else se[..., at]


def is_photograph(scene: Scene, sensor: int) -> bool:
    """Has its film a gamma, so that targets hold the numbers of a photograph?"""
    info = make(_c.imp_sensor_info)
    scene._context.check(lib.imp_scene_get_sensor(scene._handle.pointer, sensor, ctypes.byref(info)))
    return bool(info.photograph)


def _fewer(scene: Scene, path: Any, picture: Any, sensor: int) -> tuple[Any, Any]:
    """A file with a whole number of pixels for each of the sensor's: their means, and weights that are 0 where only some
    are clipped; None: all are 1."""
    film, file = scene.sensors[sensor], integers_of(path)
    part = picture.shape[1] // max(film.width, 1)
    if part < 2 or picture.shape[:2] != (part * film.height, part * film.width):
        return picture, None
    white = 1. if is_raw(path) else float("inf") if file is None else srgb_decode(1 - (5 if file[0] else 0.5) / file[1])
    small = reduce(picture, film.width, film.height, white)
    some = np.isnan(np.asarray(small)).reshape(small.shape[0], small.shape[1], -1).any(-1)
    if not some.any():
        return small, None
    small[np.isnan(np.asarray(small))] = 0
    return small, (~some).astype(np.float32)


def _one_target(scene: Scene, target: Any, sensor: int, weights: Any, loss: str, epsilon: float,
                noise_se: Any) -> tuple[Any, Any]:
    """imp_target, and what it points to."""
    path = target if is_path(target) else None
    whole = None
    if path is not None:
        target, whole = _fewer(scene, path, read(path), sensor)
    se = noise_se
    if isinstance(target, Picture) and target.ndim == 3 and target.channels:
        pixels, own = _colours(target, scene, sensor, path)
        if noise_se is None and own is not None and np.isfinite(own).all():
            se = own  # one sample has no error
    else:
        pixels = target
    if path is not None and is_photograph(scene, sensor) and integers_of(path) is not None:
        pixels = srgb_encode(pixels)  # the numbers of the file
    pixels = numbers(pixels, "target", np.float32)
    pixels = pixels[..., None] if pixels.ndim == 2 else pixels
    if pixels.ndim != 3:
        raise ArgumentError("target has shape %s: (height, width, channels) is wanted" % (pixels.shape,))
    if se is not None:
        se = np.reshape(numbers(se, "noise_se", np.float32), pixels.shape) if np.size(se) == pixels.size \
            else numbers(se, "noise_se", np.float32, shape=pixels.shape)
    if weights is not None:
        if isinstance(weights, (str, bytes)) or hasattr(weights, "__fspath__"):
            weights = np.asarray(read(weights))[..., 0]
        weights = numbers(weights, "weights", np.float32, shape=pixels.shape[:2])
    if whole is not None:
        weights = whole if weights is None else numbers(weights * whole, "weights", np.float32)
    if epsilon and loss in ("l2", "l1"):
        raise ArgumentError("epsilon is of the relative and log losses: %r has none" % loss)
    t = make(_c.imp_target, sensor=sensor, width=pixels.shape[1], height=pixels.shape[0],
             channels=pixels.shape[2], pixels=address(pixels), weights=address(weights),
             loss=choice("imp_loss", loss, "loss"), epsilon=float(epsilon), noise_se=address(se))
    return t, (pixels, weights, se)


def target_list(scene: Scene, target: Any, sensor: Any) -> list[tuple[int, Any]]:
    """(sensor, target): of one target; of a list, one for each sensor in order; of a dictionary
    by sensor."""
    if isinstance(target, Mapping):
        return [(scene.sensor_index(s), t) for s, t in target.items()]
    if isinstance(target, (list, tuple)) and not np.isscalar(target[0] if target else 0) and (
            np.ndim(target[0]) == 3 or isinstance(target[0], str) or hasattr(target[0], "__fspath__")):
        if len(target) != len(scene.sensors):
            raise ArgumentError("%d targets, but the scene has %d sensors: name them, {sensor: target}"
                                % (len(target), len(scene.sensors)))
        return list(enumerate(target))
    return [(scene.sensor_index(sensor), target)]


def targets(scene: Scene, target: Any, *, sensor: Any = 0, weights: Any = None, loss: str = "l2",
            epsilon: float = 0, noise_se: Any = None) -> list[tuple[Any, Any]]:
    """imp_targets of target_list."""
    pairs = target_list(scene, target, sensor)

    def part(value: Any, s: int, i: int) -> Any:
        if isinstance(value, Mapping):
            return value.get(s)
        return value[i] if isinstance(value, (list, tuple)) and len(pairs) > 1 else value

    return [_one_target(scene, t, s, part(weights, s, i), loss, epsilon, part(noise_se, s, i))
            for i, (s, t) in enumerate(pairs)]
