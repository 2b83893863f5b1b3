# SPDX-License-Identifier: Apache-2.0
"""Pictures, losses and bent rays in JAX: under `jit`, `grad` and `jvp`; `vmap` runs calls
one after the other.

JAX takes one rule of differentiation for a function: `render`, `loss` and `bend` have
reverse rules (`grad`, `vjp`), `render_forward` and `bend_forward` forward ones (`jvp`).
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Optional

import jax
import jax.numpy as jnp
import numpy as np

from ._functional import Function, RayFunction, other_seed, rest_of


def _flat(function: Function, values: Mapping[str, Any]) -> Any:
    from ._params import find
    given = {find(function.scene, n).name: v for n, v in values.items()}
    parts = [jnp.broadcast_to(jnp.ravel(jnp.asarray(given[i.name])), (i.size,)) if np.size(given[i.name]) in (1, i.size)
             and jnp.shape(given[i.name]) in ((), (1,), i.shape) else _shape(i, given[i.name]) for i in function.infos]
    return jnp.concatenate([jnp.asarray(p, dtype=jnp.result_type(float)) for p in parts])


def _shape(info: Any, value: Any) -> Any:
    from ._errors import ArgumentError
    raise ArgumentError("%s has shape %s, not %s" % (info.name, jnp.shape(value), info.shape))


def _like(shape: tuple[int, ...], dtype: Any) -> Any:
    return jax.ShapeDtypeStruct(shape, dtype)  # type: ignore[no-untyped-call,unused-ignore]


def _call(function: Any, result: Any, *arguments: Any) -> Any:
    return jax.pure_callback(function, result, *arguments, vmap_method="sequential")


def _pair(seed: Any, seed_grad: Any) -> Any:
    """Both seeds as words of 32 bits: arrays, so that another seed compiles nothing anew."""
    if isinstance(seed, (int, np.integer)):
        grad = other_seed(int(seed)) if seed_grad is None else int(seed_grad)
        words = [int(seed) & 0xFFFFFFFF, int(seed) >> 32, grad & 0xFFFFFFFF, grad >> 32]
        return jnp.asarray(np.array(words, dtype=np.uint32))
    low = jnp.asarray(seed, dtype=jnp.uint32)
    other = low if seed_grad is None else jnp.asarray(seed_grad, dtype=jnp.uint32)
    high = jnp.uint32(0x9E3779B9) if seed_grad is None else jnp.uint32(0)
    return jnp.stack([low, jnp.uint32(0), other, high])


def _seed(words: Any, which: int) -> int:
    words = np.asarray(words).astype(np.uint64)
    return int(words[2 * which]) | int(words[2 * which + 1]) << 32


def render(scene: Any, values: Mapping[str, Any], *, sensor: Any = 0, spp: int = 0, seed: Any = 0,
           seed_grad: Optional[Any] = None, spp_grad: int = 0, drop_budget: float = 0, guide: Any = None,
           wavelengths: str = "stratified", wavelength_set: int = 0, points: str = "scene") -> Any:
    """A picture as a function of parameters, with a reverse rule.

    Parameters
    ----------
    scene : Scene
        Its parameters are set to `values`.
    values : mapping of str to array
        Of the parameter's shape, or one number.
    seed : int or array
        May be traced.
    sensor, spp, drop_budget, guide, wavelengths, wavelength_set, points
        As `importon.render`'s.
    seed_grad, spp_grad : optional
        Of the backward pass; by default other random numbers than the picture's.

    Returns
    -------
    array
        float32 [height][width][channels].

    Raises
    ------
    BiasError
        A parameter has no unbiased derivative. Errors of a call inside a compiled function
        come as JAX's runtime errors, with the library's message.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> f = lambda x: importon.jax.render(scene, {"red.reflectance.value": x}, spp=4).sum()
    >>> jax.grad(f)(jnp.array([0.5, 0.1, 0.1])).shape
    (3,)
    """
    f = Function(scene, values, sensor, spp, spp_grad, rest_of(drop_budget, guide, wavelengths, wavelength_set, points))

    @jax.custom_vjp
    def picture(x: Any, words: Any) -> Any:
        return _call(lambda x, w: np.array(f.picture(x, _seed(w, 0))), _like(f.shape, jnp.float32), x, words)

    def forward(x: Any, words: Any) -> Any:
        return picture(x, words), (x, words)

    def backward(saved: Any, grad: Any) -> Any:
        x, words = saved
        g = _call(lambda x, i, w: f.backward(x, i, _seed(w, 1)).astype(x.dtype), _like(x.shape, x.dtype),
                  x, grad, words)
        return g, None

    picture.defvjp(forward, backward)
    return picture(_flat(f, values), _pair(seed, seed_grad))


def render_forward(scene: Any, values: Mapping[str, Any], *, sensor: Any = 0, spp: int = 0, seed: Any = 0,
                   seed_grad: Optional[Any] = None, spp_grad: int = 0, drop_budget: float = 0, guide: Any = None,
                   wavelengths: str = "stratified", wavelength_set: int = 0, points: str = "scene") -> Any:
    """A picture as a function of parameters, with a forward rule: for `jax.jvp`.

    Parameters
    ----------
    scene, values, sensor, spp, seed, seed_grad, spp_grad, drop_budget, guide, wavelengths, wavelength_set, points
        As `render`'s.

    Returns
    -------
    array
        float32 [height][width][channels].

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> f = lambda x: importon.jax.render_forward(scene, {"red.reflectance.value": x}, spp=4)
    >>> x = jnp.array([0.5, 0.1, 0.1])
    >>> jax.jvp(f, (x,), (jnp.ones(3),))[1].shape
    (8, 8, 3)
    """
    f = Function(scene, values, sensor, spp, spp_grad, rest_of(drop_budget, guide, wavelengths, wavelength_set, points))
    result = _like(f.shape, jnp.float32)

    @jax.custom_jvp
    def picture(x: Any, words: Any) -> Any:
        return _call(lambda x, w: np.array(f.picture(x, _seed(w, 0))), result, x, words)

    @picture.defjvp
    def rule(primals: Any, tangents: Any) -> Any:
        x, words = primals
        dot = _call(lambda x, d, w: np.array(f.forward(x, d, _seed(w, 1))), result, x, tangents[0], words)
        return picture(x, words), dot

    return picture(_flat(f, values), _pair(seed, seed_grad))


def loss(scene: Any, target: Any, values: Mapping[str, Any], *, spp: int = 0, seed: Any = 0, sensor: Any = 0,
         loss: str = "l2", epsilon: float = 0, weights: Any = None, drop_budget: float = 0, guide: Any = None,
         wavelengths: str = "stratified", wavelength_set: int = 0, points: str = "scene") -> Any:
    """A loss as a function of parameters: value and gradient from one pass, each walk
    compared with the mean of the others, so without bias for quadratic losses.

    Parameters
    ----------
    scene, target, spp, sensor, loss, epsilon, weights, drop_budget, guide, wavelengths, wavelength_set, points
        As `importon.loss`'s.
    values, seed
        As `render`'s.

    Returns
    -------
    array
        A scalar.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> target = importon.render(scene, spp=16, seed=1)
    >>> f = lambda x: importon.jax.loss(scene, target, {"red.reflectance.value": x}, spp=4)
    >>> jax.value_and_grad(f)(jnp.array([0.5, 0.1, 0.1]))[1].shape
    (3,)
    """
    f = Function(scene, values, sensor, spp, 0, rest_of(drop_budget, guide, wavelengths, wavelength_set, points),
                 np.asarray(target) if isinstance(target, jax.Array) else target,
                 loss=loss, epsilon=epsilon, weights=weights)
    x = _flat(f, values)
    scalar = _like((), x.dtype)

    @jax.custom_vjp
    def value(x: Any, words: Any) -> Any:
        return _call(lambda x, w: np.asarray(f.loss(x, _seed(w, 0), False)[0], x.dtype), scalar, x, words)

    def both(x: Any, words: Any) -> Any:
        v, g = f.loss(x, _seed(words, 0))
        return np.asarray(v, x.dtype), g.astype(x.dtype)

    def forward(x: Any, words: Any) -> Any:
        return _call(both, (scalar, _like(x.shape, x.dtype)), x, words)

    value.defvjp(forward, lambda g, grad: (grad * g, None))
    return value(x, _pair(seed, None))


def _rays(field: Any, theta: Any, origins: Any, directions: Any, options: dict[str, Any]) -> Any:
    f = RayFunction(field, options)
    theta, origins, directions = (jnp.asarray(a, dtype=jnp.result_type(float)) for a in (theta, origins, directions))
    n, dtype = origins.shape[0], theta.dtype
    return f, (theta, origins, directions), tuple(_like(s, dtype) for s in ((n, 3), (n, 3), (n,)))


def _trace(f: RayFunction) -> Any:
    def trace(theta: Any, origins: Any, directions: Any) -> Any:
        e = f.trace(theta, origins, directions)
        return tuple(np.asarray(a, theta.dtype) for a in (e.x, e.v, e.path))
    return trace


def bend(field: Any, theta: Any, origins: Any, directions: Any, **options: Any) -> Any:
    """Where bent rays end, as a function of field and rays, with a reverse rule.

    Parameters
    ----------
    field : importon.bend.Field
    theta : array
        [n_theta]
    origins, directions : array
        [n][3]
    **options
        As `importon.bend.trace`'s.

    Returns
    -------
    x, v, path : array
        [n][3], [n][3], [n].

    Examples
    --------
    >>> field = importon.bend.Field.profile("luneburg", [1, 0, 0, 0])
    >>> f = lambda t: importon.jax.bend(field, t, [[0, 0.3, -0.9539]], [[0, 0, 1.0]], step=0.01,
    ...                                 surfaces=[{"type": "sphere", "radius": 1}])[2].sum()
    >>> jax.grad(f)(jnp.array(field.theta)).shape
    (4,)
    """
    f, arguments, result = _rays(field, theta, origins, directions, options)

    @jax.custom_vjp
    def trace(theta: Any, origins: Any, directions: Any) -> Any:
        return _call(_trace(f), result, theta, origins, directions)

    def backward(saved: Any, bars: Any) -> Any:
        like = tuple(_like(a.shape, a.dtype) for a in saved)
        return _call(lambda *a: tuple(np.asarray(g, a[0].dtype) for g in f.backward(*a)), like, *saved, *bars)

    trace.defvjp(lambda *a: (trace(*a), a), backward)
    return trace(*arguments)


def bend_forward(field: Any, theta: Any, origins: Any, directions: Any, **options: Any) -> Any:
    """`bend` with a forward rule: for `jax.jvp`.

    Parameters
    ----------
    field, theta, origins, directions, **options
        As `bend`'s.

    Returns
    -------
    x, v, path : array
        [n][3], [n][3], [n].

    Examples
    --------
    >>> field = importon.bend.Field.profile("luneburg", [1, 0, 0, 0])
    >>> f = lambda t: importon.jax.bend_forward(field, t, [[0, 0.3, -0.9539]], [[0, 0, 1.0]], step=0.01,
    ...                                         surfaces=[{"type": "sphere", "radius": 1}])[2]
    >>> theta = jnp.array(field.theta)
    >>> jax.jvp(f, (theta,), (jnp.ones_like(theta),))[1].shape
    (1,)
    """
    f, arguments, result = _rays(field, theta, origins, directions, options)

    @jax.custom_jvp
    def trace(theta: Any, origins: Any, directions: Any) -> Any:
        return _call(_trace(f), result, theta, origins, directions)

    def host(theta: Any, origins: Any, directions: Any, *dots: Any) -> Any:
        from . import bend
        f.field.theta = theta
        made = bend.tangent(f.field, origins, directions, *dots, progress=False, **f.options)
        return tuple(np.asarray(a, theta.dtype) for a in made)

    @trace.defjvp
    def rule(primals: Any, tangents: Any) -> Any:
        return trace(*primals), _call(host, result, *primals, *tangents)

    return trace(*arguments)


__all__ = ["bend", "bend_forward", "loss", "render", "render_forward"]
