# SPDX-License-Identifier: Apache-2.0
"""JAX: jit, vmap, both rules of differentiation, errors, an optimiser's loop."""
import importon as im
import jax
import jax.numpy as jnp
import numpy as np
from tap import raises, run

jax.config.update("jax_enable_x64", True)
RED, LIGHT = "red.reflectance.value", "light.emitter.radiance.value"
X = jnp.array([.5, .3, .4])


def box(res=12, **kw):
    d = im.cornell_box(res=res, **kw)
    d["integrator"]["max_depth"] = 4
    return im.load_dict(d)


def test_is_importon():
    """The same numbers as importon.render and importon.loss"""
    s = box()
    im.traverse(s)[RED] = np.asarray(X)
    assert np.array_equal(im.jax.render(s, {RED: X}, spp=8, seed=3), im.render(s, spp=8, seed=3))
    target = im.render(s, spp=4, seed=1)
    f = lambda x: im.jax.loss(s, target, {RED: x}, spp=8, seed=3)
    value, g = jax.value_and_grad(f)(X)
    e = im.loss(s, target, [RED], spp=8, seed=3)
    assert np.isclose(value, float(e), rtol=1e-12) and np.allclose(g, e.grad[RED], rtol=1e-12)
    assert np.isclose(f(X), float(e), rtol=1e-12)


def test_rules():
    """Reverse is forward with the same walks; both are differences"""
    s = box(res=6)
    rng = np.random.default_rng(1)
    w, dot = rng.normal(size=(6, 6, 3)), rng.normal(size=3)
    seeds = dict(spp=8, seed=5, seed_grad=5)
    _, pull = jax.vjp(lambda x: im.jax.render(s, {RED: x}, **seeds), X)
    _, push = jax.jvp(lambda x: im.jax.render_forward(s, {RED: x}, **seeds), (X,), (jnp.array(dot),))
    a, b = float(pull(jnp.asarray(w, jnp.float32))[0] @ dot), float(np.sum(np.asarray(push, float) * w))
    assert abs(a - b) < 1e-5 * np.abs(push * w).sum(), (a, b)
    h = 1e-2
    d = [np.asarray(im.jax.render(s, {RED: X + q * h * dot}, **seeds), float) for q in (1, -1)]
    assert np.abs((d[0] - d[1]) / (2 * h) - push).max() < 2e-2 * np.abs(push).max()


def test_jit():
    """jit and grad; a traced seed compiles once; vmap in sequence"""
    s = box()
    target = np.asarray(im.render(s, spp=8, seed=1))
    traces = []

    @jax.jit
    def step(x, seed):
        traces.append(1)
        return jax.value_and_grad(lambda x: im.jax.loss(s, target, {RED: x}, spp=4, seed=seed))(x)
    a, b = step(X, 1), step(X, 2)
    assert len(traces) == 1 and a[0] != b[0] and np.allclose(step(X, 1)[1], a[1])
    im.traverse(s)[RED] = np.asarray(X)
    assert np.isclose(a[0], float(im.loss(s, target, [RED], spp=4, seed=1)), rtol=1e-12)
    many = jax.vmap(lambda x: im.jax.render(s, {RED: x}, spp=2).mean())(jnp.stack([X, X / 2, X / 4]))
    each = [float(im.jax.render(s, {RED: x}, spp=2).mean()) for x in (X, X / 2, X / 4)]
    assert np.allclose(many, each, rtol=1e-6), (many, each)


def test_bend():
    """Bent rays: reverse, forward, differences"""
    f = im.bend.Field.grid([4, 4, 4], [-1] * 3, [1] * 3, 1.3)
    rng = np.random.default_rng(1)
    theta = jnp.array(f.theta + .02 * rng.normal(size=f.theta.shape))
    o, d = jnp.array([[0, .3, -.8], [.1, .2, -.7]]), jnp.array([[0, 0, 1.], [0, .1, 1.]])
    dot = jnp.array(rng.normal(size=theta.shape))
    c = lambda g: lambda t: jnp.sum(g(f, t, o, d, step=.1)[0][:, 0] ** 2) + jnp.sum(g(f, t, o, d, step=.1)[2])
    a = jax.grad(c(im.jax.bend))(theta) @ dot
    _, b = jax.jvp(c(im.jax.bend_forward), (theta,), (dot,))
    h = 1e-6
    e = (c(im.jax.bend)(theta + h * dot) - c(im.jax.bend)(theta - h * dot)) / (2 * h)
    assert np.isclose(a, b, rtol=1e-11) and np.isclose(a, e, rtol=1e-5), (a, b, e)


def test_bad_input():
    """Bad values: exceptions with the library's message"""
    s = box()
    raises(im.ArgumentError, lambda: im.jax.render(s, {RED: jnp.ones(2)}, spp=2), "shape")
    raises(im.ParameterError, lambda: im.jax.render(s, {"rde": X}, spp=2), "red")
    raises(Exception, lambda: im.jax.render(s, {RED: 2 * X + 1}, spp=2).block_until_ready(), "outside [0, 1]")
    raises(Exception, lambda: jax.jit(lambda x: im.jax.render(s, {RED: x}, spp=2))(2 * X + 1).block_until_ready(), "outside [0, 1]")
    raises(Exception, lambda: jax.jvp(lambda x: im.jax.render(s, {RED: x}, spp=2), (X,), (X,)))
    assert im.jax.render(s, {RED: .5}, spp=2).shape == (12, 12, 3)


def test_loop():
    """A loop of gradient descent finds the wall"""
    s = box()
    target = im.render(s, spp=512, seed=1)
    truth = im.traverse(s)[RED]
    f = jax.jit(lambda x, k: jax.grad(lambda x: im.jax.loss(s, target, {RED: x}, spp=16, seed=k))(x))
    x = jnp.array([.2, .4, .4])
    for k in range(60):
        x = jnp.clip(x - .6 * f(x, k), 0, 1)
    assert np.abs(x - truth).max() < .12, (x, truth)


run(globals())
