# SPDX-License-Identifier: Apache-2.0
"""Parameters: reading, setting, keeping; arrays of all kinds; time."""
import array
import os
import re
import subprocess
import sys
import time

import importon as im
import numpy as np
from tap import SCENES, raises, run


def box(**kw):
    return im.load_dict(im.cornell_box(res=8, **kw))


def textured():
    return im.load_file(os.path.join(SCENES, "textured.xml"))


def test_mapping():
    """A mapping with shapes, bounds, units and flags; names as the library takes them"""
    p = im.traverse(box())
    assert len(p) == 4 and "red.reflectance.value" in p and "blue" not in p
    assert p["red.reflectance"].shape == (3,)
    i = p.info("light.emitter.radiance")
    assert (i.unit, i.lo, i.hi, i.shape) == ("W m^-2 sr^-1", 0, np.inf, (3,)) and i.differentiable
    assert p.flags("red.reflectance") == {"differentiable", "color"}, p.flags("red.reflectance")
    e = raises(im.ParameterError, lambda: p["red.reflectnce.value"], "red.reflectance.value")
    assert isinstance(e, KeyError) and isinstance(e, ValueError) and p.get("blue") is None
    assert "white.reflectance.value" in repr(p) and "<table>" in p._repr_html_()
    raises(TypeError, lambda: im.traverse(None))
    raises(TypeError, lambda: p[3])


def test_setting():
    """Setting is checked at once: shapes, bounds, finite numbers; nothing is set on failure"""
    p = im.traverse(box())
    name = "red.reflectance.value"
    p[name] = 0.25
    assert np.array_equal(p[name], [.25] * 3)
    for good in ((.1, .2, .3), [.1, .2, .3], np.array([.1, .2, .3]), im.Color3f(.1, .2, .3),
                 array.array("d", [.1, .2, .3]), memoryview(array.array("d", [.1, .2, .3])),
                 np.array([.3, .2, .1])[::-1], np.array([.1, .2, .3], dtype=">f8")):
        p[name] = 0
        p[name] = good
        assert np.array_equal(p[name], [.1, .2, .3]), good
    p[name] = np.array([.1, .2, .3], dtype=np.float16)
    p[name] = [1, 0, 1]
    before = p[name]
    for bad in ([1, 2], [[1, 2, 3]], 1.5, -1, float("nan"), [.1, np.inf, .1], "red", None, object(), 1j, True,
                [True] * 3, np.array(["a"] * 3), b"abc", np.zeros((3, 3)), np.array([None] * 3), [[], []], {}):
        raises((im.ArgumentError), lambda: p.__setitem__(name, bad))
    assert np.array_equal(p[name], before)
    raises(im.ArgumentError, lambda: p.__setitem__(name, 2), name, "[0, 1]")


def test_in_place():
    """Arrays changed in place reach the scene with update, or with the next call"""
    s = box()
    p = im.traverse(s)
    name = "red.reflectance.value"
    p[name] *= 0.5
    v = p[name]
    v[0] = 0.9
    assert p[name][0] != 0.9
    assert p.update() == [("red", {name})] and p[name][0] == 0.9
    v[1] = 0.8
    im.render(s, p, spp=1)
    assert p[name][1] == 0.8
    p.update({name: 0.1}, **{"white.reflectance.value": 0.2})
    assert p[name][2] == 0.1 and p["white.reflectance"][0] == 0.2


def test_keep():
    """keep: names, patterns, regular expressions"""
    def kept(keys):
        p = im.traverse(box())
        p.keep(keys)
        return [n.split(".")[0] for n in p]
    assert kept("red.*") == ["red"] and kept("red.reflectance") == ["red"]
    assert kept(r".*\.reflectance\.value") == ["white", "green", "red"]
    assert kept(re.compile("(red|green).*")) == ["green", "red"]
    assert kept(["light.*", "white.reflectance.value"]) == ["white", "light"]
    raises(im.ParameterError, lambda: kept("blue.*"), "blue.*")
    raises(im.ParameterError, lambda: kept("red.reflectanze"), "red.reflectance.value")
    raises(TypeError, lambda: kept([3]))
    p = im.traverse(box())
    p.keep("red.*")
    raises(im.ParameterError, lambda: p["white.reflectance"], "kept")
    e = im.loss(p.scene, im.render(p.scene, spp=2), p, spp=2)
    assert list(e.grad) == ["red.reflectance.value"]
    raises(im.ParameterError, lambda: e.grad["white.reflectance"], "active")


def test_textures():
    """A texture is an array [height][width][channels]"""
    p = im.traverse(textured())
    name = max(p, key=lambda n: p.info(n).size)
    assert p[name].ndim == 3 and p[name].shape[2] in (1, 3)
    value = np.asfortranarray(np.random.default_rng(1).random(p[name].shape))
    p[name] = value
    assert np.allclose(p[name], value, atol=1e-7)
    p[name] = value.ravel()
    assert np.allclose(p[name], value, atol=1e-7)
    raises(im.ArgumentError, lambda: p.__setitem__(name, value[:-1]), "shape")


class Device:
    """An array on a GPU, as DLPack tells it."""

    def __init__(self, kind):
        self.kind = kind

    def __dlpack_device__(self):
        return self.kind, 0

    def __dlpack__(self, **kw):
        raise BufferError("not on the CPU")


def test_dlpack():
    """DLPack comes in without a copy where it can; other devices are refused"""
    from importon._array import numbers
    a = np.arange(6.).reshape(2, 3)

    class Exporter:
        def __dlpack_device__(self):
            return a.__dlpack_device__()

        def __dlpack__(self, **kw):
            return a.__dlpack__()
    b = numbers(Exporter(), "x")
    assert np.shares_memory(a, b) and np.shares_memory(a, numbers(a, "x"))
    assert not np.shares_memory(a, numbers(a.T, "x")) and numbers(a.T, "x").flags.c_contiguous
    m = memoryview(a)
    assert np.shares_memory(np.asarray(m), numbers(m, "x"))
    raises(im.ArgumentError, lambda: numbers(Device(2), "x"), "device", "CPU")
    raises(im.ArgumentError, lambda: numbers(a.view(complex) if a.shape[1] % 2 == 0 else a.astype(complex), "x"), "complex")
    raises(im.ArgumentError, lambda: numbers(a > 0, "x"), "bool")
    out = im.render(box(), spp=1)
    assert np.shares_memory(np.from_dlpack(np.asarray(out)), out)


def test_poses():
    """A pose moves what the dictionary's transform moves; functional has its gradient; bad names are named"""
    shift, h, spp = np.array([.2, -.3, .1]), 0.02, 256

    def moved(by=None, translate=(0, 0, 0)):
        d = im.cornell_box(res=12)
        d["integrator"]["max_depth"] = 2
        d["light"]["to_world"] = im.ScalarTransform4f().translate(list(translate)) @ d["light"]["to_world"]
        del d["small-box"], d["large-box"], d["ceiling"]
        s = im.load_dict(d)
        assert s.add_pose("light") == "light.pose"
        p = im.traverse(s)
        assert p["light.pose"].shape == (6,) and p.info("light.pose").differentiable
        if by is not None:
            p["light.pose"] = by
        return s
    at = np.array([*shift, 0, 0, 0])
    assert np.allclose(im.render(moved(at), spp=4), im.render(moved(None, shift), spp=4), rtol=1e-4, atol=1e-5)
    got = im.functional(moved(at), "light.pose", spp=1024, seed=3)
    g, se = got.grad["light.pose"], got.grad.se["light.pose"]
    for k in (2, 3):  # along the lamp, and about the x axis: differences with the same random numbers
        step = np.zeros(6)
        step[k] = h
        pairs = [[im.functional(moved(at + sign * step), "white.*", spp=spp, seed=seed).value for sign in (1, -1)]
                 for seed in range(12)]
        d = np.array([(a - b) / (2 * h) for a, b in pairs])
        z = (g[k] - d.mean()) / np.hypot(se[k], d.std(ddof=1) / len(d) ** .5)
        assert abs(z) < 4 and se[k] < .25 * abs(g[k]), (k, g, se, d.mean(), z)
    raises(im.ArgumentError, lambda: moved().add_pose("nobody"), "nobody")
    used = moved()
    im.functional(used, "white.*", spp=2)
    raises(im.ArgumentError, lambda: used.add_pose("floor"), "problem")
    return "the mean along z %.4f +- %.4f, about x %.4f +- %.4f" % (g[2], se[2], g[3], se[3])


def test_to_world():
    """to_world is a 3 x 4 array with the matrix of the file; it moves, stretches, and has a gradient"""
    def scene():
        d = im.cornell_box(res=12)
        d["integrator"]["max_depth"] = 2
        del d["large-box"]
        return d, im.load_dict(d)
    d, s = scene()
    raises(im.ParameterError, lambda: im.traverse(s).keep(["small-box.to_world"]),
           "'small-box.to_world' is geometry", "Scene.add_geometry")
    assert s.add_geometry("small-box.to_world") == "small-box.to_world" and "light.to_world" in s.geometry_names
    p = im.traverse(s)
    there = np.array(p["small-box.to_world"])
    assert there.shape == (3, 4) and p.info("small-box.to_world").differentiable
    assert np.allclose(there, np.array(d["small-box"]["to_world"].matrix)[:3], atol=1e-6)

    # A shift and a stretch, as the dictionary has them.
    change = np.eye(4)
    change[0, 0], change[:3, 3] = 1.2, (.1, -.05, .2)
    moved = change @ np.vstack([there, (0, 0, 0, 1)])
    p["small-box.to_world"] = moved[:3]
    d["small-box"]["to_world"] = im.ScalarTransform4f(moved)
    assert np.allclose(im.render(s, spp=4), im.render(im.load_dict(d), spp=4), rtol=1e-4, atol=1e-5)
    raises(im.NumericError, lambda: p.__setitem__("small-box.to_world", np.zeros((3, 4))), "to_world", "singular")
    p["small-box.to_world"] = moved[:3]

    # The last column is a translation: that of a pose of the same box, with the same random numbers.
    by_matrix = im.functional(s, "small-box.to_world", spp=64, seed=3)
    other = im.load_dict(d)
    other.add_pose("small-box")
    by_pose = im.functional(other, "small-box.pose", spp=64, seed=3)
    g, e = by_matrix.grad["small-box.to_world"], by_pose.grad["small-box.pose"]
    assert g.shape == (3, 4)
    assert np.allclose(g[:, 3], e[:3], rtol=1e-4, atol=1e-5 * np.abs(e[:3]).max()), (g[:, 3], e[:3])
    posed = scene()[1]
    posed.add_pose("small-box")
    raises(im.UnsupportedError, lambda: posed.add_geometry("small-box.to_world"), "to_world says where it is")
    return "the mean by a translation %s" % np.round(g[:, 3], 4)


def test_pose_end():
    """Both places of an instance that moves in time: set as the dictionary has them, and differentiated"""
    T = im.ScalarTransform4f

    def scene(shift=0):
        film = {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}}
        camera = {"type": "perspective", "to_world": T().look_at(origin=[0, 0, 5], target=[0, 0, 0], up=[0, 1, 0]),
                  "shutter_open": 0., "shutter_close": 1., "film": film}
        tile = {"type": "rectangle", "to_world": T().scale(.4)}
        ends = T().translate([-.6, 0, 0]), T().translate([.6 + shift, .2, .1]).rotate([0, 0, 1], 40)
        return im.load_dict({"type": "scene", "integrator": {"type": "path", "max_depth": 2}, "camera": camera,
                             "sky": {"type": "constant"}, "group": {"type": "shapegroup", "tile": tile},
                             "cart": {"type": "instance", "to_world": ends[0], "to_world_end": ends[1],
                                      "shapegroup": {"type": "ref", "id": "group"}}})
    s = scene()
    assert "cart.pose_end" in s.geometry_names, s.geometry_names
    names = [s.add_geometry(name) for name in ("cart.pose", "cart.pose_end", "camera.pose")]
    p = im.traverse(s)
    assert np.array_equal(p["cart.pose_end"], np.zeros(6)) and p.info("cart.pose_end").differentiable
    p["cart.pose_end"] = [.25, 0, 0, 0, 0, 0]
    assert np.allclose(im.render(s, spp=16, seed=3), im.render(scene(.25), spp=16, seed=3), rtol=1e-5)

    # All is shifted: nothing changes.
    grad = im.functional(s, names, spp=64, seed=3).grad
    g = [grad[name] for name in names]
    assert all(e.shape == (6,) for e in g)
    most = np.abs(g[1][:3]).max()
    assert most > 1e-3 and np.abs(sum(e[:3] for e in g)).max() < 1e-6 * most, g
    raises(im.UnsupportedError, lambda: scene().add_geometry("cart.scale"), "moves in time")
    raises(im.UnsupportedError, lambda: scene().add_geometry("camera.pose_end"), "camera")
    return "the mean by shifts of the last place %s" % np.round(g[1][:3], 4)


def test_places():
    """place and film_points: where a thing is, in the scene and in its picture"""
    s = im.load_dict(im.cornell_box(res=32))
    name = s.add_geometry("small-box.pose")
    middle, radius = s.place(name)
    im.traverse(s)[name] = [.1, 0, .2, 0, .3, 0]
    moved, same = s.place(name)
    assert np.allclose(moved - middle, [.1, 0, .2]) and np.isclose(radius, same, rtol=.2)
    seen = s.film_points([moved, [0, 0, 1e6], [[0, 0, 0]][0]])
    assert seen.shape == (3, 2) and np.isfinite(seen[0]).all() and np.isnan(seen[1]).all()
    assert np.allclose(seen[2], 16, atol=1e-4) and s.film_points(moved).shape == (2,)
    # The light's share of the picture is brighter than what is around it: the lamp is seen there.
    light, _ = s.place(s.add_geometry("light.pose"))
    x, y = s.film_points(light)
    picture = im.render(s, spp=4)
    assert picture[int(y), int(x)].sum() > 10 * np.median(picture.sum(axis=2))
    raises(im.ArgumentError, lambda: s.place("red.reflectance.value"), "red.reflectance.value")
    raises(im.ParameterError, lambda: s.place("nothing"), "nothing")
    raises(im.ArgumentError, lambda: s.film_points([1, 2]), "shape")
    raises(im.ArgumentError, lambda: s.film_points([1, 2, 3], sensor=4), "sensor")
    raises(im.ArgumentError, lambda: s.film_points([1, 2, 3], sensor=-2**40), "sensor")
    raises(TypeError, lambda: s.film_points([1, 2, 3], sensor=1.5), "sensor")
    return "the lamp is at %.1f, %.1f" % (x, y)


def test_time():
    """Reading or setting a number takes less than 20 us; loading the package 50 ms beyond NumPy"""
    p = im.traverse(box())
    name = "red.reflectance.value"
    value = np.array([.1, .2, .3])

    def of(call):
        best = 1
        for _ in range(9):
            start = time.perf_counter()
            for _ in range(200):
                call()
            best = min(best, (time.perf_counter() - start) / 200)
        return 1e6 * best
    read, set_ = of(lambda: p[name]), of(lambda: p.__setitem__(name, value))
    code = "import time, numpy; t = time.process_time(); import importon; print(time.process_time() - t)"
    load = min(float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True,
                                    env={**os.environ, "PYTHONDONTWRITEBYTECODE": ""}).stdout) for _ in range(7))
    assert read < 20 and set_ < 20, (read, set_)
    assert load < 0.05, load
    return "read %.1f us, set %.1f us, import %.0f ms" % (read, set_, 1e3 * load)


run(globals())
