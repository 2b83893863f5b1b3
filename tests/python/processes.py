# SPDX-License-Identifier: Apache-2.0
"""Threads, fork, spawn, multiprocessing; objects destroyed in any order; memory over many calls."""
import gc
import itertools
import multiprocessing
import os
import subprocess
import sys
import threading

import importon as im
import numpy as np
from tap import raises, run

RED = "red.reflectance.value"


def box(res=16, **kw):
    return im.load_dict(im.cornell_box(res=res, **kw))


def picture_sum(seed):
    return float(np.sum(im.render(box(), spp=4, seed=seed), dtype=float))


SCENE = None


def inherited_sum(seed):
    return float(np.sum(im.render(SCENE, spp=4, seed=seed), dtype=float))


def test_one_scene_two_threads():
    """One scene from several threads: the same bits as one after the other"""
    s = box(res=32)
    alone = [np.array(im.render(s, spp=8, seed=k)) for k in range(6)]
    got, errors = [None] * 6, []

    def work(k):
        try:
            for _ in range(5):
                got[k] = im.render(s, spp=8, seed=k)
                im.loss(s, got[k], RED, spp=2)
        except BaseException as e:
            errors.append(e)
    threads = [threading.Thread(target=work, args=(k,)) for k in range(6)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert not errors, errors
    assert all(np.array_equal(a, b) for a, b in zip(alone, got))


def test_closing_while_used():
    """Closing a scene that another thread renders waits for it"""
    s = box(res=64)
    out = []
    t = threading.Thread(target=lambda: out.append(im.render(s, spp=256)))
    t.start()
    while not s.lock._is_owned() and s.lock.acquire(blocking=False):  # until the thread has it
        s.lock.release()
    s.close()
    t.join()
    assert out and out[0].spp == 256


def test_fork():
    """After a fork the child renders the same bits, and ends"""
    if not hasattr(os, "fork"):
        return
    s = box()
    want = picture_sum(3)
    im.render(s, spp=1)
    lock_holder = threading.Thread(target=lambda: im.render(s, spp=512))
    lock_holder.start()  # the child inherits a scene whose lock is held
    r, w = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.write(w, repr((picture_sum(3), float(np.sum(im.render(s, spp=4, seed=3), dtype=float)))).encode())
        finally:
            os._exit(0)
    os.close(w)
    said = os.fdopen(r).read()
    lock_holder.join()
    assert os.waitpid(child, 0)[1] == 0 and eval(said) == (want, want), (said, want)


def test_multiprocessing():
    """multiprocessing: fork, spawn and forkserver"""
    global SCENE
    want = [picture_sum(k) for k in range(4)]
    SCENE = box()
    for method in multiprocessing.get_all_start_methods():
        with multiprocessing.get_context(method).Pool(2) as pool:
            assert pool.map_async(picture_sum, range(4)).get(60) == want, method
            if method == "fork":
                assert pool.map_async(inherited_sum, range(4)).get(60) == want


def test_any_order():
    """Objects are destroyed in any order"""
    def objects():
        s = box(res=8)
        p = im.traverse(s)
        picture = im.render(s, spp=2)
        e = im.loss(s, picture, RED, spp=2)
        j = im.jacobian(s, RED, spp=2)
        return [s, p, picture, picture.se, e, j, picture[1:3]]
    made = objects()
    for order in itertools.islice(itertools.permutations(range(len(made))), 0, 6000, 97):
        some = objects()
        for k in order:
            some[k] = None
        del some
        gc.collect(0)
    done = subprocess.run([sys.executable, "-c", "import importon as im; s = im.load_dict(im.cornell_box(res=8)); "
                           "p = im.render(s, spp=1); q = im.traverse(s); e = im.loss(s, p, spp=2)"], capture_output=True, text=True)
    assert done.returncode == 0 and not done.stderr, done.stderr


BEND = os.path.join(os.path.dirname(__file__), "..", "..", "scenes", "bend", "rod.xml")


def resident():
    with open("/proc/self/statm") as f:
        return int(f.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def grows(call, n, warm):
    """Bytes a call, after some that fill caches."""
    for _ in range(warm):
        call()
    gc.collect()
    before = resident()
    for _ in range(n):
        call()
    gc.collect()
    return (resident() - before) / n


def test_memory():
    """Ten thousand calls without growth of memory"""
    s = box(res=4)
    p = im.traverse(s)
    p.keep("red.*")
    target = im.render(s, spp=4)

    def errors():
        for bad in (lambda: im.render(s, spp=-1), lambda: p["blue"], lambda: im.loss(s, target[:2], p, spp=2),
                    lambda: im.load_string("<scene")):
            raises(im.Error, bad)

    def setting():
        p[RED] = p[RED] * .9 + .01

    worst = {}
    for name, call, n, warm in (("render", lambda: im.render(s, spp=1), 3000, 300), ("loss", lambda: im.loss(s, target, p, spp=2), 3000, 300),
                                ("set", setting, 3000, 300), ("errors", errors, 300, 50), ("load", lambda: box(res=4), 700, 70)):
        worst[name] = grows(call, n, warm)
    assert all(v < 200 for v in worst.values()), worst
    return ", ".join("%s %.0f B" % kv for kv in worst.items())


if __name__ == "__main__":
    run(globals())
