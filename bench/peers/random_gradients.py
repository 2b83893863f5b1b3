# SPDX-License-Identifier: Apache-2.0
"""Scenes at random in importon and in Mitsuba 3: have all derivatives the same expectation?

    python3 bench/peers/random_gradients.py [-i IMPORTON] [--mode rgb|mono|spectral] [--spp N] [--runs N] [--json FILE] FIRST LAST

Scenes FIRST..LAST of random_parts.py. The loss is sum(w * picture), w a fixed random picture; its derivatives with respect to
every number that both programs have, by `importon gradient --adjoint` and by one backward pass of `prb` or `prbvolpath`, RUNS
times each with seeds of their own. importon's error is the one that it reports, Mitsuba's the spread of its runs. A scene
fails if a number is beyond 4 normal deviates, or the sum of squares beyond its 1e-4 level (numbers of one scene are correlated:
Satterthwaite's degrees of freedom, with the correlations of the runs); it is then run again with 4 times the samples and other
seeds, and the second verdict counts. For the worst number of each parameter that still fails, central differences of both
programs' pictures (common random numbers) then say whose derivative is wrong; and they stand in for Mitsuba's derivative where
it is known to be none, or another than that of its pictures (delta lobes and what wrong_there names).
"""
import json
import os
import re
import subprocess
import sys

import random_parts
import random_run
from gradients import texture_read
from random_scenes import channels_of, normal_deviate
from zcompare import mi, np, stats

STEP = 0.02  # of differences, as a fraction of the value
LEVEL, TAIL = 4, 1e-4


# ---- importon ---------------------------------------------------------------------------

def command(program, args):
    done = subprocess.run([program, *args], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError("importon: " + done.stderr.strip().splitlines()[-1])
    return done.stdout


def volume_read(path):
    with open(path, "rb") as f:
        return np.frombuffer(f.read(), "<f4", offset=48).astype(float)


class Own:
    def __init__(self, program, scene, mode, folder, weight):
        self.program, self.scene, self.mode, self.folder, self.weight = program, scene, mode, folder, weight
        self.file = os.path.join(folder, "weight.pfm")
        with open(self.file, "wb") as f:
            h, w, c = weight.shape
            f.write(b"P%s\n%d %d\n-1.0\n" % (b"F" if c == 3 else b"f", w, h) + weight[::-1].astype("<f4").tobytes())
        self.values = {}
        for line in command(program, ["gradient", scene, "-m", mode, "--dump", "-q"]).splitlines():
            self.values[line.split("=")[0]] = line.split("=")[1]

    def derivatives(self, spp, seed):
        """(loss, its error), {name: (derivative, error)}."""
        textures = os.path.join(self.folder, "g")
        out = json.loads(command(self.program, ["gradient", self.scene, "-m", self.mode, "--spp", str(spp), "--seed", str(seed), "-q", "--json",
                                                "--adjoint", self.file, "--textures", textures]))
        found = {}
        for p in out["params"]:
            if "grad" in p:
                found[p["name"]] = np.array(p["grad"], dtype=float).ravel(), np.array(p["se"], dtype=float).ravel()
            elif p["file"].endswith(".exr"):
                found[p["name"]] = texture_read(p["file"])
            elif p["file"].endswith(".vol"):
                found[p["name"]] = volume_read(p["file"]), volume_read(p["file"][:-4] + ".se.vol")
        return (out["value"], out["se"]), found

    def loss(self, spp, seed, settings=()):
        out = os.path.join(self.folder, "own.exr")
        command(self.program, ["render", self.scene, "-m", self.mode, "--spp", str(spp), "--seed", str(seed), "-q", "--no-preview", "-o", out,
                               *[a for s in settings for a in ("--set", s)]])
        return float((channels_of(out) * self.weight).sum())


# ---- Mitsuba ----------------------------------------------------------------------------

class Peer:
    def __init__(self, scene, integrator, weight):
        self.scene, self.integrator, self.weight = scene, integrator, mi.TensorXf(weight)
        self.pictures = integrator  # of differences
        self.mode = mi.variant().split("_")[-1]
        self.params = mi.traverse(scene)
        import drjit as dr
        self.dr = dr
        skip = re.compile(r"to_world|vertex_(positions|normals|texcoords)|control_points|wavelengths|principal_point|^_|rotation")
        self.keys = [k for k in self.params.keys() if dr.is_diff_v(type(self.params[k])) and dr.is_float_v(type(self.params[k])) and
                     self.params.flags(k) & mi.ParamFlags.NonDifferentiable.value == 0 and not skip.search(k)]
        self.grey = {k for k in self.keys if "Tensor" in type(self.params[k]).__name__ and self.params[k].shape[-1] == 1}
        # An envmap has its last column before its first one, and its first one behind its last one.
        self.closed = {e.id() + ".data" for e in scene.emitters() if e.class_name() == "EnvironmentMapEmitter"}

    def weighted(self, image):
        return self.dr.sum(image * self.weight, axis=None)

    def derivatives(self, spp, seed):
        """loss, {key: derivative}."""
        dr, params = self.dr, self.params
        leaves = {k: type(params[k])(dr.detach(params[k])) for k in self.keys}  # an envmap replaces what it is given
        for k, x in leaves.items():
            dr.enable_grad(x)
            params[k] = x
        params.update()
        loss = self.weighted(mi.render(self.scene, params, integrator=self.integrator, spp=spp, seed=2 * seed, seed_grad=2 * seed + 1))
        dr.backward(loss)
        found = {}
        for k, x in leaves.items():
            g = np.array(dr.grad(x), dtype=float)
            if k in self.closed:
                g[:, 1] += g[:, -1]
                g[:, -2] += g[:, 0]
                g = g[:, 1:-1]
            found[k] = g.ravel()
            params[k] = dr.detach(x)
        params.update()
        return float(np.array(loss).ravel()[0]), found

    def loss(self, spp, seed):
        return float(np.array(self.weighted(mi.render(self.scene, integrator=self.pictures, spp=spp, seed=seed))).ravel()[0])


def wrong_there(keys):
    """Keys whose derivative in Mitsuba is not that of its pictures, as differences say (docs/mitsuba.md, Derivatives)."""
    found = set()
    for k in keys:
        place, _, name = k.rpartition(".")
        if name == "alpha":  # roughplastic looks transmittances up in tables that have no derivatives
            found |= {k, place + ".eta"}
        owner = k.split(".diffuse_reflectance")[0]
        if owner != k and owner + ".alpha" not in keys:  # plastic: light that its mirror reflects is counted to its base
            found.add(k)
    return found


def deep(path):
    """`prbvolpath` with max_depth n is not `volpath` with n or n + 1 (the last vertex has no light samples): long walks for both."""
    with open(path) as f:
        text = f.read()
    if 'integrator type="volpath"' in text:
        text = re.sub(r'name="max_depth" value="\d+"', 'name="max_depth" value="32"', text)
        with open(path, "w") as f:
            f.write(text)
    return text


def derivative_integrator(text):
    kind = re.search(r'integrator type="(\w+)"', text)[1]
    depth = re.search(r'name="max_depth" value="(\d+)"', text)
    if kind == "ptracer":
        return None
    return mi.load_dict({"type": "prbvolpath" if kind == "volpath" else "prb", "max_depth": int(depth[1]) if depth else 2,
                         "hide_emitters": "hide_emitters" in text})


# ---- comparison -------------------------------------------------------------------------

def names(keys, own):
    """{Mitsuba's key: importon's name}."""
    found = {}
    for k in keys:
        bare = re.sub(r"^group\d+\.", "", k)
        for name in (k, k + ".value", bare, bare + ".value"):
            if name in own:
                found[k] = name
                break
    return found


def deviates(own, own_se, peer):
    """Of means over runs, [run][number], with importon's errors and the spread of Mitsuba's runs."""
    va, vb = (own_se ** 2).mean(0) / len(own), peer.var(0, ddof=1) / len(peer)
    rounding = (1e-5 * np.abs(peer).max(0) + 1e-12 * np.abs(peer).max(initial=0)) ** 2  # sums of floats
    return normal_deviate(own.mean(0) - peer.mean(0), [(va, 1e9), (vb, len(peer) - 1), (rounding, 1e9)])


def tail(z, own, peer):
    """Probability of so large a sum of squares, and its degrees of freedom."""
    n = z.size
    total = own.var(0, ddof=1) / len(own) + peer.var(0, ddof=1) / len(peer)
    use = total > 0
    rows = np.concatenate([(x - x.mean(0))[:, use] / np.sqrt(total[use] * len(x) * (len(x) - 1)) for x in (own, peer)])
    c, m = rows.T @ rows, len(own) + len(peer) - 2  # correlations
    square = max(((c ** 2).sum() - use.sum() ** 2 / m) / (1 + 1 / m), use.sum(), 1)
    dof = n * n / max(square, 1)
    return float(stats.chi2.sf((z ** 2).sum() * dof / n, dof)), float(dof)


def compare(own, peer, spp, runs, first):
    a = [own.derivatives(spp, first + k) for k in range(runs)]
    b = [peer.derivatives(spp, 5000 + first + k) for k in range(runs)]
    pairs = names(peer.keys, a[0][1])
    loss = deviates(np.array([[x[0][0]] for x in a]), np.array([[x[0][1]] for x in a]), np.array([[x[0]] for x in b]))
    result = {"loss_z": float(loss[0]), "loss": [float(np.mean([x[0][0] for x in a])), float(np.mean([x[0] for x in b])),
              float(np.sqrt(np.mean([x[0][1] ** 2 for x in a]) / runs))], "parameters": {}, "sizes": {}}
    rows = {}
    for key, name in sorted(pairs.items()):
        g = np.array([x[1][name][0] for x in a])
        se = np.array([x[1][name][1] for x in a])
        p = np.array([x[1][key] for x in b])
        colours = ".data" in key or "_color" in key
        if colours and peer.mode == "mono" and p.shape[1] == 3 * g.shape[1]:  # the derivative to grey
            p = p.reshape(len(p), -1, 3).sum(2)
        if colours and peer.mode == "spectral" and p.shape[1] % 3 == 0 and key not in peer.grey:
            result["sizes"][key] = "coefficients of spectra there"
            continue
        if g.shape != p.shape:
            result["sizes"][key] = [g.shape[1], p.shape[1]]
            continue
        seen = ((g != 0) | (p != 0)).any(0)
        if not seen.any():
            continue
        none = bool((p == 0).all())
        z = np.zeros(g.shape[1])
        z[seen] = deviates(g[:, seen], se[:, seen], p[:, seen])
        i = int(np.abs(z).argmax())
        spread = g.var(0, ddof=1)
        result["parameters"][key] = {"name": name, "numbers": int(seen.sum()), "index": i, "z": float(z[i]),
                                     "own": float(g.mean(0)[i]), "peer": float(p.mean(0)[i]),
                                     "own_se": float(np.sqrt((se[:, i] ** 2).mean() / runs)), "peer_se": float(p.std(0, ddof=1)[i] / np.sqrt(runs)),
                                     "own_sum": float(g.mean(0).sum()), "peer_sum": float(p.mean(0).sum()), "none": none,
                                     "error_ratio": float(np.sqrt((se ** 2).mean(0).sum() / max(spread.sum(), 1e-300)))}
        if not none:
            rows[key] = z[seen], g[:, seen], p[:, seen]
    result["own_only"] = sorted(set(a[0][1]) - set(pairs.values()))
    result["peer_only"] = sorted(k for k in set(peer.keys) - set(pairs) if any((x[1][k] != 0).any() for x in b))
    result["failing"] = sorted(k for k, r in result["parameters"].items() if abs(r["z"]) > LEVEL)
    judge(result, rows)
    return result, rows


def judge(result, rows):
    """The verdict over all numbers but those where Mitsuba's derivative is known to be wrong."""
    theirs = {k for k, r in result["parameters"].items() if r["none"] or r.get("verdict") == "prb"}
    theirs |= wrong_there(result["parameters"]) & set(result["parameters"])
    left = [rows[k] for k in rows if k not in theirs]
    result.update(numbers=0, square=0, over2=0, over3=0, tail=1, dof=0)
    if left:
        z, g, p = (np.concatenate(x, -1) for x in zip(*left))
        result["tail"], result["dof"] = tail(z, g, p)
        result.update(numbers=int(z.size), square=float((z ** 2).sum()), over2=int((np.abs(z) > 2).sum()), over3=int((np.abs(z) > 3).sum()))
    result["theirs"] = sorted(k for k in theirs if abs(result["parameters"][k]["z"]) > LEVEL)
    result["fails"] = bool(set(result["failing"]) - theirs or result["tail"] < TAIL)


def moved(kind, numbers, shape):
    """Mitsuba's value of that kind from a flat array."""
    if "Tensor" in kind.__name__:
        return kind(numbers.reshape(shape).astype(np.float32))
    return kind(*numbers.tolist()) if kind.__name__.startswith("Color") else kind(numbers.astype(np.float32).tolist())


def differences(own, peer, key, row, spp, runs):
    """Central differences of both programs' losses for one number: means and errors of each."""
    i, name = row["index"], row["name"]
    value = peer.params[key]
    start, kind = np.array(value, dtype=np.float64), type(value)
    flat = start.ravel()
    if flat.size != len(own.values[name].split(",")) and "..." not in own.values[name]:
        raise ValueError("not as many numbers here as there")
    if key in peer.closed:
        rows, w, c = start.shape
        y, x, j = np.unravel_index(i, (rows, w - 2, c))
        index = [np.ravel_multi_index((y, k, j), start.shape) for k in {0: (1, w - 1), w - 3: (w - 2, 0)}.get(x, (x + 1,))]
    else:
        index = [i]
    h = STEP * max(abs(flat[index[0]]), .05)
    ends = []
    for sign in (1, -1):
        changed = flat.copy()
        changed[index] += sign * h
        peer.params[key] = moved(kind, changed, start.shape)
        peer.params.update()
        ends.append([peer.loss(spp, 9000 + k) for k in range(runs)])
    peer.params[key] = moved(kind, flat, start.shape)
    peer.params.update()
    theirs = (np.array(ends[0]) - np.array(ends[1])) / (2 * h)
    ends = []
    for sign in (1, -1):
        numbers = (start[:, 1:-1] if key in peer.closed else start).ravel().copy()
        numbers[i] += sign * h
        file = os.path.join(own.folder, "set.txt")
        with open(file, "w") as f:
            f.write("%s=%s\n" % (name, ",".join("%.9g" % x for x in numbers)))
        ends.append([own.loss(spp, 700 + k, ["@" + file]) for k in range(runs)])
    ours = (np.array(ends[0]) - np.array(ends[1])) / (2 * h)
    return [float(x) for d in (ours, theirs) for x in (d.mean(), d.std(ddof=1) / np.sqrt(runs))]


def verdict(row, runs):
    """Whose derivative do the differences contradict?"""
    ours, ours_se, theirs, theirs_se = row["differences"]

    def off(x, se, d, d_se):
        return abs(float(normal_deviate(x - d, [(se ** 2, 1e9), (d_se ** 2, runs - 1), ((2e-3 * d) ** 2 + 1e-24, 1e9)]))) > LEVEL

    if abs(float(normal_deviate(ours - theirs, [(ours_se ** 2, runs - 1), (theirs_se ** 2, runs - 1), ((2e-3 * ours) ** 2 + 1e-24, 1e9)]))) > LEVEL:
        return "pictures"
    best = (ours, ours_se) if ours_se < theirs_se else (theirs, theirs_se)
    own, peer = off(row["own"], row["own_se"], *best), off(row["peer"], row["peer_se"], *best)
    return {(False, True): "prb", (True, False): "importon", (True, True): "both"}.get((own, peer), "unclear")


def judge_by_differences(own, peer, found, keys, spp, runs):
    for key in keys:
        row = found["parameters"][key]
        try:
            row["differences"] = differences(own, peer, key, row, spp, runs)
            row["verdict"] = verdict(row, runs)
        except (RuntimeError, ValueError, TypeError, KeyError) as e:
            row["verdict"] = "no differences: " + str(e)[-200:]


def look(args, seed, folder):
    path, kinds = random_parts.make(seed, args.mode, folder)
    result = {"seed": seed, "mode": args.mode, "kinds": kinds}
    text = deep(path)
    integrator = derivative_integrator(text)
    if integrator is None:
        return dict(result, skipped="ptracer")
    scene = mi.load_file(path, optimize=False)
    size = scene.sensors()[0].film().size()
    if size[0] * size[1] == 1:
        return dict(result, skipped="a sensor of one pixel, at which Dr.Jit's backward pass ends with an error")
    channels = 1 if args.mode == "mono" else 3
    weight = np.random.default_rng(seed).uniform(0, 2, (int(size[1]), int(size[0]), channels)) / (size[0] * size[1] * channels)
    weight = weight.astype(np.float32).astype(np.float64)
    own, peer = Own(args.importon, path, args.mode, folder, weight), Peer(scene, integrator, weight)
    found, rows = compare(own, peer, args.spp, args.runs, 1)
    if found["fails"]:
        first = {"failing": {k: found["parameters"][k]["z"] for k in found["failing"]}, "tail": found["tail"]}
        found, rows = compare(own, peer, 4 * args.spp, args.runs, 500)
        found["first"] = first
        if abs(found["loss_z"]) > LEVEL:  # are the pictures those of the scene's own integrator?
            peer.pictures = None
            theirs = np.array([[peer.loss(4 * args.spp, 3000 + k)] for k in range(args.runs)])
            value, se = found["loss"][0], found["loss"][2]
            found["scene_z"] = float(((value - theirs.mean()) / np.hypot(se, theirs.std(ddof=1) / np.sqrt(args.runs))))
            found["prb_picture_differs"] = abs(found["scene_z"]) < LEVEL
        judge_by_differences(own, peer, found, set(found["failing"]) - set(found["theirs"]), 4 * args.spp, 8)
        judge(found, rows)
    judge_by_differences(own, peer, found, [k for k in found["theirs"] if "verdict" not in found["parameters"][k]], args.spp, 8)
    found["fails"] |= any(found["parameters"][k]["verdict"] in ("importon", "both", "pictures") for k in found["theirs"])
    result.update(found)
    return result


def line(r):
    if "error" in r or "skipped" in r:
        return "%4d %s" % (r["seed"], "ERROR " + r["error"] if "error" in r else "skipped: " + r["skipped"])
    out = "%4d %s loss %5.2f; %3d numbers, %2d beyond 2, mean square %.2f, tail %.2g (%.0f)" % (
        r["seed"], "DIFFERS" if r["fails"] else "theirs " if r["theirs"] else "agrees ", r["loss_z"], r["numbers"], r["over2"],
        r["square"] / max(r["numbers"], 1), r["tail"], r["dof"])
    for k in r["failing"]:
        p = r["parameters"][k]
        out += "\n       %-60s [%d] z %6.1f own %.5g +- %.2g peer %.5g +- %.2g%s %s: %s" % (
            k, p["index"], p["z"], p["own"], p["own_se"], p["peer"], p["peer_se"], " (prb: none)" if p["none"] else "", p.get("verdict", "known"),
            " ".join("%.5g" % x for x in p.get("differences", [])))
    if "scene_z" in r:
        out += "\n       loss by the scene's own integrator: z %.2f" % r["scene_z"]
    if r["sizes"]:
        out += "\n       sizes " + str(r["sizes"])
    return out


if __name__ == "__main__":
    sys.exit(random_run.main(__doc__, 64, 16, look, line))
