# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium driven by the DevTools protocol over a pair of pipes.

(https://chromedevtools.github.io/devtools-protocol: --remote-debugging-pipe reads messages
from file descriptor 3 and writes them to 4; each is JSON and ends with a zero byte.)
"""
import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time

PROGRAM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
PATIENCE = 120  # seconds for an answer, on a loaded machine


class Browser:
    """A browser without network: no name resolves, and no proxy answers, unless `network`."""

    def __init__(self, network=False, webgl=True):
        self.folder = tempfile.mkdtemp()
        inward, outward = os.pipe(), os.pipe()
        words = [PROGRAM, "--headless", "--no-sandbox", "--remote-debugging-pipe", "--user-data-dir=" + self.folder, "--no-first-run",
                 "--hide-scrollbars", "--disable-extensions", "--disable-background-networking", "--force-color-profile=srgb"]
        words += ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"] if webgl else ["--disable-gpu", "--disable-3d-apis"]
        if not network: words += ["--host-resolver-rules=MAP * ~NOTFOUND", "--proxy-server=127.0.0.1:9"]

        def place():  # in the child: 3 and 4 may be any of the four ends
            r, w = os.dup(inward[0]), os.dup(outward[1])
            high = max(r, w, 4) + 1
            os.dup2(r, high), os.dup2(w, high + 1)
            os.dup2(high, 3), os.dup2(high + 1, 4)
            for fd in (3, 4): os.set_inheritable(fd, True)

        self.process = subprocess.Popen(words, preexec_fn=place, close_fds=False, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL)
        os.close(inward[0]), os.close(outward[1])
        self.to, self.of, self.rest = inward[1], outward[0], b""
        self.number, self.answers, self.tabs = 0, {}, {}

    def send(self, method, session=None, **params):
        """The answer to one command."""
        self.number += 1
        number = self.number
        message = {"id": number, "method": method, "params": params}
        if session: message["sessionId"] = session
        data = json.dumps(message).encode() + b"\0"
        while data: data = data[os.write(self.to, data):]
        end = time.monotonic() + PATIENCE
        while number not in self.answers: self.receive(end)
        answer = self.answers.pop(number)
        if "error" in answer: raise RuntimeError("%s: %s" % (method, answer["error"]["message"]))
        return answer["result"]

    def receive(self, end):
        """Read what comes, until time `end`: answers are kept, events go to their tabs."""
        ready = select.select([self.of], [], [], max(end - time.monotonic(), 0))[0]
        if not ready: raise TimeoutError("the browser does not answer")
        data = os.read(self.of, 1 << 20)
        if not data: raise RuntimeError("the browser has ended")
        *messages, self.rest = (self.rest + data).split(b"\0")
        for message in map(json.loads, messages):
            if "id" in message: self.answers[message["id"]] = message
            elif message.get("sessionId") in self.tabs: self.tabs[message["sessionId"]].event(message["method"], message["params"])

    def tab(self, address, *size, **options):
        return Tab(self, address, *size, **options)

    def close(self):
        try:
            self.send("Browser.close")
        except (RuntimeError, TimeoutError, OSError):
            pass
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self.to), os.close(self.of)
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self): return self
    def __exit__(self, *_): self.close()


class Tab:
    """A page. `errors`: scripts' exceptions and what the console holds as errors; `asked`:
    addresses that were asked for."""

    def __init__(self, browser, address, width=1000, height=900, dark=False, scale=1):
        self.browser, self.errors, self.asked, self.seen = browser, [], [], set()
        self.target = browser.send("Target.createTarget", url="about:blank")["targetId"]
        self.session = browser.send("Target.attachToTarget", targetId=self.target, flatten=True)["sessionId"]
        browser.tabs[self.session] = self
        for domain in ("Page", "Runtime", "Log", "Network"): self.send(domain + ".enable")
        self.size(width, height, scale)
        self.theme(dark)
        self.go(address)

    def send(self, method, **params): return self.browser.send(method, self.session, **params)

    def event(self, method, params):
        self.seen.add(method)
        if method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description") or details["text"])
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "assert"):
            self.errors.append(" ".join(str(a.get("value", a.get("description"))) for a in params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] == "error": self.errors.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent": self.asked.append(params["request"]["url"])

    def go(self, address):
        self.seen.discard("Page.loadEventFired")
        self.send("Page.navigate", url=address)
        end = time.monotonic() + PATIENCE
        while "Page.loadEventFired" not in self.seen: self.browser.receive(end)

    def size(self, width, height=900, scale=1):
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=False)

    def theme(self, dark, media=""):
        self.send("Emulation.setEmulatedMedia", media=media, features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def run(self, body):
        """What `body`, that of an async function, returns."""
        answer = self.send("Runtime.evaluate", expression="(async () => { %s })()" % body, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(answer["exceptionDetails"].get("exception", {}).get("description", answer["exceptionDetails"]["text"]))
        return answer["result"].get("value")

    def wait(self, condition, seconds=60):
        """Whether the expression `condition` came to hold."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if self.run("return Boolean(%s)" % condition): return True
            time.sleep(0.1)
        return False

    def press(self, key, modifiers=0):
        """A key as the keyboard gives it; modifiers: 1 Alt, 2 Ctrl, 4 Meta, 8 Shift."""
        codes = {"Tab": 9, "Enter": 13, " ": 32, "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Home": 36, "End": 35}
        event = {"key": key, "windowsVirtualKeyCode": codes.get(key, ord(key[0].upper())), "modifiers": modifiers,
                 "code": {" ": "Space"}.get(key, key if len(key) > 1 else "Digit" + key if key.isdigit() else "Key" + key.upper())}
        text = {"Enter": "\r"}.get(key, key if len(key) == 1 else None)
        self.send("Input.dispatchKeyEvent", type="keyDown", **event, **({"text": text} if text else {}))
        self.send("Input.dispatchKeyEvent", type="keyUp", **event)

    def click(self, x, y):
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="none" if kind == "mouseMoved" else "left", clickCount=1)

    def move(self, x, y):
        self.send("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)

    def picture(self, path=None, whole=False, clip=None):
        """PNG of the window, or of the whole page."""
        more = {"clip": dict(clip, scale=1)} if clip else {}
        data = base64.b64decode(self.send("Page.captureScreenshot", format="png", captureBeyondViewport=bool(whole or clip), **more)["data"])
        if path: open(path, "wb").write(data)
        return data

    def whole(self, path=None):
        """PNG of the whole page, however long."""
        size = self.send("Page.getLayoutMetrics")["cssContentSize"]
        return self.picture(path, clip={"x": 0, "y": 0, "width": size["width"], "height": min(size["height"], 16000)})

    def print(self, path=None):
        """PDF on the page's own paper."""
        data = base64.b64decode(self.send("Page.printToPDF", preferCSSPageSize=True, printBackground=False)["data"])
        if path: open(path, "wb").write(data)
        return data

    def close(self):
        self.browser.tabs.pop(self.session, None)
        self.browser.send("Target.closeTarget", targetId=self.target)
