# SPDX-License-Identifier: Apache-2.0
"""Fields of refractive index: kinds, values and derivatives; taps, groups, wavelengths and held
numbers of bent rays."""
import importon as im
import numpy as np
from tap import raises, run

rng = np.random.default_rng(5)
Field = im.bend.Field


def grid(cells=(4, 4, 4), noise=.02, **kw):
    f = Field.grid(cells, [-1] * 3, [1] * 3, 1.4, **kw)
    f.theta = f.theta + noise * rng.normal(size=f.theta.shape)
    return f


def kinds():
    yield grid()
    yield grid(interp="trilinear")
    yield Field.profile("rod", [1.6, .4, .1, 0, 0])
    r = Field.radial(1.5, radius=2.0, cells=6)
    r.theta = r.theta + .02 * rng.normal(size=r.theta.shape)
    yield r
    z = Field.rz(1.5, radius=2.0, lo=-1, hi=1, cells_r=3, cells_z=4)
    z.theta = z.theta + .02 * rng.normal(size=z.theta.shape)
    yield z
    yield Field.tied(grid(), mirror=(1, 0, 1), fold=0)
    yield Field.tied(grid(), axis=2, fold="axial")
    yield Field.scaled(grid(), 1.03)
    yield Field.sum([grid(), Field.profile("rod", [.1, .4, 0, 0, 0])])


def test_kinds():
    """Every kind: gradient and Hessian are differences, the adjoint is the tangent's transpose"""
    seen = []
    for f in kinds():
        seen.append(f.kind)
        x = rng.uniform(-.6, .6, (5, 3))
        eta, g, second = f.eval(x, hessian=True)
        assert np.array_equal(f.eval(x)[0], eta) and eta.shape == (5,) and g.shape == (5, 3)
        h = 1e-5
        for k in range(3):
            e = h * np.eye(3)[k]
            (a, ga), (b, gb) = f.eval(x + e), f.eval(x - e)
            assert np.abs((a - b) / (2 * h) - g[:, k]).max() < 1e-7, f
            column = second[:, [[0, 3, 4], [3, 1, 5], [4, 5, 2]][k]]
            if f.kind != "trilinear":  # whose gradient jumps between cells
                assert np.abs((ga - gb) / (2 * h) - column).max() < 1e-5, f
        dot, a, b = rng.normal(size=f.theta.shape), rng.normal(size=5), rng.normal(size=(5, 3))
        eta_dot, g_dot = f.eval_tangent(x, dot)
        left, right = a @ eta_dot + np.sum(b * g_dot), f.eval_adjoint(x, a, b) @ dot
        assert abs(left - right) < 1e-11 * (abs(left) + 1), (f, left, right)
        theta, h, values = f.theta, 1e-6, []
        for sign in (1, -1):
            f.theta = theta + sign * h * dot
            e, q = f.eval(x)
            values.append(a @ e + np.sum(b * q))
        assert abs((values[0] - values[1]) / (2 * h) - left) < 1e-5 * (abs(left) + 1), f
    return ", ".join(seen)


def test_names():
    """Numbers of profiles have names; grids and rz fields tell their sizes"""
    assert Field.profile("sech", [1.6, .4, 0, 0, 0]).names == ("n0", "g", "x", "y", "z")
    g = grid((2, 3, 4), single=True, gladstone_dale=0)
    assert g.names == () and g.grid_info["cells"] == (2, 3, 4) and g.grid_info["single"] and g.rz_info is None
    assert g.grid_info["interp"] == "spline" and g.grid_info["lo"] == (-1, -1, -1)
    z = Field.rz(1.5, radius=2.0, cells_r=3, cells_z=4)
    assert z.rz_info["cells_r"] == 3 and z.rz_info["radius"] == 2 and z.grid_info is None


def test_samples():
    """A grid passes through its samples, and the transpose of that; refining keeps the function"""
    f = Field.grid((3, 4, 5), [-1, -2, -1], [1, 2, 3])
    samples = 1.5 + .1 * rng.normal(size=(6, 5, 4))
    f.set_samples(samples)
    z, y, x = np.meshgrid(np.linspace(-1, 3, 6), np.linspace(-2, 2, 5), np.linspace(-1, 1, 4), indexing="ij")
    at = np.stack([x, y, z], -1).reshape(-1, 3) * (1 - 1e-12)
    assert np.abs(f.eval(at)[0] - samples.ravel()).max() < 1e-9
    bar, h = rng.normal(size=f.theta.shape), 1e-4
    g = f.samples_adjoint(bar)
    for k in ((0, 0, 0), (2, 3, 1), (5, 4, 3)):
        thetas = []
        for sign in (1, -1):
            s = samples.copy()
            s[k] += sign * h
            f.set_samples(s)
            thetas.append(f.theta)
        assert abs(bar @ (thetas[0] - thetas[1]) / (2 * h) - g[k]) < 1e-9, k
    f.set_samples(samples)
    fine, inside = f.refined(), rng.uniform([-.9, -1.9, -.9], [.9, 1.9, 2.9], (20, 3))
    assert np.abs(fine.eval(inside)[0] - f.eval(inside)[0]).max() < 1e-12 and fine.grid_info["cells"] == (6, 8, 10)
    w = rng.normal(size=20)
    assert np.allclose(f.refined_adjoint(fine.eval_adjoint(inside, w, np.zeros((20, 3)))),
                       f.eval_adjoint(inside, w, np.zeros((20, 3))), atol=1e-12)
    for bad in (lambda: f.set_samples(samples[1:]), lambda: Field.profile("rod", [1.6, .4, 0, 0, 0]).set_samples(samples),
                lambda: f.set_samples(samples * np.nan), lambda: Field.profile("rod", [1.6, .4, 0, 0, 0]).refined()):
        raises(im.ArgumentError, bad)


def test_taken_over():
    """Fields that others took over, or that are there twice: exceptions"""
    a, b = grid(), grid()
    s = Field.sum([a, b])
    assert len(s.theta) == 2 * 343
    raises(im.ArgumentError, lambda: a.theta, "closed")
    raises(im.ArgumentError, lambda: Field.scaled(a, 2), "closed")
    c = grid()
    raises(im.ArgumentError, lambda: Field.sum([c, c]), "twice")
    raises(im.ArgumentError, lambda: Field.sum([]))
    raises(TypeError, lambda: Field.scaled(3, 2))
    assert c.theta.size == 343
    bend = im.bend.Bend(c)
    raises(im.ArgumentError, lambda: Field.scaled(bend.field, 2), "problem")
    raises(im.ArgumentError, lambda: Field.tied(Field.profile("rod", [1.6, .4, 0, 0, 0])))
    raises(TypeError, lambda: Field.rz(1.5, cells=3), "cells_r")


def rays(n=12):
    x = np.column_stack([rng.uniform(-.3, .3, (n, 2)), np.full(n, -.9)])
    return x, np.column_stack([rng.normal(0, .05, (n, 2)), np.ones(n)])


def test_taps():
    """Taps: straight rays in closed form; their adjoint is the tangent's transpose; groups"""
    o, d = rays()
    taps = [{"normal": [0, 0, 1], "offset": -.2}, {"normal": [0, 0, 1], "offset": .4, "group": 1}]
    f = Field.profile("constant", [1.5, 0, 0, 0])
    surfaces, groups = [{"type": "plane", "offset": .8}], np.arange(12) % 2
    e = im.bend.trace(f, o, d, taps=taps, surfaces=surfaces, groups=groups, step=.1)
    t = (-.2 - o[:, 2]) / d[:, 2]
    assert e.taps.shape == (12, 2) and np.abs(e.taps["x"][:, 0] - (o + t[:, None] * d)).max() < 1e-12
    missed = (e.taps["flags"][:, 1] & 128) != 0  # rays of group 0 do not see the second
    assert np.array_equal(missed, groups == 0)
    f, (o, d) = grid(), rays()
    taps, kw = taps[:1], dict(surfaces=surfaces, step=.05)
    e = im.bend.trace(f, o, d, taps=taps, **kw)
    bars = {"x": rng.normal(size=(12, 1, 3)), "v": rng.normal(size=(12, 1, 3)), "path": rng.normal(size=(12, 1))}
    xb, td, od = rng.normal(size=(12, 3)), rng.normal(size=f.theta.shape), rng.normal(size=(12, 3))
    g = im.bend.adjoint(f, o, d, e, xb, tap_bars=bars, taps=taps, **kw)
    x, v, path, dots = im.bend.tangent(f, o, d, td, od, taps=taps, **kw)
    left = np.sum(x * xb) + sum(np.sum(dots[k] * bars[k]) for k in bars)
    right = g.theta @ td + np.sum(g.origins * od)
    assert e.ok.all() and abs(left - right) < 1e-10 * (abs(left) + 1), (left, right)
    # A plane moved by h along its normal: the exits' x moves, and the surface's derivative says how.
    h, q = 1e-6, []
    for sign in (1, -1):
        there = im.bend.trace(f, o, d, surfaces=[{"type": "plane", "offset": .8 + sign * h}], step=.05)
        q.append(np.sum(there.x * xb))
    only = im.bend.adjoint(f, o, d, im.bend.trace(f, o, d, **kw), xb, **kw)
    assert only.surfaces.shape == (1, 8) and abs((q[0] - q[1]) / (2 * h) - only.surfaces[0, 3]) < 1e-5
    raises(im.ArgumentError, lambda: im.bend.adjoint(f, o, d, e, xb, **kw), "taps")
    raises(TypeError, lambda: im.bend.adjoint(f, o, d, e, xb, tap_bars={"y": 1}, taps=taps, **kw), "'y'")
    raises(im.ArgumentError, lambda: im.bend.trace(f, o, d, groups=np.full(12, .5)), "groups")
    raises(im.ArgumentError, lambda: im.bend.trace(f, o, d, taps=[{}] * 17, step=.1))
    raises(TypeError, lambda: im.bend.trace(f, o, d, n_surfaces=3), "n_surfaces")


def problem(field=None):
    bend = im.bend.Bend(field or grid())
    o, d = rays()
    bend.add_rays(o, d)
    bend.set_options(step=.05, taps=[{"normal": [0, 0, 1], "offset": 0.0}])
    bend.add_target("focus", point=[0, 0, 1], at_plane=1, normal=[0, 0, 1], offset=1.0, outside=1.0)
    return bend, o, d


def test_problem():
    """Paths, taps, arrivals, options and the error of the step of a problem"""
    bend, o, d = problem()
    e = bend.run()
    assert e.taps.shape == (12, 1) and np.abs(e.taps["x"][:, 0, 2]).max() < 1e-12 and bend.n_bundles == 1
    p = bend.ray(3)
    assert np.allclose(p[0, :3], o[3]) and np.allclose(p[-1, :3], e.x[3], atol=1e-9)
    q = im.bend.path(bend.field, o, d, 3, step=.05)
    assert np.array_equal(p, q)
    a = bend.arrivals(0)
    assert np.abs(a.x[:, 2] - 1).max() < 1e-9 and np.allclose(np.linalg.norm(a.d, axis=1), 1) and list(a.ray) == list(range(12))
    focus = .5 * np.sum(a.weight * np.sum((a.x - [0, 0, 1])**2, 1)) / a.weight.sum()
    value, g, parts = bend.objective(parts=True)
    assert np.isclose(value, focus, rtol=1e-9) and np.isclose(parts.sum(), value)
    assert bend.options["step"] == .05 and bend.options["scheme"] == "leapfrog" and bend.options["n_taps"] == 1
    error, order = bend.step_error()
    assert 0 < error < 1e-2 and 1.5 < order < 2.6, (error, order)
    raises(im.ArgumentError, lambda: bend.arrivals(1))
    raises(im.ArgumentError, lambda: bend.ray(12))
    raises(im.ArgumentError, lambda: im.bend.path(bend.field, o, d, 12))
    raises(im.ArgumentError, lambda: bend.set_step(-1))


def test_wavelengths():
    """A bundle's wavelength: Cauchy and Sellmeier in closed form, and rays that see it"""
    cauchy = {"model": "cauchy", "coefficient": [1.5, .01, 1e-4, 0, 0, 0]}
    assert np.isclose(im.bend.dispersion_index(cauchy, .5), 1.5 + .01 / .25 + 1e-4 / .0625, rtol=1e-14)
    c = [1.03961212, .231792344, 1.01046945, .00600069867, .0200179144, 103.560653]  # BK7 (Schott)
    sellmeier = {"model": "sellmeier", "coefficient": c, "reference": .5875618}
    assert abs(im.bend.dispersion_index(sellmeier, .5875618) - 1.5168) < 2e-5
    bend, o, d = problem(Field.profile("constant", [1.5, 0, 0, 0]))
    bend.set_options(step=.05, surfaces=[{"type": "plane", "offset": .8}])
    assert bend.wavelength(0) == 0
    bend.set_wavelength(0, sellmeier, .4)
    k = (im.bend.dispersion_index(sellmeier, .4) - 1) / (im.bend.dispersion_index(sellmeier, .5875618) - 1)
    length = np.linalg.norm(d, axis=1) * 1.7 / d[:, 2]
    assert bend.wavelength(0) == .4 and np.allclose(bend.run().path, (1 + .5 * k) * length, rtol=1e-12)
    raises(im.ArgumentError, lambda: bend.set_wavelength(3, sellmeier, .4))
    raises(im.ArgumentError, lambda: bend.set_wavelength(0, {**sellmeier, "model": "hartmann"}, .4), "cauchy")
    raises(TypeError, lambda: im.bend.dispersion_index({"coeficient": c}, .5), "coefficient")


def test_held():
    """Held numbers are set, have no derivative, and stay in a fit"""
    bend, o, d = problem(grid(noise=0))
    bend.hold_rim(1, 1.4)
    bend.hold_outside([0, 0, 0], .9)
    bend.hold_number(171, 1.41)
    held = bend.objective()[1] == 0
    before = bend.field.theta
    assert held[171] and before[171] == 1.41 and 0 < np.sum(~held) < 343
    f = bend.fit(iterations=5)
    assert f.value < f.start and np.array_equal(bend.field.theta[held], before[held]) and np.any(bend.field.theta != before)
    raises(im.ArgumentError, lambda: bend.hold_number(10**6))


run(globals())
