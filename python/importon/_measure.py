# SPDX-License-Identifier: Apache-2.0
"""A scene from photographs, in stages."""
from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _c
from ._array import copy_doubles
from ._context import Handle, failure
from ._errors import ArgumentError
from ._fit import Fit, variables
from ._library import decode, integer, lib, make, rows_of, text
from ._missing import Missing
from ._params import names_of
from ._photograph import integers_of, is_path, is_raw, levels
from ._problem import Problem, _one_target, is_photograph, push, run_options, target_list
from ._run import not_inside, run
from ._scene import Scene

_NOISE = ("read", "shot", "relative")
_EXIF = ("focal_35mm", "exposure_s", "iso", "f_number")


class MeasureStage(NamedTuple):
    """A fit of a stage.

    `chi2` is the mean square of what the photographs have beside the pictures, over their noise, per degree of
    freedom, and `explained` whether it is within three of its errors above 1; `moved` by how many standard errors a
    number of the stage has moved until the end of the round."""

    round: int
    stage: str
    numbers: int
    iterations: int
    residual: float
    residual_hi: float
    chi2: float
    chi2_se: float
    explained: bool
    moved: float


class MeasuredPhoto(NamedTuple):
    """A photograph afterwards.

    `noise` is one standard deviation of its values, `weights` [height][width] are 0 where a block of pixels is masked,
    `residual` is the root of the mean square of its channels' residuals over their errors, NaN where nothing is
    compared."""

    sensor: int
    noise: float
    chi2: float
    block: int
    blocks: int
    masked: int
    weights: Any
    residual: Any


class Measurement:
    """What photographs have told.

    Attributes
    ----------
    fit : Fit
        The last fit, of all measured numbers but large textures, with intervals.
    explained : bool
        The scene explains the photographs within their noise.
    stages : list of MeasureStage
        All fits, in their order.
    photos : list of MeasuredPhoto
    decisions : list of str
        Each decision with its number.
    missing : list of Missing
        Where it is not explained: numbers that are not measured and may be wrong.
    rounds : int
    textures : list of int
        Positions of the parameters that the stage of this name has fitted and the last fit does not have.
    """

    def __init__(self, fit: Fit, result: Any, photos: list[MeasuredPhoto], missing: list[Missing]) -> None:
        self.fit, self.photos, self.missing = fit, photos, missing
        self.explained, self.rounds = bool(result.explained), int(result.rounds)
        self.stages = [MeasureStage(r.round, decode(lib.imp_measure_stage_name(r.stage)), r.n, r.iterations, r.residual,
                                    r.residual_hi, r.chi2, r.chi2_se, bool(r.explained), r.moved)
                       for r in rows_of(_c.imp_measure_row, _address(result.rows), result.n_rows)]
        at = _address(result.textures)
        self.textures = list((ctypes.c_size_t * result.n_textures).from_address(at)) if result.n_textures else []
        lines = (ctypes.c_char_p * result.n_lines).from_address(_address(result.lines)) if result.n_lines else []
        self.decisions = [decode(line) for line in lines]

    def __repr__(self) -> str:
        return "\n".join([*self.decisions, "explained" if self.explained else "not explained", repr(self.fit)])


def _address(p: Any) -> int:
    return int(p if isinstance(p, int) else ctypes.cast(p, ctypes.c_void_p).value or 0)


def _words(values: Any, name: str, keep: list[Any]) -> tuple[Any, int]:
    """A list of patterns as C has it."""
    listed = [values] if isinstance(values, str) else list(values)
    array = (ctypes.c_char_p * max(len(listed), 1))(*[text(v, name) for v in listed])
    keep.append(array)
    return ctypes.addressof(array), len(listed)


def _photo(scene: Scene, sensor: int, value: Any, weights: Any, clip: Any, noise: Any, exif: Mapping[str, float],
           keep: list[Any]) -> Any:
    """imp_photo."""
    by_light = noise if isinstance(noise, Mapping) else {}
    t, kept = _one_target(scene, value, sensor, weights, "l2", 0, None)
    file = integers_of(value) if is_path(value) else None
    p = make(_c.imp_photo, sensor=sensor, width=t.width, height=t.height, channels=t.channels, pixels=t.pixels,
             weights=t.weights, noise=0. if by_light else float(noise), step=1 / file[1] if file else 0.)
    if clip is not None and (clip != "auto" or file or (is_path(value) and is_raw(value))):
        p.clipped = True
        p.low, p.high = levels(value, clip, is_photograph(scene, sensor))
    for key, number in by_light.items():
        if key not in _NOISE:
            raise ArgumentError("noise has no %r; it has %s" % (key, ", ".join(_NOISE)))
        setattr(p, key, float(number))
    for key, number in exif.items():
        if key not in _EXIF:
            raise ArgumentError("exif has no %r; it has %s" % (key, ", ".join(_EXIF)))
        setattr(p, key, float(number))
    keep.append(kept)
    if is_path(value):
        keep.append(text(value, "photos"))
        p.name = keep[-1]
    return p


def _photos(scene: Scene, photos: Any, weights: Any, clip: Any, noise: Any, exif: Any,
            keep: list[Any]) -> tuple[list[tuple[int, Any]], Any]:
    pairs = target_list(scene, photos, 0)

    def part(value: Any, i: int, none: Any) -> Any:
        if isinstance(value, Mapping) and not set(value) <= set(_EXIF + _NOISE):
            return {scene.sensor_index(k): v for k, v in value.items()}.get(pairs[i][0], none)
        return none if value is None else value

    listed = [_photo(scene, s, value, part(weights, i, None), clip, part(noise, i, 0.), part(exif, i, {}), keep)
              for i, (s, value) in enumerate(pairs)]
    return pairs, (_c.imp_photo * max(len(listed), 1))(*listed)


def _measured(r: Any, photo: Any) -> MeasuredPhoto:
    n = photo.width * photo.height
    picture = [np.array((ctypes.c_float * n).from_address(_address(a))).reshape(photo.height, photo.width)
               for a in (r.weights, r.residual)]
    return MeasuredPhoto(photo.sensor, r.noise, r.chi2, r.block, r.n_blocks, r.n_masked, *picture)


def measure(scene: Scene, photos: Any, params: Any = None, *, stages: Any = None, hold: Any = (), rounds: int = 0,
            mask: float = 0, max_iterations: int = 0, checkpoint: Any = None, resume: bool = False, clip: Any = "auto",
            noise: Any = None, exif: Any = None, weights: Any = None, say: Optional[Callable[[str], None]] = None,
            spp: int = 0, seed: int = 0, drop_budget: float = 0, points: str = "scene",
            progress: Any = None) -> Measurement:
    """A scene from photographs, in stages: cameras, lens, exposure, lights, materials, textures, then all together. The scene
    ends at the best estimate. To be called before anything has been computed from the scene, unless its cameras' poses
    are parameters already (`Scene.add_pose`) or stay.

    Parameters
    ----------
    scene : Scene
        With rough guesses.
    photos : array, Picture, path; list, or dictionary by sensor
        As `loss`'s targets.
    params : names or patterns, optional
        What is measured, poses and other numbers of geometry included; by default all that photographs may tell of, and
        their cameras' poses.
    stages : str or list of str, optional
        Of "cameras", "lens", "exposure", "lights", "materials", "textures"; by default all. A "lens" that is named
        here measures fields of view and opencv_k1 of the photographs' cameras; `params` names others.
    hold : str or list of str
        Names or patterns of what stays as it is, with indices for single numbers: "left.pose[3-5]".
    rounds : int
        Of all stages, at most; 0: 3.
    mask : float
        Robust standard deviations from which on blocks of pixels are masked; 0: 6; negative: none are.
    max_iterations : int
        Of each fit; 0: the library's.
    checkpoint : path, optional
        Written after each stage.
    resume : bool
        Go on from the checkpoint, if it is there.
    clip : "auto", None or (low, high)
        As `loss`'s; "auto" is of files of integers, others are not clipped.
    noise : float, mapping, or dictionary of these by sensor, optional
        One standard deviation of the photographs' values; by default estimated from each. A mapping with "read",
        "shot", "relative", as `plan`'s: light v has the variance read^2 + shot v + (relative v)^2.
    exif : dictionary, or dictionary of these by sensor, optional
        "focal_35mm", "exposure_s", "iso", "f_number": where fields of view and exposures begin.
    weights : array, or dictionary by sensor, optional
        Of pixels.
    say : callable, optional
        Called with each decision.
    spp, seed, drop_budget, points, progress
        As `fit`'s; spp 0 is 64.

    Returns
    -------
    Measurement

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=16))
    >>> photo = np.asarray(importon.render(scene, spp=256, seed=1)) + np.random.default_rng(1).normal(0, .05, (16, 16, 3))
    >>> importon.traverse(scene)["red.reflectance.value"] = 0.5
    >>> lines = []
    >>> m = importon.measure(scene, photo, "red.*", spp=64, say=lines.append)
    >>> len(lines) > 0 and isinstance(lines[0], str)
    True
    >>> m.stages[-1].stage, m.explained, m.photos[0].masked
    ('together', True, 0)
    """
    not_inside()
    p = Problem(scene, None)
    keep: list[Any] = []
    spoken: list[BaseException] = []

    def on_say(line: int, payload: Any) -> None:
        try:
            if say and not spoken:
                say(decode(ctypes.string_at(line)))
        except BaseException as error:  # raised when the call has ended
            spoken.append(error)

    p.scene.lock.acquire()
    try:
        push(p.scene, params)
        p.context = p.scene._context
        pairs, listed = _photos(p.scene, photos, weights, clip, noise, exif, keep)
        call = _c.imp_measure_say_fn(on_say)
        o = make(_c.imp_measure_options, rounds=integer(rounds, "rounds"), mask=float(mask), resume=bool(resume),
                 max_iterations=integer(max_iterations, "max_iterations"), say=ctypes.cast(call, ctypes.c_void_p))
        if stages is not None:
            o.stages = text(stages if isinstance(stages, str) else ",".join(stages), "stages")
        if checkpoint is not None:
            o.checkpoint = text(checkpoint, "checkpoint")
        if params is not None:
            o.params, o.n_params = _words(names_of(params), "params", keep)
        if hold:
            o.hold, o.n_hold = _words(hold, "hold", keep)
        options = run_options(p.scene, seed=seed, spp=spp, drop_budget=drop_budget, points=points)
        made, out = ctypes.c_void_p(), ctypes.c_void_p()
        status, message = run(p.context, options, progress, lib.imp_measure, p.scene.pointer, listed, len(pairs),
                              ctypes.byref(o), ctypes.byref(options), ctypes.byref(made), ctypes.byref(out))
        p.scene._table = None  # poses have become parameters
        if spoken:
            raise spoken[0]
        if status:
            raise failure(status, message)
        p.handle = Handle(made.value or 0, lib.imp_problem_destroy)
        p.layout()
        return _measurement(p, rows_of(_c.imp_measure_result, out.value, 1)[0], pairs, listed)
    finally:
        p.__exit__()


def _measurement(p: Problem, r: Any, pairs: list[tuple[int, Any]], listed: Any) -> Measurement:
    result = _c.imp_fit_result.from_address(_address(r.fit))
    names = [info.name + ("[%d]" % k if info.size > 1 else "") for info, _ in p.blocks for k in range(info.size)]
    x = copy_doubles(result.history_x, (result.n_history, result.n))
    start = p.natural(x[0]) if x is not None and len(x) else p.natural(p.x())
    fit = Fit(p.scene, variables(result, p.blocks, start, p.natural(p.x())), result, names,
              {info.name: info for info, _ in p.blocks}, pairs, "lm", "l2")
    fit.clipped = p.clipped()
    photos = [_measured(row, listed[i]) for i, row in
              enumerate(rows_of(_c.imp_measure_photo, _address(r.photos), r.n_photos))]
    missing = []
    for row in rows_of(_c.imp_missing, _address(r.missing), r.n_missing):
        info = make(_c.imp_param_info)
        p.check(lib.imp_scene_get_param(p.scene.pointer, row.param, ctypes.byref(info)))
        missing.append(Missing(row))
        missing[-1].name = decode(info.name)
    return Measurement(fit, r, photos, missing)
