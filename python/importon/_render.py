# SPDX-License-Identifier: Apache-2.0
"""Pictures, derivatives and losses."""
from __future__ import annotations

import ctypes
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Optional

import numpy as np

from . import _c
from ._array import address, numbers
from ._library import ArgumentError, Handle, choice, integer, lib, make, run, text
from ._params import Gradient, ParameterInfo, SceneParameters, Values, names_of, table
from ._picture import Picture, from_film, read
from ._scene import Scene


def _scene(value: Any) -> Scene:
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


def _run(scene: Scene, *, sensor: Any = 0, seed: int = 0, spp: int = 0, time_limit: float = 0,
         drop_budget: float = 0, guide: Any = None) -> Any:
    return make(_c.imp_run, sensor=scene.sensor_index(sensor) if sensor else 0,
                seed=integer(seed, "seed", 0, 2**64 - 1), spp=integer(spp, "spp"),
                time_limit_s=float(time_limit), drop_budget=float(drop_budget), guide=_guide(guide))


def push(scene: Scene, params: Any) -> None:
    """Changes made in place to arrays of `params` go to the scene before it is used."""
    if isinstance(params, SceneParameters):
        if params.scene is not scene:
            raise ArgumentError("params are of another scene")
        if params._handed:
            params.update()


class Problem:
    """A scene with active parameters, for the time of a `with` block: holds the scene's lock."""

    def __init__(self, scene: Any, params: Any) -> None:
        self.scene, self.params = _scene(scene), params
        self.blocks: list[tuple[ParameterInfo, slice]] = []
        self.handle: Optional[Handle] = None

    def __enter__(self) -> Problem:
        from ._library import not_inside
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
            self.n = lib.imp_problem_n(self.pointer)
            infos = list(table(scene).values())
            i, index = 0, ctypes.c_size_t()
            while i < self.n:
                self.check(lib.imp_problem_variable(self.pointer, i, ctypes.byref(index), None, None, None))
                info = infos[index.value]
                self.blocks.append((info, slice(i, i + info.size)))
                i += info.size
            return self
        except BaseException:
            self.__exit__()
            raise

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
            from ._library import failure
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

    def gradient(self) -> tuple[Any, Any]:
        return np.zeros(self.n), np.zeros(self.n)

    def add_targets(self, target: Any, **options: Any) -> None:
        for t in targets(self.scene, target, **options):
            self.check(lib.imp_problem_add_target(self.pointer, ctypes.byref(t[0])))

    def add_regularisers(self, tikhonov: Any, stay: Any, smooth: Any) -> None:
        for glob, weight in dict(tikhonov or {}).items():
            self.check(lib.imp_problem_add_tikhonov(self.pointer, text(glob, "tikhonov"), float(weight), 0))
        for glob, weight in dict(stay or {}).items():
            self.check(lib.imp_problem_add_tikhonov(self.pointer, text(glob, "stay"), float(weight), 1))
        for glob, weight in dict(smooth or {}).items():
            self.check(lib.imp_problem_add_smoothness(self.pointer, text(glob, "smooth"), float(weight)))


def _colours(picture: Picture, channels: int) -> tuple[Any, Any]:
    """The colour channels of a file's picture, and their errors."""
    names = list(picture.channels)
    at = ([names.index(c) for c in "RGB"] if {"R", "G", "B"} <= set(names)
          else [names.index("Y") if "Y" in names else 0])
    pixels, se = np.asarray(picture), picture.se
    if len(at) == 3 and channels == 1 or pixels.shape[2] == len(at):
        return pixels, se
    return pixels[..., at], None if se is None else se[..., at]


def _one_target(scene: Scene, target: Any, sensor: int, weights: Any, loss: str, epsilon: float,
                noise_se: Any) -> tuple[Any, Any]:
    """imp_target, and what it points to."""
    if isinstance(target, (str, bytes)) or hasattr(target, "__fspath__"):
        target = read(target)
    se = noise_se
    if isinstance(target, Picture) and target.ndim == 3 and target.channels:
        pixels, own = _colours(target, scene.channels)
        if noise_se is None and own is not None and np.isfinite(own).all():
            se = own  # one sample has no error
    else:
        pixels = target
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
    t = make(_c.imp_target, sensor=sensor, width=pixels.shape[1], height=pixels.shape[0],
             channels=pixels.shape[2], pixels=address(pixels), weights=address(weights),
             loss=choice("imp_loss", loss, "loss"), epsilon=float(epsilon), noise_se=address(se))
    return t, (pixels, weights, se)


def targets(scene: Scene, target: Any, *, sensor: Any = 0, weights: Any = None, loss: str = "l2",
            epsilon: float = 0, noise_se: Any = None) -> list[tuple[Any, Any]]:
    """imp_targets: of one target; of a list, one for each sensor in order; of a dictionary
    by sensor."""
    if isinstance(target, Mapping):
        pairs = [(scene.sensor_index(s), t) for s, t in target.items()]
    elif isinstance(target, (list, tuple)) and not np.isscalar(target[0] if target else 0) and (
            np.ndim(target[0]) == 3 or isinstance(target[0], str) or hasattr(target[0], "__fspath__")):
        if len(target) != len(scene.sensors):
            raise ArgumentError("%d targets, but the scene has %d sensors: name them, {sensor: target}"
                                % (len(target), len(scene.sensors)))
        pairs = list(enumerate(target))
    else:
        pairs = [(scene.sensor_index(sensor), target)]

    def part(value: Any, s: int, i: int) -> Any:
        if isinstance(value, Mapping):
            return value.get(s)
        return value[i] if isinstance(value, (list, tuple)) and len(pairs) > 1 else value

    return [_one_target(scene, t, s, part(weights, s, i), loss, epsilon, part(noise_se, s, i))
            for i, (s, t) in enumerate(pairs)]


# ---- Pictures ----------------------------------------------------------------------


def render(scene: Scene, params: Any = None, sensor: Any = 0, integrator: None = None, seed: int = 0,
           seed_grad: int = 0, spp: int = 0, spp_grad: int = 0, *, time_limit: float = 0,
           drop_budget: float = 0, guide: Any = None, progress: Any = None) -> Picture:
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
    scene = _scene(scene)
    if integrator is not None:
        raise TypeError("integrator: the scene's own is used; write it into the scene")
    options = _run(scene, sensor=sensor, seed=seed, spp=spp, time_limit=time_limit,
                   drop_budget=drop_budget, guide=guide)
    integer(seed_grad, "seed_grad", 0, 2**64 - 1)
    integer(spp_grad, "spp_grad", 0)
    return _film(scene, params, options, progress,
                 lambda out: (lib.imp_render, scene.pointer, ctypes.byref(options), out))


def _film(scene: Scene, params: Any, options: Any, progress: Any, call: Any, signed: bool = False) -> Picture:
    from ._library import failure, not_inside
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


def render_forward(scene: Scene, params: Any, dot: Any, sensor: Any = 0, seed: int = 0, spp: int = 0, *,
                   time_limit: float = 0, drop_budget: float = 0, guide: Any = None,
                   progress: Any = None) -> Picture:
    """Forward derivative: the picture J dot, J = d picture / d parameters.

    Parameters
    ----------
    scene : Scene
    params : SceneParameters, names or patterns
        The active parameters; None: all that have a gradient.
    dot : mapping or array
        Of each parameter, its part of the direction, in its unit; parameters that are not
        named stay. Or an array of all active numbers.
    sensor, seed, spp, time_limit, drop_budget, guide, progress
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
        options = _run(p.scene, sensor=sensor, seed=seed, spp=spp, time_limit=time_limit,
                       drop_budget=drop_budget, guide=guide)
        return _film(p.scene, None, options, progress, lambda out: (
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
                    drop_budget: float = 0, guide: Any = None, progress: Any = None) -> Gradient:
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
    sensor, seed, spp, drop_budget, guide, progress
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
        options = _run(p.scene, sensor=sensor, seed=seed, spp=spp, drop_budget=drop_budget, guide=guide)
        g, se = p.gradient()
        p.run(options, progress, lib.imp_problem_reverse, p.pointer, address(image), ctypes.byref(options),
              address(g), address(se))
        return Gradient(p.scene, p.split(g), p.split(se))


class Jacobian(Values):
    """Derivative pictures by parameter: name -> float32 [*shape][height][width][channels],
    `se` likewise; `picture` is the picture itself."""

    def __init__(self, scene: Scene, values: dict[str, Any], se: dict[str, Any], picture: Picture,
                 pictures: dict[str, list[Picture]]) -> None:
        super().__init__(scene, values)
        self.se = Values(scene, se)
        self.picture = picture
        self.pictures = Values(scene, pictures)


def jacobian(scene: Scene, params: Any = None, sensor: Any = 0, seed: int = 0, spp: int = 0, *,
             time_limit: float = 0, drop_budget: float = 0, guide: Any = None, progress: Any = None) -> Jacobian:
    """A derivative picture for each active number (at most 256), from one set of walks.

    Parameters
    ----------
    scene, params, sensor, seed, spp, time_limit, drop_budget, guide, progress
        As `render_forward`'s.

    Returns
    -------
    Jacobian
        name -> [*shape of the parameter][height][width][channels]; `se`, `picture`, and
        `pictures` (lists of `Picture`, to show and to write).

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> j = importon.jacobian(scene, "red.*", spp=4)
    >>> j["red.reflectance"].shape, j.picture.shape
    ((3, 8, 8, 3), (8, 8, 3))
    """
    from ._library import failure
    with Problem(scene, params) as p:
        if p.n > 256:
            raise ArgumentError("%d numbers are active; derivative pictures are for at most 256" % p.n)
        options = _run(p.scene, sensor=sensor, seed=seed, spp=spp, time_limit=time_limit,
                       drop_budget=drop_budget, guide=guide)
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

        made = Jacobian(p.scene,
                        {info.name: stack(info, [np.asarray(q) for q in pictures[at]]) for info, at in p.blocks},
                        {info.name: stack(info, [q.se for q in pictures[at]]) for info, at in p.blocks},
                        picture, {info.name: pictures[at] for info, at in p.blocks})
        if status:
            raise failure(status, message, made)
        return made


# ---- Losses ------------------------------------------------------------------------


class Loss:
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
    """

    def __init__(self, value: float, se: float, bias_order: int, grad: Gradient) -> None:
        self.value, self.se, self.bias_order, self.grad = value, se, bias_order, grad
        self.grad_se = grad.se

    def __float__(self) -> float:
        return self.value

    def __repr__(self) -> str:
        bias = "" if not self.bias_order else ", bias of order 1/spp%s" % ("^2" if self.bias_order == 2 else "")
        return "%.6g +- %.2g%s" % (self.value, self.se, bias)

    def _repr_html_(self) -> str:
        from ._html import gradient
        return gradient(self)


def loss(scene: Scene, target: Any, params: Any = None, *, spp: int = 0, seed: int = 0, sensor: Any = 0,
         loss: str = "l2", epsilon: float = 0, weights: Any = None, tikhonov: Optional[Mapping[str, float]] = None,
         stay: Optional[Mapping[str, float]] = None, smooth: Optional[Mapping[str, float]] = None,
         drop_budget: float = 0, guide: Any = None, progress: Any = None) -> Loss:
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
    tikhonov, stay, smooth : mapping, optional
        Pattern -> weight W: W/2 |x|^2, W/2 |x - x now|^2, W/2 |grad x|^2 (of textures).
    drop_budget, guide, progress
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
        options = _run(p.scene, seed=seed, spp=spp, drop_budget=drop_budget, guide=guide)
        p.add_targets(target, sensor=sensor, weights=weights, loss=loss, epsilon=epsilon)
        p.add_regularisers(tikhonov, stay, smooth)
        value, (g, se) = _c.imp_estimate(), p.gradient()
        p.run(options, progress, lib.imp_problem_objective, p.pointer, None, ctypes.byref(options),
              ctypes.byref(value), address(g), address(se))
        return Loss(value.value, value.se, value.bias_order, Gradient(p.scene, p.split(g), p.split(se)))


# ---- Checks and comparisons --------------------------------------------------------


class CheckRow:
    """One line of a check: a method, a parameter, two numbers that must agree."""

    FIELDS = ("method", "param", "step", "value", "reference", "se", "error", "limit", "ok", "kinks")
    __slots__ = FIELDS

    method: str
    param: str
    step: float
    value: float
    reference: float
    se: float
    error: float
    limit: float
    ok: int
    kinks: int

    def __init__(self, row: Any) -> None:
        for name in self.FIELDS:
            value = getattr(row, name)
            setattr(self, name, value.decode(errors="replace") if isinstance(value, bytes) else value)

    @property
    def verdict(self) -> str:
        return {1: "ok", 0: "FAIL"}.get(self.ok, "noisy")

    def __repr__(self) -> str:
        return "%-9s %-32s %12.6g %12.6g +- %-9.2g error %-9.2g %s" % (
            self.method, self.param, self.value, self.reference, self.se, self.error, self.verdict)


class Check(Sequence):  # type: ignore[type-arg]
    """The rows of a check; true if none of them failed."""

    def __init__(self, rows: list[CheckRow]) -> None:
        self.rows = rows

    def __getitem__(self, i: Any) -> Any:
        return self.rows[i]

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[CheckRow]:
        return iter(self.rows)

    @property
    def ok(self) -> bool:
        return not self.failed

    @property
    def failed(self) -> list[CheckRow]:
        return [r for r in self.rows if r.ok == 0]

    def __bool__(self) -> bool:
        return self.ok

    def __repr__(self) -> str:
        return "\n".join(map(repr, self.rows))

    def _repr_html_(self) -> str:
        from ._html import check
        return check(self)


def check_rows(address: Optional[int], n: int) -> Check:
    rows: Any = (_c.imp_check_row * n).from_address(address) if n and address else []
    return Check([CheckRow(r) for r in rows])


def check(scene: Scene, params: Any = None, target: Any = None, *, spp: int = 0, seed: int = 0, sensor: Any = 0,
          loss: str = "l2", epsilon: float = 0, paths: int = 0, fresh_spp: int = 0, drop_budget: float = 0,
          progress: Any = None) -> Check:
    """Check gradients: each walk against differences with its decisions frozen, pictures
    against differences with fresh random numbers, forward against reverse, densities
    against the directions drawn, losses against direct computation.

    Parameters
    ----------
    scene : Scene
    params : SceneParameters, names or patterns
        The active parameters; None: all that have a gradient.
    target : optional
        As `loss`'s; checks its gradient too.
    spp, seed, sensor, loss, epsilon, drop_budget, progress
        As `loss`'s.
    paths : int
        Frozen walks looked at; 0: 1000.
    fresh_spp : int
        Samples per pixel of fresh differences; 0: `spp`.

    Returns
    -------
    Check
        Rows; false if one of them failed.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> bool(importon.check(scene, "red.*", spp=64, paths=50))
    True
    """
    with Problem(scene, params) as p:
        options = _run(p.scene, sensor=sensor, seed=seed, spp=spp, drop_budget=drop_budget)
        if target is not None:
            p.add_targets(target, sensor=sensor, loss=loss, epsilon=epsilon)
        wanted = make(_c.imp_check_options, paths=integer(paths, "paths"), fresh_spp=integer(fresh_spp, "fresh_spp"))
        rows, n = ctypes.c_void_p(), ctypes.c_size_t()
        p.run(options, progress, lib.imp_check, p.pointer, ctypes.byref(wanted), ctypes.byref(options),
              ctypes.byref(rows), ctypes.byref(n))
        return check_rows(rows.value, n.value)


class Comparison:
    """Whether two pictures show the same, within their noise: what `compare` returns.

    Attributes
    ----------
    rmse, relative_rmse, max_abs : float
        Of all channels; relative to the reference.
    mean_a, mean_b : float
        Of test and reference.
    p_fail_fraction : float
        Part of the pixels whose z-test fails at 1 % over the whole picture.
    mean_z, over2 : float
        |z| of the mean, worst channel; part of the pixels with |z| > 2 (0.0455 expected).
    has_z, agree : bool
    """

    rmse: float
    relative_rmse: float
    max_abs: float
    mean_a: float
    mean_b: float
    p_fail_fraction: float
    mean_z: float
    over2: float
    has_z: bool
    agree: bool

    def __init__(self, result: Any) -> None:
        for name, _ in result._fields_[1:]:
            value = getattr(result, name)
            setattr(self, name, bool(value) if name in ("has_z", "agree") else value)

    def __bool__(self) -> bool:
        return self.agree

    def __repr__(self) -> str:
        z = ", mean z %.2f, |z| > 2 at %.2g %%" % (self.mean_z, 100 * self.over2) if self.has_z else ""
        return "%s: rmse %.4g (relative %.4g), means %.6g and %.6g%s" % (
            "agree" if self.agree else "differ", self.rmse, self.relative_rmse, self.mean_a, self.mean_b, z)


def compare(test: Any, reference: Any, *, variance: Any = None, n_test: float = 0, n_reference: float = 0,
            floor: float = 0, xyz: bool = False) -> Comparison:
    """Do two pictures of one size show the same, within their noise?

    Parameters
    ----------
    test, reference : Picture, array or path
        With standard errors on either side, pixels are compared by z-tests.
    variance : Picture, array or path, optional
        Per sample, of `reference`.
    n_test, n_reference : float
        Samples per pixel; 0: unknown, or exact.
    floor : float
        Of the variance; 0: 1e-4 of the squared mean of the channel.
    xyz : bool
        Compare X, Y, Z, made from R, G, B.

    Returns
    -------
    Comparison
        True where they agree.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> a, b = (importon.render(scene, spp=64, seed=s) for s in (1, 2))
    >>> bool(importon.compare(a, b))
    True
    """
    from ._library import context
    from ._picture import to_film
    def load(p: Any) -> Any:
        return read(p) if isinstance(p, (str, bytes)) or hasattr(p, "__fspath__") else p

    ctx = context()
    films = [None if p is None else to_film(load(p), ctx, n)
             for p, n in ((test, "test"), (reference, "reference"), (variance, "variance"))]
    assert films[0] and films[1]
    options = make(_c.imp_compare_options, variance=films[2].pointer if films[2] else None, n_test=float(n_test),
                   n_reference=float(n_reference), floor=float(floor), xyz=bool(xyz))
    result = make(_c.imp_compare_result)
    ctx.check(lib.imp_compare(ctx.pointer, films[0].pointer, films[1].pointer, ctypes.byref(options),
                              ctypes.byref(result)))
    return Comparison(result)
