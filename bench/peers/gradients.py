# SPDX-License-Identifier: Apache-2.0
"""Do importon's and Mitsuba's gradients of a picture's mean agree?

    python3 bench/peers/gradients.py [-i IMPORTON] [--spp N] [--repeats N] [--json FILE]

Needs a python3 that can import mitsuba (llvm_ad_rgb); without it the script says so and skips
(exit 77). Mitsuba's side is `prb`, repeated with different seeds, whose spread gives its
standard errors; and central differences of its pictures with common seeds, for what prb
leaves out (lobes that are delta functions). importon brings its own standard errors.
"""
import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))
SCENE = os.path.join(root, "tests/render/peer/gradients.xml")

# importon's name, Mitsuba's key
PAIRS = [
    ("ground.reflectance.value", "floor.bsdf.reflectance.value"),
    ("paint.data", "painted.reflectance.data"),
    ("checks.color0.value", "card.brdf_0.reflectance.color0.value"),
    ("checks.color1.value", "card.brdf_0.reflectance.color1.value"),
    ("back.reflectance.value", "card.brdf_1.reflectance.value"),
    ("sky.radiance.value", "sky.radiance.value"),
    ("lamp.radiance.value", "lamp_panel.emitter.radiance.value"),
    ("bulb.intensity.value", "bulb.intensity.value"),
    ("glow.data", "sign_panel.emitter.radiance.data"),
    ("brass.alpha.value", "brass.alpha.value"),
    ("brass.eta.value", "brass.eta.value"),
    ("brass.k.value", "brass.k.value"),
    ("brass.specular_reflectance.value", "brass.specular_reflectance.value"),
    ("brushed.alpha_u.value", "brushed.alpha_u.value"),
    ("brushed.alpha_v.value", "brushed.alpha_v.value"),
    ("brushed.eta.value", "brushed.eta.value"),
    ("brushed.k.value", "brushed.k.value"),
    ("wear.data", "worn.alpha.data"),
    ("mirror.eta.value", "mirror.eta.value"),
    ("mirror.k.value", "mirror.k.value"),
    ("mirror.specular_reflectance.value", "mirror.specular_reflectance.value"),
    ("glass.specular_reflectance.value", "glass.specular_reflectance.value"),
    ("glass.specular_transmittance.value", "glass.specular_transmittance.value"),
]
DIFFERENCES = ["brass.alpha.value", "brushed.alpha_u.value", "mirror.eta.value",
               "mirror.k.value", "mirror.specular_reflectance.value",
               "glass.specular_reflectance.value", "glass.specular_transmittance.value"]
STEP = 0.02  # of differences, as a fraction of the value

import needed

mi, np = needed.modules("mitsuba", "numpy")


def texture_read(path):
    """Gradient of a bitmap and its standard errors, in the order of Mitsuba's data."""
    bitmap = mi.Bitmap(path)
    names = [f.name for f in bitmap.struct_()]
    pixels = np.array(bitmap, dtype=float).reshape(bitmap.size()[1], bitmap.size()[0], -1)
    order = [n for n in ("R", "G", "B", "Y") if n in names]
    return tuple(np.stack([pixels[:, :, names.index(k + n)] for n in order], -1).ravel()
                 for k in ("", "se."))


def importon_gradient(program, spp, seed):
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "gradient", SCENE, "--spp", str(spp), "--seed", str(seed),
                   "--json", "-q", "--textures", os.path.join(folder, "g")]
        out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        for p in json.loads(out)["params"]:
            if "grad" in p:
                found[p["name"]] = np.array(p["grad"]).ravel(), np.array(p["se"]).ravel()
            else:
                found[p["name"]] = texture_read(p["file"])
    return found


def statistics(samples):
    samples = np.array(samples)
    return samples.mean(0), samples.std(0, ddof=1) / math.sqrt(len(samples))


def mitsuba_prb(scene, params, keys, spp, repeats):
    import drjit as dr
    integrator = mi.load_dict({"type": "prb", "max_depth": 4})
    for k in keys:
        dr.enable_grad(params[k])
    params.update()
    samples = {k: [] for k in keys}
    for r in range(repeats):
        for k in keys:
            dr.clear_grad(params[k])
        image = mi.render(scene, params, integrator=integrator, spp=spp, seed=2 * r,
                          seed_grad=2 * r + 1)
        dr.backward(dr.mean(image, axis=None))
        for k in keys:
            samples[k].append(np.array(dr.grad(params[k]), dtype=float).ravel())
    for k in keys:
        dr.disable_grad(params[k])
    return {k: statistics(v) for k, v in samples.items()}


def mitsuba_difference(scene, params, key, spp, repeats):
    """Central difference of the mean, one number of the parameter at a time."""
    value = params[key]
    kind = type(value)
    flat = np.array(value, dtype=float).ravel()
    means, ses = [], []
    for i in range(flat.size):
        samples = []
        for r in range(repeats):
            ends = []
            for sign in (1, -1):
                moved = flat.copy()
                moved[i] += sign * STEP * flat[i]
                params[key] = kind(*moved.tolist()) if flat.size == 3 else kind(float(moved[0]))
                params.update()
                ends.append(np.array(mi.render(scene, spp=spp, seed=7000 + r),
                                     dtype=float).mean())
            samples.append((ends[0] - ends[1]) / (2 * STEP * flat[i]))
        mean, se = statistics(samples)
        means.append(mean)
        ses.append(se)
    params[key] = kind(*flat.tolist()) if flat.size == 3 else kind(float(flat[0]))
    params.update()
    return np.array(means), np.array(ses)


def row(name, method, own, peer):
    (a, a_se), (b, b_se) = own, peer
    if a.size != b.size:
        return {"name": name, "method": method, "sizes": [a.size, b.size], "agree": False}
    variance = a_se ** 2 + b_se ** 2 + (1e-5 * np.abs(b) + 1e-9) ** 2
    z = (a - b) / np.sqrt(variance)
    chi2 = float((z ** 2).mean())
    return {"name": name, "method": method, "numbers": int(a.size),
            "importon": float(a.sum()), "se": float(np.sqrt((a_se ** 2).sum())),
            "mitsuba": float(b.sum()), "mitsuba_se": float(np.sqrt((b_se ** 2).sum())),
            "worst_z": float(z[np.abs(z).argmax()]), "mean_z2": chi2,
            "none": bool((b == 0).all() and (a != 0).any()),
            "agree": bool(np.abs(z).max() < 4.5)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    parser.add_argument("--spp", type=int, default=4096)
    parser.add_argument("--repeats", type=int, default=24)
    parser.add_argument("--json")
    args = parser.parse_args()
    start = time.time()
    mi.set_variant("llvm_ad_rgb")
    own = importon_gradient(args.importon, args.spp, 5)
    own_s = time.time() - start
    scene = mi.load_file(SCENE, optimize=False)
    params = mi.traverse(scene)
    each = max(1, args.spp // args.repeats)
    start = time.time()
    prb = mitsuba_prb(scene, params, [k for _, k in PAIRS], each, args.repeats)
    prb_s = time.time() - start
    rows = [row(name, "prb", own[name], prb[key]) for name, key in PAIRS]
    keys = dict(PAIRS)
    for name in DIFFERENCES:
        rows.append(row(name, "difference", own[name],
                        mitsuba_difference(scene, params, keys[name], each, args.repeats)))
    bad = 0
    print("%-36s %-10s %3s %12s %9s %12s %9s %6s %6s" %
          ("parameter", "method", "n", "importon", "se", "mitsuba", "se", "worst", "z^2"))
    for r in rows:
        if "sizes" in r:
            print("%-36s sizes differ: %s" % (r["name"], r["sizes"]))
            bad += 1
            continue
        verdict = "no gradient in prb" if r["none"] else "" if r["agree"] else "DIFFERS"
        bad += not r["agree"] and not r["none"]
        print("%-36s %-10s %3d %12.5g %9.2g %12.5g %9.2g %6.2f %6.2f %s" %
              (r["name"], r["method"], r["numbers"], r["importon"], r["se"], r["mitsuba"],
               r["mitsuba_se"], r["worst_z"], r["mean_z2"], verdict))
    print("importon %.1f s, prb %.1f s" % (own_s, prb_s))
    if args.json:
        with open(args.json, "w") as file:
            json.dump({"mitsuba": mi.__version__, "rows": rows}, file, indent=1)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
