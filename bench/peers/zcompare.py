# SPDX-License-Identifier: Apache-2.0
"""Do importon's and Mitsuba's pictures of a scene have the same expectation?

    python3 bench/peers/zcompare.py [-i IMPORTON] [--spp N] [--json FILE] [CASE ...]

Needs a python3 that can import mitsuba; without it the script says so and skips (exit 77).
Cases are lines of bench/peers/cases.txt: name, scene, options. Each renderer brings its own
variance: importon its standard errors, Mitsuba the spread of batches with different seeds.
The test of one pixel is Welch's; a picture agrees if no more pixels fail at 1 % over the
whole picture (Sidak) than 0.25 %, as Mitsuba's own tests ask, and if the picture's mean is
within 4 standard errors in every channel.
"""
import argparse
import json
import os
import shlex
import subprocess
import sys
import tempfile
import time

import needed

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))
BATCHES = 32


def mitsuba_import():
    return needed.modules("mitsuba", "numpy", "scipy.stats")


mi, np, stats = mitsuba_import()


def importon_render(program, case, spp, seed, out):
    """Mean and standard error of every channel of importon's picture."""
    command = [program, "render", case.scene, "--spp", str(spp), "--seed", str(seed), "--se",
               "--points", "independent",  # a normal error for every pixel, which sets have not
               "--no-preview", "-q", "-m", case.mode, "-s", str(case.sensor), "-o", out]
    for d in case.defines:
        command += ["-D", d]
    start = time.time()
    subprocess.run(command, check=True, stderr=subprocess.PIPE, text=True)
    seconds = time.time() - start
    bitmap = mi.Bitmap(out)
    names = [f.name for f in bitmap.struct_()]
    pixels = np.array(bitmap, dtype=np.float64)
    if pixels.ndim == 2:
        pixels = pixels[:, :, None]
    pick = {n: pixels[:, :, k] for k, n in enumerate(names)}
    means = [n for n in names if not n.startswith("se.")]
    return ({n: pick[n] for n in means}, {n: pick["se." + n] for n in means}, seconds)


def mitsuba_render(case, spp):
    """Batches of Mitsuba's picture: channel -> [batch][row][column]."""
    mi.set_variant("llvm_ad_" + case.mode)
    define = dict(d.split("=", 1) for d in case.defines)
    start = time.time()
    scene = mi.load_file(case.scene, optimize=False, **define)
    sensor = scene.sensors()[case.sensor]
    each = max(1, spp // BATCHES)
    batches, names = [], None
    for k in range(BATCHES):
        scene.integrator().render(scene, sensor, seed=1000 + k, spp=each, develop=True,
                                  evaluate=True)
        bitmap = sensor.film().bitmap(raw=False)
        if names is None:
            names = [f.name for f in bitmap.struct_()]
        pixels = np.array(bitmap, dtype=np.float64)
        batches.append(pixels[:, :, None] if pixels.ndim == 2 else pixels)
    stack = np.array(batches)
    seconds = time.time() - start
    return {n: stack[:, :, :, k] for k, n in enumerate(names)}, each * BATCHES, seconds


def z_equivalent(difference, variance_a, variance_b, dof_b):
    """z with the same two-sided probability as Welch's t."""
    total = variance_a + variance_b
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(total > 0, difference / np.sqrt(total), 0)
        dof = np.where(variance_b > 0, dof_b * (total / variance_b) ** 2, 1e9)
    p = 2 * stats.t.sf(np.abs(t), np.minimum(dof, 1e9))
    return np.sign(t) * stats.norm.isf(np.maximum(p, 1e-300) / 2)


# Mitsuba computes in floats, and so does the file: differences below are not told apart.
def rounding(x):
    return (2e-5 * np.abs(x) + 1e-6) ** 2


def compare(mean, se, batches, wide):
    """Per channel: z of the picture's mean, share of failing pixels, share of |z| > 2. With a
    wide filter pixels share samples: the mean's error is taken from Mitsuba's batches."""
    result = {}
    for name, stack in batches.items():
        if name not in mean:
            result[name] = {"missing": True, "agree": False}
            continue
        a, reference = mean[name], stack.mean(0)
        if a.shape != reference.shape:
            result[name] = {"shape": [a.shape, reference.shape], "agree": False}
            continue
        n = stack.shape[0]
        variance_b = stack.var(0, ddof=1) / n
        z = z_equivalent(a - reference, se[name] ** 2 + rounding(reference), variance_b, n - 1)
        alpha = 1 - (1 - 0.01) ** (1 / z.size)
        failed = np.abs(z) > stats.norm.isf(alpha / 2)
        whole_b = stack.mean((1, 2))
        whole_a, whole_se = a.mean(), np.sqrt((se[name] ** 2).sum()) / a.size
        if wide:
            whole_se = whole_b.std(ddof=1) / np.sqrt(n)
        mean_z = float(z_equivalent(np.array(whole_a - whole_b.mean()),
                                    np.array(whole_se ** 2 + rounding(whole_a)),
                                    np.array(whole_b.var(ddof=1) / n), n - 1))
        noisy = variance_b > 0
        result[name] = {
            "mean_importon": float(whole_a), "mean_mitsuba": float(whole_b.mean()),
            "se": float(np.hypot(whole_se, whole_b.std(ddof=1) / np.sqrt(n))),
            "mean_z": mean_z, "failed": float(failed.mean()),
            "over2": float((np.abs(z[noisy]) > 2).mean()) if noisy.any() else 0.0,
            "worst": [int(k) for k in np.unravel_index(np.abs(z).argmax(), z.shape)],
            "worst_z": float(z.flat[np.abs(z).argmax()]),
            "agree": bool(abs(mean_z) < 4 and failed.mean() <= 0.0025)}
    return result


class Case:
    def __init__(self, name, words):
        self.name, self.mode, self.sensor, self.defines, self.spp = name, "rgb", 0, [], None
        self.skip, self.wide = [], False
        self.scene = words[0] if os.path.isabs(words[0]) else os.path.join(root, words[0])
        for w in words[1:]:
            if w in ("mono", "spectral"):
                self.mode = w
            elif w == "wide":
                self.wide = True
            elif w.startswith("sensor:"):
                self.sensor = int(w[7:])
            elif w.startswith("spp:"):
                self.spp = int(w[4:])
            elif w.startswith("skip:"):
                self.skip = w[5:].split(",")
            else:
                self.defines.append(w)


def cases_read(path):
    cases = []
    with open(path) as file:
        for line in file:
            words = shlex.split(line, comments=True)
            if words:
                cases.append(Case(words[0], words[1:]))
    return cases


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    parser.add_argument("--cases", default=os.path.join(here, "cases.txt"))
    parser.add_argument("--spp", type=int, default=2048)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", help="write all numbers to this file")
    parser.add_argument("--keep", help="folder for difference pictures (npz)")
    parser.add_argument("names", nargs="*", help="which cases (beginnings of names)")
    args = parser.parse_args()
    report, bad = {}, 0
    for case in cases_read(args.cases):
        if args.names and not any(case.name.startswith(n) for n in args.names):
            continue
        spp = case.spp or args.spp
        try:
            with tempfile.TemporaryDirectory() as folder:
                mean, se, own_s = importon_render(args.importon, case, spp, args.seed,
                                                  os.path.join(folder, "x.exr"))
            batches, n, peer_s = mitsuba_render(case, spp)
        except (subprocess.CalledProcessError, RuntimeError) as e:
            print("%-28s FAILED TO RENDER: %s" % (case.name, getattr(e, "stderr", None) or e))
            report[case.name] = {"error": str(e)}
            bad += 1
            continue
        rows = {k: r for k, r in compare(mean, se, batches, case.wide).items() if k not in case.skip}
        if args.keep:
            os.makedirs(args.keep, exist_ok=True)
            np.savez(os.path.join(args.keep, case.name + ".npz"),
                     **{"a_" + k: v for k, v in mean.items()},
                     **{"ase_" + k: v for k, v in se.items()},
                     **{"b_" + k: v.mean(0) for k, v in batches.items()},
                     **{"bse_" + k: v.std(0, ddof=1) / np.sqrt(len(v))
                        for k, v in batches.items()})
        agree = all(r["agree"] for r in rows.values())
        bad += not agree
        full = [r for r in rows.values() if "mean_z" in r]
        print("%-28s %s  mean z %5.2f  failed %.4f  |z|>2 %.4f  spp %d  %.1f s, %.1f s" %
              (case.name, "agrees  " if agree else "DIFFERS ",
               max((r["mean_z"] for r in full), key=abs, default=float("nan")),
               max((r["failed"] for r in full), default=1.0),
               max((r["over2"] for r in full), default=1.0), n, own_s, peer_s), flush=True)
        if not agree:
            for k, r in rows.items():
                if not r["agree"]:
                    print("    %s: %s" % (k, json.dumps(r)))
        report[case.name] = {"spp": n, "agree": agree, "channels": rows}
    if args.json:
        with open(args.json, "w") as file:
            json.dump({"mitsuba": mi.__version__, "cases": report}, file, indent=1)
    print("%d of %d cases agree" % (len(report) - bad, len(report)))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
