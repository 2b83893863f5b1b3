#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Pictures of few triangles by two builds of the program beside each other, say with and without src/scene/facets.c.

    bench/facets.py [--rounds N] [--spp S] OLD NEW

OLD and NEW are paths of two cli/importon. The scenes, under an even sky: cubes turned and scattered, and loose triangles.
Processor seconds (user) of one thread, minima of N rounds in turn.
"""
import argparse
import os
import random
import resource
import subprocess
import tempfile

HEAD = """<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="6"/></integrator>
<sensor type="perspective"><float name="fov" value="60"/>
<transform name="to_world"><lookat origin="0,0,3.9" target="0,0,0" up="0,1,0"/></transform>
<sampler type="independent"/><film type="hdrfilm"><integer name="width" value="96"/>
<integer name="height" value="96"/><rfilter type="box"/></film></sensor>
<emitter type="constant"><float name="radiance" value="1"/></emitter>"""


def cubes(n, rng):
    text = ""
    for _ in range(n):
        text += '<shape type="cube"><transform name="to_world"><scale value=".35"/><rotate y="1" angle="%g"/>' % (
            360 * rng.random())
        text += '<translate x="%g" y="%g" z="%g"/></transform></shape>' % tuple(rng.uniform(-1.3, 1.3) for _ in range(3))
    return text


def triangles(n, rng, folder):
    path = os.path.join(folder, "loose.obj")
    with open(path, "w", encoding="ascii") as f:
        for _ in range(n):
            at = [rng.uniform(-1, 1) for _ in range(3)]
            for _ in range(3):
                f.write("v %g %g %g\n" % tuple(c + rng.uniform(-0.6, 0.6) for c in at))
        for i in range(n):
            f.write("f %d %d %d\n" % (3 * i + 1, 3 * i + 2, 3 * i + 3))
    return ('<shape type="obj"><string name="filename" value="%s"/><bsdf type="twosided"><bsdf type="diffuse"/></bsdf>'
            '</shape>' % path)


def seconds(program, scene, spp):
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([program, "render", scene, "--spp", str(spp), "--threads", "1", "-q", "--no-preview", "-o",
                    os.path.join(os.path.dirname(scene), "picture.exr")], check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def main():
    ap = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    ap.add_argument("--rounds", type=int, default=5)
    ap.add_argument("--spp", type=int, default=400)
    ap.add_argument("old")
    ap.add_argument("new")
    args = ap.parse_args()
    print("| scene | triangles | old s | new s | new / old |\n|---|---|---|---|---|")
    for kind, counts in (("cubes", (1, 2, 4, 5)), ("loose triangles", (4, 16, 32))):
        for n in counts:
            rng = random.Random(n)
            with tempfile.TemporaryDirectory() as folder:
                scene = os.path.join(folder, "scene.xml")
                with open(scene, "w", encoding="ascii") as f:
                    f.write(HEAD + (cubes(n, rng) if kind == "cubes" else triangles(n, rng, folder)) + "</scene>")
                least = [min(s) for s in zip(*((seconds(args.old, scene, args.spp), seconds(args.new, scene, args.spp))
                                               for _ in range(args.rounds)))]
            print("| %s | %d | %.3f | %.3f | %.2f |" % (kind, n * (12 if kind == "cubes" else 1), *least,
                                                     least[1] / least[0]), flush=True)


if __name__ == "__main__":
    main()
