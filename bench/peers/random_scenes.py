# SPDX-License-Identifier: Apache-2.0
"""Scenes at random in importon and in Mitsuba 3: have pictures and derivatives the same expectation?

    python3 bench/peers/random_scenes.py [-i IMPORTON] [--mode rgb|mono|spectral] [--spp N] [--runs N] [--gradients]
                                         [--json FILE] FIRST LAST

Scenes FIRST..LAST of random_parts.py. Of each picture the means of 16 blocks, channel by channel, over --runs runs of
each program with seeds of their own: Welch's test, two-sided; a scene differs if a block is beyond 4.5 normal deviates, or
the mean of the picture beyond 4; it is then run again with 8 times the samples and other seeds, and the second verdict counts.
--gradients: derivatives of the picture's mean as well, beside `prb` or `prbvolpath`: each number of a parameter with
up to 3, and the derivative along a parameter's own value of one with more.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

import random_parts
from gradients import texture_read
from zcompare import mi, np, root, stats


def welch(a, b):
    """Normal deviate with the two-sided probability of Welch's t; a, b [run][...]."""
    va, vb = a.var(0, ddof=1) / len(a), b.var(0, ddof=1) / len(b)
    rounding = (2e-6 * np.abs(b.mean(0)) + 1e-9) ** 2  # floats, in both files
    total = va + vb + rounding
    t = (a.mean(0) - b.mean(0)) / np.sqrt(total)
    dof = total ** 2 / (va ** 2 / (len(a) - 1) + vb ** 2 / (len(b) - 1) + 1e-300)
    p = 2 * stats.t.sf(np.abs(t), np.minimum(dof, 1e9))
    return np.sign(t) * stats.norm.isf(np.maximum(p, 1e-300) / 2)


def blocks(picture):
    """Means of 4 x 4 blocks of [y][x][channel]; of a picture too small for that, its mean."""
    h, w, c = picture.shape
    if h % 4 or w % 4:
        return picture.mean((0, 1)).reshape(1, c)
    return picture.reshape(4, h // 4, 4, w // 4, c).mean((1, 3)).reshape(16, c)


def own_pictures(program, scene, mode, spp, runs, seed, folder):
    out, found = os.path.join(folder, "own.exr"), []
    for k in range(runs):
        done = subprocess.run([program, "render", scene, "--spp", str(spp), "--seed", str(seed + k), "--no-preview", "-q",
                               "--points", "independent", "-t", "1", "-m", mode, "-o", out], capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError("importon: " + done.stderr.strip().splitlines()[-1])
        bitmap = mi.Bitmap(out)
        names = [f.name for f in bitmap.struct_()]
        pixels = np.array(bitmap, dtype=np.float64).reshape(bitmap.size()[1], bitmap.size()[0], -1)
        found.append(blocks(pixels[:, :, [names.index(n) for n in ("R", "G", "B", "Y") if n in names]]))
    return np.array(found)


def peer_pictures(scene, spp, runs, seed, integrator=None):
    found = []
    for k in range(runs):
        pixels = np.array(mi.render(scene, spp=spp, seed=seed + k, integrator=integrator), dtype=np.float64)
        found.append(blocks(pixels.reshape(pixels.shape[0], pixels.shape[1], -1)))
    return np.array(found)


def summed(grad, value):
    """What is compared of a parameter: its numbers, or the derivative along its value."""
    return grad if grad.size <= 3 else np.array([float((grad * value).sum())])


def own_gradients(program, scene, mode, spp, runs, seed, folder, values):
    found = {}
    for k in range(runs):
        done = subprocess.run([program, "gradient", scene, "--spp", str(spp), "--seed", str(seed + k), "-q", "--json", "-t", "1",
                               "-m", mode, "--textures", os.path.join(folder, "g")], capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError("importon gradient: " + done.stderr.strip().splitlines()[-1])
        for p in json.loads(done.stdout)["params"]:
            if "grad" not in p and not p["file"].endswith(".exr"):
                continue
            grad = np.array(p["grad"], dtype=float).ravel() if "grad" in p else texture_read(p["file"])[0]
            value = np.array(p["value"], dtype=float).ravel() if "value" in p else values.get(p["name"])
            if grad.size > 3 and (value is None or np.size(value) != grad.size):
                continue
            found.setdefault(p["name"], []).append(summed(grad, value))
    return {k: np.array(v) for k, v in found.items()}


def peer_gradients(scene, params, integrator, spp, runs, seed):
    import drjit as dr
    keys = [k for k in params.keys() if dr.is_diff_v(type(params[k])) and params.flags(k) & mi.ParamFlags.NonDifferentiable.value == 0
            and dr.is_float_v(type(params[k]))]
    keys = [k for k in keys if not k.startswith("_") and "to_world" not in k and "vertex_p" not in k and "vertex_n" not in k and "vertex_t" not in k]
    for k in keys:
        dr.enable_grad(params[k])
    params.update()
    found = {k: [] for k in keys}
    for r in range(runs):
        for k in keys:
            dr.clear_grad(params[k])
        image = mi.render(scene, params, integrator=integrator, spp=spp, seed=2 * (seed + r), seed_grad=2 * (seed + r) + 1)
        dr.backward(dr.mean(image, axis=None))
        for k in keys:
            found[k].append(summed(np.array(dr.grad(params[k]), dtype=float).ravel(), np.array(params[k], dtype=float).ravel()))
    return {k: np.array(v) for k, v in found.items()}


def derivative_integrator(text):
    import re
    kind = re.search(r'integrator type="(\w+)"', text)[1]
    depth = re.search(r'name="max_depth" value="(\d+)"', text)
    if kind == "ptracer":
        return None
    return mi.load_dict({"type": "prbvolpath" if kind == "volpath" else "prb", "max_depth": int(depth[1]) if depth else 2,
                         "hide_emitters": "hide_emitters" in text})


def look(program, seed, args, spp, first, folder):
    path, kinds = random_parts.make(seed, args.mode, folder)
    result = {"seed": seed, "mode": args.mode, "spp": spp, "runs": args.runs, "kinds": kinds}
    scene = mi.load_file(path, optimize=False)
    own = own_pictures(program, path, args.mode, spp, args.runs, first, folder)
    peer = peer_pictures(scene, spp, args.runs, 1000 + first)
    z, whole = welch(own, peer), welch(own.mean(1), peer.mean(1))
    result.update(worst=float(z.flat[np.abs(z).argmax()]), mean=float(whole[np.abs(whole).argmax()]), tests=int(z.size),
                  over2=int((np.abs(z) > 2).sum()), ratio=float(own.mean() / peer.mean()) if peer.mean() else None,
                  relative=float(np.hypot(own.mean((1, 2)).std(), peer.mean((1, 2)).std()) / np.sqrt(args.runs) / max(abs(peer.mean()), 1e-12)),
                  differs=bool(np.abs(z).max() > 4.5 or np.abs(whole).max() > 4))
    return result, path, scene


def gradients(program, args, spp, first, folder, path, scene, result):
    integrator = derivative_integrator(open(path).read())
    if integrator is None or scene.sensors()[0].film().size()[0] < 4:
        return
    # Is its picture that of the scene's integrator?
    runs = [peer_pictures(scene, spp, args.runs, 7000 + first), peer_pictures(scene, spp, args.runs, 8000 + first, integrator)]
    result["picture_of_prb"] = float(np.abs(welch(runs[1], runs[0])).max())
    if result["picture_of_prb"] > 5:
        return
    params = mi.traverse(scene)
    values = {k: np.array(params[k], dtype=float).ravel() for k in params.keys() if ".data" in k or "vertex_color" in k or "face_color" in k or k.endswith(".values")}
    own = own_gradients(program, path, args.mode, spp, args.runs, first, folder, values)
    peer = peer_gradients(scene, params, integrator, spp, args.runs, 5000 + first)
    result["parameters"] = {}
    for k in sorted(own.keys() & peer.keys()):
        a, b = own[k], peer[k]
        if a.shape != b.shape:
            result["parameters"][k] = {"sizes": [a.shape[1], b.shape[1]]}
            continue
        if args.mode == "spectral" and a.shape[1] == 3:
            continue  # coefficients of a spectrum there, a colour here
        z = welch(a, b)
        i = int(np.abs(z).argmax())
        result["parameters"][k] = {"z": float(z[i]), "own": float(a.mean(0)[i]), "peer": float(b.mean(0)[i]),
                                   "se": float(np.sqrt((a.var(0, ddof=1)[i] + b.var(0, ddof=1)[i]) / args.runs)),
                                   "none": bool((b == 0).all() and (a != 0).any())}
    result["own_only"] = sorted(own.keys() - peer.keys())
    result["peer_only"] = sorted(k for k in peer.keys() - own.keys() if (peer[k] != 0).any())
    result["gradients_differ"] = sorted(k for k, r in result["parameters"].items() if "z" in r and abs(r["z"]) > 4.5 and not r["none"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    parser.add_argument("--mode", default="rgb", choices=["rgb", "mono", "spectral"])
    parser.add_argument("--spp", type=int, default=512)
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--gradients", action="store_true")
    parser.add_argument("--json")
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    args = parser.parse_args()
    mi.set_variant("llvm_ad_" + args.mode)
    mi.set_log_level(mi.LogLevel.Error)
    bad = 0
    for seed in range(args.first, args.last + 1):
        with tempfile.TemporaryDirectory() as folder:
            try:
                result, path, scene = look(args.importon, seed, args, args.spp, 1, folder)
                if result["differs"]:
                    first = {k: result[k] for k in ("worst", "mean", "ratio")}
                    result, path, scene = look(args.importon, seed, args, 8 * args.spp, 500, folder)
                    result["first"] = first
                if args.gradients:
                    gradients(args.importon, args, args.spp, 1, folder, path, scene, result)
                    if result.get("gradients_differ"):
                        first = {k: result["parameters"][k] for k in result["gradients_differ"]}
                        gradients(args.importon, args, 8 * args.spp, 500, folder, path, scene, result)
                        result["first_gradients"] = first
            except (RuntimeError, ValueError, KeyError) as e:
                result = {"seed": seed, "mode": args.mode, "error": str(e)[-600:], "kinds": random_parts.make(seed, args.mode, folder)[1]}
        bad += "error" in result or result["differs"] or bool(result.get("gradients_differ"))
        if "error" in result:
            print("%4d ERROR %s" % (seed, result["error"]), flush=True)
        else:
            print("%4d %s worst %5.2f mean %5.2f ratio %.5f +- %.1e, %d of %d beyond 2%s" % (
                seed, "DIFFERS" if result["differs"] else "agrees ", result["worst"], result["mean"], result["ratio"] or 0, result["relative"],
                result["over2"], result["tests"],
                "" if "parameters" not in result else "; %d parameters, differ: %s" % (
                    len(result["parameters"]), {k: result["parameters"][k] for k in result["gradients_differ"]})), flush=True)
        if args.json:
            with open(args.json, "a") as f:
                print(json.dumps(result), file=f)
    print("%d of %d differ or fail" % (bad, args.last - args.first + 1))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
