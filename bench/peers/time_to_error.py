# SPDX-License-Identifier: Apache-2.0
"""Processor seconds to a wanted error, importon and Mitsuba 3 in one run.

    PYTHONPATH=build/python python3 bench/peers/time_to_error.py [-b BUILD] [--scenes A,B] [--seeds N] [--spp N]
        [--peer-spp N]

Scenes: cornell (scenes/cornell.xml), textured (rough metal and a texture under a sky and a lamp), million (two
bumpy balls of a million triangles each, one rough metal, under a sky and a lamp), lamps (10,000 squares,
scalar_rgb: llvm_ad_rgb does not compile them in minutes, so that there are pictures alone), lamps300 (those of them
within 17.3 m of the middle; active are the ground and ten lamps). Both programs have one
thread, the scene loaded and kernels compiled; importon is called in process; both have the scene's own depth. They
take turns, seed by seed.

  picture    seconds until the median pixel's standard error is 1 % of it
  gradient   of a squared loss at wrong parameters, seconds until the root mean square error of
             all numbers is 1 % of the gradient's length; "optimum": the same length at the truth,
             where the gradient is 0
  fit        seconds until the median number is within 2 % of the truth (median of seeds): importon's lm;
             Mitsuba's Adam with its best of the learning rates (times the mean of a parameter's start), samples
             and coolings of FITS. Lights start at half of their radiance, grey

Errors come from the spread of seeds. Variance falls as 1/time, so that seconds to 1 % are seconds of a run times its
relative variance over .0001; fits are run to it. Mitsuba's loss is unbiased: two renders of all samples, one for
the residual and one for its derivative; importon's has two sets of half of them. Points: independent, and the best
of each: sobol here, of pictures whole (one set a pixel, without standard errors, which Mitsuba does not have
either); multijitter there.
"""
import argparse
import os
import re
import statistics
import subprocess
import tempfile
import time

import needed

dr, im, mi, np, stats = needed.modules("drjit", "importon", "mitsuba", "numpy", "scipy.stats")

import meshes

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))
COLOUR = (".reflectance.value", ".radiance.value", ".reflectance.values", ".radiance.values")
FITS = [(rate, spp, cool) for spp in (4, 16) for rate in (0.02, 0.05) for cool in (1, 0.97)]

MILLION = """<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='5'/></integrator>
<sensor type='perspective' id='eye'><float name='fov' value='40'/><transform name='to_world'>
<lookat origin='0,3,-7' target='0,0.6,0' up='0,1,0'/></transform><film type='hdrfilm'>
<integer name='width' value='64'/><integer name='height' value='64'/><rfilter type='box'/></film></sensor>
<emitter type='constant' id='sky'><rgb name='radiance' value='.3,.35,.45'/></emitter>
<bsdf type='diffuse' id='floor'><rgb name='reflectance' value='.5,.4,.3'/></bsdf>
<bsdf type='diffuse' id='clay'><rgb name='reflectance' value='.7,.3,.2'/></bsdf>
<bsdf type='roughconductor' id='metal'><string name='material' value='Cu'/><float name='alpha' value='.2'/></bsdf>
<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/><translate x='-1' y='5'/></transform>
<emitter type='area' id='lamp'><rgb name='radiance' value='9,8,7'/></emitter></shape>
<shape type='rectangle'><transform name='to_world'><scale value='8'/><rotate x='1' angle='-90'/></transform>
<ref id='floor'/></shape><shape type='ply'><string name='filename' value='ball.ply'/><transform name='to_world'>
<translate x='-1.2' y='1'/></transform><ref id='clay'/></shape>
<shape type='ply'><string name='filename' value='ball.ply'/><transform name='to_world'>
<translate x='1.2' y='1'/></transform><ref id='metal'/></shape></scene>"""


class Case:
    """A scene file, what its $defaults are told, the numbers that are active, and wrong values of them."""

    def __init__(self, name, path, told=None, active=(), wrong=None, variant="llvm_ad_rgb"):
        self.name, self.path, self.told, self.active = name, path, told or {}, active
        self.wrong, self.variant = wrong, variant


def cases(folder, build, wanted):
    all_colours = r"^(?!.*(eta|k)\b).*(reflectance|radiance)(\.value)?$"
    if "cornell" in wanted:
        yield Case("cornell", root + "/scenes/cornell.xml", {"res": "64"}, all_colours, 0.4)
    if "textured" in wanted:
        yield Case("textured", root + "/scenes/textured.xml", {"width": "80", "height": "60"},
                   r"^(sky|lamp|wall|metal)\.(radiance|reflectance\.color.|alpha)(\.value)?$", 0.4)
    if "million" in wanted:
        meshes.ball(folder + "/ball.ply", 500)
        with open(folder + "/million.xml", "w", encoding="utf-8") as file:
            file.write(MILLION)
        yield Case("million", folder + "/million.xml", {}, r"^(clay|floor|sky|lamp|metal)\.(reflectance|radiance|alpha)(\.value)?$",
                   0.4)
    if {"lamps", "lamps300"} & set(wanted):
        subprocess.run([build + "/bench/lamps", folder, "--spp", "1"], check=True, stdout=subprocess.DEVNULL)
    if "lamps300" in wanted:
        yield few_lamps(folder)
    if "lamps" in wanted:
        yield Case("lamps", folder + "/squares10000_tree.xml", variant="scalar_rgb")


def few_lamps(folder):
    """The lamps over the middle of the ground, of as many a square metre as all; ids stand at their shapes, where Mitsuba keeps them."""
    text = open(folder + "/squares10000_tree.xml", encoding="utf-8").read()
    head, *lamps = re.split(r"(?=<shape type='rectangle'><transform name='to_world'><scale value='0.1'/>)", text.replace("</scene>", ""))
    kept = []
    for lamp in lamps:
        x, z = (float(re.search(r"<translate [^>]*%s='([^']*)'" % axis, lamp).group(1)) for axis in "xz")
        if max(abs(x), abs(z)) < 300 ** .5:
            name = " id='lamp%d'" % len(kept)
            kept.append(re.sub(r" id='lamp\d+'", "", lamp).replace("<shape type='rectangle'", "<shape type='rectangle'" + name, 1))
    with open(folder + "/lamps300.xml", "w", encoding="utf-8") as file:
        file.write(head + "".join(kept) + "</scene>")
    print("# lamps300 has %d" % len(kept))
    return Case("lamps300", folder + "/lamps300.xml", {}, r"^(ground|lamp\d)\.(emitter\.)?(reflectance|radiance)(\.value)?$", 0.25)


def clocked(function):
    start = time.process_time()
    value = function()
    return time.process_time() - start, value


class Own:
    name = "importon"
    best = "sobol"
    best_picture = "whole"

    def __init__(self, case):
        self.scene = im.load_file(case.path, **case.told)
        self.params = im.traverse(self.scene)
        self.active = []
        if case.active:
            self.params.keep(case.active)
            self.active = sorted(self.params.keys())
        self.truth = {k: np.array(self.params[k], float) for k in self.active}

    def set(self, values):
        for k, v in values.items():
            self.params[k] = v
        self.params.update()

    def picture(self, points, spp, seed):
        return np.array(im.render(self.scene, spp=spp, seed=seed, points=points))[..., :3]

    def gradient(self, target, points, spp, seed):
        e = im.loss(self.scene, target, self.params, spp=spp, seed=seed, points=points)
        return np.concatenate([np.ravel(e.grad[k]) for k in self.active])


class Peer:
    name = "Mitsuba"
    best = best_picture = "multijitter"

    def __init__(self, case, own):
        mi.set_variant(case.variant)
        text = re.sub(r"<string name='light_choice'[^>]*/>", "", open(case.path, encoding="utf-8").read())
        folder = os.path.dirname(case.path)
        text = re.sub(r"(name=[\"']filename[\"'] value=[\"'])", r"\1" + folder + "/", text)
        for k, v in case.told.items():
            text = re.sub(r'(<default name="%s" value=")[^"]*' % k, r"\g<1>" + v, text)
        depth = re.search(r"max_depth['\"] value=['\"](\d+)", text)
        self.scenes = {}
        for points in ("independent", self.best):
            with_points = re.sub(r"type=(['\"])independent\1", "type='%s'" % points, text)
            if "<sampler" not in with_points:
                with_points = with_points.replace("<film ", "<sampler type='%s'/><film " % points, 1)
            self.scenes[points] = mi.load_string(with_points)
        self.keys = {}
        if own.active:
            self.integrator = mi.load_dict({"type": "prb", "max_depth": int(depth.group(1)) if depth else -1})
            self.params = {p: mi.traverse(s) for p, s in self.scenes.items()}
            for points, params in self.params.items():
                self.keys[points] = [self.same(list(params.keys()), name) for name in own.active]

    @staticmethod
    def same(keys, name):
        """Mitsuba's name of the same number. It forgets the ids of what stands in shapes."""
        found = [k for k in keys if k == name or k.startswith(name + ".") or k.endswith("." + name)]
        for inner in (".emitter.", ".bsdf."):
            found = found or [k for k in keys if k.endswith(inner + name.split(".", 1)[1])]
        if len(found) != 1:
            raise SystemExit("%s is not one parameter of Mitsuba's: %s" % (name, found or keys))
        return found[0]

    def set(self, values):
        for points, params in self.params.items():
            for k, v in zip(self.keys[points], values.values()):
                params[k] = type(params[k])([float(x) for x in np.ravel(v)])
            params.update()

    def picture(self, points, spp, seed):
        return np.array(mi.render(self.scenes[points], spp=spp, seed=seed))[..., :3]

    def gradient(self, target, points, spp, seed):
        params, keys = self.params[points], self.keys[points]
        for k in keys:
            dr.enable_grad(params[k])
            dr.set_grad(params[k], 0)
        params.update()
        image = mi.render(self.scenes[points], params, integrator=self.integrator, spp=spp, seed=2 * seed,
                          seed_grad=2 * seed + 1)
        dr.backward(dr.sum(dr.square(image - mi.TensorXf(target)), axis=None) / 2)
        out = [np.ravel(np.array(dr.grad(params[k]))) for k in keys]
        for k in keys:
            dr.disable_grad(params[k])
        return np.concatenate(out)


def in_turn(programs, points_of, seeds, call):
    """{(program, points): (median seconds, values [seed]...)}; the first call of each compiles and is left out."""
    seconds, values = {}, {}
    for seed in range(seeds + 1):
        for p in programs:
            for points in points_of(p):
                s, v = clocked(lambda: call(p, points, seed))
                if seed:
                    seconds.setdefault((p.name, points), []).append(s)
                    values.setdefault((p.name, points), []).append(v)
    return {k: (statistics.median(seconds[k]), np.array(values[k])) for k in seconds}


def both_points(p):
    return ("independent", p.best)


def samples(p, a):
    return a.peer_spp if a.peer_spp and p.name == "Mitsuba" else a.spp


def told(what, rows, note=""):
    fastest = min(s for (name, _), s in rows.items() if name == "Mitsuba")
    for (name, points), s in rows.items():
        if s == float("inf"):
            print("%-28s %-9s %-12s not within the limit%s" % (what, name, points, note), flush=True)
            continue
        print("%-28s %-9s %-12s %10.4g s   Mitsuba's best / this %6.3g%s" % (what, name, points, s, fastest / s, note),
              flush=True)


def pictures(case, own, peer, a):
    got = in_turn((own, peer), lambda p: ("independent", p.best_picture), a.seeds,
                  lambda p, points, seed: p.picture(points, samples(p, a), seed))
    mean = got["importon", "independent"][1].mean(axis=0)
    lit = mean > 1e-3 * mean.mean()
    told(case.name + " picture, 1 %", {k: s * float(np.median(v.var(axis=0, ddof=1)[lit] / mean[lit] ** 2)) / 1e-4
                                       for k, (s, v) in got.items()})


def gradients(case, own, peer, a):
    target = own.picture("sobol", 4096, 99).astype(np.float32)
    values = {}
    for where in ("wrong", "optimum"):
        now = {k: v if where == "optimum" else 0 * v + np.minimum(case.wrong, v * 1.5 if k.endswith("alpha") else case.wrong)
               for k, v in own.truth.items()}
        own.set(now)
        peer.set(now)
        got = in_turn((own, peer), both_points, a.seeds,
                      lambda p, points, seed: p.gradient(target, points, samples(p, a), seed))
        values[where] = got
        if where == "wrong":
            ours, theirs = (got[p.name, p.best][1] for p in (own, peer))
            length = float((ours.mean(axis=0) ** 2).sum())
            level = stats.ttest_ind(ours, theirs, equal_var=False).pvalue.min() * ours.shape[1]
            print("%s: %d numbers, the programs' mean gradients agree at level %.3g" % (case.name, ours.shape[1], level))
            print("%s: a gradient takes %s" % (case.name, ", ".join(
                "%.3g s (%s, %s, %d samples)" % (s, p.name, points, samples(p, a)) for p in (own, peer)
                for points in both_points(p) for s in [got[p.name, points][0]])), flush=True)
        told("%s gradient, %s" % (case.name, where),
             {k: s * float(v.var(axis=0, ddof=1).sum()) / length / 1e-4 for k, (s, v) in got.items()})
        best = got["Mitsuba", "independent"]
        for k, (s, v) in got.items():
            gain = np.median(best[0] * best[1].var(axis=0, ddof=1) / (s * np.maximum(v.var(axis=0, ddof=1), 1e-300)))
            print("%-28s %-9s %-12s median number: %.3g times Mitsuba's independent rate" %
                  ("%s gradient, %s" % (case.name, where), k[0], k[1], gain), flush=True)


def error(values, truth):
    a = np.concatenate([np.ravel(v) for v in values])
    b = np.concatenate([np.ravel(v) for v in truth])
    return float(np.median(np.abs(a / b - 1)))


def adam(case, peer, target, start, truth, points, setting, seed, limit):
    """Seconds of Mitsuba's gradients until the error is small and stays; infinity: not within the limit."""
    rate, spp, cool = setting
    peer.set(start)
    values = [np.array(v, float) for v in start.values()]
    scale = [np.abs(x).mean() for x in values]
    m, v2 = [0 * x for x in values], [0 * x for x in values]
    spent, k, when = 0, 0, None
    peer.gradient(target, points, spp, 1)  # compiles
    while spent < limit:
        s, g = clocked(lambda: peer.gradient(target, points, spp, 100000 * seed + k))
        spent += s
        k += 1
        at = 0
        for i, x in enumerate(values):
            gi = g[at:at + x.size].reshape(x.shape)
            at += x.size
            m[i] = 0.9 * m[i] + 0.1 * gi
            v2[i] = 0.999 * v2[i] + 0.001 * gi ** 2
            step = rate * scale[i] * cool ** k * (m[i] / (1 - 0.9 ** k)) / (np.sqrt(v2[i] / (1 - 0.999 ** k)) + 1e-12)
            values[i] = np.maximum(x - step, 1e-3)
        peer.set(dict(enumerate(values)))
        when = (when or spent) if error(values, truth) <= 0.02 else None
        if when and spent > 1.2 * when + 5 * spent / k:
            return when
    return float("inf")


def fits(case, own, peer, a):
    """Each program's seconds until the median number is within 2 %, by its best setting."""
    own.set(own.truth)
    target = own.picture("sobol", 4096, 98).astype(np.float32)
    start = {k: 0 * v + (v.mean() / 2 if ".radiance" in k else np.minimum(case.wrong, v * 1.5 if k.endswith("alpha") else case.wrong))
             for k, v in own.truth.items()}
    truth = list(own.truth.values())
    rows = {}
    for points in both_points(own):
        for spp in (1, 2, 4, 8, 16, 32, 64):
            seconds, errors = [], []
            for seed in range(a.fits):
                own.set(start)
                s, fit = clocked(lambda: im.fit(own.scene, target, own.params, optimizer="lm", spp=spp, seed=seed,
                                                points=points, intervals=False))
                seconds.append(s)
                errors.append(error([own.params[k] for k in own.active], truth))
            if statistics.median(errors) <= 0.02:
                rows["importon", points] = statistics.median(seconds)
                print("# importon's lm, %s: %d samples, median error %.2g %%, %.3g s" % (points, spp, 100 * statistics.median(errors), statistics.median(seconds)), flush=True)
                break
    for points in both_points(peer):
        first = {setting: adam(case, peer, target, start, truth, points, setting, 0, a.limit) for setting in FITS}
        setting = min(first, key=first.get)
        more = [adam(case, peer, target, start, truth, points, setting, seed, a.limit) for seed in range(1, a.fits)]
        rows["Mitsuba", points] = statistics.median([first[setting]] + more)
        print("# Mitsuba's Adam, %s: rate %g, %d samples, cooled by %g" % (points, *setting), flush=True)
    told(case.name + " fit, 2 %", rows)


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("-b", "--build", default=os.path.join(root, "build"))
    ap.add_argument("--scenes", default="cornell,textured,million,lamps")
    ap.add_argument("--what", default="picture,gradient,fit")
    ap.add_argument("--seeds", type=int, default=32)
    ap.add_argument("--fits", type=int, default=5)
    ap.add_argument("--spp", type=int, default=64)
    ap.add_argument("--peer-spp", type=int, help="samples of each of Mitsuba's renders; else those of --spp")
    ap.add_argument("--limit", type=float, default=20, help="processor seconds of a fit of Mitsuba's")
    a = ap.parse_args()
    mi.set_log_level(mi.LogLevel.Error) if mi.variant() else None
    im.set_threads(1)
    dr.set_thread_count(1)
    with tempfile.TemporaryDirectory() as folder:
        for case in cases(folder, a.build, a.scenes.split(",")):
            own = Own(case)
            peer = Peer(case, own)
            if "picture" in a.what:
                pictures(case, own, peer, a)
            if "gradient" in a.what and own.active:
                gradients(case, own, peer, a)
            if "fit" in a.what and own.active:
                fits(case, own, peer, a)


if __name__ == "__main__":
    main()
