#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Pages of reports in a headless Chromium, from file://.

Usage: browser.py IMPORTON SCENES

A copy of the page gets one more script, which acts as a reader does and leaves what it
found in the page; the browser prints the page.
"""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

import numpy as np

importon, scenes = sys.argv[1:]
browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
count = failed = 0


def ok(good, what):
    global count, failed
    count += 1
    failed += not good
    print("%sok %d - %s" % ("" if good else "not ", count, what), flush=True)


def run(*words):
    return subprocess.run([importon, *words], check=True, capture_output=True, text=True).stdout


def look(page, script, *options):
    """What `script`, the body of an async function, returns in the page."""
    text = open(page, encoding="utf-8", errors="replace").read()
    end = text.rindex("</body>")
    probe = "<script>(async () => { let found; try { found = await (async () => { %s })(); }" \
            " catch (error) { found = {error: String(error.stack)}; }" \
            " const out = document.createElement('pre'); out.id = 'found'; out.textContent = JSON.stringify(found);" \
            " document.body.append(out); })();</script>" % script
    copy = os.path.join(os.path.dirname(page), "probe.html")
    open(copy, "w", encoding="utf-8").write(text[:end] + probe + text[end:])
    done = subprocess.run([browser, "--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader", "--virtual-time-budget=20000", "--user-data-dir=" + os.path.join(folder, "profile"),
        "--host-resolver-rules=MAP * ~NOTFOUND", *options, "--dump-dom", "file://" + copy],
        capture_output=True, text=True, timeout=300)
    found = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.S)
    if not found: raise RuntimeError("the page left nothing: " + done.stderr[-500:])
    import html
    answer = json.loads(html.unescape(found[1]))
    if isinstance(answer, dict) and "error" in answer: raise RuntimeError(answer["error"])
    return answer


if not browser:
    print("1..0 # SKIP no chromium")
    sys.exit(0)
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
# The same pixels as the picture in the report, by another way out of the program.
run("render", cornell, *common, "--spp", "64", "--seed", "5", "--no-preview", "-o", folder + "/t.npy")
truth = np.load(folder + "/t.npy")

# ---- Numbers under the cursor ---------------------------------------------------------
read = """
const canvas = document.querySelector("canvas.view"), box = canvas.getBoundingClientRect(), found = [];
for (const [x, y] of [[0, 0], [24, 24], [47, 47], [10, 30], [30, 12], [25, 3]]) {
    canvas.dispatchEvent(new PointerEvent("pointermove", {clientX: box.left + (x + 0.5) * box.width / 48,
        clientY: box.top + (y + 0.5) * box.height / 48, bubbles: true}));
    found.push({x, y, place: document.getElementById("pixel").textContent,
        rows: [...document.querySelectorAll("#pictures .stage tr")].map((r) => r.cells[0].textContent + "=" + r.cells[1].textContent)});
}
return {found, ready: document.documentElement.dataset.ready, gl: !!document.createElement("canvas").getContext("webgl2")};
"""
answer = look(page, read)
ok(answer["ready"] == "1", "the page is drawn, offline%s" % ("" if answer["gl"] else " # without WebGL2"))
worst, places = 0., True
for pixel in answer["found"]:
    places &= pixel["place"] == "pixel %d, %d" % (pixel["x"], pixel["y"])
    rows = dict(r.split("=") for r in pixel["rows"])
    for c, name in enumerate("RGB"):
        shown, _, se = rows["target " + name].partition(" ± ")
        value = float(truth[pixel["y"], pixel["x"], c])
        # Shown with two digits of its error: what is cut off is below a twentieth of it.
        allowed = abs(value) * 2. ** -11 + (0.05 * float(se) if se else 5e-6 * abs(value))
        worst = max(worst, abs(float(shown) - value) / allowed if allowed else 0)
ok(places and worst <= 1, "the pixel under the cursor is the file's # %.2f of half a unit and what is shown" % worst)

# ---- By keyboard alone ----------------------------------------------------------------
keys = """
const press = (key, where = document.body) => where.dispatchEvent(new KeyboardEvent("keydown", {key, bubbles: true}));
const pressed = () => [...document.querySelectorAll("#pictures button")].findIndex((b) => b.getAttribute("aria-pressed") === "true");
const order = [];
for (const key of ["3", "1", "2", "9"]) { press(key); order.push(pressed()); }
const canvas = document.querySelector("canvas.view");
canvas.focus();
for (const key of ["ArrowRight", "ArrowRight", "ArrowDown"]) press(key, canvas);
return {order, pixel: document.getElementById("pixel").textContent, focused: document.activeElement === canvas,
    reachable: [...document.querySelectorAll("button, input, select, canvas.view, .thumbs canvas[role=button]")].every((e) => e.tabIndex >= 0)};
"""
answer = look(page, keys)
ok(answer["order"] == [2, 0, 1, 1], "keys 1 to 9 choose the layer, and one too many does nothing")
ok(answer["pixel"] == "pixel 2, 1" and answer["focused"] and answer["reachable"],
   "arrows move the pixel; whatever can be pressed can be reached by Tab")

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

# ---- Widths, and a page from strangers ----------------------------------------------------
for width in (400, 800, 2000):
    wide = look(page, "return [document.documentElement.scrollWidth, innerWidth]", "--window-size=%d,900" % width)
    # Chromium's windows are 500 pixels wide at least.
    ok(wide[0] <= wide[1], "%d pixels wide: nothing runs over the edge # %d" % (wide[1], wide[0]))

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
shutil.rmtree(folder, ignore_errors=True)
print("1..%d" % count)
sys.exit(failed > 0)
