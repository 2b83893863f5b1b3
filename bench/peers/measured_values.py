# SPDX-License-Identifier: Apache-2.0
"""Values of Mitsuba's `measured`, direction by direction.

    build/tests/render/measured_values --write DIR
    python3 bench/peers/measured_values.py DIR [-n ROWS] [-o tests/render/peer/measured.txt]

For every file, a line `file NAME`, then lines

  value  WO  WI  F P     value times cosine, of three channels or at 450, 500, 550 and 600 nm, and density
  draw   WO  U1 U2  WI   the direction that these two numbers draw

WO towards the sensor. tests/render/measured_values.c compares them with importon's. Needs a python3
that can import mitsuba; skips (77) without.
"""
import argparse
import os
import sys

try:
    import mitsuba as mi
    import numpy as np
except ImportError as e:
    print("SKIP: this python3 has no mitsuba or numpy (%s)" % e, file=sys.stderr)
    sys.exit(77)

FILES = ["isotropic", "plain", "whole", "half", "quarter", "spectral", "half_spectral"]
# Mitsuba reads spectra in spectral modes alone, and rgb in no other than rgb.
SPECTRAL = {"spectral", "half_spectral"}


def upwards(rng, grazing):
    v = rng.normal(size=3)
    v[2] = abs(v[2]) * (0.15 if grazing else 1)
    v /= np.linalg.norm(v)
    return v


def text(*numbers):
    return " ".join("%.9g" % x for x in numbers)


def rows(bsdf, n, rng, spectral, out):
    ctx = mi.BSDFContext()
    for i in range(n):
        wo, wi, u = upwards(rng, i % 8 == 5), upwards(rng, i % 8 == 6), rng.uniform(0.02, 0.98, 2)
        if i % 3 == 0:  # near the mirror direction
            wi = np.array([-wo[0], -wo[1], wo[2]]) + 0.2 * wi
            wi /= np.linalg.norm(wi)
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(*wo)
        if spectral:
            si.wavelengths = [450, 500, 550, 600]
        f = np.array(bsdf.eval(ctx, si, mi.Vector3f(*wi)))
        print("value", text(*wo, *wi, *f, bsdf.pdf(ctx, si, mi.Vector3f(*wi))), file=out)
        bs, weight = bsdf.sample(ctx, si, 0.5, mi.Point2f(*u))
        print("draw", text(*wo, *u, *np.array(bs.wo)), file=out)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    parser.add_argument("-n", type=int, default=48)
    parser.add_argument("-o", "--output", default="/dev/stdout")
    args = parser.parse_args()
    out = open(args.output, "w")
    mi.set_variant("scalar_rgb")
    print("# SPDX-License-Identifier: Apache-2.0", file=out)
    print("# Mitsuba %s, by bench/peers/measured_values.py" % mi.__version__, file=out)
    for name in FILES:
        mi.set_variant("scalar_spectral" if name in SPECTRAL else "scalar_rgb")
        path = os.path.join(args.folder, name + ".bsdf")
        bsdf = mi.load_dict({"type": "measured", "filename": path})
        print("file", name, file=out)
        rows(bsdf, args.n, np.random.default_rng(sum(map(ord, name))), name in SPECTRAL, out)


if __name__ == "__main__":
    main()
