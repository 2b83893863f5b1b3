# SPDX-License-Identifier: Apache-2.0
"""The smallest part of a random scene in which importon and Mitsuba 3 still differ.

    python3 bench/peers/random_reduce.py [-i IMPORTON] [--mode rgb|mono|spectral] [--spp N] SEED

Objects and properties of scene SEED of random_parts.py are left out, or replaced by plainer ones, one after the other, as
long as a block of the picture stays 7 normal deviates off; what remains is printed.
"""
import argparse
import copy
import os
import sys
import tempfile
import xml.etree.ElementTree as tree

import random_parts
import random_scenes
from zcompare import mi, np, root


def plain(text):
    return tree.fromstring(text)


def moves(scene):
    """Scenes with one thing less, the largest pieces first."""
    parents = [(p, i, c) for p in scene.iter() for i, c in enumerate(p)]
    order = {"shape": 0, "emitter": 1, "medium": 2, "bsdf": 3}
    for p, i, c in sorted(parents, key=lambda m: order.get(m[2].tag, 9)):
        kind = c.get("type")
        if c.tag in ("sensor", "film", "sampler", "integrator", "lookat", "scale", "rotate", "translate"):
            continue
        if c.tag == "rfilter":
            if kind != "box":
                yield p, i, plain('<rfilter type="box"/>')
            continue
        if c.tag == "bsdf":
            inner = [n for n in c if n.tag == "bsdf"]
            for n in inner:
                yield p, i, copy.deepcopy(n)
            if kind != "diffuse" or len(c):
                yield p, i, plain('<bsdf type="diffuse"/>')
            continue
        if c.tag == "texture" and kind != "mesh_attribute":
            name = c.get("name")
            yield p, i, plain('<float name="%s" value="0.5"/>' % name if name in ("alpha", "opacity", "weight") else '<rgb name="%s" value="0.5,0.5,0.5"/>' % name)
            continue
        if c.get("name") in ("filename", "width", "height", "component_format", "pixel_format", "shape"):
            continue
        yield p, i, None
        if c.tag in ("rgb", "spectrum") and c.get("value") not in ("0.5", "0.5,0.5,0.5"):
            yield p, i, plain('<rgb name="%s" value="0.5,0.5,0.5"/>' % c.get("name"))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    parser.add_argument("--mode", default="rgb")
    parser.add_argument("--spp", type=int, default=1024)
    parser.add_argument("--runs", type=int, default=8)
    parser.add_argument("seed", type=int)
    args = parser.parse_args()
    mi.set_variant("llvm_ad_" + args.mode)
    mi.set_log_level(mi.LogLevel.Error)
    with tempfile.TemporaryDirectory() as folder:
        path, _ = random_parts.make(args.seed, args.mode, folder)
        scene = tree.parse(path).getroot()

        def worst(candidate):
            with open(path, "w") as f:
                f.write(tree.tostring(candidate, encoding="unicode"))
            try:
                peer = random_scenes.peer_pictures(mi.load_file(path, optimize=False), args.spp, args.runs, 9000)
                own = random_scenes.own_pictures(args.importon, path, args.mode, args.spp, args.runs, 50, folder)
            except (RuntimeError, ValueError):
                return 0, 0
            z = random_scenes.welch(own, peer)
            return float(np.abs(z).max()), float(own.mean() / max(peer.mean(), 1e-30))

        best = worst(scene)
        print("whole: %.1f, ratio %.4f" % best, file=sys.stderr)
        again = best[0] > 5
        while again:
            again = False
            for k in range(10000):
                trial = copy.deepcopy(scene)
                step = next((m for j, m in enumerate(moves(trial)) if j == k), None)
                if step is None:
                    break
                parent, i, new = step
                del parent[i]
                if new is not None:
                    parent.insert(i, new)
                found = worst(trial)
                if found[0] > 7:
                    scene, best, again = trial, found, True
                    break
        print("%d %s: %.1f, ratio %.4f" % (args.seed, args.mode, *best))
        print(tree.tostring(scene, encoding="unicode"))


if __name__ == "__main__":
    main()
