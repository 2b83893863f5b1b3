#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""importon view without a browser: who may ask, what it tells, and how it ends.

Usage: view.py IMPORTON SCENES
"""
import base64
import hashlib
import http.client
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse
import zlib

from tap import done, ok

importon, scenes = sys.argv[1:]
PATIENCE = 120
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # under nohup it is ignored, and the command leaves it so


class View:
    """A running view; `news` [(event, value)] grows while it runs."""

    def __init__(self, *words, session=False):
        self.process = subprocess.Popen([importon, "view", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                        start_new_session=session)
        self.url = self.process.stdout.readline().strip()
        at = urllib.parse.urlsplit(self.url)
        self.host, self.port, self.path = at.hostname, at.port, at.path
        self.news, self.changed, self.ended = [], threading.Condition(), False
        threading.Thread(target=self.listen, daemon=True).start()

    def ask(self, path="", method="GET", token=None, **headers):
        """Status, headers and text of an answer."""
        c = http.client.HTTPConnection(self.host, self.port, timeout=PATIENCE)
        c.putrequest(method, (self.path if token is None else "/%s/" % token) + path, skip_host="Host" in headers)
        for name, value in headers.items(): c.putheader(name.replace("_", "-"), value)
        c.endheaders()
        answer = c.getresponse()
        text = answer.read().decode()
        c.close()
        return answer.status, answer.headers, text

    def act(self, what, **more):
        return self.ask("act?" + urllib.parse.urlencode({"do": what, **more}), "POST")[0]

    def listen(self):
        event = None
        try:
            c = http.client.HTTPConnection(self.host, self.port, timeout=PATIENCE)
            c.request("GET", self.path + "events")
            for line in c.getresponse():
                line = line.decode().rstrip("\n")
                if line.startswith("event: "): event = line[7:]
                elif line.startswith("data: "):
                    with self.changed:
                        self.news.append((event, json.loads(line[6:])))
                        self.changed.notify_all()
        except OSError:
            pass
        with self.changed:
            self.ended = True
            self.changed.notify_all()

    def wait(self, good, since=0):
        """The first piece of news, from number `since`, that is good; None: it never came."""
        with self.changed:
            end = time.monotonic() + PATIENCE
            while True:
                for event, value in self.news[since:]:
                    if good(event, value): return value
                if self.ended or time.monotonic() > end: return None
                self.changed.wait(1)

    def state(self, word, since=0):
        return self.wait(lambda event, value: event == "state" and value["state"] == word, since)

    def items(self, kind):
        with self.changed:
            return [i for event, value in self.news if event == "report" for i in value["items"] if i["kind"] == kind]

    def end(self, number=signal.SIGINT):
        self.process.send_signal(number)
        code = self.process.wait(PATIENCE)
        self.said = self.process.stderr.read()
        return code


folder = tempfile.mkdtemp()
cornell = os.path.join(scenes, "cornell.xml")
common = ["-D", "res=16", "--seed", "3"]


def mean(item):
    """Mean of the numbers of a picture's item: halves, all low bytes first."""
    packed = zlib.decompress(base64.b64decode(item["pixels"]))
    half = len(packed) // 2
    numbers = struct.unpack("<%de" % half, bytes(b for pair in zip(packed[:half], packed[half:]) for b in pair))
    return sum(numbers) * item["scale"] / half


def run(*words):
    return subprocess.run([importon, *words], check=True, capture_output=True, text=True).stdout


# ---- Who may ask ------------------------------------------------------------------------
out = os.path.join(folder, "picture.exr")
view = View(cornell, *common, "--spp", "256", "-p", "red.*", "-p", "light.*", "-o", out)
try:
    ok(re.fullmatch(r"http://127\.0\.0\.1:\d+/[0-9a-f]{32}/", view.url) is not None, "the address has a token of 128 bits")
    port = "%04X" % view.port
    heard = [line.split()[1] for name in ("tcp", "tcp6") if os.path.exists("/proc/net/" + name)
             for line in open("/proc/net/" + name).readlines()[1:] if line.split()[3] == "0A" and line.split()[1].endswith(":" + port)]
    ok(heard == ["0100007F:" + port], "it listens on 127.0.0.1 and nowhere else # %s" % heard)
    status, headers, page = view.ask()
    ok(status == 200 and "connect-src 'self'" in page and headers["Cache-Control"] == "no-store" and headers["X-Frame-Options"] == "DENY"
       and "Access-Control-Allow-Origin" not in headers, "the page, which nobody frames, keeps or reads from elsewhere")
    token = view.path.strip("/")
    wrong = token[:-1] + ("0" if token[-1] != "0" else "1")
    got = [view.ask(token=t)[0] for t in (wrong, "", token[:-1], token + "0", "x" * 32)] + [view.ask("", "GET", wrong + "/events")[0]]
    ok(got == [404] * 6, "without the token there is nothing # %s" % got)
    host = "127.0.0.1:%d" % view.port
    got = [view.ask(Host=h)[0] for h in ("evil.example", "localhost:%d" % view.port, "127.0.0.1", "evil.example:%d" % view.port)]
    ok(got == [403] * 4 and view.ask(Host=host)[0] == 200, "another Host, which a name of a stranger's has, is refused # %s" % got)
    got = [view.ask("act?do=stop", "POST", Origin=o)[0] for o in ("http://evil.example", "null", "https://" + host, "http://127.0.0.1")]
    ok(got == [403] * 4 and view.ask(Origin="http://" + host)[0] == 200, "another Origin is refused # %s" % got)
    got = [view.ask(Sec_Fetch_Site=s)[0] for s in ("cross-site", "same-site", "same-origin", "none")]
    ok(got == [403, 403, 200, 200], "what browsers call another site is refused # %s" % got)
    got = [view.ask("act?do=stop")[0], view.ask("", "POST")[0], view.ask("other")[0], view.act("no-such"), view.act("again"),
           view.act("set", name="red.reflectance.value[0]", value="2"), view.act("set", name="no", value="1"),
           view.act("set", name="red.reflectance.value[0]", value="nan"), view.act("walks", x="1"), view.act("walks", x="-1", y="0")]
    ok(got == [405, 405, 404, 400, 400, 400, 400, 400, 400, 400], "and so is what there is not # %s" % got)
    with socket.create_connection((view.host, view.port), timeout=PATIENCE) as s:
        try:
            s.sendall(b"GET / HTTP/1.1\r\n" + b"X: " + b"y" * 100000 + b"\r\n\r\n" + bytes(range(256)))
            answer = s.recv(4096)
        except OSError:
            answer = b""
    ok(b" 200 " not in answer and view.ask()[0] == 200, "garbage is answered with an error, and the view goes on")

    # ---- Who holds connections and says nothing -------------------------------------------
    held = []
    for k in range(300):
        held.append(socket.create_connection((view.host, view.port)))
        if k % 3: held[-1].sendall(b"GET / HTTP/1.1\r\nHost: " [:k % 20])  # nothing, or half of a request
    since = time.monotonic()
    good = [view.ask()[0] for _ in range(20)]
    ok(good == [200] * 20 and time.monotonic() - since < 9, "300 connections that say nothing lock nobody out # %.1f s" % (time.monotonic() - since))
    def is_closed(c):
        c.settimeout(PATIENCE)
        try: return c.recv(1000) is not None
        except TimeoutError: return False
        except OSError: return True
    ok(all(map(is_closed, held)), "and they end without a word of theirs # %.1f s" % (time.monotonic() - since))
    ok(not view.ended and view.act("walks", x=0, y=0) == 200, "while the page that listens stays")
    policy = re.search(r'script-src ([^;]*);', page)[1]
    script = re.search(r"<script>(.*?)</script>", page, re.S)[1]
    ok(policy == "'sha256-%s'" % base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(), "its policy allows its own script alone, by its hash # %s" % policy)

    # ---- A render ---------------------------------------------------------------------------
    ok(view.state("done") is not None, "the picture is done")
    spp = [i["spp"] for i in view.items("picture")]
    ok(spp[-1] == 256 and all(a <= b for a, b in zip(spp, spp[1:])), "it came with more and more samples # %s" % spp)
    numbers = view.wait(lambda event, value: event == "numbers")
    ok([n["name"] for n in numbers] == ["red.reflectance.value[%d]" % k for k in range(3)] + ["light.radiance.value[%d]" % k for k in range(3)]
       and numbers[0]["min"] == 0 and numbers[3]["max"] is None, "a slider for each number of -p, with its bounds")
    n = len(view.news)
    ok(view.act("walks", x=8, y=12) == 200 and (walks := view.wait(lambda e, v: e == "report" and v["items"][0]["name"] == "pixel 8, 12", n))
       and all(w["pixel"] == [8, 12] for w in walks["items"][0]["data"]["walks"]) and len(walks["items"][0]["data"]["walks"]) == 16,
       "random walks of a pixel")
    ok(view.act("save") == 200 and view.wait(lambda e, v: e == "state" and "saved" in (v["message"] or "")) is not None, "saved")
    run("render", cornell, *common, "--spp", "256", "--se", "--no-preview", "-q", "-o", folder + "/render.exr")
    text = run("compare", out, folder + "/render.exr", "--json")
    ok(json.loads(text)["max_abs"] == 0, "and it is what importon render makes, to the bit")
    n = len(view.news)
    bright = view.items("picture")[-1]
    ok(view.act("set", name="light.radiance.value[0]", value="40") == 200 and view.state("running", n) and view.state("done", n),
       "a slider is moved, and the picture made again")
    moved = view.items("picture")[-1]
    ok(moved["pixels"] != bright["pixels"] and view.wait(lambda e, v: e == "numbers" and v[3]["value"] == 40, n), "with the light that was asked for")
    told = view.wait(lambda e, v: e == "state" and "recorded walks" in (v["message"] or ""), n)
    first = view.wait(lambda e, v: e == "report" and v["items"][0]["kind"] == "picture", n)["items"][0]
    ratio = mean(first) / mean(moved)
    ok(told is not None and first["spp"] == 16 and abs(ratio - 1) < .1,
       "first by recorded walks, as the page says # %d samples, %.3f of the mean of fresh ones" % (first["spp"], ratio))
    view.act("save")
    view.wait(lambda e, v: e == "state" and "saved" in (v["message"] or ""), n)
    light = next(p["value"] for p in json.loads(run("info", cornell, "-D", "res=16", "--json"))["params"] if p["name"] == "light.radiance.value")
    run("render", cornell, *common, "--set", "light.radiance.value=40,%r,%r" % tuple(light[1:]), "--spp", "256", "--se", "--no-preview", "-q", "-o", folder + "/moved.exr")
    ok(json.loads(run("compare", out, folder + "/moved.exr", "--json"))["max_abs"] == 0, "and at last what importon render makes there, to the bit")
    n = len(view.news)
    view.act("set", name="red.reflectance.value[0]", value="0")
    view.state("running", n), view.state("done", n)
    back = len(view.news)
    view.act("set", name="red.reflectance.value[0]", value="0.6")
    view.state("running", back), view.state("done", back)
    dark, red = view.items("picture")[-1], mean(view.items("picture")[-1])
    first = view.wait(lambda e, v: e == "report" and v["items"][0]["kind"] == "picture", back)["items"][0]
    ok(first["spp"] == 16 and abs(mean(first) / red - 1) < .1, "walks that were kept before a wall was black still count # %.3f" % (mean(first) / red))
    code = view.end()
    ok(code == 130 and view.said.count("\n") == 1, "Ctrl-C ends it # %d" % code)
    ok(view.wait(lambda e, v: False) is None and view.ended, "and the page's connection")
finally:
    if view.process.poll() is None: view.process.kill()

# ---- Stop and resume, and the end of the terminal ------------------------------------------
view = View(cornell, "-D", "res=64", "--seed", "3", "--spp", "4096", "-o", folder + "/long.exr")
try:
    # Rounds of few samples are over, and the long one has begun.
    view.wait(lambda e, v: e == "report" and v["items"][0]["kind"] == "picture" and v["items"][0]["spp"] >= 64)
    n = len(view.news)
    view.act("stop")
    stopped = view.state("stopped", n)
    at = view.items("picture")[-1]["spp"]
    ok(stopped is not None and 0 < at < 4096, "stopped with what it has # %d samples" % at)
    n = len(view.news)
    view.act("go")
    ok(view.state("running", n) is not None, "resumed")
    view.act("stop")
    view.state("stopped", n)
    ok(view.items("picture")[-1]["spp"] >= at, "and what was there still counts # %d samples" % view.items("picture")[-1]["spp"])
    code = view.end(signal.SIGHUP)
    ok(code == 129, "it ends with its terminal # %d" % code)
finally:
    if view.process.poll() is None: view.process.kill()

# ---- A fit ------------------------------------------------------------------------------------
run("render", cornell, *common, "--spp", "64", "--se", "--no-preview", "-q", "-o", folder + "/t.exr")
fit = [cornell, *common, "--spp", "4", "--target", folder + "/t.exr", "--set", "red.reflectance.value=0.4", "-p", "red.*", "-p", "light.*",
       "--optimizer", "adam", "-n", "300"]
alone = json.loads(run("fit", *fit, "--json", "-q"))
view = View(*fit, "-o", folder + "/fit")
try:
    ok(view.wait(lambda e, v: e == "report" and v["items"][0]["kind"] == "fit" and v["items"][0]["data"]["iterations"] >= 3) is not None,
       "a fit tells its iterations as it runs")
    n = len(view.news)
    view.act("stop")
    stopped = view.state("stopped", n)
    last = view.items("fit")[-1]["data"]
    ok(stopped is not None and last["iterations"] < 300, "stopped after %d iterations" % last["iterations"])
    view.act("set", name="red.reflectance.value[0]", value="0.9")
    n = len(view.news)
    view.act("go")
    ok(view.state("done", n) is not None, "resumed to its end")
    last = view.items("fit")[-1]["data"]
    ok([p["value"] for p in last["params"]] == [p["value"] for p in alone["params"]] and last["history"] == alone["history"],
       "with the bits of a fit that was never stopped")
    x, loss = last["history"]["x"], last["history"]["loss"]
    ok(len(x) == len(loss) == 300 and x[0] == [p["start"] for p in last["params"]] and len(last["history"]["names"]) == 6,
       "the numbers of every iteration are there")
    roles = {(i["name"], i.get("role")) for i in view.items("picture")}
    ok({("target", "target"), ("start", None), ("recovered", "picture")} <= roles, "pictures: target, start, recovered")
    view.act("save")
    view.wait(lambda e, v: e == "state" and "saved" in (v["message"] or ""))
    ok(json.load(open(folder + "/fit/parameters.json"))["params"] == alone["params"] and os.path.exists(folder + "/fit/recovered.exr"),
       "saved as importon fit does")
    n = len(view.news)
    view.act("set", name="red.reflectance.value[0]", value="0.2")
    view.wait(lambda e, v: e == "numbers" and v[0]["value"] == 0.2, n)
    view.act("again")
    again = view.wait(lambda e, v: e == "report" and v["items"][0]["kind"] == "fit" and v["items"][0]["data"]["iterations"] < 250, n)
    ok(again is not None and again["items"][0]["data"]["params"][0]["start"] == 0.2, "begun anew where the slider is")
    ok(view.end(signal.SIGTERM) == 143, "ended while it runs")
finally:
    if view.process.poll() is None: view.process.kill()

# Logarithms have bounds that are no powers of e: what a slider or a result says lies inside them. And --levels is the fit's.
logs = [cornell, *common, "--spp", "4", "--target", folder + "/t.exr", "-p", "red.*", "--log", "red.*", "--optimizer", "adam", "-n", "3"]
view = View(*logs, "-o", folder + "/logs")
try:
    ok(view.state("done") is not None, "a fit of logarithms")
    n = len(view.news)
    view.act("set", name="red.reflectance.value[1]", value="0")
    moved = view.wait(lambda e, v: e == "numbers" and v[1]["value"] < 1e-9, n)
    ok(moved is not None, "a slider at 0 moves to the least number")
    n = len(view.news)
    view.act("again")
    ok(view.state("running", n) is not None and view.state("done", n) is not None
       and view.items("fit")[-1]["data"]["params"][1]["start"] < 1e-9, "and a fit begins there")
    n = len(view.news)
    view.act("save")
    said = view.wait(lambda e, v: e == "state" and "saved" in (v["message"] or ""), n)
    ok(said is not None and "not saved" not in said["message"] and os.path.exists(folder + "/logs/parameters.json"),
       "whose result is saved # %s" % (said or {}).get("message"))
    ok(view.end() == 130, "ended")
finally:
    if view.process.poll() is None: view.process.kill()

textured = [os.path.join(scenes, "textured.xml"), "-D", "width=16", "-D", "height=12", "--seed", "3"]
run("render", *textured, "--spp", "16", "--se", "--no-preview", "-q", "-o", folder + "/floor.exr")
levels = [*textured, "--spp", "4", "--target", folder + "/floor.exr", "-p", "floor.*", "--optimizer", "adam", "-n", "6", "--levels", "3",
          "--set", "floor.reflectance.data=0.3"]
alone, whole = (json.loads(run("fit", *levels[:len(levels) - k], *more, "--json", "-q"))["history"]["loss"] for k, more in ((0, []), (4, levels[-2:])))
view = View(*levels)
try:
    ok(view.state("done") is not None and view.items("fit")[-1]["data"]["history"]["loss"] == alone and alone != whole,
       "a fit from coarse to fine, with the bits of importon fit --levels")
    ok(view.end() == 130, "ended")
finally:
    if view.process.poll() is None: view.process.kill()

# ---- What moves ------------------------------------------------------------------------------------
poses = [os.path.join(scenes, "poses.xml"), "-D", "res=16", "--seed", "3", "-p", "block.pose", "--spp", "4"]
view = View(*poses)
try:
    ok(view.state("done") is not None, "a picture with the sliders of a pose")
    sliders = view.wait(lambda e, v: e == "numbers")
    ok([n["name"] for n in sliders] == ["block.pose[%d]" % k for k in range(6)] and [n["unit"] for n in sliders] == ["scene units"] * 3 + ["radians"] * 3
       and all(n["reach"] > .3 for n in sliders), "whose units and lengths are those of shifts and turns # %s" % [round(n["reach"], 2) for n in sliders])
    before = view.items("places")[-1]["data"]["places"][0]
    n = len(view.news)
    view.act("set", name="block.pose[0]", value="0.1")
    moved = view.wait(lambda e, v: e == "report" and v["items"][0]["kind"] == "places", n)
    ok(view.wait(lambda e, v: e == "numbers" and v[0]["value"] == .1, n) is not None and moved is not None and view.state("done", n) is not None, "moved")
    now = moved["items"][0]["data"]["places"][0]
    off = [now["at"][i] - before["at"][i] - .1 * before["axes"][0][i] for i in range(2)]
    ok(max(map(abs, off)) < .02 and abs(before["axes"][0][0]) > 1, "and its place in the picture by what its axis said # off by %.2g pixels" % max(map(abs, off)))
    ok(view.end() == 130, "ended")
finally:
    if view.process.poll() is None: view.process.kill()
run("render", *poses[:5], "--spp", "16", "-q", "--no-preview", "-o", folder + "/block.exr")
view = View(*poses, "--target", folder + "/block.exr", "--set", "block.pose=.1,0,.1,0,0,0", "--optimizer", "adam", "-n", "4")
try:
    ok(view.state("done") is not None, "a fit of it")
    places = view.items("places")
    first, last = (p["data"]["places"][0] for p in (places[0], places[-1]))
    start = last["way"][0]
    ok(len(last["way"]) == 4 and max(abs(start[i] - first["at"][i]) for i in range(2)) < 1e-6, "its way in the picture begins where it was # %d places" % len(last["way"]))
    ok(view.end() == 130, "ended")
finally:
    if view.process.poll() is None: view.process.kill()

# ---- Bent rays -----------------------------------------------------------------------------------
lens = os.path.join(scenes, "bend", "focus.xml")
view = View(lens, "-n", "12")
try:
    ok(view.state("done") is not None, "bend fit: to its end")
    rays, answers = view.items("rays"), [i["data"] for i in view.items("bend")]
    ok(len(rays) >= 2 and len(rays[0]["data"]["slices"]) == 3 and rays[-1]["data"]["slices"] != rays[0]["data"]["slices"],
       "rays and the index follow the fit # %d times" % len(rays))
    ok(answers[-1]["history"]["loss"][-1] < answers[-1]["history"]["loss"][0], "and so does the objective # %.3g to %.3g"
       % (answers[-1]["history"]["loss"][0], answers[-1]["history"]["loss"][-1]))
    ok(view.end() == 130, "ended")
finally:
    if view.process.poll() is None: view.process.kill()

shutil.rmtree(folder, ignore_errors=True)
done()
