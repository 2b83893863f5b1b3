# SPDX-License-Identifier: Apache-2.0
"""Mitsuba's test scenes, rendered by importon and by the installed Mitsuba, in all colour modes.

    python3 bench/peers/foreign_scenes.py FOLDER [--modes rgb,mono,spectral] [--samples N] [NAME ...]

FOLDER holds scenes as Mitsuba's data repository has them: `KIND/test_WHAT_INTEGRATOR.xml`. No reference
pictures are needed: both programs render each scene, with the integrator that it names, and Mitsuba's picture
and variances are made as its references are, by `moment`. The test is that of `importon compare --variance`:
X, Y and Z of every pixel, and their means. For `ptracer` the reference is by `path`, as in Mitsuba's own tests.

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


def reference(path, mode, integrator, samples):
    """Mitsuba's picture of about `samples` samples: (colours [y][x][c], variance of one sample of X, Y, Z or,
    in mono, of Y, samples per pixel). The moments are those of Mitsuba's own integrator for them."""
    mi.set_variant("llvm_ad_" + mode)
    scene = mi.load_file(path, optimize=False, integrator=integrator)
    moment = scene.integrator()
    if moment.class_name() != "MomentIntegrator":
        moment = mi.load_dict({"type": "moment", "nested": moment})
    sensor = scene.sensors()[0]
    size = sensor.film().crop_size()
    each = max(1, min(round(samples / (size[0] * size[1])), (1 << 23) // (size[0] * size[1])))
    parts = max(1, round(samples / (size[0] * size[1] * each)))
    total = 0
    for k in range(parts):
        moment.render(scene, sensor, seed=1000 + k, spp=each, develop=True, evaluate=True)
        bitmap = sensor.film().bitmap(raw=False)
        total = total + np.array(bitmap, dtype=np.float64)
    total /= parts
    at = {f.name: k for k, f in enumerate(bitmap.struct_())}
    pick = lambda names: np.stack([total[:, :, at[n]] for n in names], -1)
    first = [n for n in at if n.startswith("m2_")]
    value = [n[len("m2_"):] for n in first]
    variance = np.maximum(pick(first) - pick(value) ** 2, 0)
    colours = [n for n in ("R", "G", "B", "Y") if n in at][:3]
    return pick(colours), variance, each * parts


def write(path, pixels):
    """Pictures of one channel are Y, those of three R, G, B."""
    kind = mi.Bitmap.PixelFormat.Y if pixels.shape[2] == 1 else mi.Bitmap.PixelFormat.RGB
    mi.Bitmap(np.ascontiguousarray(pixels, dtype=np.float32), kind).write(path)


def compared(args, path, integrator, mode):
    """One scene in one mode: a result for the table."""
    try:
        peers = "path" if integrator == "ptracer" else integrator
        colours, variance, n_reference = reference(path, mode, peers, args.samples * args.reference)
    except (RuntimeError, ValueError) as e:
        return {"peer_refuses": " ".join(str(e).split())}
    if colours.shape[2] == 1:
        variance = variance[:, :, :1]
    else:  # the file is in R, G, B, from which `importon compare` has X, Y, Z
        variance = variance @ np.linalg.inv(FROM_RGB).T
    spp = max(1, round(args.samples / (colours.shape[0] * colours.shape[1])))
    with tempfile.TemporaryDirectory() as folder:
        own, peer, deviation = (os.path.join(folder, n + ".exr") for n in ("own", "peer", "variance"))
        write(peer, colours)
        write(deviation, variance)
        own_path = os.path.join(args.own or args.folder, os.path.relpath(path, args.folder))
        render = [args.importon, "render", own_path, "-D", "integrator=" + integrator, "--spp", str(spp), "-m", mode,
                  "--seed", str(args.seed), "--points", "independent", "--no-preview", "-q", "-o", own]
        run = subprocess.run(render, stderr=subprocess.PIPE, text=True)
        if run.returncode:
            return {"refused": run.stderr.strip().splitlines()[:1], "agree": False}
        compare = [args.importon, "compare", "--json", own, peer, "--variance", deviation, "--spp-test", str(spp),
                   "--spp-ref", str(n_reference)]
        run = subprocess.run(compare, capture_output=True, text=True)  # its status tells whether they agree
    r = json.loads(run.stdout)
    return {"spp": spp, "spp_reference": n_reference, "agree": r["agree"], "mean_z": r["mean_z"],
            "ratio": r["mean_test"] / r["mean_reference"], "failed": r["failing_fraction"], "over2": r["over2_fraction"]}


def line(r):
    if "peer_refuses" in r:
        return "not by Mitsuba: " + r["peer_refuses"]
    if "refused" in r:
        return "REFUSED: %s" % r["refused"]
    return "%s  mean z %.2f  ratio %.5f  failed %.4f  |z|>2 %.4f  spp %d, %d" % (
        "agrees " if r["agree"] else "DIFFERS", r["mean_z"], r["ratio"], r["failed"], r["over2"], r["spp"],
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
