# SPDX-License-Identifier: Apache-2.0
"""Mitsuba's numbers as a regression test that needs no Mitsuba.

    python3 bench/peers/stored.py [--spp N] [-o tests/render/peer/mitsuba.txt] [CASE ...]

For cases of bench/peers/cases.txt (default: those below), the mean over each quarter of Mitsuba's
picture (top left, top right, bottom left, bottom right), channel by channel, with standard errors
from batches of different seeds. tests/render/mitsuba.c compares importon's pictures with them.
Needs a python3 that can import mitsuba; skips (77) without.
"""
import argparse
import os
import sys

import zcompare
from zcompare import mi, np

CASES = ["stage", "stage_mono", "shapes", "shapes_flip", "shapes_mirror", "meshes", "lights",
         "lights_mono", "rough_ggx", "rough_beckmann", "alphas", "metals", "metals_mono", "glass",
         "twosided", "textures", "textures_nearest", "textures_mirror", "textures_raw",
         "emission_forms", "reflectance_forms", "sensor_0", "sensor_4", "sensor_9", "spots",
         "spots_mono", "directional", "projector", "stage_spectral", "rough_spectral", "glass_spectral",
         "textures_spectral", "emission_forms_spectral", "reflectance_forms_spectral", "sky_spectral",
         "attributes", "attributes_mono", "bumps", "bumps_nearest", "bumps_curves", "bumps_instances",
         "beam", "beam_disk", "curves_bspline", "curves_linear", "batch"]


def quarters(stack):
    h, w = stack.shape[1] // 2, stack.shape[2] // 2
    parts = [stack[:, :h, :w], stack[:, :h, w:], stack[:, h:, :w], stack[:, h:, w:]]
    return [p.mean((1, 2)) for p in parts]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--spp", type=int, default=2048)
    parser.add_argument("names", nargs="*")
    parser.add_argument("-o", "--output", default="/dev/stdout")
    args = parser.parse_args()
    out = open(args.output, "w")  # Mitsuba itself talks on standard output
    print("# SPDX-License-Identifier: Apache-2.0", file=out)
    print("# Mitsuba %s, by bench/peers/stored.py; quarters: mean and standard error" %
          mi.__version__, file=out)
    for case in zcompare.cases_read(os.path.join(zcompare.here, "cases.txt")):
        if case.name not in (args.names or CASES) or case.wide:
            continue
        batches, n, seconds = zcompare.mitsuba_render(case, args.spp)
        print("%s: %d samples, %.0f s" % (case.name, n, seconds), file=sys.stderr)
        print("case %s %s %s %d %s" % (case.name, os.path.relpath(case.scene, zcompare.root),
                                       case.mode, case.sensor, " ".join(case.defines)),
              file=out)
        for name, stack in batches.items():
            if name in case.skip:
                continue
            numbers = []
            for part in quarters(stack):
                numbers += ["%.7g %.2g" % (part.mean(), part.std(ddof=1) / np.sqrt(len(part)))]
            print("channel %s %s" % (name, " ".join(numbers)), file=out)


if __name__ == "__main__":
    main()
