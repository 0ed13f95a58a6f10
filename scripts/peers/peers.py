"""Figures of merit of radwalk and Mitsuba 3 for scenes: peers.py RADWALK FOLDER SECONDS SCENE…"""

import csv
import json
import pathlib
import subprocess
import sys

import mitsuba_patches
import numpy as np
import patches

COLUMNS = ("", "_r", "_g", "_b")


def main(radwalk, folder, seconds, scenes):
    """A row for each scene and method."""
    print("| scene | patches | method | mean squared relative error | core-seconds | figure of merit | over Mitsuba's | reflected power, less Mitsuba's |")
    print("|---|---|---|---|---|---|---|---|")
    for scene in scenes:
        surfaces = patches.read(scene)
        reflects = surfaces[3].max(axis=1) > 0.0
        dark = surfaces[4].max(axis=1) == 0.0
        chosen = reflects & dark
        theirs = mitsuba_patches.run(surfaces, seconds, pathlib.Path(folder))
        rows = [("Mitsuba 3 path", theirs)]
        for method in ("shooting", "jacobi"):
            rows.append((f"radwalk {method}", ours(radwalk, folder, seconds, scene, method)))
        # Patches of which every method knows a radiosity.
        known = chosen & np.all([found[0].min(axis=0) > 0.0 for _, found in rows], axis=0)
        of_theirs = merit(theirs, known)
        for name, found in rows:
            mean, squared_error, core_seconds = found
            relative = np.mean(squared_error[:, known] / mean[:, known] ** 2)
            value = merit(found, known)
            row = pathlib.Path(scene).stem, int(known.sum()), name, f"{relative:.3g}", f"{core_seconds:.2f}"
            numbers = f"{value:.4g}", f"{value / of_theirs:.3g}", f"{difference(found, theirs, areas(surfaces) * chosen):+.1%}"
            print("| " + " | ".join(map(str, (*row, *numbers))) + " |", flush=True)


def merit(found, known):
    """1/(mean squared relative error × core-seconds)."""
    mean, squared_error, core_seconds = found
    return 1.0 / (np.mean(squared_error[:, known] / mean[:, known] ** 2) * core_seconds)


def difference(found, theirs, areas):
    """Of the power that leaves the patches, in parts: another scene or a mistake would show. Discretisation makes some. Patches
    that a method knows nothing of count, with 0: left out, those that few samples find would make its power too large."""
    return (found[0] @ areas).sum() / (theirs[0] @ areas).sum() - 1.0


def areas(surfaces):
    """The areas of patches."""
    edges, triangle = surfaces[1], surfaces[2]
    return np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) * np.where(triangle, 0.5, 1.0)


def ours(radwalk, folder, seconds, scene, method):
    """A run of about as many core-seconds, found by a short one."""
    paths = 2_000_000
    for _ in range(2):
        found = run(radwalk, folder, scene, method, paths)
        paths = int(paths * max(1.0, seconds / max(found[2], 1e-3)))
    return found


def run(radwalk, folder, scene, method, paths):
    """Radiosity and squared standard error of each patch and channel, core-seconds."""
    out = pathlib.Path(folder) / "out"
    job = pathlib.Path(folder) / "job.toml"
    job.write_text(f'scene = {json.dumps(str(pathlib.Path(scene).resolve()))}\n[budget]\npaths = {paths}\n[method]\nwalk = "{method}"\n')
    command = [radwalk, "run", job, "--quiet", "--force", "--out", out]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    with open(out / "patches.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row.get("side") != "back"]
    channels = [end for end in COLUMNS if f"radiosity{end}" in rows[0]]
    column = lambda name: np.array([[float(row[name + end] or "nan") for row in rows] for end in channels])
    core_seconds = json.loads((out / "summary.json").read_text())["cpu_seconds"]
    return np.nan_to_num(column("radiosity")), np.nan_to_num(column("std_error")) ** 2, core_seconds


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]), sys.argv[4:])
