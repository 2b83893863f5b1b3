# SPDX-License-Identifier: Apache-2.0
"""Dictionaries of tests/python/scenes.py, changed at random: load_dict makes a scene or raises an error
of importon, and neither crashes, hangs nor raises anything else.

    hostile_dictionaries.py                          a test of IMP_SECONDS seconds (default 6)
    hostile_dictionaries.py --cases FIRST SECONDS    the cases alone, in this process
    hostile_dictionaries.py --case NUMBER            one case, with its dictionary

A case is a function of its number, whatever the time. The test runs the cases in another process, so that
a crash names the case that it came from."""
import copy
import faulthandler
import inspect
import os
import random
import runpy
import subprocess
import sys
import time
import warnings
from collections.abc import Mapping
from types import MappingProxyType

import importon as im
import numpy as np
import tap

HERE = os.path.dirname(os.path.realpath(__file__))
CASE_SECONDS = 30  # what takes longer hangs: most cases take a millisecond


class Raises:
    """Raises for every question that load_dict may ask."""

    def __array__(self, *a, **k):
        raise KeyError("no array")

    def __fspath__(self):
        raise IndexError("no path")

    def __len__(self):
        raise ZeroDivisionError("no length")


class Path:
    def __fspath__(self):
        return 7


class Matrix:
    def __init__(self, matrix):
        self.matrix = matrix


class Device:
    def __dlpack_device__(self):
        return ()

    def __dlpack__(self, **k):
        return None


class Vertices:
    """A mesh by its attributes, which are what a case gives."""

    def __init__(self, vertices, faces):
        self.vertices, self.faces = vertices, faces


class Keys(Mapping):
    """A mapping that says it has keys and gives none."""

    def __getitem__(self, key):
        raise KeyError(key)

    def __iter__(self):
        return iter(["type", "radius"])

    def __len__(self):
        return 2


def itself(kind):
    """A container that contains itself."""
    if kind == "list":
        a = [1]
        a.append(a)
    else:
        a = {"type": "diffuse"}
        a["reflectance"] = a
    return a


def deep(kind, depth):
    """Containers inside containers, in both ways that scenes nest."""
    at = .5
    for _ in range(depth):
        at = [at] if kind == "list" else {"type": "twosided", "bsdf": at}
    return at


def array(r):
    """Arrays of every type, shape and layout; of some the memory could not be had."""
    a = np.random.default_rng(r.randrange(2**32))
    shape = tuple(r.choice([0, 1, 2, 3, 4, 5]) for _ in range(r.randrange(5)))
    made = r.choice([
        lambda: a.random(shape), lambda: a.random(shape) * 10.0**r.randrange(-320, 309), lambda: a.random((4, 4)),
        lambda: a.integers(-3, 9, shape), lambda: np.full(shape, r.choice([np.nan, np.inf, -np.inf, -0.0])),
        lambda: np.full(shape, "x"), lambda: np.full(shape, None, object), lambda: np.full(shape, 1j),
        lambda: np.zeros(shape, bool), lambda: np.full(shape, 7, "datetime64[s]"), lambda: np.zeros(shape, [("a", "f4")]),
        lambda: np.full(shape, 2**64 - 1, np.uint64), lambda: a.random(shape).astype(np.float16),
        lambda: a.random(shape).astype(np.longdouble), lambda: a.random(shape).astype(">f4"),
        lambda: np.lib.stride_tricks.as_strided(np.zeros(1), (2**r.randrange(40, 58), 3), (0, 0)),
        lambda: np.lib.stride_tricks.as_strided(np.zeros(1, np.float32), (2**20, 2**20, 3), (0, 0, 0)),
        lambda: np.ma.masked_array(a.random((3,)), [1, 0, 0]), lambda: np.zeros((1,) * 32),
    ])()
    return made[::-1] if made.ndim and r.random() < .2 else made


def value(r, pool):
    """A value of any kind, good and bad."""
    return r.choice([
        lambda: r.choice([None, True, 0, -1, 1, 2**31, 2**63, -2**63, 2**64, 10**5000, 1e308, 5e-324, -0.0, float("nan"),
                          float("inf"), -float("inf"), 1j, ..., NotImplemented, object(), int, len]),
        lambda: r.choice(["", " ", "x" * 100000, "a\0b", "\ud800", "%s%n", "\U0001f600", "400:1,500:2", ":,:", "1 2 3",
                          "/dev/null", "/", "..", "nan", "1e999", "rgb", "ref", "scene", "mesh", "a.b.c", "*", "$x"]),
        lambda: r.choice([b"", b"\xff\0", bytearray(3), memoryview(bytes(12)), set(), frozenset([1]), range(3), range(2**62)]),
        lambda: r.choice([Raises(), Path(), Device(), Keys(), Matrix(None), Matrix(np.eye(3)), Matrix("x"),
                          Matrix(Raises()), im.Transform4f(), Vertices(1, None), iter([1, 2]), (k for k in range(3))]),
        lambda: Vertices(array(r), array(r)), lambda: Matrix(array(r)), lambda: array(r), lambda: array(r),
        lambda: r.choice([np.float32, np.float16, np.int8, np.uint64, np.bool_, np.str_, np.longdouble, np.complex64])(1),
        lambda: [value(r, pool) for _ in range(r.randrange(4))], lambda: tuple(r.random() for _ in range(r.randrange(6))),
        lambda: [[r.random() for _ in range(r.randrange(5))] for _ in range(r.randrange(5))],
        lambda: {r.choice(["type", "id", "name", "value", "filename", ""]): value(r, pool) for _ in range(r.randrange(3))},
        lambda: {"type": r.choice(["rgb", "spectrum", "ref"]), r.choice(["value", "id", "filename"]): value(r, pool)},
        lambda: itself(r.choice(["list", "dict"])), lambda: deep(r.choice(["list", "dict"]), r.choice([3, 40, 900, 20000])),
        lambda: MappingProxyType({"type": "sphere"}), lambda: copy.deepcopy(r.choice(pool)), lambda: copy.deepcopy(r.choice(pool)),
    ])()


def places(d):
    """(container, key) of every value inside; what is met twice is taken once."""
    found, seen, left = [], set(), [d]
    while left and len(found) < 5000:
        at = left.pop()
        if id(at) in seen:
            continue
        seen.add(id(at))
        for key in list(at) if isinstance(at, dict) else range(len(at)):
            found.append((at, key))
            if isinstance(at[key], (dict, list)):
                left.append(at[key])
    return found


def scaled(x, r):
    if isinstance(x, bool) or not isinstance(x, (int, float, np.ndarray)):
        return x
    with np.errstate(all="ignore"):
        try:
            return x * r.choice([-1, 0, 1e-30, 1e30, 2**31, 2**62, 1e308, .5, float("nan")])
        except (TypeError, ValueError, OverflowError):
            return x


def change(d, r, pool, types, keys):
    """One change somewhere inside."""
    at, key = r.choice(places(d) or [(d, "type")])
    way = r.randrange(12)
    if way < 3 or key not in (at if isinstance(at, dict) else range(len(at))):
        at[key] = value(r, pool)
    elif way < 6:
        at[key] = scaled(at[key], r)
    elif way == 6:
        del at[key]
    elif way == 7 and isinstance(at, dict):
        at[r.choice(keys + [3, None, (), b"x", "", "\0", "\ud800", float("nan")])] = at.pop(key) if r.random() < .5 else at[key]
    elif way == 8 and isinstance(at, dict) and "type" in at:
        at["type"] = r.choice(types)
    elif way == 9:
        at[key] = r.choice([lambda x: [x], lambda x: (x, x), lambda x: {"type": r.choice(types), r.choice(keys): x}])(at[key])
    else:
        other, name = r.choice(places(d))
        at[key] = other[name] if r.random() < .5 else other  # the same object twice, or a cycle


def recorded():
    """Dictionaries that scenes.py gives to load_dict without an error, in order."""
    found, load, run = [], im.load_dict, tap.run

    def recorder(d, **options):
        scene = load(d, **options)
        if not options:
            found.append(d)
        return scene
    try:
        im.load_dict, tap.run = recorder, lambda namespace: None
        for name, test in runpy.run_path(os.path.join(HERE, "scenes.py")).items():
            if name.startswith("test_") and inspect.isfunction(test):
                test()
    finally:
        im.load_dict, tap.run = load, run
    return found + [im.cornell_box(res=8, spp=2)]


class Cases:
    def __init__(self):
        self.good = recorded()
        held = [at[key] for d in self.good for at, key in places(d)]
        self.pool = [x for x in held if isinstance(x, dict)]
        self.types = sorted({x["type"] for x in self.pool if isinstance(x.get("type"), str)} |
                            {"scene", "shapegroup", "instance", "heterogeneous", "merge", "blendbsdf", "none"})
        self.keys = sorted({key for x in self.pool for key in x if isinstance(key, str)})

    def dictionary(self, number):
        r = random.Random(number)
        d = copy.deepcopy(r.choice(self.good))
        for _ in range(r.choice([1, 1, 1, 2, 3, 5, 9])):
            change(d, r, self.pool, self.types, self.keys)
        return d

    def run(self, number):
        """1 if there is a scene."""
        d = self.dictionary(number)
        try:
            scene = im.load_dict(d)
            im.traverse(scene)
        except im.Error as error:
            assert str(error), "an error without a message"
            return 0
        except TypeError as error:  # documented: a key that is no string
            assert "no string" in str(error), error
            return 0
        s = scene.sensors[0] if scene.sensors else None
        if s and s.width * s.height <= 256:
            try:
                im.render(scene, spp=1)
            except im.Error:
                pass
        scene.close()
        return 1


def run_cases(first, seconds):
    """Write the number of each case before it runs, and at the end how many made scenes."""
    cases, start, scenes, number = Cases(), time.time(), 0, first
    while time.time() - start < seconds:
        print(number, flush=True)
        faulthandler.dump_traceback_later(CASE_SECONDS, exit=True)
        scenes += cases.run(number)
        faulthandler.cancel_dump_traceback_later()
        number += 1
    print("done", number - first, scenes)


def test_random_dictionaries():
    """Dictionaries changed at random: a scene or an error of importon"""
    seconds = float(os.environ.get("IMP_SECONDS", 6))
    p = subprocess.run([sys.executable, os.path.realpath(__file__), "--cases", os.environ.get("IMP_SEED", "0"), str(seconds)],
                       capture_output=True, text=True, timeout=2 * seconds + 120)
    last = p.stdout.split("\n")[-2:-1]
    assert p.returncode == 0 and last and last[0].startswith("done"), "status %d in --case %s: %s" % (
        p.returncode, last[0] if last else "none", p.stderr[-3000:])
    count, scenes = map(int, last[0].split()[1:])
    assert count >= 20 and 0 < scenes < count, "%d scenes of %d dictionaries" % (scenes, count)
    return "%d dictionaries, %d scenes" % (count, scenes)


if sys.argv[1:2] in (["--cases"], ["--case"]):
    faulthandler.enable()
    im.set_progress(False)
    warnings.simplefilter("ignore")
    if sys.argv[1] == "--cases":
        run_cases(int(sys.argv[2]), float(sys.argv[3]))
    else:
        one = Cases()
        print(one.dictionary(int(sys.argv[2])))
        print(one.run(int(sys.argv[2])))
else:
    tap.run(globals())
