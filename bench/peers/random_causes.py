# SPDX-License-Identifier: Apache-2.0
"""Random scenes whose pictures differ, beside a third evaluation of what is suspected.

    python3 bench/peers/random_causes.py [-i IMPORTON] [--mode rgb|mono|spectral] [--spp N] [--runs N] CAUSE SEED

CAUSE  blend     mirrors may stand in blends again; Mitsuba has a blend in Python, whose draws of a mirror weigh what the mirror
                 reflects, and other draws the mixture
       cylinder  cylinders may be scaled unevenly again; both have a mesh in place of the first
       plastic   the base of the first `plastic` is written to importon with the mean reflectance from inside that Mitsuba's fit has,
                 where importon has it by quadrature (scipy's here; for `nonlinear` false)

Each prints the two programs as they are, and with the change; blocks and deviates are those of random_scenes.py.
"""
import argparse
import math
import os
import re
import sys
import tempfile

import random_parts
import random_scenes
from zcompare import mi, np, root


class OldMaker(random_parts.Maker):
    """Scenes with what the generator leaves out by now, from the same random numbers."""

    def opaque(self, *args, **named):
        named.pop("deltas", None)
        return super().opaque(*args[:3], **named)

    def place(self, *args, **named):
        named.pop("stays_round", None)
        return super().place(*args, **named)


def fair_blend():
    """Registers `fairblend`."""
    import drjit as dr

    class Fair(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.nested = [props[k] for k in props.keys() if isinstance(props[k], mi.BSDF)]
            self.given = props["weight"]
            flags = 0
            for n in self.nested:
                flags |= int(n.flags())
            self.m_components = [flags]
            self.m_flags = flags

        def weight(self, si, active):
            if isinstance(self.given, mi.Texture):
                return dr.clip(self.given.eval_1(si, active), 0, 1)
            return mi.Float(self.given)

        def sample(self, ctx, si, sample1, sample2, active=True):
            w = self.weight(si, active)
            second = sample1 < w
            b0, r0 = self.nested[0].sample(ctx, si, (sample1 - w) / (1 - w), sample2, active & ~second)
            b1, r1 = self.nested[1].sample(ctx, si, sample1 / w, sample2, active & second)
            b, reflected = dr.select(second, b1, b0), dr.select(second, r1, r0)
            mirror = mi.has_flag(b.sampled_type, mi.BSDFFlags.Delta)
            f, p = self.eval_pdf(ctx, si, b.wo, active & ~mirror)
            mixed = dr.select((p > 0) & (b.pdf > 0), f / dr.maximum(p, 1e-30), 0)
            b.pdf = dr.select(mirror, b.pdf * dr.select(second, w, 1 - w), p)
            return b, dr.select(mirror, reflected, mixed)

        def eval_pdf(self, ctx, si, wo, active=True):
            w = self.weight(si, active)
            f0, p0 = self.nested[0].eval_pdf(ctx, si, wo, active)
            f1, p1 = self.nested[1].eval_pdf(ctx, si, wo, active)
            return f0 * (1 - w) + f1 * w, p0 * (1 - w) + p1 * w

        def eval(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[1]

        def traverse(self, callback):
            pass

    mi.register_bsdf("fairblend", Fair)


def blend(text, folder):
    fair_blend()
    return text, text.replace('type="blendbsdf"', 'type="fairblend"')


def cylinder(text, folder):
    sides = 720
    with open(os.path.join(folder, "cylinder.obj"), "w") as f:
        for j in range(sides + 1):
            x, y = math.cos(2 * math.pi * j / sides), math.sin(2 * math.pi * j / sides)
            for z in (0, 1):
                f.write("v %.9g %.9g %g\nvn %.9g %.9g 0\nvt %.9g %g\n" % (x, y, z, x, y, j / sides, z))
        for j in range(sides):
            a, b, c, d = (2 * j + k for k in (1, 3, 4, 2))
            for t in ((a, b, c), (a, c, d)):
                f.write("f %s\n" % " ".join("%d/%d/%d" % (k, k, k) for k in t))
    mesh = re.sub(r'<shape type="cylinder"( id="[^"]*")?>', r'<shape type="obj"\1><string name="filename" value="cylinder.obj"/>', text, count=1)
    return mesh, mesh


def reflectance_from_inside(n):
    """Twice the integral of Fresnel's reflectance times the cosine, light inside, where the index is n > 1."""
    from scipy import integrate
    def fresnel(c):
        t = math.sqrt(max(1 - n * n * (1 - c * c), 0))
        return (((n * c - t) / (n * c + t)) ** 2 + ((c - n * t) / (c + n * t)) ** 2) / 2
    edge = math.sqrt(1 - 1 / n ** 2)
    return edge ** 2 + integrate.quad(lambda c: 2 * c * fresnel(c), edge, 1, epsabs=1e-12)[0]


INDICES = {"bk7": 1.5046, "water": 1.3330, "diamond": 2.419}


def plastic(text, folder):
    start = text.index('<bsdf type="plastic">')
    part = text[start:text.index("</bsdf>", start)]
    if 'name="nonlinear" value="false"' not in part or 'name="diffuse_reflectance" value=' not in part:
        raise SystemExit("the first plastic has a texture, or is nonlinear: its base is not only scaled")
    found = dict(re.findall(r'name="(int_ior|ext_ior)" value="([^"]*)"', part))
    inside, outside = (INDICES.get(found.get(k, v), None) or float(found.get(k, v)) for k, v in (("int_ior", "1.49"), ("ext_ior", "1.000277")))
    own = reflectance_from_inside(inside / outside)
    theirs = float(np.ravel(np.array(mi.fresnel_diffuse_reflectance(mi.Float(outside / inside))))[0])
    factor = (1 - own) / (1 - theirs)
    print("index %.5g: mean reflectance from inside %.6f, Mitsuba's %.6f; the base times %.6f" % (inside / outside, own, theirs, factor))

    def scaled(m):
        terms = [x.strip().split(":") for x in m.group(2).split(",")]
        return m.group(1) + ", ".join(":".join(t[:-1] + ["%.9g" % (float(t[-1]) * factor)]) for t in terms) + '"'

    changed = re.sub(r'(name="diffuse_reflectance" value=")([^"]*)"', scaled, part, count=1)
    return text.replace(part, changed, 1), text


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    parser.add_argument("--mode", default="rgb", choices=["rgb", "mono", "spectral"])
    parser.add_argument("--spp", type=int, default=4096)
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("cause", choices=["blend", "cylinder", "plastic"])
    parser.add_argument("seed", type=int)
    args = parser.parse_args()
    mi.set_variant("llvm_ad_" + args.mode)
    mi.set_log_level(mi.LogLevel.Error)
    with tempfile.TemporaryDirectory() as folder:
        maker = (random_parts.Maker if args.cause == "plastic" else OldMaker)(args.seed, args.mode, folder)
        text = maker.scene()
        own_text, peer_text = {"blend": blend, "cylinder": cylinder, "plastic": plastic}[args.cause](text, folder)
        made = {}

        def pictures(program, content):
            if (program, content) not in made:
                path = os.path.join(folder, program + ".xml")
                with open(path, "w") as f:
                    f.write(content)
                made[program, content] = (random_scenes.own_pictures(args.importon, path, args.mode, args.spp, args.runs, 3000, folder) if program == "own"
                                          else random_scenes.peer_pictures(mi.load_file(path, optimize=False), args.spp, args.runs, 7000))
            return made[program, content]

        for name, a, b in (("as they are", text, text), ("with the change here", own_text, text), ("with the change there", text, peer_text),
                           ("with the change in both", own_text, peer_text)):
            if (a, b) == (text, text) and name != "as they are" or name.endswith("both") and text in (own_text, peer_text):
                continue
            own, peer = pictures("own", a), pictures("peer", b)
            z, whole = random_scenes.welch(own, peer), random_scenes.welch(own.mean(1), peer.mean(1))
            error = np.hypot(own.mean((1, 2)).std(), peer.mean((1, 2)).std()) / np.sqrt(args.runs) / peer.mean()
            print("%-24s worst %6.2f mean %6.2f ratio %.5f +- %.1e, %d of %d beyond 2" % (
                name, z.flat[np.abs(z).argmax()], whole[np.abs(whole).argmax()], own.mean() / peer.mean(), error, (np.abs(z) > 2).sum(), z.size), flush=True)


if __name__ == "__main__":
    sys.exit(main())
