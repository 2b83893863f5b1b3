# SPDX-License-Identifier: Apache-2.0
"""Fits: answers, intervals, covariances, checkpoints, what is said of bad ones."""
import os

import importon as im
import numpy as np
from tap import SCENES, raises, run, z

RED = "red.reflectance.value"
GREEN = "green.reflectance.value"
LIGHT = "light.emitter.radiance.value"


def box(res=16, **kw):
    return im.load_dict(im.cornell_box(res=res, **kw))


def setting(noise_spp=256, res=16):
    s = box(res)
    target = im.render(s, spp=noise_spp, seed=1, points="independent")
    p = im.traverse(s)
    truth = p[RED]
    p.keep("red.*")
    p[RED] = .4, .3, .2
    return s, target, p, truth


def test_walks_in_files():
    """Recorded walks come back from a file, and answer without their scene, to the bit"""
    s = box(8)
    im.keep(s, spp=8, seed=3, losses=True).write("box.walks")
    kept, walks = im.keep(s, spp=8, seed=3, losses=True), im.read_walks("box.walks")
    p, q = im.traverse(s), im.traverse(walks.scene)
    assert list(p) == list(q) and walks.seed == 3 and walks.spp == 8
    p[RED] = q[RED] = .3, .2, .1
    assert np.array_equal(im.render(s, p, walks=kept), im.render(walks.scene, q, walks=walks))
    again = im.read_walks("box.walks", s)
    assert again.scene is s and np.array_equal(im.render(s, p, walks=again), im.render(s, p, walks=kept))
    raises(im.UnsupportedError, lambda: im.render(walks.scene), "no geometry")
    raises(im.ArgumentError, lambda: im.read_walks("box.walks", box(9)), "walks of another scene")
    scene = walks.scene
    del walks
    assert len(im.traverse(scene)) == len(p)  # lives as long as somebody has it
    open("bad.walks", "wb").write(open("box.walks", "rb").read()[:-100])
    raises(im.FileError, lambda: im.read_walks("bad.walks"), "ends early")


def photographed():
    """A box whose film has an exposure and a gamma, and a picture of 8 bits as such a camera makes it"""
    d = im.cornell_box(res=12)
    d["sensor"]["film"].update({"exposure": .5, "gamma": 1., "rfilter": {"type": "box"}})
    s = im.load_dict(d)
    linear = np.asarray(im.render(s, spp=512, seed=7))
    encoded = np.where(linear <= .0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - .055)
    values = np.clip(np.round(255 * encoded), 0, 255).astype(np.uint8)
    with open("photo.ppm", "wb") as f:
        f.write(b"P6 12 12 255\n" + values.tobytes())
    return s, values / 255


def test_photographs():
    """Files of 8 bits keep their numbers where the film has a gamma, and white is at least"""
    s, values = photographed()
    p = im.traverse(s)
    name = [n for n in p if n.endswith("exposure.value")][0]
    p.keep(name)
    by_file = im.loss(s, "photo.ppm", p, spp=8, seed=2)
    by_array = im.loss(s, values, p, spp=8, seed=2)
    assert abs(float(by_file) / float(by_array) - 1) < 1e-5
    told = im.loss(s, "photo.ppm", p, spp=8, seed=2, clip="auto")
    again = im.loss(s, values, p, spp=8, seed=2, clip=(.5 / 255, 254.5 / 255))
    assert abs(float(told) / float(again) - 1) < 1e-4 and float(told) < float(by_file)
    one = im.loss(s, values, p, spp=8, seed=2, clip=(None, 254.5 / 255))
    assert float(one) != float(again) or (values > 0).all()
    raises(im.ArgumentError, lambda: im.loss(s, values, p, clip="auto"), "auto")
    raises(im.ArgumentError, lambda: im.loss(s, values, p, clip=(1, 0)), "less than")
    f = im.fit(s, values, [name, "light.*"], log="light.*", optimizer="lm", spp=16, max_iterations=2, clip=(0, .99))
    assert f.clipped["clipped"] > 0 and f.clipped["numbers"] == 432, f.clipped


def test_missing():
    """Which number is wrong, with the priors, ties and masks of the fit"""
    s = box(8)
    target, p = im.render(s, spp=256, seed=1), im.traverse(s)
    p["light.emitter.radiance.value"] = 20, 9, 2

    def first(**kw):
        return {r.name + str(r.element): r for r in im.missing(s, "white.*", target, spp=64, seed=3, **kw)}

    name = LIGHT + "2"
    free, held = first(), first(tikhonov={"white.*": 1e9})
    assert name in free and name in held
    # Walls that cannot follow explain nothing of it: its score has all of its variance.
    assert held[name].chi2 > free[name].chi2 and held[name].step_se < free[name].step_se
    half = np.ones((8, 8))
    half[:4] = 0
    assert first(weights=half)[name].step_se > free[name].step_se
    assert name in first(factor="white.*,red.*") or first(factor="white.*,red.*")
    raises(im.ArgumentError, lambda: first(weights=np.zeros((8, 8))), "weights")


def test_plan():
    """Gains are the determinants and traces of NumPy, of the informations handed out; maps add up to these"""
    s = box(8)
    views = [0, {"origin": (.6, .3, 2.5), "target": (0, 0, 0), "name": "aside"}, {"time": 4, "name": "long"}]
    names, call = ["red.*", "green.*"], dict(noise={"read": .05}, spp=256, seed=4)
    p = im.plan(s, names, views, have=[0], take=2, **call)
    red = [p.names.index(RED + "[%d]" % k) for k in range(3)]
    assert len(p.rows) == 3 and len(p.chosen) == 2 and np.isfinite(p.half95_today).all()
    taken = im.plan(s, names, [0], seed=1, **{k: call[k] for k in ("noise", "spp")})
    alone = im.plan(s, names, views, criterion="A", of=RED, **call)
    for criterion, q in (("d", im.plan(s, names, views, **call)), ("a", alone)):
        for r in q.rows:
            prior = np.diag(q.prior ** -2)
            C = np.linalg.inv(prior + r.information)
            gain = (np.linalg.slogdet(prior + r.information)[1] - np.linalg.slogdet(prior)[1]) / 6 if criterion == "d" \
                else np.log(3 / np.trace(C[np.ix_(red, red)] / q.prior[0] ** 2))
            assert abs(r.gain / gain - 1) < 1e-9, (criterion, r.gain, gain)
            assert np.allclose(r.half95, 1.959963984540054 * np.sqrt(np.diag(C)))
            assert np.allclose(r.information, r.information.T) and (r.information_se >= 0).all()
    row = taken.rows[0]
    maps = im.plan_map(s, names, 0, row.pull, noise=call["noise"], spp=256, seed=9)
    for k, m in enumerate(maps[:-1]):
        assert abs(np.asarray(m).sum() / row.information[k, k] - 1) < .2, (k, np.asarray(m).sum(), row.information[k, k])
    assert im.lamps(s) == ["light.emitter"] and im.plan(s, LIGHT, [{"lamps": im.lamps(s)}], spp=16).rows[0].lit == 1
    half = im.plan(s, names, views, prior={RED: 1e-6}, **call)
    assert np.allclose(half.half95_today[red], 1.959963984540054e-6)
    raises(im.ArgumentError, lambda: im.plan(s, names, [], **call), "candidates")
    raises(im.ArgumentError, lambda: im.plan(s, names, [{"place": 1}]), "place")
    raises(im.ArgumentError, lambda: im.plan(s, names, of="nothing"), "nothing")
    raises(im.ArgumentError, lambda: im.plan(s, names, noise={"dark": 1}), "dark")
    raises(im.ArgumentError, lambda: im.plan(s, names, [{"lamps": "none"}]), "none")


def test_design():
    """Levels of a design are those of arithmetic; the room with its luminaires and levels has what was said"""
    path = os.path.join(SCENES, "office.xml")
    lamps = {"lamp_*": ["lamps/opal.ldt", "lamps/batwing.ies"]}
    s = im.load_file(path, mode="mono", luminaires=lamps, spp=32)
    rows = [{"lamp": x.name, "place": x.name.split(":")[0], "watts": 25 if "batwing" in x.name else 32}
            for x in im.luminaires(s)]
    assert len(rows) == 12
    d = im.design(s, {"work": {"average": 450}, "eyes": {"ugr": 22}}, rows, others=1, within=.5)
    assert d.found and d.holds and d.bound == d.objective == d.watts and "lx" not in repr(d)
    assert [(w.sensor, w.of, w.wanted) for w in d.wants] == [("work", "average", 450), ("eyes", "ugr", 22)]
    assert abs(sum(d.levels[r["lamp"]] * r["watts"] for r in rows) - d.watts) < 1e-9
    used = {name.split(":")[0]: (name.split(":")[1], x) for name, x in d.levels.items() if x > 0}
    assert len(used) == sum(x > 0 for x in d.levels.values()) and len(d.others) == 1 and d.others[0][0] >= d.watts
    files = {"opal": "lamps/opal.ldt", "batwing": "lamps/batwing.ies"}
    room = im.load_file(path, mode="mono", luminaires={k: files[f] for k, (f, _) in used.items()}, spp=256)
    p = im.traverse(room)
    for x in im.luminaires(room):
        p[x.name + ".scale.value"] = used.get(x.name, (None, 0))[1]
    g = im.grid(room, "work", params=p)
    assert g.raster == (8, 5) and g.cells.shape == (5, 8, 2) and g.cells[4, 7].tolist() == [7, 4]
    assert g.average.hi > 450 and abs(g.average.value - d.wants[0].value) < 15, (g.average, d)
    xml = '''<scene version="3.0.0"><integrator type="path"/><emitter type="point" id="lamp">
<point name="position" x="1" y=".5" z="2"/><rgb name="intensity" value="400"/></emitter>
<shape type="rectangle"><sensor type="irradiancemeter" id="desk"><string name="at" value="points"/></sensor></shape></scene>'''
    row = [{"lamp": "lamp", "watts": 10, "least": .01}]
    still = im.design(im.load_string(xml), {"desk": {"minimum": 20}}, row)
    hall = im.load_string(xml)
    put = im.design(hall, {"desk": {"minimum": 20}}, row, moves={"lamp.position": [(-2, 2), (-2, 2), None]})
    to = [b for _, b in put.moves["lamp.position"]]
    assert put.watts < .8 * still.watts and max(map(abs, to)) < .02 and not still.moves and put.steps > 0, (put, to)
    raises(im.ArgumentError, lambda: im.design(hall, {"desk": {"minimum": 20}}, row, moves={"lamp.position": [1]}), "pairs")
    none = im.design(s, {"work": {"average": 2000}}, rows)
    assert not none.found and none.wants[0].alone < 1000 and "no combination" in repr(none)
    raises(im.ArgumentError, lambda: im.design(s, {"work": {"brightness": 1}}), "brightness")
    raises(im.ArgumentError, lambda: im.design(s, {"work": {"average": 1}}, [{"lamp": "x"}]), "'x'")
    raises(im.ArgumentError, lambda: im.design(s, {"work": {"average": 1}}, [{"lamb": "x"}]), "lamb")
    raises(im.ArgumentError, lambda: im.design(s, [1]), "wants")


def test_answer():
    """The truth comes back within its errors; covariance and intervals belong together"""
    s, target, p, truth = setting()
    f = im.fit(s, target, p, optimizer="lm", spp=256, seed=3)
    v = f["red.reflectance"]
    worst = z(v.value, truth, v.se, most_se=.1)
    assert np.allclose(p[RED], v.value) and np.allclose(v.start, [.4, .3, .2])
    assert f.covariance.shape == (3, 3) and np.allclose(f.covariance, f.covariance.T)
    free = (v.at_bound == 0) & (v.interval[0] > 0)
    assert free.any() and np.allclose(np.sqrt(np.diag(f.covariance))[free], v.se[free])
    lo, hi = v.interval
    assert np.allclose((hi - lo)[free], 2 * 1.959964 * v.se[free], rtol=1e-5)
    assert f.names == [RED + "[%d]" % k for k in range(3)] and len(f.history) == f.iterations or f.iterations
    z(f.chi2, 1, f.chi2_se, most_se=3, what="chi-square")
    assert f.reason and RED in repr(f) and "<table>" in f._repr_html_() and "<svg" in f._repr_html_()
    return "z %.2f" % worst


def test_report():
    """A page of a fit has its numbers, its target and what was recovered"""
    import json
    import re
    s, target, p, _ = setting()
    f = im.fit(s, target, p, optimizer="lm", spp=64, seed=3)
    f.report("fit.html", title="A <fit>", spp=64)
    data = json.loads(re.search(r'id="data">(.*?)</script>', open("fit.html", encoding="utf-8").read(), re.S)[1])
    items = {(i["kind"], i.get("role")): i for i in data["items"]}
    fit = items["fit", None]["data"]
    assert data["title"] == "A <fit>" and {("picture", "target"), ("picture", "picture"), ("explained", None)} <= set(items)
    assert items["explained", None]["data"]["explained"] is True
    v = f[RED]
    for k, row in enumerate(fit["params"]):
        assert row["name"] == RED + "[%d]" % k and row["value"] == v.value[k] and row["se"] == v.se[k]
        assert row["lo95"] == v.interval[0][k] and row["start"] == v.start[k] and (row["min"], row["max"]) == (0, 1)
    assert fit["value"] == f.loss and fit["chi2_per_freedom"] == f.chi2 and fit["history"]["x"] == f.history_x.tolist()
    assert np.array_equal(np.array(fit["covariance"]), f.covariance) and len(fit["history"]["loss"]) == len(f.history)
    scene = im.load_file(os.path.join(SCENES, "textured.xml"), width=8, height=8)
    name = next(n for n in im.traverse(scene) if n.endswith(".data") and np.size(im.traverse(scene)[n]) > 12)
    shot = im.render(scene, spp=4)
    g = im.fit(scene, shot, name, spp=2, max_iterations=2, intervals=False)
    g.report("field.html", spp=2)
    data = json.loads(re.search(r'id="data">(.*?)</script>', open("field.html", encoding="utf-8").read(), re.S)[1])
    row, = [i["data"]["params"][0] for i in data["items"] if i["kind"] == "fit"]
    assert row["count"] == np.size(g[name].value) and row["n_intervals"] == 0
    scene = im.load_dict({"type": "scene", "integrator": {"type": "direct"}, "sky": {"type": "constant"}, "sensor": {
        "type": "orthographic", "to_world": im.Transform4f().look_at([0, 0, 1], [0, 0, 0], [0, 1, 0]), "film": {
            "type": "hdrfilm", "width": 8, "height": 8, "filter": {"type": "box"}}}, "wall": {"type": "rectangle", "bsdf": {
                "type": "diffuse", "reflectance": {"type": "bitmap", "data": np.full((4, 4, 3), .5, np.float32), "raw": True}}}})
    name, = [n for n in im.traverse(scene) if n.endswith(".data")]
    g = im.fit(scene, im.render(scene, spp=64, seed=1), name, optimizer="lm", spp=16, max_iterations=2)
    g.report("field.html", spp=2)
    data = json.loads(re.search(r'id="data">(.*?)</script>', open("field.html", encoding="utf-8").read(), re.S)[1])
    row, = [i["data"]["params"][0] for i in data["items"] if i["kind"] == "fit"]
    known = int(np.count_nonzero(np.isfinite(g[name].interval[1] - g[name].interval[0])))
    assert row["n_intervals"] == known > 0, (row, known)
    assert name + ".interval" in [i.get("name") for i in data["items"]]
    raises(im.FileError, lambda: f.report("/nowhere/fit.html", spp=1))


def test_is_the_command():
    """The same bits as `importon fit`"""
    import json
    import subprocess
    path = os.path.join(SCENES, "cornell.xml")
    s = im.load_file(path, res=16)
    im.render(s, spp=64, seed=1).write("target.exr")
    im.traverse(s)[RED] = .5
    f = im.fit(s, "target.exr", RED, optimizer="lm", spp=16, seed=2)
    said = subprocess.run(
        [os.path.join(os.environ["IMP_BUILD"], "cli", "importon"), "fit", path, "-D", "res=16", "--set", RED + "=0.5,0.5,0.5",
         "-p", RED, "--target", "target.exr", "--optimizer", "lm", "--spp", "16", "--seed", "2", "--json"],
        capture_output=True, text=True, check=True).stdout
    for value in [*f[RED].value, *f[RED].se]:
        assert any(abs(float(x) - value) <= 1e-8 * abs(value) for x in
                   json.dumps(json.loads(said)).replace(",", " ").replace("]", " ").replace("}", " ").replace("[", " ").split()
                   if x[0].isdigit()), (value, said)


def test_optimizers():
    """Each optimiser finds it"""
    for name in ("adam", "lm", "lbfgs", "mma", "slsqp"):
        s, target, p, truth = setting(res=8)
        f = im.fit(s, target, p, optimizer=name, spp=32, seed=5, max_iterations=60)
        z(f[RED].value, truth, f[RED].se, what=name)


def test_control_variate():
    """Control variates of Adam: other answers than without, and a reason where there are none"""
    s, target, p, truth = setting(noise_spp=64, res=8)
    fits = []
    for which in ("on", "off"):
        p[RED] = .4, .3, .2
        fits.append(im.fit(s, target, p, spp=4, max_iterations=20, control_variate=which, intervals=False))
    on, off = fits
    assert "1/" in on.control_variate and off.control_variate == ""
    assert not np.array_equal(on[RED].value, off[RED].value) and on.history[0] == off.history[0]
    raises(im.UnsupportedError, lambda: im.fit(s, target, p, spp=4, loss="log", control_variate="on"), "not quadratic")
    raises(im.ArgumentError, lambda: im.fit(s, target, p, control_variate="perhaps"), "auto, on, off")


def test_cancel_and_resume():
    """A cancelled fit has its state; a checkpoint continues to the same bits"""
    s, target, p, truth = setting()
    whole = im.fit(s, target, p, spp=16, max_iterations=12, tolerance=1e-12)
    s, target, p, truth = setting()
    seen = []
    e = raises(im.Cancelled, lambda: im.fit(s, target, p, spp=16, max_iterations=10**6, tolerance=1e-14,
                                            progress=lambda q: seen.append(q) or len(seen) > 2))
    assert e.result["red.reflectance"].value.shape == (3,) and seen[0].stage == "fit" and "loss" in seen[-1].note
    assert np.allclose(p[RED], e.result[RED].value)
    s, target, p, truth = setting()
    im.fit(s, target, p, spp=16, max_iterations=6, tolerance=1e-12, checkpoint="c", intervals=False)
    s, target, p, truth = setting()
    again = im.fit(s, target, p, spp=16, max_iterations=12, tolerance=1e-12, checkpoint="c", resume=True)
    assert np.array_equal(again[RED].value, whole[RED].value)


def test_ties():
    """Equal numbers, a common factor and logarithms, back from a picture"""
    s = box(12)
    p = im.traverse(s)
    p[GREEN] = p[RED] = .5, .2, .3
    before = p[LIGHT]
    target = im.render(s, spp=1024, seed=1)
    p[GREEN] = .3  # the first of the scene: red follows
    p[LIGHT] = .7 * before
    f = im.fit(s, target, ["red.*", "green.*", "light.*"], optimizer="lm", spp=64, seed=2, same="red.*,green.*",
               factor=["light.*"], log=["light.*"])
    names = {GREEN + "[%d]" % k for k in range(3)} | {"factor(light.*)"}
    assert set(f.names) == names, f.names
    one = f["factor(light.*)"]
    worst = max(z(one.value, 1 / .7, one.se, most_se=.2), z(f[GREEN].value, (.5, .2, .3), f[GREEN].se, most_se=.2))
    assert np.allclose(p[RED], f[GREEN].value) and np.allclose(p[LIGHT], .7 * before * one.value)
    lo, hi = one.interval
    assert np.isclose(lo * hi, one.value ** 2)
    raises(im.ArgumentError, lambda: im.fit(s, target, ["red.*"], same="red.*"), "alone")
    p[RED] = .5, .25, .3
    f = im.fit(s, target, ["red.*"], optimizer="lm", spp=4, hold=[RED + "[1]"])
    assert f[RED].value[1] == .25 and f[RED].se[1] == 0 and f[RED].se[0] > 0
    raises(im.ArgumentError, lambda: im.fit(s, target, ["red.*"], hold=RED + "[9]"), "no number 9")
    return "z %.2f" % worst


def test_momentum():
    """Momentum of Adam: 0 is 0.9, and another takes another way"""
    s, target, p, truth = setting(res=8)
    fits = []
    for momentum in (0, .9, .5):
        p[RED] = .4, .3, .2
        fits.append(im.fit(s, target, p, spp=4, max_iterations=10, momentum=momentum, intervals=False)[RED].value)
    assert np.array_equal(fits[0], fits[1]) and not np.array_equal(fits[0], fits[2])


def test_intervals_off():
    """Without intervals there are no errors and no covariance"""
    s, target, p, truth = setting()
    f = im.fit(s, target, p, optimizer="lm", spp=8, intervals=False)
    assert f.covariance is None and np.isnan(f[RED].se).all()


def test_bad_fits():
    """Bad arguments are named; the scene is as it was"""
    s, target, p, truth = setting()
    for words, kw in ((("optimizer", "adam"), dict(optimizer="sgd")), (("max_iterations",), dict(max_iterations=-1)),
                      (("learning_rate",), dict(learning_rate=float("nan"))), (("momentum",), dict(momentum=1)), (("loss",), dict(loss="l0")),
                      (("l1",), dict(optimizer="lm", loss="l1")), (("learning_rate 100", "[0, 1]"), dict(learning_rate=100)),
                      (("epsilon", "l2"), dict(epsilon=3)), (("learning_rate", "Adam"), dict(optimizer="lm", learning_rate=.1)),
                      (("momentum", "Adam"), dict(optimizer="lbfgs", momentum=.5)), (("memory", "L-BFGS"), dict(memory=1e6)), (("no/where/c",), dict(checkpoint="no/where/c")),
                      (("noise_se",), dict(noise_se=np.full((16, 16, 3), -1.)))):
        raises(im.Error, lambda: im.fit(s, target, p, spp=4, **kw), *words)
    assert np.allclose(p[RED], [.4, .3, .2])
    raises(TypeError, lambda: im.fit(s, target, p, lr=.1))


def test_foreign_channels():
    """Bins are a target of a film of the same bins, and of no other; an array of two numbers is none"""
    scene = lambda **kw: im.load_file(os.path.join(SCENES, "cornell.xml"), mode="spectral", res=8, **kw)
    bins = im.render(scene(bins=(400, 700, 4)), spp=16)
    im.write("bins.exr", bins)
    np.save("two.npy", np.zeros((8, 8, 2), np.float32))
    for target, words in ((bins, ("S0.437.5nm", "R, G, B")), ("bins.exr", ("bins.exr", "S0.437.5nm", "R, G, B")),
                          ("two.npy", ("two.npy", "R, G, B"))):
        raises(im.ArgumentError, lambda: im.fit(scene(), target, ["red.*"], spp=4), *words)
    for target in (bins, "bins.exr"):
        f = im.fit(scene(bins=(400, 700, 4)), target, ["red.*"], spp=4, max_iterations=1)
        assert np.isfinite(f.loss)


def test_texture():
    """A texture of thousands of numbers: no errors, and it comes closer"""
    s = im.load_file(os.path.join(SCENES, "textured.xml"))
    p = im.traverse(s)
    name = max(p, key=lambda n: p.info(n).size)
    target, truth = im.render(s, spp=32, seed=1), p[name]
    p[name] = .5
    before = float(im.loss(s, target, name, spp=8, seed=9))
    f = im.fit(s, target, name, spp=2, max_iterations=8, learning_rate=.1, intervals=False)
    v = f[name]
    assert v.value.shape == truth.shape and np.all(v.start == .5) and np.isnan(v.se).all() and f.covariance is None
    assert np.array_equal(v.value, p[name]) and np.array_equal(v.at_bound == 1, v.value >= 1)
    assert float(im.loss(s, target, name, spp=8, seed=9)) < .8 * before and "numbers in" in repr(f) + f._repr_html_()


def test_views():
    """Several sensors: a list in order, a dictionary by sensor"""
    d = im.cornell_box(res=12)
    d["other"] = {**d["sensor"], "to_world": im.ScalarTransform4f().look_at([.5, .2, 3.8], [0, 0, 0], [0, 1, 0])}
    s = im.load_dict(d)
    targets = [im.render(s, sensor=k, spp=256, seed=k + 1) for k in (0, 1)]
    p = im.traverse(s)
    truth = p[RED]
    a = float(im.loss(s, targets, RED, spp=16))
    assert a == float(im.loss(s, {0: targets[0], "other": targets[1]}, RED, spp=16))
    p[RED] = .4
    f = im.fit(s, targets, RED, optimizer="lm", spp=64)
    z(f[RED].value, truth, f[RED].se)
    raises(im.ArgumentError, lambda: im.loss(s, targets[:1], RED), "1 target")


run(globals())
