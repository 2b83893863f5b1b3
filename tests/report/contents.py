#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What pages say of elements, walks and fits, in a headless Chromium: the numbers that a reader sees are those
of the command's own files.

Usage: contents.py IMPORTON SCENES
"""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

from chromium import PROGRAM, Browser
from tap import done, ok

importon, scenes = sys.argv[1:]


def run(*words):
    return subprocess.run([importon, *words], check=True, capture_output=True, text=True).stdout


def data(page, kind):
    report = json.loads(re.search(r'id="data">(.*?)</script>', open(page, encoding="utf-8").read(), re.S)[1])
    return next(i["data"] for i in report["items"] if i["kind"] == kind)


def look(page, script):
    """What `script`, the body of a function, returns in the page."""
    tab = browser.tab("file://" + page)
    tab.wait("document.documentElement.dataset.ready")
    answer = tab.run(script)
    ok(not tab.errors, "no script failed # %s" % tab.errors)
    tab.close()
    return answer


if not PROGRAM:
    print("1..0 # SKIP no chromium")
    sys.exit(0)
browser = Browser()
folder = tempfile.mkdtemp()
cornell, room = os.path.join(scenes, "cornell.xml"), os.path.join(scenes, "elements", "d.xml")
near = lambda shown, value, digits: abs(float(shown) - value) <= 10. ** (1 - digits) * abs(value)

# ---- Elements ------------------------------------------------------------------------------
e = os.path.join(folder, "e")
run("elements", room, "-D", "res=16", "-q", "--stop", "5", "--lux", "floor", "--report", e)
run("report", e, "-q")
page = e + "/report.html"
mesh, own = data(page, "mesh"), json.load(open(e + "/elements.json"))
answer = look(page, """const s = document.getElementById("elements"), canvas = s.querySelector("canvas.space"), before = canvas.toDataURL();
canvas.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowLeft", bubbles: true}));
const turned = canvas.toDataURL(); canvas.dispatchEvent(new KeyboardEvent("keydown", {key: "+", bubbles: true}));
const zoomed = canvas.toDataURL(); canvas.dispatchEvent(new KeyboardEvent("keydown", {key: "n", bubbles: true}));
const by = s.querySelector("select"), pictures = [...by.options].map((o) => { by.value = o.value; by.dispatchEvent(new Event("change")); return canvas.toDataURL(); });
return {turned: turned !== before, zoomed: zoomed !== turned, ways: new Set(pictures).size, said: s.querySelector("[aria-live]").textContent,
    links: [...s.querySelectorAll(".scroll tbody")].map((b) => [...b.rows].map((r) => [...r.cells].map((c) => c.textContent))),
    lamps: [...s.querySelector("table.shares").tBodies[0].rows].map((r) => [...r.cells].map((c) => c.textContent)),
    isolines: s.querySelectorAll("path.isoline").length, flat: s.querySelectorAll("polygon.element").length, chosen: s.querySelectorAll("polygon.chosen").length,
    measured: [...document.querySelectorAll("#measurements tbody td")].map((t) => t.textContent)}""")
first = mesh["elements"][0]
ok(answer["turned"] and answer["zoomed"] and answer["ways"] == 4, "elements turn and zoom by keys, in four ways of colour")
ok("illuminance %.5g" % first["illuminance"] in answer["said"] and answer["chosen"] == 1
   and answer["flat"] == sum(x["polygon"] == first["polygon"] for x in mesh["elements"]), "a chosen one, in space and flat # %(said)s" % answer)
rows = answer["links"][0]
ok(all(near(r[1], l[1], 4) for r, l in zip(rows, first["links"])) and len(rows) == len(first["links"]) + (first["n_links"] > len(first["links"])),
   "the links that light arrives by")
ok([r[0] for r in answer["lamps"]] == [l["name"] for l in mesh["lamps"]]
   and all(near(r[1].split()[0], 100 * l["share"], 4) for r, l in zip(answer["lamps"], mesh["lamps"])), "lamps ranked by their shares")
ok(answer["isolines"] > 0 and near(answer["measured"][1], own["measurements"][0]["value"], 6), "illuminance with isolines, and the measurement")

# ---- A fit: is it explained, iterations, charts ------------------------------------------------
f = os.path.join(folder, "f")
common = ["-D", "res=32", "-q"]
run("render", cornell, *common, "--spp", "64", "--seed", "5", "--se", "-o", folder + "/t.exr", "--no-preview")
run("fit", cornell, *common, "--target", folder + "/t.exr", "--set", "red.reflectance.value=0.5", "-p", "red.*", "-p", "green.*", "-p", "white.*",
    "-p", "lamp.*", "-p", "light.*", "--spp", "32", "--optimizer", "lm", "--picture-spp", "32", "-o", f)
run("report", f, "-q", "--scene", cornell, "-D", "res=32", "--walks", "15,20")
page = f + "/report.html"
explained, fit, walks = data(page, "explained"), data(page, "fit"), data(page, "walks")
answer = look(page, """const slider = document.querySelector("#loss input[type=range]"), told = () => document.querySelector("#loss [aria-live]").textContent;
const values = () => [...document.querySelectorAll("#parameters tbody tr")].map((r) => Number(r.cells[2].textContent)), go = (i) => { slider.value = i; slider.dispatchEvent(new Event("input")); return values(); };
const s = document.getElementById("walks"), by = s.querySelector("select"), canvas = s.querySelector("canvas.space");
const colours = [...by.options].map((o) => { by.value = o.value; by.dispatchEvent(new Event("change")); return canvas.toDataURL(); });
return {explained: document.querySelector(".explained").textContent, stops: Number(slider.max), last: go(slider.max), answer: told(), before: go(slider.max - 1), iteration: told(),
    charts: document.querySelectorAll("#loss .traces svg").length, ways: [...by.options].map((o) => o.textContent), colours: new Set(colours).size,
    shares: [...s.querySelectorAll("table.shares tbody tr")].map((r) => [...r.cells].map((c) => c.textContent))}""")
ok("The picture is explained" in answer["explained"] and "%.4g" % explained["chi2"] in answer["explained"] and explained["explained"],
   "the picture is explained, in words # %s" % answer["explained"][:120])
ok(answer["stops"] == len(fit["history"]["loss"]) and "the answer" in answer["answer"] and "iteration" in answer["iteration"]
   and all(near(a, p["value"], 6) or a == p["value"] for a, p in zip(answer["last"], fit["params"]))
   and all(near(a, x, 6) or a == x for a, x in zip(answer["before"], fit["history"]["x"][-1])), "the last stop of the slider is the answer")
ok(answer["charts"] == len(fit["params"]) == 15, "every number has its chart")
params = [p["name"] for p in walks["params"]]
told = {p: s for p, s in zip(params, walks["pixels"][0]["shares"]) if s[0]}
ok(answer["ways"][2:] == ["x dL/dx of " + p for p in params] and answer["colours"] >= 4, "walks are coloured by what each parameter does")
ok({r[0] for r in answer["shares"]} == set(told) and all(near(r[1].split()[0], 100 * told[r[0]][0], 4) for r in answer["shares"]),
   "which lamp and which reflectance carried the pixel")
browser.close()
shutil.rmtree(folder, ignore_errors=True)
done()
