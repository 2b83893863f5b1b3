# SPDX-License-Identifier: Apache-2.0
"""What walks carry and draw from: colour modes, wavelengths, weights; self-tests; single walks;
functionals; sums of derivative pictures; skies; single steps of optimisers."""
import json
import os
import re
import subprocess

import importon as im
import numpy as np
from tap import SCENES, raises, run, spread, z

RED, LIGHT = "red.reflectance.value", "light.emitter.radiance.value"
CORNELL = os.path.join(SCENES, "cornell.xml")


def box(res=12, filter="box", **kw):
    d = im.cornell_box(res=res)
    d["sensor"]["film"]["rfilter"] = {"type": filter}
    return im.load_dict(d, **kw)


def same_mean(a, b, what):
    """Means of two pictures within their errors."""
    se = [np.sqrt(np.sum(p.se.astype(float)**2)) / p.size for p in (a, b)]
    return z(np.mean(a, dtype=float), np.mean(b, dtype=float), np.hypot(*se), what=what)


def test_modes():
    """Spectral and single modes: the picture of the three ways to draw wavelengths is one"""
    said = []
    for mode in ("spectral", "single"):
        s = box(mode=mode)
        assert s.mode == mode and s.channels == 3
        pictures = [im.render(s, spp=128, seed=k, wavelengths=w, wavelength_set=n) for k, (w, n) in enumerate(
            (("stratified", 0), ("stratified", 4), ("independent", 0), ("importance", 0)))]
        said += ["%.1f" % same_mean(p, pictures[0], mode) for p in pictures[1:]]
        assert len({p.tobytes() for p in pictures}) == 4
    s = box(mode="single")
    target = im.render(s, spp=64, seed=9)
    e = im.loss(s, target, RED, spp=16, wavelengths="independent")
    assert np.isfinite(e.grad[RED]).all() and im.check(s, RED, spp=64, paths=40, draws_time=0.1, wavelengths="importance")
    assert float(im.loss(s, target, RED, spp=16, wavelengths="importance")) != float(e)
    raises(im.ArgumentError, lambda: im.render(s, wavelengths="stratifed"), "stratified")
    raises(im.ArgumentError, lambda: im.render(s, spp=16, wavelength_set=-1))
    im.set_variant("llvm_ad_spectral")
    try:
        assert im.variant() == "spectral" and box().mode == "spectral"
    finally:
        im.set_variant("scalar_rgb")
    return "z " + " ".join(said)


def test_kept_walks():
    """Recorded walks: the same picture and loss, others within their errors, and refusals"""
    s = im.load_file(CORNELL, res=12)
    params = im.traverse(s)
    walks = im.keep(s, spp=64, seed=3, losses=True, survival=-1)
    assert walks.spp == 64 and walks.seed == 3 and 40 * walks.n_vertices < walks.bytes < 194 * walks.n_vertices + 88 * 12 * 12 * 64 and "MB" in repr(walks)
    # Walks that are recorded for losses are independent.
    assert im.render(s, walks=walks).tobytes() == im.render(s, spp=64, seed=3, points="independent").tobytes()
    target = im.render(s, spp=16, seed=9)
    a, b = (im.loss(s, target, RED, **key) for key in ({"walks": walks}, {"spp": 64, "seed": 3, "points": "independent"}))
    # Recorded walks are sums of products here, which round in another order.
    for x, y in ((a.value, b.value), (a.se, b.se), (a.grad[RED], b.grad[RED])):
        assert np.allclose(x, y, rtol=1e-9, atol=0)
    assert walks.weigh() == (1, 0, None)
    params[RED] = params[RED] * 0.5
    kept, fresh = im.render(s, params, walks=walks), im.render(s, spp=64, seed=4)
    said = same_mean(kept, fresh, "other reflectance")
    f, g = im.functional(s, RED, walks=walks), im.functional(s, RED, spp=64, seed=4)
    z(f.value, g.value, np.hypot(f.se, g.se), what="mean")
    mask = np.zeros((12, 12))
    mask[:6] = 1
    assert walks.weigh(mask=mask)[0] > 0.9
    other = im.load_file(CORNELL, res=12)
    raises(im.ArgumentError, lambda: im.render(other, walks=walks), "another scene")
    raises(TypeError, lambda: im.render(s, walks=3), "importon.keep")
    raises(im.OutOfMemoryError, lambda: im.keep(s, spp=64, memory=1e5), "MB")
    raises(im.ArgumentError, lambda: im.render(s, walks=walks, time_limit=1), "time_limit")
    return "z %.1f" % said


def test_walks():
    """Points in sets, and light walks: other noise, the same picture and loss"""
    s = im.load_file(CORNELL, res=12)
    plain = im.render(s, spp=256, seed=1, points="independent")
    said = []
    for key, value in (("points", "sobol"), ("walks_from", "lights")):
        p = im.render(s, spp=256, seed=2, **{key: value})
        assert not np.array_equal(p, plain)
        said.append("%.1f" % same_mean(p, plain, value))
        raises(im.ArgumentError, lambda: im.render(s, **{key: "lihgts"}), key)
    target = im.render(s, spp=256, seed=9)
    e, f = (im.loss(s, target, RED, spp=64, seed=5, points=p) for p in ("independent", "sobol"))
    assert np.all(f.grad_se[RED] < e.grad_se[RED]) and float(e) != float(f)
    return "z " + " ".join(said)


def test_upsampling():
    """Colours as spectra in two ways: the picture of each is nearly that of rgb; what is not known is skipped if asked"""
    rgb, sigmoid, linear = (im.render(im.load_dict(im.cornell_box(res=12), mode=mode, upsampling=u), spp=256, seed=1)
                            for mode, u in (("rgb", "sigmoid"), ("spectral", "sigmoid"), ("spectral", "linear")))
    assert not np.array_equal(sigmoid, linear)
    for p in (sigmoid, linear):  # light between walls has spectra, not three numbers
        assert abs(p.mean() / rgb.mean() - 1) < .05
    raises(im.ArgumentError, lambda: im.load_file(CORNELL, upsampling="sigmod"), "sigmoid")
    xml = "<scene version='3.0.0'><shape type='sphere'/><shape type='teapot'/></scene>"
    raises(im.UnsupportedError, lambda: im.load_string(xml), "teapot")
    import warnings
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert im.load_string(xml, lenient=True).n_shapes == 1
    assert any("teapot" in str(w.message) for w in said)


def test_weights():
    """Weights of densities, as a mapping and as text: other walks, the same picture; a check of sampling"""
    plain = im.load_file(CORNELL, res=12)
    given = im.load_file(CORNELL, res=12, weights={"kernel": 1, "emitters": .5})
    text = im.load_file(CORNELL, res=12, weights="kernel=1, emitters=0.5")
    a, b, c = (im.render(s, spp=256, seed=1) for s in (plain, given, text))
    assert np.array_equal(b, c) and not np.array_equal(a, b)
    same_mean(a, b, "weights")
    rows = im.check(given, sampling=True, spp=64)
    assert rows and {r.method for r in rows} >= {"uniform", "energy"} and {"kernel", "emitters"} <= {r.param for r in rows}
    raises(im.SceneError, lambda: im.load_file(CORNELL, weights={"kernl": 1}), "kernel")
    raises(im.SceneError, lambda: im.load_file(CORNELL, weights={"kernel": -1}), "-1")
    raises(TypeError, lambda: im.load_file(CORNELL, weights=3), "weights")


def test_selftest():
    """Self-tests of materials, lights, shapes and cameras: rows that hold; the command's numbers"""
    s = im.load_file(CORNELL, res=12)
    for subject, contracts in (("material", {"draws", "albedo", "derivative"}), ("light", {"density", "light"}),
                               ("shape", {"hits", "normal", "box", "area", "angle"}), ("camera", {"unit", "filter"})):
        rows = im.selftest(s, subject, samples=20000, directions=2, seed=5)
        assert rows and {r.contract for r in rows} >= contracts, rows
        assert "<table>" in rows._repr_html_() and "self-test: ok" in rows._repr_html_()
    said = json.loads(subprocess.run(
        [os.path.join(os.environ["IMP_BUILD"], "cli", "importon"), "selftest", "camera", CORNELL, "-D", "res=12", "--samples",
         "20000", "--directions", "2", "--seed", "5", "--json"], capture_output=True, text=True, check=True).stdout)
    assert [r["contract"] for r in said["rows"]] == [r.contract for r in rows]
    assert np.allclose([r["value"] for r in said["rows"]], [r.value for r in rows], rtol=1e-8)
    raises(im.ArgumentError, lambda: im.selftest(s, "lamp"), "material")
    raises(im.ArgumentError, lambda: im.selftest(s, samples=-3))
    raises(TypeError, lambda: im.selftest(s, samples=1e5))
    raises(im.Cancelled, lambda: im.selftest(s, samples=10**9, progress=lambda p: p.stage == "selftest"), "cancelled")


def test_walk():
    """The walks of a pixel add up to the pixel; those that were dropped are found again"""
    s = box(res=6)
    p = im.render(s, spp=8, seed=4)
    # Four sets of two points, which have the numbers 0, 1, 64, 65, ...
    values = [im.walk(s, 2, 3, 64 * (k // 2) + k % 2, seed=4, spp=8, json=True)["radiance"] for k in range(8)]
    assert np.allclose(np.mean(values, axis=0), p[3, 2], rtol=1e-5), (values, p[3, 2])
    assert im.walk(s, 2, 3, 1, seed=4, spp=8).startswith("walk: pixel 2,3 sample 1")
    im.traverse(s)[LIGHT] = 1e39  # more than a float holds
    q = im.render(s, spp=64, drop_budget=1)
    assert q.dropped["infinite"] == sum(q.dropped.values()) and 0 < len(q.dropped_walks) <= 8
    for w in q.dropped_walks:
        assert w.cause == "infinite" and "1e+39" in im.walk(s, w.x, w.y, w.sample, seed=w.seed, spp=64)
    raises(im.ArgumentError, lambda: im.walk(s, 6, 0), "6,0")
    raises(TypeError, lambda: im.walk(s, 1.5, 0), "x")


def test_functional():
    """Functionals and sums over derivative pictures: of the pictures themselves, with errors that repeats show"""
    rng = np.random.default_rng(1)
    said = []
    for filter in ("box", "gaussian"):
        s = box(filter=filter)
        w = rng.random((12, 12, 3)).astype(np.float32)
        run = {"spp": 16, "seed": 3, "points": "independent"}  # values and gradients are of the same walks
        f = im.functional(s, RED, w, **run)
        p, j = im.render(s, **run), im.jacobian(s, RED, **run)
        assert np.isclose(f.value, np.sum(p.astype(float) * w), rtol=1e-6)
        assert np.allclose(f.grad[RED], im.render_backward(s, RED, w, **run)[RED], rtol=1e-9)
        # Through a wide filter a picture divides by the weights that fell on a pixel, a gradient by their mean.
        se, product = f.grad_se[RED], np.einsum("khwc,hwc->k", j[RED].astype(float), w)
        assert np.all(np.abs(f.grad[RED] - product) < (1e-5 if filter == "box" else .5) * se)
        sums = j.sums(w)
        assert np.isclose(sums.value, f.value, rtol=1e-6) and np.allclose(sums.grad[RED], product, rtol=1e-5)
        mean = im.functional(s, [], **run)
        assert np.isclose(mean.value, np.mean(p, dtype=float), rtol=1e-6) and not len(mean.grad)
        many = [im.functional(s, [], w, spp=4, seed=50 + k) for k in range(400)]
        said.append(spread([m.se for m in many], [m.value for m in many]))
        if filter == "gaussian":  # neighbours share samples: errors of pixels added as if they did not are others
            assert abs(sums.se / f.se - 1) < .25
    im.traverse(s)[RED] = .2
    raises(im.ArgumentError, lambda: j.sums(), "changed")
    raises(im.ArgumentError, lambda: im.functional(s, RED, w[:3]), "adjoint")
    e = im.loss(s, p, RED, spp=3)
    assert len(e.spp) == 1 and e.spp[0] >= 3
    return "; ".join(said)


def test_reduce():
    """Smaller pictures: means, errors and what is clipped; sizes that do not go into each other are refused"""
    big = np.random.default_rng(3).random((6, 8, 3)).astype(np.float32)
    small = im.reduce(big, 4, 2)
    assert np.allclose(small, big.reshape(2, 3, 4, 2, 3).mean((1, 3)), rtol=1e-6)
    big[:3, :2], big[3, 2] = 2, 2
    small = im.reduce(big, 4, 2, white=2)
    assert (small[0, 0] == 2).all() and np.isnan(small[1, 1]).all() and np.isnan(small).sum() == 3
    im.write("big.exr", big)
    assert np.array_equal(im.reduce("big.exr", 4, 2, 2), small, equal_nan=True)
    drawn = im.render(im.load_dict(im.cornell_box(res=8)), spp=16)
    reduced = im.reduce(drawn, 4, 4)
    assert np.allclose(reduced.se, np.sqrt((drawn.se.reshape(4, 2, 4, 2, 3) ** 2).sum((1, 3))) / 4, rtol=1e-5)
    box = im.load_dict(im.cornell_box(res=4))  # files with four pixels for each of its film's are targets, too
    big = .9 * np.random.default_rng(4).random((8, 8, 3)).astype(np.float32)
    im.write("target.exr", big)
    of_file, of_array = (im.loss(box, t, "red.*", spp=2) for t in ("target.exr", im.reduce(big, 4, 4)))
    assert of_file.value == of_array.value
    big[0, 0] = 3
    im.write("white.png", big)  # one of the first pixel's four is clipped: it has no weight
    weights = np.ones((4, 4))
    weights[0, 0] = 0
    small = im.reduce("white.png", 4, 4)
    of_file, of_array = im.loss(box, "white.png", "red.*", spp=2), im.loss(box, small, "red.*", spp=2, weights=weights)
    assert np.isclose(of_file.value, of_array.value, rtol=1e-6) and of_file.value != im.loss(box, small, "red.*", spp=2).value
    raises(im.ArgumentError, lambda: im.reduce(big, 3, 2), "whole")
    raises(im.ArgumentError, lambda: im.reduce(big, 0, 2))
    raises(im.ArgumentError, lambda: im.reduce(big, 4, 2, float("nan")), "nan")


def test_sky():
    """Skies: projections and sizes keep the light; files and arrays"""
    sky = np.random.default_rng(2).random((16, 32, 3)).astype(np.float32)
    light = lambda p: np.array([np.mean(p[..., c], dtype=float) for c in range(3)])  # of equal areas
    equal = im.project(sky)
    assert equal.shape == sky.shape and im.project(sky, height=8, width=24).shape == (8, 24, 3)
    small, back = im.project(equal, "equal_area", "equal_area", width=16, height=8), im.project(equal, "equal_area", "latlong")
    assert np.allclose(light(small), light(equal), rtol=2e-2) and np.allclose(light(im.project(back)), light(equal), rtol=2e-2)
    im.write("sky.exr", sky)
    assert np.array_equal(im.project("sky.exr"), equal)
    assert np.allclose(im.project(np.full((4, 8, 3), .5)), .5, rtol=1e-6)
    raises(im.ArgumentError, lambda: im.project(sky, "latlon"), "latlong")
    raises(im.ArgumentError, lambda: im.project(sky[:1]))
    raises(im.ArgumentError, lambda: im.project(sky, width=-3))


def test_attributes():
    """Texts in files"""
    p = im.render(box(), spp=2)
    p.write("a.exr", attributes={"made by": "a test", "comment": "red"})
    q = im.read("a.exr")
    assert q.attribute("made by") == "a test" and q.attribute("comment") == "red" and q.attribute("none") is None
    assert q[..., 0].attribute("comment") is None
    raises(im.ArgumentError, lambda: p.write("a.exr", attributes={"a\0b": "x"}), "zero byte")
    raises(TypeError, lambda: p.write("a.exr", attributes={"a": 3}))


def test_report():
    """A page with pictures and data; bad items are named"""
    p = im.render(box(), spp=2)
    dot = im.render_forward(box(), RED, {RED: 1}, spp=2)
    im.report("r.html", [p, {"picture": np.zeros((2, 3, 3)), "role": "target", "name": "<b>", "unit": "lx"}, dot,
                         {"json": {"a": [1, 2]}, "kind": "own"}, {"json": "[3]", "kind": "own"}, {"image": p._repr_png_()}],
              title="T & U", command="python x.py")
    page = open("r.html").read()
    data = json.loads(re.search(r'<script[^>]*id="data"[^>]*>(.*?)</script>', page, re.S)[1])
    assert (data["title"], data["command"]) == ("T & U", "python x.py") and "<b>" not in page
    assert [i["kind"] for i in data["items"]] == ["picture", "picture", "derivative", "own", "own", "image"]
    assert data["items"][1]["name"] == "<b>" and data["items"][1]["role"] == "target" and data["items"][3]["data"] == {"a": [1, 2]}
    raises(TypeError, lambda: im.report("r.html", [{"pictur": p}]), "pictur")
    for bad in ({}, {"picture": p, "json": 1}, {"json": "{"}, {"picture": np.zeros(3)}, {"image": b"x", "json": 1}):
        raises(im.ArgumentError, lambda: im.report("r.html", [bad]))
    raises(im.FileError, lambda: im.report("no/where.html", [p]))
    assert open("r.html").read() == page


def test_optimisers():
    """importon.ad: closed forms; what is refused changes nothing"""
    opt = im.ad.Adam(lr=.01, params={"a": [1.0, 2.0], "b": 3.0})
    for _ in range(50):  # of a constant gradient: steps of lr each
        opt.step({"a": [2.0, -.5], "b": 1e-3})
    assert np.allclose(opt["a"], [.5, 2.5], atol=1e-6) and abs(opt["b"] - 2.5) < 1e-4
    sgd, x, v = im.ad.SGD(lr=.1, momentum=.6, params={"x": 0.0}), 0.0, 0.0
    for g in (1.0, -2.0, .5):
        sgd.step({"x": g})
        v = .6 * v + g
        x -= .1 * v
    assert abs(sgd["x"] - x) < 1e-15
    handed = opt["a"]
    before = handed.copy()
    raises(im.ArgumentError, lambda: opt.step({"a": [1.0, 1.0], "b": np.nan}), "gradient")
    raises(im.ArgumentError, lambda: opt.step({"a": [1.0], "b": 1.0}), "shape")
    raises(KeyError, lambda: opt.step({"a": [1.0, 1.0]}))
    assert np.array_equal(opt["a"], before)
    opt.step({"a": [1.0, 1.0], "b": 1.0})
    assert np.array_equal(handed, before) and not np.array_equal(opt["a"], before) and opt.lr == .01
    for bad in (dict(lr=0), dict(lr=np.inf), dict(lr=.1, beta_1=1), dict(lr=.1, beta_2=-1), dict(lr=.1, epsilon=0)):
        raises(im.ArgumentError, lambda: im.ad.Adam(**bad))
    raises(im.ArgumentError, lambda: im.ad.SGD(lr=.1, momentum=1))
    raises(TypeError, lambda: im.ad.Adam(.1, learning_rate=3))
    opt["a"] = [1.0, 2.0, 3.0]  # another quantity begins anew
    opt.step({"a": [1.0, 1.0, 1.0], "b": 1.0})
    assert np.allclose(opt["a"], [.99, 1.99, 2.99]) and list(opt) == ["a", "b"] and len(opt) == 2
    del opt["b"]
    assert dict(opt).keys() == {"a"}


run(globals())
