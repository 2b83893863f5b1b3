# SPDX-License-Identifier: Apache-2.0
"""Variance times processor time of the derivative by a block's pose: importon and Mitsuba 3's prb_projective and
direct_projective.

    python3 bench/peers/poses.py [-b BUILD] [--seeds N] [--spp N] [--peer-spp N] [--sppi N] [--res N] [--depth N]
                                 [--integrators NAME,...] [--variant NAME] [--block welded|split|egg] [--json FILE]

The scene is scenes/poses.xml with its block as a flat-shaded mesh of 8 vertices and 12 triangles (split: of 24
vertices; egg: a ball of 1,280 triangles with vertex normals in its place), so that both have the same edges. The
functional is the mean of the picture, its derivative one gradient of six numbers: translation and rotation vector
about the middle of the block. One thread each; scenes are loaded and kernels compiled before, and the two take
turns, seed by seed. Points are independent.

  truth      central differences of importon's pictures with common numbers, several seeds
  agrees     the mean of the seeds is within 3.5 standard errors (its own and the truth's) of the truth
  ratio      importon's variance times time over the peer's, of numbers that the peer gets right

Mitsuba samples the boundary that the camera sees (sppp), and that of light (sppi, with its octree, whose time is in
every gradient, since a fit builds it anew in every step). Skips (77) without mitsuba."""
import argparse
import json
import math
import os
import re
import resource
import subprocess
import tempfile

import needed

dr, mi, np = needed.modules("drjit", "mitsuba", "numpy")

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))
NAMES = ["x", "y", "z", "turn x", "turn y", "turn z"]
STEPS = [.02, .02, .02, .02, .02, .02]
FACES = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2),
         (1, 3, 7), (1, 7, 5)]
MIDDLE, SIZE = (-.2, .3, 1.1), (.6, .5, .35)


def seconds(who):
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def welded():
    """The corners of a cube and its triangles."""
    return [[1 if k >> n & 1 else -1 for n in range(3)] for k in range(8)], FACES


def split():
    """The same, each side with four corners of its own."""
    at = welded()[0]
    corners = [at[v] for n in range(0, 12, 2) for v in FACES[n] + FACES[n + 1][2:]]
    return corners, [t for n in range(0, 24, 4) for t in ((n, n + 1, n + 2), (n, n + 2, n + 3))]


def egg(levels=3):
    """A ball of 20 4^levels triangles; its vertex normals are computed by both programs."""
    t = (1 + math.sqrt(5)) / 2
    corners = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t), (0, -1, -t), (0, 1, -t),
               (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
             (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
             (8, 6, 7), (9, 8, 1)]
    for _ in range(levels):
        between, finer = {}, []

        def middle(i, j):
            key = (min(i, j), max(i, j))
            if key not in between:
                between[key] = len(corners)
                corners.append([(corners[i][n] + corners[j][n]) / 2 for n in range(3)])
            return between[key]
        for i, j, k in faces:
            a, b, c = middle(i, j), middle(j, k), middle(k, i)
            finer += [(i, a, c), (j, b, a), (k, c, b), (a, b, c)]
        faces = finer
    return [[x / math.sqrt(sum(y * y for y in v)) for x in v] for v in corners], faces


def scene_write(folder, a):
    """The scene with the block as a mesh: its corners are those of the file's cube."""
    with open(os.path.join(root, "scenes/poses.xml"), encoding="utf-8") as f:
        text = f.read()
    corners, faces = {"welded": welded, "split": split, "egg": egg}[a.block]()
    c, s = math.cos(math.radians(25)), math.sin(math.radians(25))
    with open(os.path.join(folder, "block.obj"), "w", encoding="ascii") as f:
        for x, y, z in corners:
            x, y, z = SIZE[0] * x, SIZE[1] * y, SIZE[2] * z
            f.write("v %.9g %.9g %.9g\n" % (c * x - s * y + MIDDLE[0], s * x + c * y + MIDDLE[1], z + MIDDLE[2]))
        for face in faces:
            f.write("f %d %d %d\n" % tuple(v + 1 for v in face))
    block = """<shape type="obj" id="block"><string name="filename" value="block.obj"/>
<boolean name="face_normals" value="%s"/><ref id="paint"/></shape>""" % ("false" if a.block == "egg" else "true")
    text, n = re.subn(r'<shape type="cube" id="block">.*?</shape>', block, text, flags=re.S)
    assert n == 1
    text = text.replace('name="max_depth" value="4"', 'name="max_depth" value="%d"' % a.depth)
    path = os.path.join(folder, "scene.xml")
    with open(path, "w", encoding="utf-8") as f:
        f.write(text)
    return path


def run(a, command):
    return json.loads(subprocess.run([os.path.join(a.build, "cli/importon")] + command + ["-t", "1", "-q", "--json"],
                                     check=True, capture_output=True, text=True).stdout)


def truth(a, scene):
    """Central differences with common numbers: (6), and their standard errors."""
    rows = []
    for seed in range(a.truth_seeds):
        row = []
        for k, step in enumerate(STEPS):
            value = []
            for sign in (1, -1):
                pose = ",".join(repr(sign * step if j == k else 0) for j in range(6))
                out = run(a, ["gradient", scene, "--set", "block.pose=" + pose, "-p", "paint.reflectance.value",
                              "-D", "res=%d" % a.res, "--spp", str(a.truth_spp), "--seed", str(1000 + seed)])
                value.append(out["value"])
            row.append((value[0] - value[1]) / (2 * step))
        rows.append(row)
    rows = np.array(rows)
    return rows.mean(0), rows.std(0, ddof=1) / math.sqrt(len(rows))


def ours(a, scene, seed):
    before = seconds(resource.RUSAGE_CHILDREN)
    out = run(a, ["gradient", scene, "-p", "block.pose", "-D", "res=%d" % a.res, "--spp", str(a.spp), "--seed", str(seed),
                  "--points", "independent"])
    return out["params"][0]["grad"], seconds(resource.RUSAGE_CHILDREN) - before


class Peer:
    def __init__(self, a, scene, name):
        settings = {"type": name, "sppi": a.sppi, "guiding": "octree", "guiding_proj": True, "sppc": a.peer_spp,
                    "sppp": a.peer_spp}
        if name == "prb_projective":
            settings["max_depth"] = a.depth
            settings["rr_depth"] = 100
        self.integrator = mi.load_dict(settings)
        self.scene = mi.load_file(scene, res=a.res)
        self.params = mi.traverse(self.scene)
        self.spp = a.peer_spp
        self.start = mi.Float(self.params["block.vertex_positions"])

    def gradient(self, seed):
        before = seconds(resource.RUSAGE_SELF)
        t, w = mi.Vector3f(0), mi.Vector3f(0)
        dr.enable_grad(t, w)
        # At 0 the derivative of the rotation of w is that of p + w x p.
        p = dr.unravel(mi.Point3f, self.start) - mi.Point3f(*MIDDLE)
        self.params["block.vertex_positions"] = dr.ravel(p + dr.cross(w, mi.Vector3f(p)) + t + mi.Vector3f(*MIDDLE))
        self.params.update()
        image = mi.render(self.scene, self.params, integrator=self.integrator, seed=seed, seed_grad=seed + 7919,
                          spp=self.spp, spp_grad=self.spp)
        dr.backward(dr.mean(image, axis=None))
        g = [float(dr.grad(v)[k][0]) for v in (t, w) for k in range(3)]
        return g, seconds(resource.RUSAGE_SELF) - before


def summary(rows):
    rows = np.array(rows)
    return rows.mean(0), rows.var(0, ddof=1)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-b", "--build", default=os.path.join(root, "build"))
    parser.add_argument("--seeds", type=int, default=16)
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--peer-spp", type=int, default=16)
    parser.add_argument("--sppi", type=int, default=16)
    parser.add_argument("--res", type=int, default=64)
    parser.add_argument("--depth", type=int, default=3)
    parser.add_argument("--truth-seeds", type=int, default=12)
    parser.add_argument("--truth-spp", type=int, default=512)
    parser.add_argument("--integrators", default="prb_projective,direct_projective")
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--block", choices=("welded", "split", "egg"), default="welded")
    parser.add_argument("--json")
    a = parser.parse_args()
    mi.set_variant(a.variant)
    if a.variant.startswith("llvm"):
        dr.set_thread_count(1)
    report = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in a.integrators.split(","):
            if name == "direct_projective":
                a.depth = 2
            scene = scene_write(folder, a)
            want, want_se = truth(a, scene)
            peer = Peer(a, scene, name)
            for seed in range(2):
                peer.gradient(seed)
            mine, theirs, my_time, their_time = [], [], 0, 0
            for seed in range(a.seeds):
                g, used = ours(a, scene, seed)
                mine.append(g)
                my_time += used / a.seeds
                g, used = peer.gradient(100 + seed)
                theirs.append(g)
                their_time += used / a.seeds
            (m, v), (pm, pv) = summary(mine), summary(theirs)
            print("%s, depth %d: a gradient takes %.3f s here, %.3f s there" % (name, a.depth, my_time, their_time))
            print("%-8s%22s%22s%22s%10s" % ("", "differences", "importon", "Mitsuba", "ratio"))
            ratios = []
            for k in range(6):
                def z(mean, var):
                    return (mean[k] - want[k]) / math.sqrt(var[k] / a.seeds + want_se[k] ** 2)
                right = abs(z(pm, pv)) <= 3.5
                ratio = v[k] * my_time / (pv[k] * their_time)
                if right:
                    ratios.append(ratio)
                print("%-8s%12.6f +-%8.6f%12.6f (%5.1f)  %12.6f (%5.1f)%10s" % (
                    NAMES[k], want[k], want_se[k], m[k], z(m, v), pm[k], z(pm, pv), "%.3f" % ratio if right else "wrong"),
                    flush=True)
            if ratios:
                print("median ratio of the %d numbers that agree: %.3f, largest %.3f" % (
                    len(ratios), float(np.median(ratios)), max(ratios)))
            report[name] = {"truth": want.tolist(), "truth_se": want_se.tolist(), "importon": m.tolist(),
                            "importon_var": v.tolist(), "importon_seconds": my_time, "mitsuba": pm.tolist(),
                            "mitsuba_var": pv.tolist(), "mitsuba_seconds": their_time, "ratios": ratios}
    if a.json:
        with open(a.json, "w", encoding="utf-8") as f:
            json.dump(report, f, indent=1)


if __name__ == "__main__":
    main()
