#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fits by Levenberg and Marquardt of two builds of the program beside each other: processor seconds to
the same interval.

    bench/fit_versions.py [--seeds N] [--spp S] [--new-spp A,B,..] [--cases cornell,stam] OLD NEW

OLD and NEW are paths of two cli/importon. Each seed has a target of its own, 512 samples with their errors, and is
fitted by OLD with S samples (64) and by NEW with A, B, .. (S), one thread each, in turn. Of each setting it prints
processor seconds (user and system) over OLD's, medians of the ratios of seeds; the geometric mean of the standard errors of
all numbers over OLD's; seconds x errors^2, what NEW takes for the error of OLD where all of it falls with samples;
and the mean z^2 of both, from the truth. With several settings, the last line is the time to OLD's error itself, between
those.
"""
import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile

SCENES = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "scenes")
LAMP = (20.7108, 10.8546, 2.77115)
# Name: the scene with its $defaults, active numbers, where they start.
CASES = {
    "cornell": (
        ["cornell.xml", "-D", "res=64"],
        ["white.*", "red.*", "green.*", "light.*"],
        {"white.reflectance.value": ".4", "red.reflectance.value": ".4", "green.reflectance.value": ".4",
         "light.radiance.value": ",".join(str(0.5 * x) for x in LAMP)}),
    "stam": (
        ["stam.xml", "-D", "res=32", "-D", "integrator=path", "-m", "mono"],
        ["*"],
        {"sphere.ambient.value": ".03", "sphere.diffuse.value": ".35", "sphere.specular.value": ".4",
         "sphere.exponent.value": "15", "walls.ambient.value": ".04", "walls.diffuse.value": ".4",
         "light.emission.value": "4"}),
}


def run(program, words):
    """What it prints and its processor seconds."""
    child = subprocess.Popen([program] + words + ["-q", "-t", "1"], stdout=subprocess.PIPE)
    text = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        sys.exit("%s %s failed" % (program, " ".join(words)))
    return text, usage.ru_utime + usage.ru_stime


def scene_words(name):
    words = CASES[name][0]
    return [os.path.join(SCENES, words[0])] + words[1:]


def truth(program, name):
    """The scene's numbers, as a fit names them."""
    out = {}
    for p in json.loads(run(program, ["info", "--json"] + scene_words(name))[0])["params"]:
        if isinstance(p["value"], list) and len(p["value"]) > 1:
            out.update(("%s[%d]" % (p["name"], k), x) for k, x in enumerate(p["value"]))
        else:
            out[p["name"]] = p["value"][0] if isinstance(p["value"], list) else p["value"]
    return out


class Setting:
    def __init__(self, program, spp):
        self.program, self.spp = program, spp
        self.seconds, self.fits, self.iterations = [], [], []

    def fit(self, name, target, seed):
        _, active, start = CASES[name]
        words = ["fit"] + scene_words(name) + ["-T", target, "--optimizer", "lm", "--json", "--spp", str(self.spp),
                                               "--seed", str(1000 + seed)]
        for p in active:
            words += ["-p", p]
        for p, value in start.items():
            words += ["--set", p + "=" + value]
        text, seconds = run(self.program, words)
        fit = json.loads(text)
        self.seconds.append(seconds)
        self.iterations.append(fit["iterations"])
        self.fits.append({p["name"]: (p["value"], p["se"]) for p in fit["params"] if p["se"] is not None})


def against(old, new, true):
    """Ratios of seconds and of errors of new over old; mean z^2 of new; numbers without interval."""
    seconds = statistics.median(b / a for a, b in zip(old.seconds, new.seconds))
    logs, z2, lost = [], [], 0
    for a, b in zip(old.fits, new.fits):
        lost += len(set(a) - set(b)) - len(set(b) - set(a))
        logs += [math.log(b[k][1] / a[k][1]) for k in a if k in b and a[k][1] > 0 and b[k][1] > 0]
        z2 += [((v - true[k]) / se) ** 2 for k, (v, se) in b.items() if se > 0]
    return seconds, math.exp(statistics.fmean(logs)), statistics.fmean(z2), lost


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--new-spp")
    parser.add_argument("--cases", default="cornell,stam")
    parser.add_argument("--target-spp", type=int, default=512)
    parser.add_argument("old")
    parser.add_argument("new")
    o = parser.parse_args()
    for name in o.cases.split(","):
        old = Setting(o.old, o.spp)
        new = [Setting(o.new, int(s)) for s in (o.new_spp or str(o.spp)).split(",")]
        true = truth(o.new, name)
        with tempfile.TemporaryDirectory() as work:
            target = os.path.join(work, "target.exr")
            for seed in range(o.seeds):
                run(o.old, ["render"] + scene_words(name) + ["--spp", str(o.target_spp), "--seed", str(77 + seed), "--se",
                                                             "--no-preview", "-o", target])
                for setting in [old] + new:
                    setting.fit(name, target, seed)
        z2 = against(old, old, true)[2]
        print("%s, %d seeds: old, %d spp: %.2f s, %.1f iterations, mean z^2 %.2f" % (
            name, o.seeds, o.spp, statistics.median(old.seconds), statistics.fmean(old.iterations), z2))
        found = []
        for setting in new:
            seconds, errors, z2, lost = against(old, setting, true)
            found.append((math.log(errors), math.log(seconds)))
            print("  new, %d spp: time %.2f (%.2f to %.2f; %.1f iterations), error %.2f, time x error^2 %.2f, mean z^2 %.2f%s"
                  % (setting.spp, seconds, min(b / a for a, b in zip(old.seconds, setting.seconds)),
                     max(b / a for a, b in zip(old.seconds, setting.seconds)), statistics.fmean(setting.iterations),
                     errors, seconds * errors ** 2, z2, ", %d more numbers without interval" % lost if lost else ""))
        found.sort()
        for (e0, s0), (e1, s1) in zip(found, found[1:]):
            if e0 <= 0 <= e1:
                print("  the same error in %.2f of the time" % math.exp(s0 + (s1 - s0) * -e0 / (e1 - e0)))


main()
