# SPDX-License-Identifier: Apache-2.0
"""Mitsuba's test scenes, rendered by importon and by the installed Mitsuba, in all colour modes.

    python3 bench/peers/foreign_scenes.py FOLDER [--modes rgb,mono,spectral] [--samples N] [NAME ...]

FOLDER holds scenes as Mitsuba's data repository has them: `KIND/test_WHAT_INTEGRATOR.xml`. No reference
pictures are needed: both programs render each scene, with the integrator that it names, and the test is that of
`importon compare` with the standard errors of both pictures, Mitsuba's by its parts of different seeds: X, Y and Z
of every pixel (R, G and B where the scene has no `moment`), and their means. Beside it the test as Mitsuba's own
tests make it, `importon compare --variance`, which takes Mitsuba's variance for both pictures. For `ptracer` the
reference is by `path`, as in Mitsuba's own tests.

A scene that Mitsuba refuses in a mode is not counted; one that only importon refuses counts as a difference.
Prints one line for each scene and mode, then a table (Markdown) and the counts. --json FILE adds the results
to those of earlier calls in that file, so that the scenes can be rendered in portions; --table prints the
table of such a file and renders nothing.
"""
import argparse
import glob
import json
import os
import subprocess
import sys
import tempfile

from zcompare import mi, np, root

PARTS = 32
MODES = ("rgb", "mono", "spectral")
FROM_RGB = np.array([[.412453, .357580, .180423], [.212671, .715160, .072169], [.019334, .119193, .950227]])


def scenes_of(folder, names):
    """[(name, path, integrator)] of the scenes whose names begin with one of `names`, or all."""
    found = []
    for path in sorted(glob.glob(os.path.join(folder, "*", "test_*.xml"))):
        name, integrator = os.path.basename(path)[len("test_"):-len(".xml")].rsplit("_", 1)
        if not names or any(name.startswith(n) for n in names):
            found.append((name, path, integrator))
    return found


def reference(path, mode, defines, samples):
    """Mitsuba's picture of about `samples` samples in PARTS parts: (channel -> mean, channel -> standard error,
    both [y][x], variance of one sample [y][x][colour] or None, samples per pixel). The variances, of X, Y and Z
    or, in mono, of Y, are made as those of Mitsuba's references, by the moments that the scene asks for."""
    mi.set_variant("llvm_ad_" + mode)
    scene = mi.load_file(path, optimize=False, **defines)
    sensor = scene.sensors()[0]
    pixels = sensor.film().crop_size()[0] * sensor.film().crop_size()[1]
    each = max(1, round(samples / pixels / PARTS))
    total = square = 0
    for k in range(PARTS):
        scene.integrator().render(scene, sensor, seed=1000 + k, spp=each, develop=True, evaluate=True)
        bitmap = sensor.film().bitmap(raw=False)
        picture = np.array(bitmap, dtype=np.float64).reshape(bitmap.size()[1], bitmap.size()[0], -1)
        total, square = total + picture, square + picture ** 2
    mean = total / PARTS
    error = np.sqrt(np.maximum(square / PARTS - mean ** 2, 0) / (PARTS - 1))
    names = [f.name for f in bitmap.struct_()]
    mean, error = ({n: x[:, :, k] for k, n in enumerate(names)} for x in (mean, error))
    seconds = [n for n in names if n.startswith("m2_")][:1 if mode == "mono" else 3]
    variance = np.stack([mean[n] - mean[n[3:]] ** 2 for n in seconds], -1) if seconds else None
    return mean, error, variance, each * PARTS


def write(path, channels):
    """channels: name -> [y][x]."""
    pixels = np.stack(list(channels.values()), -1).astype(np.float32)
    mi.Bitmap(pixels, mi.Bitmap.PixelFormat.MultiChannel, list(channels)).write(path)


def importon(args, *words):
    return subprocess.run([args.importon, *words], capture_output=True, text=True)


def compared(args, path, integrator, mode):
    """One scene in one mode: a result for the table."""
    defines = dict(d.split("=", 1) for d in args.define)
    try:
        peers = "path" if integrator == "ptracer" else integrator
        mean, error, variance, n_reference = reference(path, mode, {"integrator": peers, **defines},
                                                       args.samples * args.reference)
    except (RuntimeError, ValueError) as e:
        return {"peer_refuses": " ".join(str(e).split())}
    colours = [n for n in ("R", "G", "B", "Y") if n in mean]
    spp = max(1, round(args.samples / mean[colours[0]].size))
    with tempfile.TemporaryDirectory() as folder:
        own, peer, deviation = (os.path.join(folder, n + ".exr") for n in ("own", "peer", "variance"))
        defined = [w for n, v in {"integrator": integrator, **defines}.items() for w in ("-D", n + "=" + v)]
        own_path = os.path.join(args.own or args.folder, os.path.relpath(path, args.folder))
        run = importon(args, "render", own_path, *defined, "--spp", str(spp), "-m", mode, "--seed", str(args.seed),
                       "--points", "independent", "--se", "--no-preview", "--no-manifest", "-q", "-o", own)
        if run.returncode:
            return {"refused": run.stderr.strip().splitlines()[:1], "agree": False}
        kept = [n[3:] for n in mean if n.startswith("m2_")] if variance is not None and mode != "mono" else colours
        write(peer, {**{n: mean[n] for n in kept}, **{"se." + n: error[n] for n in kept}})
        r = json.loads(importon(args, "compare", "--json", own, peer).stdout)
        result = {"spp": spp, "spp_reference": n_reference, "agree": r["agree"], "mean_z": r["mean_z"],
                  "ratio": r["mean_test"] / r["mean_reference"], "failed": r["failing_fraction"],
                  "over2": r["over2_fraction"]}
        if variance is not None:
            if mode != "mono":  # the file is in R, G, B, from which `compare` has X, Y, Z
                variance = variance @ np.linalg.inv(FROM_RGB).T
            write(peer, {n: mean[n] for n in colours})
            write(deviation, {n: variance[:, :, k] for k, n in enumerate(colours)})
            result["by_variance"] = json.loads(importon(
                args, "compare", "--json", own, peer, "--variance", deviation, "--spp-test", str(spp), "--spp-ref",
                str(n_reference)).stdout)
    return result


def line(r):
    if "peer_refuses" in r:
        return "not by Mitsuba: " + r["peer_refuses"]
    if "refused" in r:
        return "REFUSED: %s" % r["refused"]
    by = r.get("by_variance")
    return "%s  mean z %.2f  ratio %.5f  failed %.4f  |z|>2 %.4f  by variance: %s  spp %d, %d" % (
        "agrees " if r["agree"] else "DIFFERS", r["mean_z"], r["ratio"], r["failed"], r["over2"],
        "%s %.2f %.4f" % (by["agree"], by["mean_z"], by["failing_fraction"]) if by else "-", r["spp"],
        r["spp_reference"])


def cell(r):
    if r is None:
        return ""
    if "peer_refuses" in r:
        return "not by Mitsuba"
    if "refused" in r:
        return "**refused**"
    text = "%.2f, %s" % (r["mean_z"], "0" if not r["failed"] else "%.2f %%" % (100 * r["failed"]))
    return text if r["agree"] else "**%s**" % text


def table(results):
    lines = ["| scene | rgb | mono | spectral |", "|---|---|---|---|"]
    for name in sorted({k.rsplit(" ", 1)[0] for k in results}):
        lines.append("| `%s` | %s |" % (name, " | ".join(cell(results.get(name + " " + m)) for m in MODES)))
    counted = [r for r in results.values() if "peer_refuses" not in r]
    lines.append("")
    lines.append("%d of %d scenes and modes that Mitsuba %s loads agree; it refuses %d." %
                 (sum(r["agree"] for r in counted), len(counted), mi.__version__, len(results) - len(counted)))
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    parser.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    parser.add_argument("--modes", default=",".join(MODES))
    parser.add_argument("--samples", type=float, default=2e6, help="samples of a picture (default 2e6)")
    parser.add_argument("--reference", type=float, default=4, help="times as many by Mitsuba (default 4)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-D", "--define", action="append", default=[], help="NAME=VALUE of the scenes, as res=24")
    parser.add_argument("--own", help="a copy of FOLDER that importon reads, as with a picture of sky_product.py for a sky")
    parser.add_argument("--json", help="file of results, to be extended")
    parser.add_argument("--table", action="store_true", help="only print the table of --json")
    parser.add_argument("names", nargs="*", help="which scenes (beginnings of names)")
    args = parser.parse_intermixed_args()
    results = {}
    if args.json and os.path.exists(args.json):
        with open(args.json) as file:
            results = json.load(file)
    for name, path, integrator in [] if args.table else scenes_of(args.folder, args.names):
        for mode in args.modes.split(","):
            r = compared(args, path, integrator, mode)
            results["%s %s" % (name, mode)] = r
            print("%-40s %-8s %s" % (name, mode, line(r)), flush=True)
            if args.json:
                with open(args.json, "w") as file:
                    json.dump(results, file, indent=1)
    print(table(results))
    return 0 if all(r.get("agree", True) for r in results.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
