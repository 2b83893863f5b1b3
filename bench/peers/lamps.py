# SPDX-License-Identifier: Apache-2.0
"""Many lamps beside Mitsuba 3, which chooses among lights by their weights: variance times processor time.

    python3 bench/peers/lamps.py [-b BENCH] [--spp N]

BENCH is build/bench/lamps, whose scenes and rows are taken. Needs mitsuba (skips with 77), variant llvm_ad_rgb, and
scalar_rgb for 10,000 lights, which llvm_ad_rgb compiles for many minutes.
"""
import argparse
import os
import re
import subprocess
import sys
import tempfile
import time

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))

import needed

dr, mi, np = needed.modules("drjit", "mitsuba", "numpy")


def measured(path, spp, pictures=8):
    """Mean, processor seconds of a picture with kernels compiled, and variance of one sample."""
    mi.set_variant("scalar_rgb" if "10000" in path else "llvm_ad_rgb")
    text = re.sub(r"<string name='light_choice'[^>]*/>", "", open(path, encoding="utf-8").read())
    scene = mi.load_string(text)
    stack, best = [], float("inf")
    for k in range(pictures + 1):
        start = time.process_time()
        stack.append(np.array(mi.render(scene, spp=spp, seed=k)))
        if k:
            best = min(best, time.process_time() - start)
    stack = np.array(stack)
    return stack.mean(), best, stack.var(axis=0, ddof=1).mean() * spp


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("-b", "--bench", default=os.path.join(root, "build/bench/lamps"))
    ap.add_argument("--spp", type=int, default=256)
    a = ap.parse_args()
    dr.set_thread_count(1)
    with tempfile.TemporaryDirectory() as folder:
        text = subprocess.run([a.bench, folder, "--spp", str(a.spp)], check=True, capture_output=True,
                              text=True).stdout
        sys.stdout.write(text)
        row = r"^(\w+?\d+) (\w+) mean (\S+) picture (\S+) variance (\S+)"
        theirs = {}
        for name, way, mean, seconds, variance in re.findall(row, text, re.MULTILINE):
            more = 8 if name.endswith("10000") else 1
            if name not in theirs:
                theirs[name] = measured("%s/%s_weights.xml" % (folder, name), a.spp * more)
                print("%s: Mitsuba mean %.5g, picture %.4g s, variance %.4g" % (name, *theirs[name]))
            ratio = float(variance) * float(seconds) / (theirs[name][1] * theirs[name][2])
            print("%s %s: variance x time, importon/Mitsuba %.3g" % (name, way, ratio))


if __name__ == "__main__":
    main()
