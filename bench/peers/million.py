# SPDX-License-Identifier: Apache-2.0
"""A scene of a million triangles with textures, an environment, rough glass and instances, beside Mitsuba 3.

    python3 bench/peers/million.py [-i IMPORTON] [--repeats N] [--rows N]

Seconds from process start to a picture of one sample (32 x 32), peak memory, and its bytes a triangle (what a scene of the same
things with 8,000 triangles takes is left out); then processor seconds of a picture of 64 samples with everything
loaded, less those of the first. Two balls of a half million triangles (1.01 million in all) under normals and uv: one with a
texture of 1024 x 1024, one of rough glass; four instances of a third (8,000); an environment of 1024 x 512. Both
programs use one thread and take turns; Mitsuba is llvm_ad_rgb, whose kernels are on disk from a first run that does not count.
"""
import argparse
import os
import statistics
import subprocess
import sys
import tempfile

import needed

needed.modules("mitsuba", "numpy")

import meshes

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))

SCENE = """<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='8'/></integrator>
<sensor type='perspective' id='eye'><float name='fov' value='40'/><transform name='to_world'>
<lookat origin='0,3,-9' target='0,0.6,0' up='0,1,0'/></transform><sampler type='independent'>
<integer name='sample_count' value='1'/></sampler><film type='hdrfilm'><integer name='width' value='32'/>
<integer name='height' value='32'/><rfilter type='box'/></film></sensor>
<emitter type='envmap'><string name='filename' value='sky.pfm'/></emitter>
<bsdf type='diffuse' id='clay'><texture type='bitmap' name='reflectance'><string name='filename' value='clay.pfm'/>
<boolean name='raw' value='true'/></texture></bsdf>
<bsdf type='roughdielectric' id='glass'><float name='alpha' value='0.1'/><float name='int_ior' value='1.5'/></bsdf>
<bsdf type='roughconductor' id='metal'><string name='material' value='Cu'/><float name='alpha' value='.2'/></bsdf>
<shape type='rectangle'><transform name='to_world'><scale value='8'/><rotate x='1' angle='-90'/></transform><ref id='clay'/></shape>
<shape type='ply'><string name='filename' value='NAME.ply'/><transform name='to_world'><translate x='-1.2' y='1'/>
</transform><ref id='clay'/></shape>
<shape type='ply'><string name='filename' value='NAME.ply'/><transform name='to_world'><translate x='1.2' y='1'/>
</transform><ref id='glass'/></shape>
<shape type='shapegroup' id='group'><shape type='ply'><string name='filename' value='small.ply'/><ref id='metal'/></shape>
</shape>INSTANCES</scene>"""
PLACE = """<shape type='instance'><ref id='group'/><transform name='to_world'><scale value='.4'/>
<translate x='%g' y='.4' z='-1.5'/></transform></shape>"""

PEER = """
import sys, mitsuba as mi, drjit as dr, numpy as np
mi.set_variant("llvm_ad_rgb")
scene = mi.load_file(sys.argv[1])
dr.set_thread_count(1)
np.array(mi.render(scene, spp=int(sys.argv[2]))).tofile(sys.argv[3])  # its own writer waits for ever on one thread
"""


def measured(command, file):
    """Seconds on the clock, of processors, and peak memory of a process. Another process takes them: what a
    child of this one shares with it before it runs the command would count as its memory."""
    text = ("import os,resource,subprocess,sys,time; s=time.perf_counter(); subprocess.run(sys.argv[1:],check=True,"
            "stdout=subprocess.DEVNULL); u=resource.getrusage(resource.RUSAGE_CHILDREN);"
            "print(time.perf_counter()-s,u.ru_utime+u.ru_stime,u.ru_maxrss*1024)")
    out = subprocess.run([sys.executable, "-c", text, *command, file], check=True, stdout=subprocess.PIPE, text=True)
    return [float(x) for x in out.stdout.split()]


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    ap.add_argument("--repeats", type=int, default=5)
    ap.add_argument("--rows", type=int, default=355)
    a = ap.parse_args()
    a.importon = os.path.abspath(a.importon)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        each = {"large": meshes.ball("large.ply", a.rows), "small": meshes.ball("small.ply", 45)}
        meshes.picture("clay.pfm", 1024, 1024, 1)
        meshes.picture("sky.pfm", 512, 1024, 2)
        for name in each:
            with open(name + ".xml", "w", encoding="utf-8") as file:
                file.write(SCENE.replace("NAME", name).replace("INSTANCES", "".join(PLACE % x for x in (-3, -1, 1, 3))))
        own = [a.importon, "render", "-t", "1", "-q", "--no-preview"]
        commands = {
            "importon": lambda name, spp: own + [name + ".xml", "--spp", str(spp), "-o"],
            "Mitsuba": lambda name, spp: [sys.executable, "-c", PEER, name + ".xml", str(spp)],
        }
        rows = {(p, name, spp): [] for p in commands for name in each for spp in (1, 64)}
        for k in range(a.repeats + 1):
            for key in rows:
                got = measured(commands[key[0]](*key[1:]), key[0] + ".exr")
                if k:
                    rows[key].append(got)
        for p in commands:
            first, small, more = (list(map(statistics.median, zip(*rows[p, n, s])))
                                  for n, s in (("large", 1), ("small", 1), ("large", 64)))
            triangles = 2 * (each["large"] - each["small"])
            print("%-9s first picture %.3g s (processor %.3g s), memory %.4g MB, %.4g bytes a triangle, 63 samples more %.3g s" %
                  (p, first[0], first[1], first[2] / 1e6, (first[2] - small[2]) / triangles, more[1] - first[1]))
        ratio = [statistics.median(y[i] for y in rows["Mitsuba", "large", 1]) /
                 statistics.median(x[i] for x in rows["importon", "large", 1]) for i in range(3)]
        print("Mitsuba / importon: first picture %.3g (processor %.3g), memory %.3g" % tuple(ratio))


if __name__ == "__main__":
    main()
