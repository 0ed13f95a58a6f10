#!/usr/bin/env python3
"""Makes docs/terminal.svg: a terminal in which radwalk runs, as it was at one moment of a real session.

usage: scripts/terminal.py [RADWALK]     the program, by default target/release/radwalk

The commands run on a pseudo-terminal in an empty folder. The last one is stopped some seconds after its start, and the screen of that
moment is drawn. Needs `pip install rich pyte`.
"""

import os
import pty
import select
import signal
import struct
import sys
import tempfile
import termios
import time
from fcntl import ioctl
from pathlib import Path

import pyte
from rich.console import Console
from rich.text import Text

ROOT = Path(__file__).resolve().parent.parent
COLUMNS, ROWS = 112, 24
SESSION = [
    "radwalk new room",
    "radwalk run room.toml",
    "radwalk run room.toml --resume --paths 4e8 --set target.relative_error=0.05",
]
SECONDS_OF_LAST = 6.0


def run(command: str, radwalk: Path, folder: str, stream: pyte.ByteStream, seconds: float | None) -> None:
    """Runs a command and feeds the screen with what it writes; interrupts it after some seconds."""
    child, terminal = pty.fork()
    if child == 0:
        os.chdir(folder)
        os.execv(radwalk, command.split())
    ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, COLUMNS, 0, 0))
    end = time.monotonic() + (seconds or 600.0)
    while time.monotonic() < end:
        if not select.select([terminal], [], [], 0.05)[0]:
            continue
        try:
            written = os.read(terminal, 65536)
        except OSError:  # the command has ended
            break
        stream.feed(written)
    else:
        os.kill(child, signal.SIGINT)
        while select.select([terminal], [], [], 10.0)[0]:
            try:
                os.read(terminal, 65536)
            except OSError:
                break
    os.waitpid(child, 0)


def line(screen: pyte.Screen, row: int) -> Text:
    """A row of the screen with its colours."""
    text = Text()
    for column in range(COLUMNS):
        cell = screen.buffer[row][column]
        colour = "" if cell.fg == "default" else {"brown": "yellow"}.get(cell.fg, cell.fg)
        text.append(cell.data, style=f"{'bold ' if cell.bold else ''}{'#' + colour if len(colour) == 6 and colour.isalnum() and any(c.isdigit() for c in colour) else colour}".strip())
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
    (ROOT / "docs/terminal.svg").write_text(drawn)


if __name__ == "__main__":
    main()
