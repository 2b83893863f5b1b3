#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The page of importon view in a headless Chromium: what a reader sees and presses while
work goes on, what another site's page may not, and how it ends. (view.py: the same server
without a browser.)

Usage: live.py IMPORTON SCENES
"""
import fcntl
import http.server
import json
import os
import pty
import shutil
import signal
import subprocess
import sys
import tempfile
import termios
import threading
import time

from chromium import PROGRAM, Browser
from tap import done, ok

importon, scenes = sys.argv[1:]
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # under nohup it is ignored, and the command leaves it so

if not PROGRAM:
    print("1..0 # SKIP no chromium")
    sys.exit(0)
folder = tempfile.mkdtemp()
cornell = os.path.join(scenes, "cornell.xml")
browser = Browser(network=True)
processes = []


def view(*words, **options):
    process = subprocess.Popen([importon, "view", *words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, **options)
    processes.append(process)
    return process, process.stdout.readline().strip()


def centre(tab, selector):
    return tab.run("""const b = document.querySelector(%s); b.scrollIntoView({block: "center"}); const r = b.getBoundingClientRect(); return [r.left + r.width / 2, r.top + r.height / 2]""" % json.dumps(selector))


said = """document.getElementById("state").textContent"""
layer = """JSON.stringify([...document.querySelector("canvas.view").getContext("2d").getImageData(0, 0, 64, 64).data])"""
try:
    # ---- A render ---------------------------------------------------------------------------
    out = os.path.join(folder, "picture.exr")
    process, url = view(cornell, "-D", "res=32", "--seed", "3", "--spp", "64", "-p", "red.*", "-p", "light.*", "-o", out)
    tab = browser.tab(url)
    ok(tab.wait(said + """.startsWith("render: done")""") and tab.wait("""document.querySelector("canvas.view")"""), "the page loads with its token, and a picture arrives")
    ok(tab.run("""return document.querySelectorAll("#live input[type=range]").length""") == 6, "with a slider for each number")
    before, news = tab.run("return " + layer), tab.run("return Number(document.documentElement.dataset.news)")
    tab.run("""const s = document.getElementById("number-light.radiance.value[0]"); s.value = 40; s.dispatchEvent(new Event("input"))""")
    # While the picture is made anew it already follows; in the end it is whole again.
    ok(tab.wait("Number(document.documentElement.dataset.news) > %d && %s !== %s" % (news, layer, json.dumps(before))) and tab.wait(said + """.startsWith("render: done")"""),
       "a slider that is moved changes the picture")
    tab.run("""document.getElementById("number-red.reflectance.value[0]").focus()""")
    at = tab.run("""return document.activeElement.value""")
    news = tab.run("return Number(document.documentElement.dataset.news)")
    for _ in range(20): tab.press("ArrowLeft")
    ok(float(tab.run("return document.activeElement.value")) < float(at) and tab.wait("Number(document.documentElement.dataset.news) > %d" % news), "so do the arrow keys, and the slider keeps the focus # %s to %s"
       % (at, tab.run("return document.activeElement.value")))
    tab.wait(said + """.startsWith("render: done")""")
    x, y = centre(tab, "canvas.view")
    tab.click(x, y)
    ok(tab.wait("""document.querySelector("#walks canvas") && /^16 walks/.test(document.querySelector("#walks .mono[aria-live]").textContent)"""), "a click shows the pixel's walks")
    tab.run("""document.querySelector("canvas.view").focus()""")
    tab.press("ArrowRight"), tab.press("Enter")
    pixel = tab.run("""return document.getElementById("pixel").textContent""")
    tab.run("""await new Promise((done) => setTimeout(done, 500)); document.querySelector("#walks canvas").focus()""")
    tab.press("n")
    ok(tab.wait("""document.querySelector("#walks .mono[aria-live]").textContent.startsWith(document.getElementById("pixel").textContent)"""), "and so does Enter # %s" % pixel)
    tab.click(*centre(tab, "#do-save"))
    ok(tab.wait("""/saved/.test(%s)""" % said) and os.path.exists(out), "save writes the picture")
    ok(not tab.errors, "no script failed%s" % (" # %s" % tab.errors if tab.errors else ""))

    # ---- Who may not ----------------------------------------------------------------------------
    class Other(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><p>Another site.")

        def log_message(self, *_): pass

    other = http.server.HTTPServer(("127.0.0.1", 0), Other)
    threading.Thread(target=other.serve_forever, daemon=True).start()
    strange = browser.tab("http://127.0.0.1:%d/" % other.server_port)
    got = strange.run("""const url = %s, tell = (wait) => wait.then((a) => a.type === "opaque" ? "sent" : a.status, () => "refused");
        const frame = document.createElement("iframe"); frame.src = url; document.body.append(frame);
        const script = (src) => new Promise((done) => { const s = document.createElement("script"); s.onload = () => done("loaded"); s.onerror = () => done("refused"); s.src = src; document.body.append(s); });
        await new Promise((done) => { frame.onload = done; setTimeout(done, 2000); });
        let inside; try { inside = frame.contentDocument === null ? "closed" : frame.contentDocument.title; } catch (error) { inside = "closed"; }
        const stream = await new Promise((done) => { const e = new EventSource(url + "events"); e.onopen = () => done("open"); e.onerror = () => done("refused"); });
        return [await tell(fetch(url)), await tell(fetch(url + "act?do=set&name=red.reflectance.value[0]&value=0.9", {method: "POST"})), await script(url + "events?x"), stream, inside];""" % json.dumps(url))
    ok(got == ["refused"] * 4 + ["closed"], "another site's page reads, asks, loads and frames nothing # %s" % got)
    strange.run("""await fetch(%s, {method: "POST", mode: "no-cors"}).catch(() => 0)""" % json.dumps(url + "act?do=set&name=red.reflectance.value[0]&value=0.9"))
    time.sleep(0.5)
    ok(float(tab.run("""return document.getElementById("number-red.reflectance.value[0]").value""")) < 0.85, "a request that it sends blindly moves nothing")
    token = url.rstrip("/").rsplit("/", 1)[1]
    strange.go(url.replace(token, token[::-1]))
    ok("importon report" not in strange.run("return document.documentElement.outerHTML") and strange.run("return document.querySelector('#data')") is None, "without the token there is no page")
    strange.close()
    other.shutdown()
    process.send_signal(signal.SIGINT)
    ok(process.wait(60) == 130 and tab.wait("""/ended|lost/.test(%s)""" % said), "Ctrl-C ends it, and the page says so # %s" % tab.run("return " + said))
    tab.close()

    # ---- A fit is stopped and resumed --------------------------------------------------------------
    subprocess.run([importon, "render", cornell, "-D", "res=16", "--spp", "64", "--se", "--no-preview", "-q", "-o", folder + "/t.exr"], check=True)
    process, url = view(cornell, "-D", "res=16", "--spp", "4", "--target", folder + "/t.exr", "--set", "red.reflectance.value=0.4", "-p", "red.*", "--optimizer", "adam",
                        "-n", "2000", "-o", folder + "/fit")
    tab = browser.tab(url)
    ok(tab.wait("""document.querySelector("#loss svg") && document.querySelectorAll("#parameters tbody tr").length === 3"""), "a fit shows its numbers and its loss as it runs")
    tab.click(*centre(tab, "#do-stop"))
    ok(tab.wait(said + """.startsWith("fit: stopped")"""), "stop stops it")
    time.sleep(0.5) # what was sent before is unpacked behind the news of its state
    at = tab.run("""return document.querySelector("#parameters tbody").textContent""")
    time.sleep(0.5)
    still = tab.run("""return document.querySelector("#parameters tbody").textContent""")
    tab.click(*centre(tab, "#do-go"))
    ok(at == still and tab.wait(said + """.startsWith("fit: running")""") and tab.wait("""document.querySelector("#parameters tbody").textContent !== %s""" % json.dumps(at)), "resume goes on")
    tab.click(*centre(tab, "#do-stop"))
    tab.wait(said + """.startsWith("fit: stopped")""")
    tab.click(*centre(tab, "#do-save"))
    ok(tab.wait("""/saved/.test(%s)""" % said) and os.path.exists(folder + "/fit/parameters.json"), "save writes the folder")
    for width in (400, 800, 2000):
        tab.size(width)
        wide = tab.run("return [document.documentElement.scrollWidth, innerWidth]")
        ok(wide[0] <= wide[1], "%d pixels wide: nothing runs over the edge # %d" % (width, wide[0]))
    ok(not tab.errors, "no script failed%s" % (" # %s" % tab.errors if tab.errors else ""))
    process.terminate()
    process.wait(60)
    tab.close()

    # ---- The end of its terminal ----------------------------------------------------------------------
    master, slave = pty.openpty()

    def own_terminal():
        os.setsid()
        fcntl.ioctl(slave, termios.TIOCSCTTY, 0)

    process = subprocess.Popen([importon, "view", cornell, "-D", "res=16", "--spp", "16"], stdin=slave, stdout=subprocess.PIPE, stderr=slave, text=True, preexec_fn=own_terminal)
    processes.append(process)
    os.close(slave)
    url = process.stdout.readline().strip()
    tab = browser.tab(url)
    tab.wait("""document.querySelector("canvas.view")""")
    os.close(master)
    code = process.wait(60)
    ok(code == 129 and tab.wait("""/ended|lost/.test(%s)""" % said), "it ends with its terminal # %d" % code)
finally:
    for process in processes:
        if process.poll() is None: process.kill()
    browser.close()
shutil.rmtree(folder, ignore_errors=True)
done()
