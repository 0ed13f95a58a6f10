#!/usr/bin/env python3
"""Runs meshes by others as they are, and writes docs/results/meshes.md.

    scripts/meshes.py FOLDER [--radwalk PROGRAM] [--out PAGE] [--jobs N] [--only WORD]

FOLDER holds the files that scripts/meshes.tsv lists, fetched from the repositories named there. Each is run by the bare
command with 100,000 paths. The page has no paths of this machine.
"""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

PATHS = "100000"
HERE = Path(__file__).resolve().parent

# Assumptions beside light and units, and what their notes say.
KINDS = [
    ("limit", "clamped to"),
    ("textures", "their mean colours"),
    ("missing textures", "colours stand alone"),
    ("solid panes", "modelled as solid"),
    ("mirrors", "mirror-like"),
    ("black", "takes all light"),
    ("sheets", "shine to one side"),
    ("left out", "left out"),
    ("undefined", "defined by no file"),
    ("point lights", "lights without area"),
]


def ran(command, folder):
    """The exit code, stdout, stderr and processor time of a command."""
    out, err = Path(folder) / "stdout", Path(folder) / "stderr"
    with out.open("wb") as stdout, err.open("wb") as stderr:
        process = subprocess.Popen(command, stdout=stdout, stderr=stderr)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, out.read_text(), err.read_text(), usage.ru_utime + usage.ru_stime


def light(notes):
    """What lights the mesh, by its first note."""
    first = next((note for note in notes if "nothing in the file emits" in note), None)
    if first is None:
        return "the file's own"
    if "called a lamp" in first:
        return "names of lamps"
    lamps = re.search(r"so (\d+) assumed lamp", first)
    return f"{lamps[1]} below ceilings" if lamps else "a sky"


def measure(program, file):
    with tempfile.TemporaryDirectory() as folder:
        run = [program, "run", str(file), "--paths", PATHS, "--workers", "1", "--out", folder + "/out"]
        code, _, error, seconds = ran(run, folder)
        check, told, _, _ = ran([program, "check", str(file), "--json"], folder)
    notes = [line.split("note: ", 1)[1] for line in error.splitlines() if "note: " in line]
    last = error.strip().splitlines()[-1] if code not in (0, 1) else ""
    return code, notes, last, seconds, json.loads(told) if check in (0, 1) else None


def row(args, listed):
    """A row of the table, whether the mesh ran, whether its unit is known and right, and how many notes it has."""
    path, repository, name, unit = listed
    file = args.folder / path
    if not file.exists():
        print("missing:", path, file=sys.stderr)
        return None
    code, notes, last, seconds, told = measure(args.radwalk, file)
    likely = told["scene"]["likely_unit"] if told else None
    right = unit == "–" or (likely or 1.0) == float(unit)
    extent = " × ".join(f"{length:.3g}" for length in told["scene"]["extent"]) if told else "–"
    mark = "yes" if code in (0, 1) else "no: " + last.replace(args.folder.as_posix(), "").strip()[:120]
    shown = (f"{likely:g} m" if likely else "1 m") + ("" if right else f" (is {unit} m)") + (" ?" if unit == "–" else "")
    others = ", ".join(kind for kind, word in KINDS if any(word in note for note in notes)) or "–"
    surfaces = told["scene"]["surfaces"] if told else "–"
    text = f"| {name} | {repository} | {surfaces} | {extent} | {mark} | {light(notes)} | {others} | {shown} | {len(notes)} | {seconds:.1f} |"
    print(text, flush=True)
    return text, code in (0, 1), unit != "–", right, len(notes)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--radwalk", default=str(HERE.parent / "target/release/radwalk"))
    parser.add_argument("--out", type=Path, default=HERE.parent / "docs/results/meshes.md")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", default="")
    args = parser.parse_args()
    listed = [line.split("\t") for line in (HERE / "meshes.tsv").read_text().splitlines() if line and line[0] != "#"]
    version = subprocess.run([args.radwalk, "--version"], capture_output=True, text=True).stdout.strip()
    rows = []
    with ThreadPoolExecutor(args.jobs) as pool:
        for one in pool.map(lambda one: row(args, one), [one for one in listed if args.only in one[0]]):
            if one is not None:
                rows.append(one)
                args.out.write_text(page(rows, version))


def page(rows, version):
    runs, known = sum(row[1] for row in rows), [row for row in rows if row[2]]
    return f"""# Meshes by others, as they are

Written by `scripts/meshes.py FOLDER` ({version}). The files are listed in `scripts/meshes.tsv`; none is part of this project. Each is run by the bare command,
`radwalk run FILE` with {int(PATHS):,} paths on one worker, on an AMD EPYC with AVX-512. *Extent* is as read, in units of the file, z up. *Unit* is the one that is told to
be likely; a person judged by the things in the file whether it is right, and `?` marks where none is known. *Notes* is how many lines are said before the run. *Seconds* are of
processor time of the coordinator, which reads, chooses patches and writes all files; the walks of its worker come on top.

{runs} of {len(rows)} run as they are; of {len(known)} units that are known {sum(row[3] for row in known)} are told rightly; no run says more than {max(row[4] for row in rows)} notes.

| file | repository | surfaces | extent | runs | light | other assumptions | unit | notes | seconds |
|---|---|---|---|---|---|---|---|---|---|
""" + "\n".join(row[0] for row in rows) + "\n"


if __name__ == "__main__":
    main()
