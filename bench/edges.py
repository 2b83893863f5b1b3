#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Loss and gradient by the pose of a bumpy ball, by its number of triangles: processor seconds and peak memory.

    python3 bench/edges.py [-b IMPORTON] [--triangles N ...] [--spp N] [--rounds N]

The ball lies over a floor below a square lamp, seen by 64 x 64 pixels. Every side of a triangle is an edge. One
thread; the least of some rounds, and what the picture of as many samples takes, both from the start of the program.
"""
import argparse
import math
import os
import random
import resource
import subprocess
import tempfile
import time

here = os.path.dirname(os.path.abspath(__file__))
SCENE = """<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="4"/></integrator>
<sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0, -7, 2" target="0, 0, .5" up="0, 0, 1"/></transform>
<sampler type="independent"><integer name="sample_count" value="64"/></sampler>
<film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="64"/><rfilter type="box"/></film></sensor>
<shape type="obj" id="ball"><string name="filename" value="ball.obj"/><boolean name="face_normals" value="true"/>
<transform name="to_world"><translate z="1.1"/></transform>
<bsdf type="diffuse"><rgb name="reflectance" value=".5"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><scale value="5"/></transform>
<bsdf type="diffuse"><rgb name="reflectance" value=".6"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="180"/><translate x="1" z="5"/></transform>
<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
<emitter type="area"><rgb name="radiance" value="10"/></emitter></shape></scene>
"""


def ball(path, triangles):
    """About so many; returns how many."""
    rows = max(4, math.isqrt(triangles // 4))
    columns, r = 2 * rows, random.Random(3)
    vertices = [(0., 0., 1.)]
    for i in range(1, rows):
        for j in range(columns):
            t, p = math.pi * i / rows, 2 * math.pi * j / columns
            size = 1 + .05 * math.sin(7 * p) * math.sin(5 * t) * math.sin(t) + .2 / rows * r.uniform(-1, 1)
            vertices.append((size * math.sin(t) * math.cos(p), size * math.sin(t) * math.sin(p), size * math.cos(t)))
    vertices.append((0., 0., -1.))
    faces, last = [], len(vertices)
    for j in range(columns):
        k = (j + 1) % columns
        faces += [(1, 2 + j, 2 + k), (last, last - columns + k, last - columns + j)]
        for a in range(2, last - columns - 1, columns):
            faces += [(a + j, a + columns + j, a + columns + k), (a + j, a + columns + k, a + k)]
    with open(path, "w", encoding="utf-8") as f:
        f.write("".join("v %.9g %.9g %.9g\n" % v for v in vertices) + "".join("f %d %d %d\n" % t for t in faces))
    return len(faces)


def seconds(command, rounds):
    best = math.inf
    for _ in range(rounds):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        best = min(best, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return best


def peak(command):
    """Megabytes of the program alone (VmHWM of Linux): what a parent's children used holds the parent's, too."""
    most = 0
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as program:
        while program.poll() is None:
            with open("/proc/%d/status" % program.pid, encoding="utf-8") as status:
                most = max([most] + [int(line.split()[1]) for line in status if line.startswith("VmHWM")])
            time.sleep(.002)
    return most / 1024


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("-b", "--importon", default=os.path.join(os.path.dirname(here), "build/cli/importon"))
    ap.add_argument("--triangles", type=int, nargs="+", default=[1000, 10000, 100000, 1000000])
    ap.add_argument("--spp", type=int, default=16)
    ap.add_argument("--rounds", type=int, default=3)
    a = ap.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scene, seen = os.path.join(folder, "scene.xml"), os.path.join(folder, "seen.exr")
        with open(scene, "w", encoding="utf-8") as f:
            f.write(SCENE)
        ball(os.path.join(folder, "ball.obj"), 1000)
        subprocess.run([a.importon, "render", scene, "-q", "-m", "mono", "--spp", "64", "-o", seen], check=True)
        common = ["-q", "-m", "mono", "-t", "1", "--spp", str(a.spp)]
        for n in a.triangles:
            n = ball(os.path.join(folder, "ball.obj"), n)
            picture = [a.importon, "render", scene, *common, "-o", os.path.join(folder, "picture.exr")]
            gradient = [a.importon, "gradient", scene, *common, "--target", seen, "-p", "ball.pose"]
            print("%d triangles: gradient %.3f s, %.0f MB, picture %.3f s, %.0f MB"
                  % (n, seconds(gradient, a.rounds), peak(gradient), seconds(picture, a.rounds), peak(picture)), flush=True)


if __name__ == "__main__":
    main()
