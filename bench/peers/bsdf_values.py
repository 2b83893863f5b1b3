# SPDX-License-Identifier: Apache-2.0
"""Values of Mitsuba's materials, direction by direction.

    python3 bench/peers/bsdf_values.py [-n ROWS] [-o tests/render/peer/bsdfs.txt]

For every shape of tests/render/peer/bsdfs.xml, a line `bsdf ID`, then lines

  smooth U V  WO  WI  F      value times cosine, at texture coordinates U V; WO towards the sensor
  delta  U V  WO  WI  C      a delta lobe that was drawn, and its coefficient

tests/render/bsdf_values.c compares them with importon's. Needs a python3 that can import
mitsuba; skips (77) without.
"""
import argparse
import os

import needed

mi, np = needed.modules("mitsuba", "numpy")

here = os.path.dirname(os.path.abspath(__file__))
SCENE = os.path.join(here, "../../tests/render/peer/bsdfs.xml")


def direction(rng):
    """Uniform on the sphere, not at the horizon: there single precision has few digits."""
    while True:
        v = rng.normal(size=3)
        v /= np.linalg.norm(v)
        if abs(v[2]) > 0.05:
            return v


def interaction(shape, uv, wo):
    """The point of a shape with these texture coordinates, as Mitsuba's own rays find it."""
    si = shape.eval_parameterization(mi.Point2f(*uv))
    si.wi = mi.Vector3f(*wo)
    return si


def text(*numbers):
    return " ".join("%.9g" % x for x in numbers)


def rows(shape, n, rng, out):
    bsdf, ctx = shape.bsdf(), mi.BSDFContext()
    for i in range(n):
        uv, wo, wi = rng.uniform(0.01, 0.99, 2), direction(rng), direction(rng)
        if i % 4 < 3:
            wo[2] = abs(wo[2])
        if i % 2:
            wi[2] = -wi[2] if wi[2] * wo[2] < 0 else wi[2]
        if i % 4 == 1:  # near the mirror direction, where lobes are
            wi = np.array([-wo[0], -wo[1], wo[2]]) + 0.1 * wi
            wi /= np.linalg.norm(wi)
        if i % 8 == 2:  # near what goes straight through
            wi = -wo + 0.3 * wi
            wi /= np.linalg.norm(wi)
        si = interaction(shape, uv, wo)
        f = bsdf.eval(ctx, si, mi.Vector3f(*wi))
        print("smooth", text(*uv, *wo, *wi, *f), file=out)
        found = []
        for k in range(8):
            bs, weight = bsdf.sample(ctx, si, (k + 0.5) / 8, mi.Point2f(0.3, 0.6))
            delta = mi.has_flag(mi.BSDFFlags(bs.sampled_type), mi.BSDFFlags.Delta) or \
                mi.has_flag(mi.BSDFFlags(bs.sampled_type), mi.BSDFFlags.Null)
            w = np.array(bs.wo)
            if bs.pdf > 0 and delta and not any(np.dot(w, o) > 0.99999 for o in found):
                found.append(w)
                print("delta", text(*uv, *wo, *w, *(np.array(weight) * bs.pdf)), file=out)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-n", type=int, default=32)
    parser.add_argument("-o", "--output", default="/dev/stdout")
    args = parser.parse_args()
    mi.set_variant("scalar_rgb")
    out = open(args.output, "w")
    print("# SPDX-License-Identifier: Apache-2.0", file=out)
    print("# Mitsuba %s, by bench/peers/bsdf_values.py" % mi.__version__, file=out)
    for shape in mi.load_file(SCENE, parallel=False, optimize=False).shapes():
        rng = np.random.default_rng(sum(map(ord, shape.id())))
        print("bsdf", shape.id(), file=out)
        rows(shape, args.n, rng, out)


if __name__ == "__main__":
    main()
