#!/usr/bin/env python3
"""Runs meshes by others as they are, and writes docs/results/meshes.md.

    scripts/meshes.py FOLDER [--radwalk PROGRAM] [--out PAGE]

FOLDER holds the files that scripts/meshes.tsv lists, fetched from the repositories named there. Each is run by the bare
command with 20,000 paths. The page has no paths of this machine.
"""
import argparse
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

PATHS = "20000"
HERE = Path(__file__).resolve().parent


def used():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


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
    with tempfile.TemporaryDirectory() as out:
        before = used()
        command = [program, "run", str(file), "--paths", PATHS, "--workers", "1", "--out", out + "/out"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=600)
        seconds = used() - before
    lines = [line.split("note: ", 1)[1] for line in done.stderr.splitlines() if "note: " in line]
    last = done.stderr.strip().splitlines()[-1] if done.returncode > 1 else ""
    check = subprocess.run([program, "check", str(file), "--json"], capture_output=True, text=True, timeout=600)
    told = json.loads(check.stdout) if check.returncode < 2 else None
    return done.returncode, lines, last, seconds, told


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--radwalk", default=str(HERE.parent / "target/release/radwalk"))
    parser.add_argument("--out", type=Path, default=HERE.parent / "docs/results/meshes.md")
    parser.add_argument("--only", default="")
    args = parser.parse_args()
    rows, ran, units, known, most = [], 0, 0, 0, 0
    listed = [line.split("\t") for line in (HERE / "meshes.tsv").read_text().splitlines() if line and line[0] != "#"]
    listed = [row for row in listed if args.only in row[0]]
    for path, repository, name, true_unit in listed:
        file = args.folder / path
        if not file.exists():
            print("missing:", path, file=sys.stderr)
            continue
        code, notes, last, seconds, told = measure(args.radwalk, file)
        ran += code < 2
        most = max(most, len(notes))
        likely = told["scene"]["likely_unit"] if told else None
        right = true_unit == "–" or (likely or 1.0) == float(true_unit)
        known += true_unit != "–"
        units += right and true_unit != "–"
        extent = " × ".join(f"{length:.3g}" for length in told["scene"]["extent"]) if told else "–"
        mark = "yes" if code < 2 else "no: " + last.replace(args.folder.as_posix(), "").strip()[:120]
        unit = f"{likely:g} m" if likely else "1 m"
        others = [kind for kind, word in [("limit", "clamped to"), ("textures", "their mean colours"), ("solid panes", "modelled as solid"),
                                          ("mirrors", "mirror-like"), ("black", "takes all light"), ("sheets", "shine to one side"),
                                          ("left out", "left out:"), ("undefined", "defined by no file")]
                  if any(word in note for note in notes)]
        rows.append(f"| {name} | {repository} | {told['scene']['surfaces'] if told else '–'} | {extent} | {mark} | {light(notes)} | "
                    f"{', '.join(others) or '–'} | {unit}{'' if right else ' (is ' + true_unit + ' m)'} | {len(notes)} | {seconds:.1f} |")
        print(rows[-1], flush=True)
    version = subprocess.run([args.radwalk, "--version"], capture_output=True, text=True).stdout.strip()
    args.out.write_text(f"""# Meshes by others, as they are

Written by `scripts/meshes.py FOLDER` ({version}). The files are listed in `scripts/meshes.tsv`; none is part of this project. Each is run by the bare command,
`radwalk run FILE` with {PATHS} paths on one worker, on an AMD EPYC (Zen 4, AVX-512). *Extent* is as written, z up. *Unit* is the one that is told to be likely; it is
right where it is that of the things in the file, which a person judged. *Notes* is how many lines are said before the run. *Seconds* are of
processor time, all output files included.

{ran} of {len(rows)} run as they are; of {known} units that are known {units} are told rightly; no run says more than {most} notes.

| file | repository | surfaces | extent | runs | light | other assumptions | unit | notes | seconds |
|---|---|---|---|---|---|---|---|---|---|
""" + "\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
