"""Chromium without a screen, driven over its debugging pipe: nothing but Python's own library.

    with Browser("/usr/bin/chromium", width=1280, height=800) as page:
        page.open("file:///page.html")
        page.evaluate("document.title")

The protocol: https://chromedevtools.github.io/devtools-protocol/
"""
import base64
import json
import os
import select
import shutil
import struct
import subprocess
import tempfile
import time
import zlib

FLAGS = (
    "--headless=new", "--no-sandbox", "--no-first-run", "--disable-dev-shm-usage", "--disable-extensions",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-default-browser-check",
    "--disable-features=Translate,OptimizationHints,MediaRouter", "--hide-scrollbars", "--mute-audio",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--remote-debugging-pipe",
)


def find():
    """The path of Chromium, or None."""
    return shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


class Browser:
    """One page. Keeps what it asked the network for, and what its console and its scripts complained of."""

    def __init__(self, program, width=1280, height=800):
        self.requests = []
        self.complaints = []
        self._home = tempfile.mkdtemp(prefix="review-browser-")
        to_read, self._to = os.pipe()
        self._from, to_write = os.pipe()

        def hand_over():
            # The pipe's ends are the child's files 3 and 4; copies first, that neither covers the other.
            ends = os.dup(to_read), os.dup(to_write)
            os.dup2(ends[0], 3)
            os.dup2(ends[1], 4)

        self._process = subprocess.Popen(
            [program, *FLAGS, "--user-data-dir=" + self._home, "about:blank"], preexec_fn=hand_over, close_fds=False,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env={**os.environ, "HOME": self._home, "XDG_CONFIG_HOME": self._home, "XDG_CACHE_HOME": self._home})
        os.close(to_read)
        os.close(to_write)
        self._rest = b""
        self._number = 0
        self._session = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(domain + ".enable")
        self.resize(width, height)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self._session = None
            self.call("Browser.close")
        except (OSError, RuntimeError):
            pass
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._to)
        os.close(self._from)
        shutil.rmtree(self._home, ignore_errors=True)

    def _next(self, deadline):
        """The next message; None when the deadline is over."""
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._from], [], [], max(0.0, deadline - time.monotonic()))
            if not ready:
                return None
            read = os.read(self._from, 1 << 20)
            if not read:
                raise RuntimeError("the browser has ended")
            self._rest += read
        message, self._rest = self._rest.split(b"\0", 1)
        return json.loads(message)

    def _keep(self, message):
        method, values = message.get("method"), message.get("params", {})
        if method == "Network.requestWillBeSent":
            self.requests.append(values["request"]["url"])
        elif method == "Runtime.exceptionThrown":
            details = values["exceptionDetails"]
            self.complaints.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and values["type"] in ("error", "warning", "assert"):
            self.complaints.append(" ".join(str(one.get("value", one)) for one in values["args"]))
        elif method == "Log.entryAdded" and values["entry"]["level"] in ("error", "warning"):
            self.complaints.append(values["entry"]["text"])
        elif method == "Page.javascriptDialogOpening":
            self.complaints.append("a dialog opened: " + values["message"])

    def call(self, method, timeout=60.0, **values):
        """The result of a method of the protocol."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": values}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + timeout
        while True:
            answer = self._next(deadline)
            if answer is None:
                raise RuntimeError(method + " was not answered")
            if answer.get("id") == self._number:
                if "error" in answer:
                    raise RuntimeError(method + ": " + answer["error"]["message"])
                return answer["result"]
            self._keep(answer)

    def resize(self, width, height, scale=1, mobile=False):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=mobile)
        self.call("Emulation.setTouchEmulationEnabled", enabled=mobile, maxTouchPoints=2 if mobile else 1)

    def dark(self, on):
        value = "dark" if on else "light"
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": value}])

    def media(self, kind):
        """What styles are for: "print", or "" for the screen."""
        self.call("Emulation.setEmulatedMedia", media=kind)

    def open(self, url):
        self.requests.clear()
        self.complaints.clear()
        self.call("Page.navigate", url=url)

    def evaluate(self, script):
        """The value of an expression; a promise is waited for."""
        result = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError("%s: %s" % (script, result["exceptionDetails"]["exception"].get("description")))
        return result["result"].get("value")

    def wait(self, condition, timeout=60.0):
        """Until an expression is true; says for how long, in seconds."""
        begin = time.monotonic()
        while not self.evaluate(condition):
            if time.monotonic() - begin > timeout:
                raise RuntimeError("never true: " + condition)
            time.sleep(0.02)
        return time.monotonic() - begin

    def mouse(self, kind, x, y, **values):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **values)

    def click(self, selector):
        """With the mouse, on the middle of an element."""
        box = self.evaluate("(() => { const one = document.querySelector(%s); one.scrollIntoView({ block: 'nearest' });"
                            " const box = one.getBoundingClientRect();"
                            " return [box.x + box.width / 2, box.y + box.height / 2]; })()" % json.dumps(selector))
        self.click_at(*box)

    def click_at(self, x, y):
        self.mouse("mouseMoved", x, y)
        self.mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1)
        self.mouse("mouseReleased", x, y, button="left", clickCount=1)

    def drag(self, begin, end, steps=6):
        self.mouse("mouseMoved", *begin)
        self.mouse("mousePressed", *begin, button="left", buttons=1, clickCount=1)
        for k in range(1, steps + 1):
            part = k / steps
            self.mouse("mouseMoved", begin[0] + part * (end[0] - begin[0]), begin[1] + part * (end[1] - begin[1]),
                       button="left", buttons=1)
        self.mouse("mouseReleased", *end, button="left", clickCount=1)

    def touch(self, *steps):
        """Fingers that come down at the places of the first step, move through the others and go."""
        kind = "touchStart"
        for places in steps:
            points = [{"x": x, "y": y, "id": finger} for finger, (x, y) in enumerate(places)]
            self.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)
            kind = "touchMove"
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def press(self, key):
        text = {"text": key} if len(key) == 1 else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key)

    def screenshot(self, path=None, selector=None, scale=1.0):
        """PNG bytes of the window, or of an element; written to a file too if one is named."""
        values = {}
        if selector:
            box = self.evaluate("(() => { const box = document.querySelector(%s).getBoundingClientRect();"
                                " return [box.x, box.y, box.width, box.height]; })()" % json.dumps(selector))
            values["clip"] = dict(zip(("x", "y", "width", "height"), box), scale=scale)
        png = base64.b64decode(self.call("Page.captureScreenshot", format="png", **values)["data"])
        if path:
            with open(path, "wb") as file:
                file.write(png)
        return png

    def print(self, path):
        """The bytes of the printed page, which go to a PDF file too."""
        pdf = base64.b64decode(self.call("Page.printToPDF", printBackground=True)["data"])
        with open(path, "wb") as file:
            file.write(pdf)
        return pdf


def pixels(png):
    """Rows of (red, green, blue) of an 8-bit PNG without interlacing."""
    place, data = 8, b""
    while place < len(png):
        length, kind = struct.unpack(">I4s", png[place:place + 8])
        chunk = png[place + 8:place + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", chunk[:10])
        elif kind == b"IDAT":
            data += chunk
        place += 12 + length
    size = {2: 3, 6: 4}[colour]
    assert depth == 8
    raw, rows, above = zlib.decompress(data), [], bytearray(width * size)
    for row in range(height):
        begin = row * (width * size + 1)
        kind, line = raw[begin], bytearray(raw[begin + 1:begin + 1 + width * size])
        for k in range(len(line)):
            left = line[k - size] if k >= size else 0
            corner = above[k - size] if k >= size else 0
            if kind == 1:
                line[k] = (line[k] + left) & 255
            elif kind == 2:
                line[k] = (line[k] + above[k]) & 255
            elif kind == 3:
                line[k] = (line[k] + (left + above[k]) // 2) & 255
            elif kind == 4:
                guess = left + above[k] - corner
                far = abs(guess - left), abs(guess - above[k]), abs(guess - corner)
                best = left if far[0] <= far[1] and far[0] <= far[2] else above[k] if far[1] <= far[2] else corner
                line[k] = (line[k] + best) & 255
        rows.append([tuple(line[k:k + 3]) for k in range(0, len(line), size)])
        above = line
    return rows
