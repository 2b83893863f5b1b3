# SPDX-License-Identifier: Apache-2.0
"""Pictures: their life, errors, files; progress and Ctrl-C; objects destroyed in any order."""
import gc
import os
import pickle
import signal
import subprocess
import sys
import threading
import time

import importon as im
import numpy as np
from tap import SCENES, raises, run, z


def box(res=16, **kw):
    return im.load_dict(im.cornell_box(res=res, **kw))


def cli(*arguments):
    program = os.path.join(os.environ["IMP_BUILD"], "cli", "importon")
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)


def test_is_the_command():
    """The same bits, and the same words in errors, as the command line"""
    path = os.path.join(SCENES, "cornell.xml")
    assert cli("render", path, "-D", "res=16", "--spp", 8, "--seed", 3, "--se", "-o", "a.exr").returncode == 0
    a, b = im.read("a.exr"), im.render(im.load_file(path, res=16), spp=8, seed=3)
    assert np.array_equal(a, b) and np.array_equal(a.se, b.se) and a.channels == b.channels == ("R", "G", "B")
    done = cli("render", "none.xml", "-o", "b.exr")
    assert str(raises(im.FileError, lambda: im.load_file("none.xml"))) in done.stderr
    done = cli("gradient", path, "-p", "rde.*")
    scene = im.load_file(path)
    assert str(raises(im.ArgumentError, lambda: im.loss(scene, np.zeros((256, 256, 3)), "rde.*"))) in done.stderr


def test_threads():
    """The same bits on any number of threads"""
    try:
        pictures = []
        for n in (1, 2, 5):
            im.set_threads(n)
            assert im.threads() == n
            pictures.append(im.render(box(), spp=8))
    finally:
        im.set_threads(0)
    assert all(np.array_equal(p, pictures[0]) and np.array_equal(p.se, pictures[0].se) for p in pictures)


def test_standard_errors():
    """Standard errors are the spread of pictures with other seeds"""
    s = box(res=8)
    many = [im.render(s, spp=16, seed=k) for k in range(240)]  # a pixel at the lamp's edge has most of the variance
    spread = np.var([np.asarray(p) for p in many], axis=0, ddof=1).mean()
    said = np.mean([p.se**2 for p in many])
    assert 0.8 < said / spread < 1.25, said / spread
    return "ratio %.3f" % (said / spread)


def test_outlives_its_scene():
    """A picture outlives scene, context and every other reference"""
    s = box()
    p = im.render(s, spp=2)
    kept = np.array(p)
    part, se = p[2:5, ::2], p.se
    s.close()
    im.set_threads(1)
    im.set_threads(0)
    del s, p
    gc.collect()
    for _ in range(20):
        im.render(box(), spp=1)  # writes over memory that is free
    assert np.array_equal(part, kept[2:5, ::2]) and np.isfinite(se).all()
    part[...] = 0  # the memory may be written to
    assert not part.any()


def test_arrays():
    """Parts keep their errors; what is computed is plain; pickled, copied, sliced"""
    p = im.render(box(), spp=2)
    assert type(p + 1) is np.ndarray and type(np.mean(p, axis=2)) is np.ndarray and type(2 * p) is np.ndarray
    assert type(np.stack([p, p])) is np.ndarray and type(np.concatenate([p, p])) is np.ndarray
    assert np.array_equal(p[3, 4:6].se, p.se[3, 4:6]) and isinstance(p[0, 0, 0], np.float32)
    q = pickle.loads(pickle.dumps(p))
    assert np.array_equal(q, p) and np.array_equal(q.se, p.se) and (q.channels, q.spp) == (p.channels, 2)
    p *= 2
    assert np.array_equal(p, 2 * q)
    assert p._repr_png_()[:4] == b"\x89PNG" and "<img" in p._repr_html_() and p[:, 0, 0]._repr_png_() is None
    assert p[..., 0]._repr_png_()[:4] == b"\x89PNG"


def test_files():
    """Files: what is written is read; bad ones are exceptions"""
    p = im.render(box(), spp=2)
    for path, tolerance in (("a.exr", 0), ("a.pfm", 0), ("a.npy", 0), ("a.hdr", .01)):
        im.write(path, p)
        assert np.allclose(im.read(path), p, rtol=tolerance, atol=tolerance * p.max()), path
    assert np.array_equal(im.read("a.exr").se, p.se)
    im.write("b.exr", p, standard_error=False)
    assert im.read("b.exr").se is None
    p.write("c.png", exposure=1)
    assert im.read("c.png").shape == p.shape
    im.write("d.exr", np.random.default_rng(1).random((3, 5)))
    assert im.read("d.exr").shape == (3, 5, 1)
    raises(im.ArgumentError, lambda: im.write("a.gif", p), "a.gif")
    raises(im.FileError, lambda: im.read("none.exr"))
    with open("bad.exr", "wb") as f:
        f.write(open("a.exr", "rb").read()[:200])
    raises(im.Error, lambda: im.read("bad.exr"), "bad.exr")
    for bad in (np.zeros(3), np.zeros((0, 3, 3)), np.zeros((2, 2, 3), complex), None, "x", np.zeros((2, 2, 2, 2))):
        raises(im.ArgumentError, lambda: im.write("e.exr", bad))
    raises(im.ArgumentError, lambda: im.write("a\0.exr", p))
    raises(TypeError, lambda: im.write(3, p))


def test_npy_of_whole_numbers():
    """NPY files of uint8 and uint16 are sRGB, as the PNG file of the same numbers, also as clipped targets"""
    scene = box(8)
    im.render(scene, spp=4).write("d.png", exposure=2)
    png = np.asarray(im.read("d.png"))
    words = np.where(png <= 0.0031308, 12.92 * png, 1.055 * np.maximum(png, 1e-9) ** (1 / 2.4) - 0.055)
    words = np.round(255 * words).astype(np.uint8)
    assert words.max() == 255
    np.save("d.npy", words)
    np.save("e.npy", words.astype(np.uint16) * 257)
    assert (np.asarray(im.read("d.npy")) == png).all()
    assert np.allclose(im.read("e.npy"), png, rtol=1e-6)
    losses = [im.loss(scene, f, spp=4, clip="auto") for f in ("d.png", "d.npy")]
    assert float(losses[0]) == float(losses[1])
    np.save("f.npy", words.astype(np.int32))
    raises(im.SceneError, lambda: im.read("f.npy"), "f.npy: an array of '<i4'")


def test_compare():
    """compare: within noise, and not"""
    s = box()
    a, b = im.render(s, spp=64, seed=1), im.render(s, spp=64, seed=2)
    c = im.compare(a, b)
    assert c and c.has_z and c.mean_z < 4.5 and "agree" in repr(c)
    b[...] *= 1.2
    assert not im.compare(a, b)
    a.write("a.exr")
    assert im.compare("a.exr", a).rmse == 0
    assert im.compare(np.ones((2, 2, 3)), np.ones((2, 2, 3))) and not im.compare(np.ones((2, 2)), np.zeros((2, 2)))
    raises(im.ArgumentError, lambda: im.compare(np.ones((2, 2, 3)), np.ones((2, 3, 3))))


def test_closed():
    """A closed scene, and one used after an error"""
    s = box()
    params = im.traverse(s)
    raises(im.ArgumentError, lambda: im.render(s, spp=-1), "spp")
    raises(im.ArgumentError, lambda: im.render(s, sensor=1), "sensor")
    raises(im.ArgumentError, lambda: im.render(s, sensor="front"), "front")
    raises(im.ArgumentError, lambda: im.render(s, seed=-1), "seed")
    raises(TypeError, lambda: im.render(s, spp=1.5), "spp")
    raises(TypeError, lambda: im.render(s, integrator={"type": "prb"}), "integrator")
    raises(TypeError, lambda: im.render(3))
    raises(TypeError, lambda: pickle.dumps(s))
    assert im.render(s, spp=1).shape == (16, 16, 3)
    s.close()
    s.close()
    for call in (lambda: im.render(s), lambda: im.traverse(s), lambda: params["red.reflectance.value"],
                 lambda: params.update({"red.reflectance.value": 1}), lambda: im.loss(s, np.zeros((16, 16, 3)))):
        raises(im.ArgumentError, call, "closed")
    assert "closed" in repr(s) and "closed" in s._repr_html_()


def test_progress():
    """Progress: stages and fractions; stopping leaves a picture and a usable scene"""
    s = box(res=64)
    seen = []
    im.render(s, spp=256, progress=lambda p: seen.append(p))
    assert seen and seen[-1].stage == "render" and all(0 <= p.fraction <= 1 for p in seen), seen[-1:]
    e = raises(im.Cancelled, lambda: im.render(s, spp=10**7, progress=lambda p: True))
    assert e.result.shape == (64, 64, 3) and e.result.mean() > 0
    raises(ZeroDivisionError, lambda: im.render(s, spp=10**7, progress=lambda p: 1 / 0))
    e = raises(im.Cancelled, lambda: im.loss(s, im.render(s, spp=1), spp=10**6, progress=lambda p: True))
    assert im.render(s, spp=1).mean() > 0
    time_limited = im.render(s, spp=10**7, time_limit=.3)
    assert 0 < time_limited.spp < 10**7


def test_calls_from_callbacks():
    """Calls of the library from a progress callback are exceptions"""
    s = box(res=64)
    p = im.traverse(s)
    for call in (lambda: im.render(s, spp=1), lambda: p.update({"red.reflectance.value": .1}),
                 lambda: im.load_dict(im.cornell_box()), lambda: s.close(),
                 lambda: im.loss(s, np.zeros((64, 64, 3)), spp=2)):
        raises(im.ArgumentError, lambda: im.render(s, spp=10**7, progress=lambda _: call()), "callback")
    assert im.render(s, spp=1).mean() > 0


def test_ctrl_c():
    """Ctrl-C stops at the next tile, and the scene is usable"""
    code = """
import importon as im, os, signal, threading, time, sys
s = im.load_dict(im.cornell_box(res=64))
for call in (lambda: im.render(s, spp=10**8), lambda: im.loss(s, im.render(s, spp=1), spp=10**7),
             lambda: im.fit(s, im.render(s, spp=4), 'red.*', spp=64, max_iterations=10**6, tolerance=1e-15)):
    timer = threading.Timer(.4, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    start = time.time()
    try:
        call()
        sys.exit('it went on')
    except KeyboardInterrupt:
        print('%.2f' % (time.time() - start - .4))
print(im.render(s, spp=1).mean() > 0)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr[-600:]
    *late, good = done.stdout.split()
    assert good == "True" and len(late) == 3 and max(map(float, late)) < 2, done.stdout
    return "%s s later" % ", ".join(late)


def test_handlers():
    """A signal handler that does not raise lets the call go on"""
    s = box(res=64)
    seen = []
    before = signal.signal(signal.SIGUSR1, lambda *a: seen.append(1))
    try:
        timer = threading.Timer(.1, lambda: os.kill(os.getpid(), signal.SIGUSR1))
        timer.start()
        p = im.render(s, spp=256)
        timer.join()
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert seen and p.spp == 256


def test_the_lock_is_released():
    """Other threads of Python run while C works"""
    count, stop = [0], []

    def work():
        while not stop:
            count[0] += 1
            time.sleep(.001)
    t = threading.Thread(target=work)
    t.start()
    start = time.time()
    im.render(box(res=64), spp=128)
    took = time.time() - start
    stop.append(1)
    t.join()
    assert count[0] > 50 * took, (count[0], took)


run(globals())
