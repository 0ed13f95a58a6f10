#!/usr/bin/env python3
"""Writes docs/results/first.md: how long a person waits for the first page with a picture, and for an error of 5 %.

Usage: scripts/first.py RADWALK SCENE..., in the folder of the sources. Each SCENE is run without further words but `--watch`, and a browser's request is sent
ten times a second from the start. Times are of the clock, so the machine should have nothing else to do.
"""

import json
import pathlib
import platform
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

PAGE = pathlib.Path("docs/results/first.md")
PORT = 9917
# A page without a picture, which tells that the run has begun, is shorter.
PICTURE = 10_000


def page():
    """The page of the running job; empty where none answers yet."""
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{PORT}/", timeout=5) as answer:
            return answer.read()
    except (urllib.error.URLError, ConnectionError, TimeoutError):
        return b""


def measured(radwalk, scene):
    """A row of the table."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "out"
        start = time.monotonic()
        run = subprocess.Popen([radwalk, "run", scene, "--quiet", "--watch", str(PORT), "--out", out], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        first = None
        while run.poll() is None:
            if first is None and len(page()) > PICTURE:
                first = time.monotonic() - start
            time.sleep(0.1)
        whole = time.monotonic() - start
        # 1: the target is not reached.
        if run.returncode not in (0, 1):
            sys.exit(f"first: {scene}: {run.stderr.read()}")
        summary = json.loads((out / "summary.json").read_text())
    first = "–" if first is None else f"{first:.1f}"
    return pathlib.Path(scene).stem, first, f"{whole:.1f}", summary


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    radwalk, *scenes = sys.argv[1:]
    version = subprocess.run([radwalk, "--version"], capture_output=True, text=True, check=True).stdout.split()[-1]
    processor = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), platform.machine())
    lines = [
        "# From Enter to the first picture",
        "",
        f"`scripts/first.py RADWALK {' '.join(pathlib.Path(scene).name for scene in scenes)}` writes this page: radwalk {version}, {processor}.",
        "",
        "Seconds of the clock of `radwalk run SCENE --watch PORT` without further words: to the first page with a picture, and to the end, with all files written. Without words a run ends",
        "at a total error of 5 % or at its default budget. The picture comes with the first walks after the pilot, which chooses the patches.",
        "",
        "| scene | first picture [s] | end [s] | total error there [%] |",
        "|---|---|---|---|",
    ]
    for scene in scenes:
        name, first, whole, summary = measured(radwalk, scene)
        lines.append(f"| {name} | {first} | {whole} | {100 * summary['accuracy']['total']:.1f} |")
        print(lines[-1], flush=True)
    PAGE.write_text("\n".join(lines) + "\n")


main()
