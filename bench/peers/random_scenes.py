# SPDX-License-Identifier: Apache-2.0
"""Scenes at random in importon and in Mitsuba 3: have their pictures the same expectation?

    python3 bench/peers/random_scenes.py [-i IMPORTON] [--mode rgb|mono|spectral] [--spp N] [--runs N] [--json FILE]
                                         FIRST LAST

Scenes FIRST..LAST of random_parts.py. Of each picture the means of 16 blocks, channel by channel, over --runs runs of
each program with seeds of their own: Welch's test, two-sided; a scene differs if a block is beyond 4.5 normal deviates, or
the mean of the picture beyond 4; it is then run again with 8 times the samples and other seeds, and the second verdict counts.
Of derivatives: random_gradients.py.
"""
import os
import subprocess
import sys

import random_parts
import random_run
from zcompare import mi, np, stats


def normal_deviate(difference, parts):
    """Normal deviate with the two-sided probability of Welch's t; parts: (variance, its degrees of freedom) of the difference."""
    total = sum(v for v, _ in parts)
    t = difference / np.sqrt(total)
    dof = total ** 2 / (sum(v ** 2 / n for v, n in parts) + 1e-300)
    p = 2 * stats.t.sf(np.abs(t), np.minimum(dof, 1e9))
    return np.sign(t) * stats.norm.isf(np.maximum(p, 1e-300) / 2)


def welch(a, b):
    """Normal deviates of differences of means; a, b [run][...]."""
    rounding = (2e-6 * np.abs(b.mean(0)) + 1e-9) ** 2  # floats, in both files
    return normal_deviate(a.mean(0) - b.mean(0), [(a.var(0, ddof=1) / len(a), len(a) - 1), (b.var(0, ddof=1) / len(b), len(b) - 1), (rounding, np.inf)])


def blocks(picture):
    """Means of 4 x 4 blocks of [y][x][channel]; of a picture too small for that, its mean."""
    h, w, c = picture.shape
    if h % 4 or w % 4:
        return picture.mean((0, 1)).reshape(1, c)
    return picture.reshape(4, h // 4, 4, w // 4, c).mean((1, 3)).reshape(16, c)


def channels_of(path):
    """Colours of an EXR file, [y][x][channel]."""
    bitmap = mi.Bitmap(path)
    names = [f.name for f in bitmap.struct_()]
    pixels = np.array(bitmap, dtype=np.float64).reshape(bitmap.size()[1], bitmap.size()[0], -1)
    return pixels[:, :, [names.index(n) for n in ("R", "G", "B", "Y") if n in names]]


def own_pictures(program, scene, mode, spp, runs, seed, folder):
    out, found = os.path.join(folder, "own.exr"), []
    for k in range(runs):
        done = subprocess.run([program, "render", scene, "--spp", str(spp), "--seed", str(seed + k), "--no-preview", "-q",
                               "--points", "independent", "-t", "1", "-m", mode, "-o", out], capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError("importon: " + done.stderr.strip().splitlines()[-1])
        found.append(blocks(channels_of(out)))
    return np.array(found)


def peer_pictures(scene, spp, runs, seed, integrator=None):
    found = []
    for k in range(runs):
        pixels = np.array(mi.render(scene, spp=spp, seed=seed + k, integrator=integrator), dtype=np.float64)
        found.append(blocks(pixels.reshape(pixels.shape[0], pixels.shape[1], -1)))
    return np.array(found)


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
    return result


def twice(args, seed, folder):
    """A scene that differs is looked at again, with more samples."""
    result = look(args.importon, seed, args, args.spp, 1, folder)
    if result["differs"]:
        first = {k: result[k] for k in ("worst", "mean", "ratio")}
        result = look(args.importon, seed, args, 8 * args.spp, 500, folder)
        result["first"] = first
    return dict(result, fails=result["differs"])


def line(r):
    if "error" in r:
        return "%4d ERROR %s" % (r["seed"], r["error"])
    return "%4d %s worst %5.2f mean %5.2f ratio %.5f +- %.1e, %d of %d beyond 2" % (
        r["seed"], "DIFFERS" if r["differs"] else "agrees ", r["worst"], r["mean"], r["ratio"] or 0, r["relative"], r["over2"], r["tests"])


if __name__ == "__main__":
    sys.exit(random_run.main(__doc__, 512, 10, twice, line))
