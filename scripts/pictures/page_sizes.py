"""Pages at several sizes in headless Chromium: bytes, time to open, memory, and what a click tells.

    page_sizes.py RADWALK RADWALK_LAB FOLDER      writes FOLDER/pages.json, and a screenshot of each page beside it

A page is open when its scene can be turned, by the page's own clock, which starts with the navigation. Scenes are made by rule; each patch is a face of its own.
"""

import base64
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SIZES = {"cube": ["cube", "3"], "ten-thousands": ["interior", "10000"], "hundred-thousand": ["interior", "100000"], "million": ["interior", "1000000"]}
PATHS = 1_000_000
FLAGS = [
    "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--remote-debugging-pipe", "--window-size=1280,900",
]
PATIENCE = 120.0
# Of the browser, which is busy with itself when it has started [s].
SETTLING = 3.0
# Notes when the page is ready.
WATCHER = """new MutationObserver(() => {
  if (document.documentElement?.dataset.ready) window.readyAt ??= performance.now();
}).observe(document, { attributes: true, subtree: true, childList: true });"""


class Browser:
    """Chromium, spoken to over two pipes (DevTools protocol)."""

    def __init__(self, profile):
        there, self.write = os.pipe()
        self.read, back = os.pipe()
        self.number, self.rest = 0, b""

        def pipes():
            os.dup2(there, 13), os.dup2(back, 14)
            os.dup2(13, 3), os.dup2(14, 4)

        self.process = subprocess.Popen(["chromium", *FLAGS, f"--user-data-dir={profile}"], preexec_fn=pipes, close_fds=False, stderr=subprocess.DEVNULL)
        os.close(there), os.close(back)
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]

    def ask(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if hasattr(self, "session"):
            message["sessionId"] = self.session
        os.write(self.write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.answer()
            if answer.get("id") == self.number:
                return answer["result"]

    def answer(self):
        while b"\0" not in self.rest:
            got = os.read(self.read, 1 << 20)
            if not got:
                raise SystemExit("Chromium has ended")
            self.rest += got
        message, self.rest = self.rest.split(b"\0", 1)
        return json.loads(message)

    def close(self):
        self.process.terminate()
        self.process.wait()
        # Pipes of many browsers would come to the numbers that the next one gives its own.
        os.close(self.write), os.close(self.read)

    def value(self, expression):
        return self.ask("Runtime.evaluate", expression=expression, returnByValue=True)["result"].get("value")

    def memory(self):
        """Of the process that shows the page [MB]."""
        renderers = [folder for folder in self.processes() if b"--type=renderer" in (folder / "cmdline").read_bytes()]
        rollups = [(folder / "smaps_rollup").read_text() for folder in renderers]
        return max(int(line.split()[1]) for text in rollups for line in text.splitlines() if line.startswith("Pss:")) / 1000

    def processor_seconds(self):
        """Of all its processes."""
        ticks = [sum(map(int, stat(folder)[11:13])) for folder in self.processes()]
        return sum(ticks) / os.sysconf("SC_CLK_TCK")

    def processes(self):
        return [path.parent for path in Path("/proc").glob("[0-9]*/stat") if is_below(int(path.parent.name), self.process.pid)]


def stat(folder):
    """The fields of a process after its name, from the third on."""
    return (folder / "stat").read_text().rsplit(")", 1)[1].split()


def is_below(pid, ancestor):
    try:
        while pid > 1 and pid != ancestor:
            pid = int(stat(Path(f"/proc/{pid}"))[1])
        return pid == ancestor
    except OSError:
        return False


def opened(page, screenshot):
    """The figures of a page."""
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(profile)
        browser.ask("Page.enable")
        browser.ask("Page.addScriptToEvaluateOnNewDocument", source=WATCHER)
        time.sleep(SETTLING)
        before, used = time.monotonic(), browser.processor_seconds()
        browser.ask("Page.navigate", url=page.absolute().as_uri())
        while (ready := browser.value("document.documentElement.dataset.ready")) is None and time.monotonic() - before < PATIENCE:
            time.sleep(0.02)
        used = browser.processor_seconds() - used
        seconds = (browser.value("window.readyAt") or 1000 * PATIENCE) / 1000
        spot = json.loads(browser.value("JSON.stringify(document.getElementById('view').getBoundingClientRect())"))
        at = {"x": spot["x"] + spot["width"] / 2, "y": spot["y"] + spot["height"] / 2, "button": "left", "clickCount": 1}
        for kind in ("mousePressed", "mouseReleased"):
            browser.ask("Input.dispatchMouseEvent", type=kind, **at)
        told = browser.value("document.getElementById('numbers').innerText")
        memory = browser.memory()
        shot = browser.ask("Page.captureScreenshot", format="png")["data"]
        screenshot.write_bytes(base64.b64decode(shot))
        browser.close()
    return {"bytes": page.stat().st_size, "ready": ready, "seconds": seconds, "processor": used, "memory": memory, "told": told}


def main():
    radwalk, lab, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    found = {}
    for name, words in SIZES.items():
        scene, out = folder / f"{name}.toml", folder / name
        if not (out / "report.html").exists():
            scene.write_text(subprocess.run([lab, "write", *words], check=True, capture_output=True, text=True).stdout)
            job = folder / f"{name}-job.toml"
            job.write_text(f'scene = "{scene.name}"\n\n[budget]\npaths = {PATHS}\n')
            subprocess.run([radwalk, "run", job, "--out", out, "--force", "--quiet", "--set", 'output.files=["summary", "report"]', "--set", "scene.patches=given"])
        summary = json.loads((out / "summary.json").read_text())
        found[name] = opened(out / "report.html", folder / f"{name}.png") | {"patches": summary["model"]["patches"]}
        print(name, found[name], flush=True)
        (folder / "pages.json").write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
