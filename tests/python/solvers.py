# SPDX-License-Identifier: Apache-2.0
"""Bent rays and finite elements."""
import os

import importon as im
import numpy as np
from tap import SCENES, raises, run, z

BEND = os.path.join(SCENES, "bend")
SPHERE = [{"type": "sphere", "radius": 1.0}]


def rays(n, seed=1):
    rng = np.random.default_rng(seed)
    x = np.column_stack([rng.uniform(-.4, .4, (n, 2)), np.full(n, -.8)])
    return x, np.column_stack([rng.normal(0, .05, (n, 2)), np.ones(n)])


def field():
    f = im.bend.Field.grid([6, 6, 6], [-1] * 3, [1] * 3, 1.3)
    f.theta = f.theta + .02 * np.random.default_rng(3).normal(size=f.theta.shape)
    return f


def test_luneburg():
    """Parallel rays into a Luneburg lens meet in a point (closed form)"""
    f = im.bend.Field.profile("luneburg", [1, 0, 0, 0])
    y = np.linspace(-.6, .6, 7)
    o = np.column_stack([np.zeros(7), y, -np.sqrt(1 - y**2) * .9999999])
    e = im.bend.trace(f, o, np.tile([0, 0, 1.], (7, 1)), step=.002, surfaces=SPHERE, scheme="yoshida4")
    assert e.ok.all() and np.abs(e.x - [0, 0, 1]).max() < 1e-5, (e.ok, e.x)
    eta, gradient = f.eval([[0, 0, .5]])
    assert abs(eta[0] - np.sqrt(2 - .25)) < 1e-12 and abs(gradient[0, 2] + .5 / eta[0]) < 1e-12


def test_adjoint():
    """Reverse is forward; both are the differences of traces"""
    f, (o, d) = field(), rays(40)
    rng = np.random.default_rng(2)
    e = im.bend.trace(f, o, d, step=.05)
    assert e.ok.all() and e.stats["traced"] == 40
    xb, vb, pb = rng.normal(size=(40, 3)), rng.normal(size=(40, 3)), rng.normal(size=40)
    g = im.bend.adjoint(f, o, d, e, xb, vb, pb, step=.05)
    td, od, dd = rng.normal(size=f.theta.shape), rng.normal(size=o.shape), rng.normal(size=d.shape)
    x, v, p = im.bend.tangent(f, o, d, td, od, dd, step=.05)
    a = np.sum(x * xb) + np.sum(v * vb) + np.sum(p * pb)
    b = np.sum(g.theta * td) + np.sum(g.origins * od) + np.sum(g.directions * dd)
    assert abs(a - b) < 1e-11 * (np.abs(x * xb).sum() + 1), (a, b)
    theta, h, values = f.theta, 1e-6, []
    for sign in (1, -1):
        f.theta = theta + sign * h * td
        q = im.bend.trace(f, o + sign * h * od, d + sign * h * dd, step=.05)
        values.append(np.sum(q.x * xb) + np.sum(q.v * vb) + np.sum(q.path * pb))
    assert abs((values[0] - values[1]) / (2 * h) - b) < 1e-6 * abs(b) + 1e-6


def test_problems():
    """Problems from files: objective, gradient, run, check, fit"""
    b = im.bend.load_file(os.path.join(BEND, "rod.xml"), count=32)
    value, g = b.objective()
    theta, h = b.field.theta, 1e-6
    d = []
    for sign in (1, -1):
        t = theta.copy()
        t[0] += sign * h
        b.field.theta = t
        d.append(b.objective(gradient=False)[0])
    assert abs((d[0] - d[1]) / (2 * h) - g[0]) < 1e-5 * abs(g[0]) + 1e-9
    b.field.theta = theta * 1.02
    f = b.fit(iterations=20)
    assert f.value < f.start and len(f.history) and f.reason and np.array_equal(b.field.theta.shape, theta.shape)
    assert b.check() and b.run().ok.sum() == 32 and b.ray(3).shape[1] == 4
    raises(TypeError, lambda: im.bend.load_file(os.path.join(BEND, "rod.xml"), cuont=3), "count")
    raises(im.FileError, lambda: im.bend.load_file("none.xml"))
    raises(im.SceneError, lambda: im.bend.load_string("<scene version='3.0.0'/>"))


def test_built():
    """A problem built by calls"""
    b = im.bend.Bend(field())
    o, d = rays(24)
    assert b.add_rays(o, d) == 0 and b.n_rays == 24
    b.set_options(step=.05)
    b.add_target("focus", point=[0, 0, 1], weight=2.0)
    b.add_target("path", data=np.full(24, 2.4))
    raises(im.ArgumentError, lambda: b.add_target("points"), "data")
    raises(im.ArgumentError, lambda: b.add_target("path", data=np.ones(3)), "24")
    raises(im.ArgumentError, lambda: b.add_target("fcous"), "focus")
    raises(TypeError, lambda: b.add_target("focus", pointt=[0, 0, 1]), "point")
    assert b.n_targets == 2
    before = b.objective()[0]
    assert b.fit(iterations=15).value < .5 * before
    raises(im.Cancelled, lambda: b.fit(iterations=10**6, tolerance=1e-300, progress=lambda p: True))


def test_bad_rays():
    """Bad rays, fields and options: exceptions, and objects that belong to others"""
    f, (o, d) = field(), rays(4)
    for bad in (lambda: im.bend.trace(f, o[:2], d), lambda: im.bend.trace(f, o[:, :2], d), lambda: im.bend.trace(f, o * np.nan, d),
                lambda: im.bend.trace(f, o, d, step=-1), lambda: im.bend.trace(f, o, d, scheme="rk4"),
                lambda: im.bend.trace(f, o, d, surfaces=[{"type": "cone"}]), lambda: im.bend.Field.grid([0, 1, 1], [0] * 3, [1] * 3),
                lambda: im.bend.Field.profile("lunebrug", [1.]), lambda: setattr(f, "theta", f.theta[1:]),
                lambda: setattr(f, "theta", f.theta * np.inf), lambda: im.bend.adjoint(f, o, d, im.bend.trace(f, o[:1], d[:1])),
                lambda: im.bend.adjoint(f, o, d, None)):
        raises(im.ArgumentError, bad)
    raises(TypeError, lambda: im.bend.trace(f, o, d, stpe=1), "step")
    e = im.bend.trace(f, o, d, scheme="arc_index", step=.05)
    raises(im.BiasError, lambda: im.bend.adjoint(f, o, d, e, x_bar=o, scheme="arc_index", step=.05))
    b = im.bend.Bend(f)
    raises(TypeError, lambda: im.bend.Bend(f))
    assert f.theta.size and b.field.kind == f.kind
    b.close()
    raises(im.ArgumentError, lambda: f.theta, "closed")
    raises(im.ArgumentError, lambda: b.objective(), "closed")


def test_elements():
    """Elements: pictures, measurements, sensitivities, a fit of lamps to wanted lux"""
    s = im.load_file(os.path.join(SCENES, "elements", "d_lamps.xml"))
    shapes = [{"kind": "shape", "shape": "floor"}]
    e = im.elements.Elements(s, shapes, stop=.02)
    assert e.measures.shape == (1,) and np.isclose(e.measure, e.measures[0], rtol=1e-12) and e.measure > 0 and "links" in repr(e)
    rows = e.sensitivity()
    light = [r for r in rows if r.emission]
    assert abs(sum(r.value * r.derivative for r in light) / e.measure - 1) < 1e-6  # linear in the lamps
    assert e.image(kind="flat").shape == e.image().shape
    params = im.traverse(s)
    names = sorted({r.name for r in light})
    f = e.fit([1.5 * e.measure], names)
    (target, before, after), = f.goals
    assert f.linear and abs(after / target - 1) < 1e-3 and before < after and set(f) == set(names), f.goals
    assert np.allclose(f[names[0]].value, params[names[0]])
    e.save("x.el")
    again = im.elements.Elements(s, shapes, stop=.02, open="x.el")
    assert again.measure == e.measure
    e.export("x.json")
    raises(TypeError, lambda: im.elements.Elements(s, oder=3), "order")
    raises(TypeError, lambda: im.elements.Elements(s, [{"kind": "shape", "shap": "floor"}]), "shape")
    raises(im.ArgumentError, lambda: im.elements.Elements(s, [{"kind": "lamp"}]), "lamp")
    raises(im.ArgumentError, lambda: e.fit([1, 2], names), "targets")
    raises(im.Error, lambda: im.elements.Elements(im.load_file(os.path.join(SCENES, "textured.xml"))))


def test_guide():
    """A guide changes the noise and not the mean"""
    d = im.cornell_box(res=12)
    s = im.load_dict(d)
    e = im.elements.Elements(s, stop=.05)
    g = im.guide(e, share=.3)
    a, b = im.render(s, spp=256, seed=1, guide=g), im.render(s, spp=256, seed=2)
    assert im.compare(a, b) and not np.array_equal(a, im.render(s, spp=256, seed=1))
    z(np.mean(a, dtype=float), np.mean(b, dtype=float), np.hypot(*(np.sqrt(np.sum(p.se.astype(float)**2)) / p.size for p in (a, b))))
    raises(TypeError, lambda: im.render(s, guide=e), "guide")
    raises(TypeError, lambda: im.guide(s))
    s.close()
    raises(im.ArgumentError, lambda: e.measure, "closed")
    raises(im.ArgumentError, lambda: im.render(im.load_dict(d), spp=1, guide=g), "closed")


run(globals())
