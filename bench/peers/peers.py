# SPDX-License-Identifier: Apache-2.0
"""importon and Mitsuba 3 on the same scene in the same run, as ratios.

    python3 bench/peers/peers.py [-i IMPORTON] [--repeats N] [--res N] [--spp N] [--json FILE]

Needs a python3 that can import mitsuba (PyPI); without it the script says so and skips (exit
77). Both renderers load scenes/cornell.xml. The two are timed in turn, A B A B ..., and the
median of the pairs' ratios is reported, for machines are noisy and differ: of seconds on the
clock, and of processor seconds, which a busy machine stretches less.

  picture    process start to picture on disk, 64 x 64, 4 samples per pixel
  render     a picture: importon's whole process, Mitsuba with scene loaded and kernels compiled
  gradient   the same of a squared loss with the gradient of all 15 numbers: `importon gradient
             --target`, Mitsuba's mi.render with prb and backward()

Variants: scalar_rgb (no gradients), llvm_ad_rgb (needs an LLVM that Dr.Jit accepts); a spectral one, like
llvm_ad_spectral, is beside importon's mode spectral. The means of the pictures' channels are compared too.
"""
import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))
SCENE = os.path.join(root, "scenes/cornell.xml")

import needed

mi, np = needed.modules("mitsuba", "numpy")

PICTURE = """
import sys
import mitsuba as mi
mi.set_variant(sys.argv[1])
mi.util.write_bitmap(sys.argv[3], mi.render(mi.load_file(sys.argv[2], res='64'), spp=4),
                     write_async=False)
"""


def clock(function):
    """Seconds on the clock, and of processors: this process's and its children's."""
    def cpu():
        child = resource.getrusage(resource.RUSAGE_CHILDREN)
        return time.process_time() + child.ru_utime + child.ru_stime
    start, cpu_start = time.perf_counter(), cpu()
    function()
    return time.perf_counter() - start, cpu() - cpu_start


def median(values):
    ordered = sorted(values)
    n = len(ordered)
    return ordered[n // 2] if n % 2 else (ordered[n // 2 - 1] + ordered[n // 2]) / 2


def run(command):
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def mode(variant):
    return ["-m", "spectral"] if "spectral" in variant else []


def time_pictures(program, variant, repeats, folder):
    """Pairs of seconds (importon, Mitsuba) from process start to picture."""
    own = [program, "render", SCENE] + mode(variant) + ["-D", "res=64", "--spp", "4", "-q", "--no-preview", "-o",
           os.path.join(folder, "own.exr")]
    peer = [sys.executable, "-c", PICTURE, variant, SCENE, os.path.join(folder, "peer.exr")]
    run(peer)  # compiled kernels are kept on disk; the first run makes them
    return [(clock(lambda: run(own)), clock(lambda: run(peer))) for _ in range(repeats)]


class Peer:
    """Mitsuba with the scene loaded, warm."""

    def __init__(self, variant, res, spp, target):
        mi.set_variant(variant)
        self.variant, self.spp, self.seed = variant, spp, 0
        self.scene = mi.load_file(SCENE, optimize=False, res=str(res))
        self.gradients = variant.startswith(("llvm_ad", "cuda_ad"))
        self.render()
        if self.gradients:
            import drjit as dr
            self.dr = dr
            self.params = mi.traverse(self.scene)
            self.keys = [k for k in self.params.keys()
                         if k.endswith((".reflectance.value", ".radiance.value", ".reflectance.values",
                                        ".radiance.values"))]
            self.integrator = mi.load_dict({"type": "prb", "max_depth": 6})
            self.target = mi.TensorXf(mi.Bitmap(target))
            for k in self.keys:
                dr.enable_grad(self.params[k])
            self.params.update()
            self.gradient()

    def render(self):
        self.seed += 1
        self.picture = np.array(mi.render(self.scene, spp=self.spp, seed=self.seed))

    def gradient(self):
        dr = self.dr
        self.seed += 2
        for k in self.keys:
            dr.clear_grad(self.params[k])
        image = mi.render(self.scene, self.params, integrator=self.integrator, spp=self.spp,
                          seed=self.seed, seed_grad=self.seed + 1)
        dr.backward(dr.sum(dr.square(image - self.target), axis=None) / 2)
        return [np.array(dr.grad(self.params[k])) for k in self.keys]


def ratios(pairs, name, variant, samples, unit):
    """pairs: ((wall, cpu) of importon, (wall, cpu) of Mitsuba)."""
    row = {"what": name, "variant": variant, "unit": unit, "pairs": pairs}
    for k, clock_name in enumerate(("wall", "cpu")):
        own, peer = median([a[k] for a, _ in pairs]), median([b[k] for _, b in pairs])
        row[clock_name] = {"importon_s": own, "mitsuba_s": peer,
                           "mitsuba_over_importon": median([b[k] / a[k] for a, b in pairs])}
        if samples:
            row[clock_name]["importon_samples_per_s"] = samples / own
            row[clock_name]["mitsuba_samples_per_s"] = samples / peer
    wall, cpu = row["wall"], row["cpu"]
    print("%-9s %-12s importon %8.3g s (cpu %8.3g)  mitsuba %8.3g s (cpu %8.3g)  ratio %6.3g "
          "(cpu %6.3g)  %s" %
          (name, variant, wall["importon_s"], cpu["importon_s"], wall["mitsuba_s"],
           cpu["mitsuba_s"], wall["mitsuba_over_importon"], cpu["mitsuba_over_importon"], unit),
          file=sys.stderr, flush=True)
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--res", type=int, default=256)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--variants", default="scalar_rgb,llvm_ad_rgb")
    parser.add_argument("--json", help="file; default standard output")
    args = parser.parse_args()
    rows = []
    for variant in args.variants.split(","):
        with tempfile.TemporaryDirectory() as folder:
            rows.append(ratios(time_pictures(args.importon, variant, args.repeats, folder),
                               "picture", variant, 64 * 64 * 4, "64 x 64, 4 spp, from start"))
            target = os.path.join(folder, "target.exr")
            common = [SCENE, "-D", "res=%d" % args.res, "-q"] + mode(variant)
            run([args.importon, "render", "--spp", "16", "--seed", "99", "--no-preview", "-o",
                 target] + common)
            spp = args.spp if variant != "scalar_rgb" else max(1, args.spp // 8)
            common += ["--spp", str(spp)]
            render = [args.importon, "render", "--no-preview", "-o",
                      os.path.join(folder, "own.exr")] + common
            gradient = [args.importon, "gradient", "-T", target] + common
            peer = Peer(variant, args.res, spp, target)
            renders, gradients = [], []
            for _ in range(args.repeats):
                renders.append((clock(lambda: run(render)), clock(peer.render)))
                if peer.gradients:
                    gradients.append((clock(lambda: run(gradient)), clock(peer.gradient)))
            own = np.array(mi.Bitmap(os.path.join(folder, "own.exr")))[..., :3].mean(axis=(0, 1))
        means = [float(v) for v in peer.picture[..., :3].mean(axis=(0, 1))]
        rows.append({"what": "mean", "variant": variant, "importon": [float(v) for v in own], "mitsuba": means})
        print("%-9s %-12s importon %s  mitsuba %s  ratio %s" %
              ("mean", variant, *(" ".join("%.5f" % v for v in x) for x in (own, means, own / means))),
              file=sys.stderr, flush=True)
        samples = args.res * args.res * spp
        unit = "%d x %d, %d spp" % (args.res, args.res, spp)
        rows.append(ratios(renders, "render", variant, samples, unit))
        if gradients:
            rows.append(ratios(gradients, "gradient", variant, samples, unit))
    report = {"scene": "scenes/cornell.xml", "mitsuba": mi.__version__,
              "importon": subprocess.run([args.importon, "--version"], capture_output=True,
                                         text=True).stdout.strip(),
              "cpus": os.cpu_count(), "machine": platform.machine(),
              "load_average": os.getloadavg()[0], "repeats": args.repeats, "rows": rows}
    text = json.dumps(report, indent=1)
    if args.json:
        with open(args.json, "w") as file:
            file.write(text + "\n")
    else:
        print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
