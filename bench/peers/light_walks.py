# SPDX-License-Identifier: Apache-2.0
"""Light walks beside Mitsuba 3's ptracer: walks a second, and processor time to an error of 1 %.

    python3 bench/peers/light_walks.py [-i IMPORTON] [--spp N] [--runs N]

One scene for both: a floor under a small lamp, with and without a clear glass ball between them (caustic), and a camera.
Runs alternate, one thread each; the error is the root mean square over pixels of the spread of runs, over the mean value.
Times are processor seconds of a picture less those of one with a hundredth of the walks: no loading, no compiling. Needs
mitsuba (skips with 77), variant llvm_ad_rgb.
"""
import argparse
import os
import resource
import subprocess
import tempfile
import time

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))

import needed

dr, mi, np = needed.modules("drjit", "mitsuba", "numpy")

SCENE = """<scene version="3.0.0"><integrator type="ptracer"><integer name="max_depth" value="8"/>
<integer name="rr_depth" value="100"/></integrator>
<sensor type="perspective"><float name="fov" value="30"/><transform name="to_world"><lookat origin="0,3,4" target="0,0,1"
up="0,1,0"/></transform><film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="32"/>
<rfilter type="box"/></film></sensor>
<shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/></transform>
<bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><scale value="0.1"/><rotate x="1" angle="125"/><translate y="2.5" z="-2"/>
</transform><emitter type="area"><rgb name="radiance" value="50"/></emitter></shape>%s</scene>
"""
BALL = """<shape type="sphere"><float name="radius" value="0.6"/><point name="center" x="0" y="0.9" z="-0.4"/>
<bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf></shape>"""


def pfm(path):
    """A PFM file; mi.Bitmap waits for ever with one thread."""
    with open(path, "rb") as f:
        f.readline()
        width, height = map(int, f.readline().split())
        f.readline()
        return np.frombuffer(f.read(), "<f4").reshape(height, width, -1)[::-1]


def ours(importon, path, spp, seed, folder):
    out = os.path.join(folder, "a.pfm")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([importon, "render", path, "--spp", str(spp), "--seed", str(seed), "-t", "1", "-q", "-o", out],
                   check=True, capture_output=True, stdin=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return pfm(out), after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def theirs(scene, spp, seed):
    start = time.process_time()
    picture = np.array(mi.render(scene, spp=spp, seed=seed))
    return picture[..., :3], time.process_time() - start


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    ap.add_argument("--spp", type=int, default=400)
    ap.add_argument("--runs", type=int, default=8)
    a = ap.parse_args()
    mi.set_variant("llvm_ad_rgb")
    dr.set_thread_count(1)
    print("| scene | | walks/s | to 1 %, s | mean |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name, body in ("floor under a lamp", ""), ("glass ball (caustic)", BALL):
            path = os.path.join(folder, "scene.xml")
            with open(path, "w", encoding="utf-8") as f:
                f.write(SCENE % body)
            scene = mi.load_file(path)
            ways = {"importon": lambda spp, seed, p=path: ours(a.importon, p, spp, seed, folder),
                    "Mitsuba": lambda spp, seed, s=scene: theirs(s, spp, seed)}
            pictures, seconds = {w: [] for w in ways}, {w: [] for w in ways}
            few = max(a.spp // 100, 1)
            for way in ways.values():  # compiles
                way(a.spp, 1)
                way(few, 1)
            for run in range(a.runs):
                for w, way in ways.items():
                    none = way(few, 100 + run)[1]
                    picture, time_s = way(a.spp, 1 + run)
                    pictures[w].append(picture)
                    seconds[w].append((time_s - none) / (1 - few / a.spp))
            cost, rate = {}, {}
            for w in ways:
                stack, s = np.array(pictures[w]), float(np.median(seconds[w]))
                error = np.sqrt(stack.var(axis=0, ddof=1).mean()) / stack.mean()
                cost[w], rate[w] = s * (error / 0.01) ** 2, a.spp * 48 * 32 / s
                spread = stack.mean(axis=(1, 2, 3)).std(ddof=1) / a.runs ** 0.5
                print("| %s | %s | %.3g | %.3g | %.5g +- %.2g |" % (name, w, rate[w], cost[w], stack.mean(), spread))
            print("| %s | ratio | %.2f | %.2f | |" % (name, rate["importon"] / rate["Mitsuba"],
                                                     cost["importon"] / cost["Mitsuba"]))


if __name__ == "__main__":
    main()
