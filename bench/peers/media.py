# SPDX-License-Identifier: Apache-2.0
"""Media in importon and Mitsuba 3 (llvm_ad_rgb) in one run: pictures, and gradients of the
picture's mean with respect to every number of an extinction.

    python3 bench/peers/media.py [-b MEDIA] [--repeats N] [--spp N] [--cells N] [--runs N]

MEDIA is bench/media, which writes the scenes and measures importon on one thread;
Mitsuba's volpath and prbvolpath follow on one thread, kernels compiled beforehand. Seconds
are the processor's. The variance is that of the gradient, summed over its numbers: from
importon's standard errors, and from the spread of Mitsuba's N runs with other seeds.
Skips (77) without mitsuba.
"""
import argparse
import os
import re
import subprocess
import sys
import tempfile
import time

try:
    import drjit as dr
    import mitsuba as mi
    import numpy as np
except ImportError as e:
    print("SKIP: this python3 has no mitsuba or numpy (%s)" % e)
    sys.exit(77)

here = os.path.dirname(os.path.abspath(__file__))
NUMBERS = {"box": "smoke.sigma_t.value.value", "plume": "smoke.sigma_t.data"}


def mitsuba(folder, name, spp, runs):
    picture_scene = mi.load_file("%s/%s.xml" % (folder, name), integrator="volpath")
    scene = mi.load_file("%s/%s.xml" % (folder, name), integrator="prbvolpath")
    params = mi.traverse(scene)
    key = NUMBERS[name]
    picture, gradient, values = [], [], []
    for seed in range(runs + 1):  # the first compiles
        start = time.process_time()
        image = mi.render(picture_scene, spp=spp, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        picture.append(time.process_time() - start)
        dr.enable_grad(params[key])
        params.update()
        start = time.process_time()
        image = mi.render(scene, params, spp=spp, seed=seed + 100, seed_grad=seed + 1000)
        dr.backward(dr.mean(image, axis=None))
        values.append(np.array(dr.grad(params[key])).ravel().astype(float))
        gradient.append(time.process_time() - start)
        dr.disable_grad(params[key])
    spread = np.array(values[1:]).var(axis=0, ddof=1).sum()
    return min(picture[1:]), min(gradient[1:]), spread


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("-b", "--bench", default=os.path.join(here, "../../build/bench/media"))
    ap.add_argument("--repeats", type=int, default=3)
    ap.add_argument("--spp", type=int, default=32)
    ap.add_argument("--cells", type=int, default=64)
    ap.add_argument("--runs", type=int, default=12)
    a = ap.parse_args()
    mi.set_variant("llvm_ad_rgb")
    dr.set_thread_count(1)
    with tempfile.TemporaryDirectory() as folder:
        text = subprocess.run([a.bench, folder, str(a.repeats), str(a.spp), str(a.cells)],
                              check=True, capture_output=True, text=True).stdout
        sys.stdout.write(text)
        row = r"^(\w+) picture (\S+) gradient (\S+) variance (\S+)$"
        for name, *numbers in re.findall(row, text, re.MULTILINE):
            ours = [float(x) for x in numbers]
            theirs = mitsuba(folder, name, a.spp, a.runs)
            print("%s: Mitsuba picture %.4g s, gradient %.4g s (%.2f pictures), variance %.3g; "
                  "variance x time, importon/Mitsuba %.3g"
                  % (name, *theirs[:2], theirs[1] / theirs[0], theirs[2],
                     ours[1] * ours[2] / (theirs[1] * theirs[2])))


if __name__ == "__main__":
    main()
