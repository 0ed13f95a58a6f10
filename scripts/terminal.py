#!/usr/bin/env python3
"""Makes docs/terminal.svg: a terminal in which radwalk runs, as it was at one moment of a real session.

usage: scripts/terminal.py [RADWALK]     the program, by default target/release/radwalk

The commands run on a pseudo-terminal in an empty folder. The last one is stopped some seconds after its start, and the screen of that
moment is drawn. Needs `pip install rich pyte`.
"""

import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import time
from fcntl import ioctl
from pathlib import Path

import pyte
from rich.console import Console
from rich.style import Style
from rich.text import Text

ROOT = Path(__file__).resolve().parent.parent
COLUMNS, ROWS = 118, 30
SESSION = [
    "radwalk new room",
    "radwalk run room.toml",
    "radwalk run room.toml --resume --paths 4e8 --set target.relative_error=0.01",
]
SECONDS_OF_LAST = 5.0


def run(command: str, radwalk: Path, folder: str, stream: pyte.ByteStream, seconds: float | None) -> None:
    """Runs a command and feeds the screen with what it writes; interrupts it after some seconds, and feeds no more."""
    terminal, other_end = pty.openpty()
    ioctl(other_end, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, COLUMNS, 0, 0))
    words = [str(radwalk), *command.split()[1:]]
    child = subprocess.Popen(words, cwd=folder, stdin=other_end, stdout=other_end, stderr=other_end, start_new_session=True)
    os.close(other_end)
    end = time.monotonic() + (seconds or 600.0)
    interrupted = False
    while True:
        if not interrupted and time.monotonic() >= end:
            child.send_signal(signal.SIGINT)
            interrupted = True
        if select.select([terminal], [], [], 0.05)[0]:
            try:
                written = os.read(terminal, 65536)
            except OSError:  # the command has ended
                break
            if not interrupted:
                stream.feed(written)
    os.close(terminal)
    if child.wait() not in (0, 1, 130):
        sys.exit(f"{command}: exit code {child.returncode}")


COLOURS = {"brown": "yellow", "brightblack": "bright_black"}


def line(screen: pyte.Screen, row: int) -> Text:
    """A row of the screen with its colours."""
    text = Text()
    for column in range(COLUMNS):
        cell = screen.buffer[row][column]
        colour = COLOURS.get(cell.fg, cell.fg)
        text.append(cell.data, style=Style(bold=cell.bold, color=None if colour == "default" else colour))
    text.rstrip()
    return text


def main() -> None:
    radwalk = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/radwalk").resolve()
    screen = pyte.Screen(COLUMNS, ROWS)
    stream = pyte.ByteStream(screen)
    with tempfile.TemporaryDirectory() as folder:
        for command in SESSION:
            stream.feed(f"\x1b[1m$ {command}\x1b[0m\r\n".encode())
            run(command, radwalk, folder, stream, SECONDS_OF_LAST if command is SESSION[-1] else None)
    rows = [line(screen, row) for row in range(ROWS)]
    while not rows[-1].plain:
        rows.pop()
    console = Console(record=True, width=COLUMNS, file=open(os.devnull, "w"))
    for row in rows:
        console.print(row, no_wrap=True, overflow="crop")
    drawn = console.export_svg(title="radwalk")
    # The fonts of the template are on a server; the viewer's own serve.
    drawn = re.sub(r"@font-face \{.*?\}\s*", "", drawn, flags=re.DOTALL)
    (ROOT / "docs/terminal.svg").write_text(re.sub(r"[ \t]+\n", "\n", drawn))


if __name__ == "__main__":
    main()
