#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What pages of reports show, in a headless Chromium, from file://. (hold.py: numbers,
keyboard, widths, looks.)

Usage: browser.py IMPORTON SCENES
"""
import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
import zlib

from chromium import PROGRAM, Browser
from tap import done, ok

importon, scenes = sys.argv[1:]
VERSION = 2  # of the data


def run(*words):
    return subprocess.run([importon, *words], check=True, capture_output=True, text=True).stdout


def look(page, script):
    """What `script`, the body of an async function, returns in the page."""
    tab = browser.tab("file://" + page)
    tab.wait("document.documentElement.dataset.ready")
    answer = tab.run(script)
    errors.extend(tab.errors)
    tab.close()
    return answer


if not PROGRAM:
    print("1..0 # SKIP no chromium")
    sys.exit(0)
browser, errors = Browser(), []
folder = tempfile.mkdtemp()
result = os.path.join(folder, "result")
page = os.path.join(result, "report.html")
cornell = os.path.join(scenes, "cornell.xml")
common = ["-D", "res=48", "-q"]
run("render", cornell, *common, "--spp", "64", "--seed", "5", "--se", "-o", folder + "/t.exr", "--no-preview")
run("fit", cornell, *common, "--target", folder + "/t.exr", "--set", "red.reflectance.value=0.5", "-p", "red.*", "-p",
    "light.*", "--spp", "32", "--optimizer", "lm", "--picture-spp", "16", "-o", result)
run("jacobian", cornell, *common, "--spp", "16", "-p", "red.*", "-o", result)
run("check", cornell, *common, "--spp", "16", "-p", "red.*", "--json", "-o", result + "/check.json")
run("report", result, "-q", "--scene", cornell, "-D", "res=48", "--walks", "4")
# ---- Walks ------------------------------------------------------------------------------
walks = """
const canvas = document.querySelector("#walks canvas"), press = (key) => canvas.dispatchEvent(new KeyboardEvent("keydown", {key, bubbles: true}));
const before = canvas.toDataURL(), rows = () => document.querySelectorAll("#walks tbody tr").length;
press("ArrowLeft");
const turned = canvas.toDataURL() !== before, none = rows();
press("n");
return {turned, none, first: rows(), said: document.querySelector("#walks .mono[aria-live]").textContent};
"""
answer = look(page, walks)
ok(answer["turned"] and answer["none"] == 0 and answer["first"] > 0 and answer["said"].startswith("pixel 6, 6, sample 0"),
   "walks turn, and one is listed vertex by vertex")

# ---- What it says ----------------------------------------------------------------------
text = look(page, 'return document.getElementById("page").innerText')
told = json.load(open(result + "/parameters.json"))
least = max((p for p in told["params"] if p["se"]), key=lambda p: abs(p["se"] / p["value"]))
ok("Least certain, relative to its value: " + least["name"] in text, "which number is least certain")
ok("importon fit" in text and "--seed" not in text and "optimizer" in text, "the command that made it")
ok(all(p["name"] in text for p in told["params"]) and "none disagrees" in text, "all parameters, and the checks")
sizes = look(page, 'return [...document.querySelectorAll("#correlations rect title")].map((t) => t.textContent)')
ok(len(sizes) == len(told["params"]) ** 2 and all(abs(float(s.rsplit(": ")[1].replace("–", "nan"))) <= 1 + 1e-9 for s in sizes),
   "correlations are between -1 and 1")

# ---- Iterations ------------------------------------------------------------------------
scrub = """
const slider = document.querySelector("#loss input[type=range]"), cells = () => [...document.querySelectorAll("#parameters tbody tr")].map((r) => r.cells[2].textContent);
const go = (i) => { slider.value = i; slider.dispatchEvent(new Event("input")); return cells(); };
const end = cells();
return {end, first: go(0), last: go(slider.max), heads: document.querySelector("#parameters th:nth-child(3)").textContent, drawn: document.querySelectorAll("#loss .traces svg").length};
"""
answer = look(page, scrub)
first = [float(x) for x in answer["first"]]
ok(all(abs(a - b) <= 1e-5 * abs(b) for a, b in zip(first, told["history"]["x"][0])) and answer["last"] == answer["end"] and answer["end"] != answer["first"]
   and answer["drawn"] == len(first), "scrubbing moves the parameters to those of the iteration, and back")

# ---- Bent rays --------------------------------------------------------------------------
lens = os.path.join(scenes, "bend", "focus.xml")
run("bend", "view", lens, "-q", "-o", folder + "/lens", "--truth", lens)
run("report", folder + "/lens", "-q")
answer = look(folder + "/lens/report.html", """const s = document.getElementById("rays"), canvas = s.querySelector("canvas.space"), before = canvas.toDataURL();
canvas.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowLeft", bubbles: true}));
return {turned: canvas.toDataURL() !== before, rays: s.querySelectorAll("path.ray").length, spots: s.querySelectorAll("circle.spot").length, truth: s.querySelectorAll("path.truth").length,
    said: [...s.querySelectorAll("figcaption")].map((c) => c.textContent).join("\\n")}""")
ok(answer["turned"] and answer["rays"] > 100 and answer["spots"] > 100 and answer["truth"] == 3 and "0 apart at most" in answer["said"],
   "bent rays in space, in sections, as spots; and found over true # %(rays)d, %(spots)d" % answer)

# ---- Pages from strangers ----------------------------------------------------------------
strange = os.path.join(folder, "strange")
os.mkdir(strange)
name = "</script><img src=x onerror=document.title=1><script>document.title=2</script>"
rows = [{"name": "p%d" % i, "unit": "1", "start": 1, "value": None, "se": None, "lo95": None, "hi95": None, "at_bound": 0,
         "determined": False} for i in range(100000)]
rows[0]["name"] = rows[0]["unit"] = name
json.dump({"importon": "0", "command": "fit", "loss": name, "value": None, "se": None, "iterations": 0, "reason": name, "warning": name,
           "params": rows, "history": {"loss": [None, None], "se": []}}, open(strange + "/parameters.json", "w"), separators=(",", ":"))
run("report", strange, "-q", "--title", name)
answer = look(strange + "/report.html", """return {ready: document.documentElement.dataset.ready, images: document.images.length,
    title: document.title, header: document.querySelector("h1").textContent, rows: document.querySelectorAll("#parameters tbody tr").length,
    name: document.querySelector("#parameters td").textContent}""")
ok(answer["ready"] == "1" and answer["images"] == 0 and answer["title"] == name and answer["header"] == name and answer["name"] == name,
   "names that look like markup are text")
ok(answer["rows"] == 200, "of 100,000 parameters without values, 200 are listed")
# Names that look like markup, wherever a page shows one; numbers that are none; nothing at all.
ugly = os.path.join(folder, "ugly")
os.mkdir(ugly)
run("render", cornell, "-D", "res=8", "-q", "--spp", "4", "--se", "-o", ugly + "/picture.exr", "--no-preview")
json.dump({"importon": "0", "command": "fit", "loss": name, "optimizer": name, "value": 1, "se": 1, "iterations": 1, "reason": name, "warning": name,
           "residual": None, "residual_hi": None, "chi2_per_freedom": None, "covariance": [[1, 0], [0, None]], "undetermined": {"names": [name], "direction": [None]},
           "params": [dict(rows[0], value=1, se=0, lo95=1, hi95=1, start=name), dict(rows[1], name=name + "2", unit=None, start=None)],
           "history": {"loss": [1, None, 2], "se": [None, 0, 1], "names": [name, 3], "x": [[1, None], [None, None], [2, 2]]}}, open(ugly + "/parameters.json", "w"))
walk = {"pixel": [0, 0], "sample": 0, "origin": [0, 0, 0], "direction": [0, 0, 1], "radiance": [None], "vertices": [
    {"shape": name, "bsdf": name, "light": name, "position": [0, 0, 1], "throughput": [None], "emission": [], "arriving": [None]},
    {"shape": "", "bsdf": "", "escapes": [0, 0, 1], "throughput": [1], "emission": [1], "arriving": [0]}]}
answers = {"check": {"rows": [{"method": name, "param": name, "value": None, "reference": None, "error": None, "limit": None, "ok": False}]},
           "gradient": {name: name, "params": [{"name": name, name: [name], "grad": None}], "empty": [], "nothing": None}, "walks": {"bounds": [[None] * 3] * 2, "walks": [walk, {}]},
           "bend": {"rays": None, "history": {"loss": []}}, "elements": {}, name: {name: [{name: name}]}}
for number, (kind, content) in enumerate(answers.items()):
    json.dump({"importon": "0", "command": kind, **content}, open(ugly + "/%d.json" % number, "w"))
run("report", ugly, "-q", "--title", name)
errors.clear()
answer = look(ugly + "/report.html", """return {ready: document.documentElement.dataset.ready, images: document.images.length, title: document.title,
    scripts: document.scripts.length, text: document.getElementById("page").innerText}""")
ok(answer["ready"] == "1" and answer["images"] == 0 and answer["title"] == name and answer["scripts"] == 2 and name in answer["text"] and not errors,
   "and so they are in walks, checks, gradients and histories, beside numbers that are none%s" % (" # " + "; ".join(errors[:3]) if errors else ""))

# The page is drawn from data that nobody wrote so far: kinds that it does not know, wrong types, nothing.
bare = open(page, encoding="utf-8").read()
start = bare.index('id="data">') + len('id="data">')
end = bare.index("</script>", start)
known = ("picture", "derivative", "fit", "check", "walks", "rays", "bend", "image", "elements", "gradient", "manifest")
cases = {"no items": [], "unknown kinds": [{"kind": "later", "data": {"a": 1}}, {"kind": "later"}],
         "empty data": [{"kind": k, "data": {}} for k in known if k not in ("picture", "derivative", "image")],
         "wrong types": [{"kind": k, "data": d} for k in ("fit", "check", "walks", "rays", "bend", "elements") for d in (None, [], 3, "text", {"params": 3, "rows": 3, "walks": 3, "history": 3})],
         "pictures of nothing": [{"kind": "picture", "name": "x", "width": 1, "height": 1, "spp": 0, "view": 0, "not_finite": 1, "channels": ["R"], "pixels": p, "scale": 1} for p in (base64.b64encode(zlib.compress(bytes([0, 0x7e]))).decode(), "AHw=", "", "???")]}
for what, items in cases.items():
    text = json.dumps({"schema": "importon-report", "version": VERSION, "importon": "0", "items": items}).replace("<", "\\u003c")
    open(folder + "/bare.html", "w", encoding="utf-8").write(bare[:start] + text + bare[end:])
    errors.clear()
    answer = look(folder + "/bare.html", 'return [document.documentElement.dataset.ready, document.getElementById("page").innerText]')
    ok(answer[0] == "1" and not errors and (items or "holds nothing" in answer[1]), "%s: the page stands%s" % (what, " # %s %s" % (answer[1][:80], "; ".join(errors[:3])) if answer[0] != "1" or errors else ""))
    if what == "pictures of nothing": ok("not finite" in answer[1] and "all of it" in answer[1] and "cannot be shown" in answer[1], "and says what is no number, and what is no picture")
    if what == "wrong types": ok("cannot be shown" in answer[1], "and says what it cannot show")
browser.close()
shutil.rmtree(folder, ignore_errors=True)
done()
