# SPDX-License-Identifier: Apache-2.0
"""Values, densities and draws of Mitsuba's materials, direction by direction.

    build/tests/render/drawn_values --write DIR
    python3 bench/peers/drawn_values.py DIR [-n ROWS] [-o tests/render/peer/drawn.txt]

For every scene DIR/NAME.xml, whose only shape has the material, a line `case NAME`, then lines

  value  WO  WI  F P     value times cosine, of three channels or at 450, 500, 550 and 600 nm, and density
  draw   WO  U0 U1 U2  WI   the direction that these numbers draw

WO towards the sensor. tests/render/drawn_values.c compares them with importon's. Needs a python3 that
can import mitsuba; skips (77) without.
"""
import argparse
import glob
import os

import needed

mi, np = needed.modules("mitsuba", "numpy")


def direction(rng, both, grazing):
    v = rng.normal(size=3)
    v[2] = (v[2] if both else abs(v[2])) * (0.15 if grazing else 1)
    return v / np.linalg.norm(v)


def text(*numbers):
    return " ".join("%.9g" % x for x in numbers)


def rows(bsdf, n, rng, spectral, both, out):
    ctx = mi.BSDFContext()
    for i in range(n):
        wo, wi = direction(rng, both and i % 4 == 3, i % 8 == 5), direction(rng, both, i % 8 == 6)
        u = rng.uniform(0.02, 0.98, 3)
        if i % 3 == 0:  # near the mirror direction
            wi = np.array([-wo[0], -wo[1], wo[2]]) + 0.2 * wi
            wi /= np.linalg.norm(wi)
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(*wo)
        if spectral:
            si.wavelengths = [450, 500, 550, 600]
        f = np.array(bsdf.eval(ctx, si, mi.Vector3f(*wi)))
        print("value", text(*wo, *wi, *f, bsdf.pdf(ctx, si, mi.Vector3f(*wi))), file=out)
        bs, weight = bsdf.sample(ctx, si, u[0], mi.Point2f(*u[1:]))
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
    print("# Mitsuba %s, by bench/peers/drawn_values.py" % mi.__version__, file=out)
    for path in sorted(glob.glob(os.path.join(args.folder, "*.xml"))):
        name = os.path.basename(path)[:-4]
        spectral = "spectral" in name
        mi.set_variant("scalar_spectral" if spectral else "scalar_rgb")
        bsdf = mi.load_file(path, parallel=False, optimize=False).shapes()[0].bsdf()
        print("case", name, file=out)
        rng = np.random.default_rng(sum(map(ord, name)))
        rows(bsdf, args.n, rng, spectral, name.startswith("hair"), out)


if __name__ == "__main__":
    main()
