#!/usr/bin/env python3
"""Sparse factors of made cities and of fetched ones: times, memory, entries, errors, row sums, kills; View3D and pyviewfactor beside them.
Writes docs/results/factors.md.

    scripts/factors.py RADWALK [--view3d VIEW3D] [--blocks 4,16,34] [--stl CITY.stl]... [--out FOLDER]

numpy and scipy read the matrices. Peers are compared where View3D is given, on the city of up to 2,000 facets. A fetched city is counted twice:
as it is, and as a cell that repeats along x and y. scripts/factors.sh says where View3D and cities come from.
"""

import argparse
import hashlib
import json
import os
import struct
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy import sparse

RAYS = 10_000
PAGE = Path(__file__).resolve().parent.parent / "docs" / "results" / "factors.md"


def height(i, j):
    """The height of a building [m], from 6 to 60, most of them low: a hash of its place."""
    h = (i * 73856093 ^ j * 19349663) & 0xFFFFFFFF
    h = ((h ^ (h >> 15)) * 0x2C1B3C6D) & 0xFFFFFFFF
    h = ((h ^ (h >> 12)) * 0x297A2D39) & 0xFFFFFFFF
    return 6.0 + 54.0 * ((h ^ (h >> 15)) / 2**32) ** 3


def city(side):
    """Blocks of 30 m × 30 m, side × side of them, with a building of 15 m × 15 m on each: 88 triangles a block."""
    triangles = []

    def quad(corner, u, v, nu, nv):
        corner, u, v = map(np.array, (corner, u, v))
        for a in range(nu):
            for b in range(nv):
                at = lambda s, t: corner + u * (s / nu) + v * (t / nv)
                p, q, r, s = at(a, b), at(a + 1, b), at(a + 1, b + 1), at(a, b + 1)
                triangles.extend([(p, q, r), (p, r, s)])

    for i in range(side):
        for j in range(side):
            x, y, h = 30.0 * i, 30.0 * j, height(i, j)
            strips = [(0.0, 7.5), (7.5, 15.0), (22.5, 7.5)]
            for a, (x0, w) in enumerate(strips):
                for b, (y0, d) in enumerate(strips):
                    if (a, b) != (1, 1):
                        quad((x + x0, y + y0, 0.0), (w, 0, 0), (0, d, 0), 1, 1)
            x, y = x + 7.5, y + 7.5
            quad((x, y, 0.0), (15, 0, 0), (0, 0, h), 2, 4)
            quad((x + 15, y, 0.0), (0, 15, 0), (0, 0, h), 2, 4)
            quad((x + 15, y + 15, 0.0), (-15, 0, 0), (0, 0, h), 2, 4)
            quad((x, y + 15, 0.0), (0, -15, 0), (0, 0, h), 2, 4)
            quad((x, y, h), (15, 0, 0), (0, 15, 0), 2, 2)
    return np.array(triangles, dtype="<f4")


def write_stl(path, triangles):
    records = np.zeros(len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    records["corners"] = triangles
    path.write_bytes(b"a made city".ljust(80) + struct.pack("<I", len(triangles)) + records.tobytes())


def write_vs3(path, triangles):
    vertices, of_corner = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    with open(path, "w") as file:
        file.write("T a made city\nC eps=1.0e-4 encl=0 list=0 out=0\nF 3\n")
        for number, point in enumerate(vertices, 1):
            file.write("V {} {:.9g} {:.9g} {:.9g}\n".format(number, *point))
        for number, corners in enumerate(of_corner.reshape(-1, 3) + 1, 1):
            file.write("S {} {} {} {} 0 0 0 0.9 f{}\n".format(number, *corners, number))
        file.write("End of data\n")


def timed(command, folder=None):
    """Runs a command; seconds by the clock and of the processor, those that its threads waited for a core, and the most memory [MB], both
    looked up twenty times a second."""
    began, most, waits = time.monotonic(), 0, {}
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder)
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid != 0:
            break
        # What wait4 tells of memory is that of this process where it was more.
        lines = Path(f"/proc/{process.pid}/status").read_text().splitlines()
        most = max([most, *(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))])
        for thread in Path(f"/proc/{process.pid}/task").glob("*/schedstat"):
            try:
                waits[thread] = int(thread.read_text().split()[1]) / 1e9
            except OSError:
                pass
        time.sleep(0.05)
    assert os.waitstatus_to_exitcode(status) == 0, command
    return time.monotonic() - began, usage.ru_utime + usage.ru_stime, sum(waits.values()), most / 1024


def arguments(binary, stl, out, *more, rays=RAYS):
    # The mesh's fronts look out of the buildings; its unit is the metre.
    return [binary, "factors", stl, "--sparse", "--rays", str(rays), "--set", "import.sides=1", "--out", out, "--quiet", *more]


def read_stl(path):
    """The triangles of a binary STL."""
    records = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    return np.frombuffer(path.read_bytes(), dtype=records, offset=84)["corners"]


def measured(binary, stl, out, name, *more):
    """A row of the table of cities, and the matrix."""
    wall, processor, waited, memory = timed(arguments(binary, stl, out, "--export", "npz", "--force", *more))
    summary = json.loads((out / "factors.json").read_text())
    matrix = sparse.load_npz(out / "factors.npz")
    off = np.abs(matrix.sum(axis=1) - 1.0).max()
    row = {
        "name": name,
        "facets": matrix.shape[0],
        "escape": summary["escape"],
        "walks": summary["walks"],
        "wall": wall,
        "processor": processor,
        "waited": waited,
        "memory": memory,
        "entries": summary["entries"],
        "error": summary["error"],
        "off": off,
        "size": (out / "factors.npz").stat().st_size / 1e6,
    }
    # What smoothing takes and the files that it makes, of the counted rows.
    _, processor, _, memory = timed(arguments(binary, stl, out, "--export", "npz", "--resume", "--smooth", *more))
    return row | {"smooth processor": processor, "smooth memory": memory}, matrix


def fetched(binary, stl, folder):
    """Two rows of the table: a city as it is, and a cell of copies of it."""
    triangles = read_stl(stl).reshape(-1, 3)
    steps = ",".join(str(float(step)) for step in (triangles.max(axis=0) - triangles.min(axis=0))[:2])
    for name, more in ((stl.name, []), (f"{stl.name}, repeated", ["--periodic", steps])):
        yield measured(binary, stl, folder / f"out-{len(more)}", name, *more)[0]


def by_area(areas, squares):
    """The root of the sum of squares of a row, in the mean square over rows by area."""
    return np.sqrt((areas * squares.sum(axis=1)).sum() / areas.sum())


def view3d_row(view3d, triangles, matrix, folder):
    """View3D on the same facets: its times, and the counted factors held against its own, which are returned, too."""
    vs3, vf = folder / "city.vs3", folder / "city.vf"
    write_vs3(vs3, triangles)
    _, processor, _, memory = timed([view3d, vs3.name, vf.name], folder)
    numbers = np.array(vf.read_text().split("\n", 1)[1].split(), dtype=float)
    n = len(triangles)
    areas, exact = numbers[:n], numbers[n : n + n * n].reshape(n, n)
    counted = matrix[:, :n].toarray()[:n]
    told = exact * RAYS > 5.0
    z = (counted - exact)[told] / np.sqrt(exact[told] * (1.0 - exact[told]) / RAYS)
    rms, error = by_area(areas, (counted - exact) ** 2), by_area(areas, counted * (1.0 - counted) / RAYS)
    row = {"facets": n, "error": error, "processor": processor, "memory": memory, "pairs": int(told.sum())}
    return row | {"z": np.sqrt(np.mean(z**2)), "mean": z.mean(), "rms": rms}, areas, exact


def pyviewfactor_row(binary, side, triangles, areas, exact, folder):
    """pyviewfactor on the same facets: its error beside View3D, and the count of the same error, raw and smoothed."""
    import pyvista
    import pyviewfactor

    def found(triangles):
        corners = np.arange(3 * len(triangles)).reshape(-1, 3)
        faces = np.hstack([np.full((len(triangles), 1), 3), corners]).ravel()
        return pyviewfactor.compute_viewfactor_matrix(pyvista.PolyData(triangles.reshape(-1, 3).astype(float), faces)).T

    # The first call compiles.
    found(triangles[:16])
    began = time.process_time()
    theirs = found(triangles)
    processor, error = time.process_time() - began, by_area(areas, (theirs - exact) ** 2)
    row = {"processor": processor, "error": error}
    row["rays"] = rays = int(np.ceil(by_area(areas, exact * (1.0 - exact)) ** 2 / error**2))
    n, stl = len(triangles), folder / f"city{side}.stl"
    for name, more in (("raw", []), ("smooth", ["--smooth"])):
        out = folder / f"equal-{name}"
        _, row[f"{name} processor"], _, _ = timed(arguments(binary, stl, out, "--force", "--export", "npz", *more, rays=rays))
        matrix = sparse.load_npz(out / ("smoothed.npz" if more else "factors.npz"))
        row[f"{name} error"] = by_area(areas, (matrix[:, :n].toarray() - exact) ** 2)
        row[f"{name} off"] = np.abs(matrix.sum(axis=1) - 1.0).max()
    return row


def killed(binary, side, folder, kills):
    """Whether a count that is killed so often comes to the same bytes, and how often it was killed while it counted."""
    stl, whole, broken = folder / f"city{side}.stl", folder / "whole", folder / "broken"
    began = time.monotonic()
    subprocess.run(arguments(binary, stl, whole, "--force"), check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    step, times = (time.monotonic() - began) / 12, 0
    for kill in range(kills):
        rows = broken / "factors.rows"
        more = ["--resume"] if rows.exists() else []
        process = subprocess.Popen(arguments(binary, stl, broken, *more), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(step * (0.5 + (kill * 7 % 10) / 10))
        times += process.poll() is None
        process.kill()
        process.wait()
    subprocess.run(arguments(binary, stl, broken, "--resume"), check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    digest = lambda out, name: hashlib.sha256((out / name).read_bytes()).hexdigest()
    same = all(digest(whole, name) == digest(broken, name) for name in ("factors.rows", "factors.mtx", "groups.csv"))
    return times, same


def page(version, rows, peer, other, kills, processor):
    lines = [
        "# Sparse factors of cities",
        "",
        "<!-- Written by scripts/factors.py; do not edit. -->",
        "",
        f"`scripts/factors.sh RADWALK KEPT`, {version}, {processor}. Made cities: blocks of 30 m with a building of 15 m × 15 m and 6 m to 60 m on each, 88",
        f"triangles a block, each a surface of one side. Fetched ones have the names of their files; *repeated* is a cell of copies without end (`--periodic`). {RAYS:,} walks a row, form factors, two threads. While other programs run the threads wait for a core: the clock shows about half of the sum of",
        "processor and waiting.",
        "",
        "| city | facets | walks | clock [s] | processor [s] | waited for a core [s] | walks per processor second | memory [MB] | factors that are not 0 | a row | error of a row | leaves for the sky | rows off 1 by | `factors.npz` [MB] | `--smooth` [s] | its memory [MB] |",
        "|---|" + "---:|" * 15,
    ]
    for row in rows:
        lines.append(
            "| {name} | {facets:,} | {walks:,} | {wall:.0f} | {processor:.1f} | {waited:.0f} | {rate:.2g} million | {memory:.0f} | {entries:,} | {each:.0f} | {error:.2e} | {escape:.1%} | {off:.0e} | {size:.0f} | {smooth processor:.1f} | {smooth memory:.0f} |".format(
                **row, rate=row["walks"] / row["processor"] / 1e6, each=row["entries"] / row["facets"]
            )
        )
    lines += ["", "The error of a row is the root of the sum of variances of its factors, in the mean square over rows by area. `--smooth` was asked of the counted rows: its", "seconds are those of the processor, with the files that are written.", ""]
    if peer:
        lines += [
            f"## Beside View3D, {peer['facets']:,} facets",
            "",
            f"View3D (adaptive integration, `eps=1.0e-4`) takes {peer['processor']:.1f} s of processor time on one thread, the count {peer['ours']:.1f} s on two. Of {peer['pairs']:,} factors that expect more than five walks, the count",
            f"differs by z with a mean square of {peer['z'] ** 2:.3f} (1 where both agree but for the noise that is told) and a mean of {peer['mean']:.4f}. The columns of facets of a row differ by {peer['rms']:.2e} (root of the sum of squares) where {peer['error']:.2e} is told.",
            "The time of View3D grows faster than the square of the number of facets, that of a count about as their number.",
            "",
        ]
    if other:
        lines += [
            "## Beside pyviewfactor at equal error, the same facets",
            "",
            "The error is that beside View3D. pyviewfactor asks one ray a pair whether it is hidden, so a pair is seen whole or not at all.",
            "",
            "| | walks a row | processor [s] | error of a row | rows off 1 by |",
            "|---|---:|---:|---:|---:|",
            f"| pyviewfactor, compiled before | – | {other['processor']:.1f} | {other['error']:.2e} | – |",
            f"| counted | {other['rays']:,} | {other['raw processor']:.1f} | {other['raw error']:.2e} | {other['raw off']:.0e} |",
            f"| counted and smoothed | {other['rays']:,} | {other['smooth processor']:.1f} | {other['smooth error']:.2e} | {other['smooth off']:.0e} |",
            "",
        ]
    times, same = kills
    lines += [
        "## Killed and resumed",
        "",
        f"A count of {rows[0]['facets']:,} facets was killed {times} times while it counted or wrote, and resumed: the bytes of `factors.rows`, `factors.mtx` and `groups.csv` are {'those' if same else 'NOT those'} of a count that was not.",
        "",
    ]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("radwalk")
    parser.add_argument("--view3d")
    parser.add_argument("--blocks", default="4,16,34")
    parser.add_argument("--stl", type=Path, action="append", default=[])
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.out or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        rows, peer, other = [], None, None
        for side in map(int, given.blocks.split(",")):
            stl, triangles = folder / f"city{side}.stl", city(side)
            write_stl(stl, triangles)
            row, matrix = measured(given.radwalk, stl, folder / f"out{side}", f"{side} × {side} blocks")
            rows.append(row)
            print(row, flush=True)
            # View3D writes a log where it runs.
            if given.view3d and len(triangles) <= 2000:
                peer, areas, exact = view3d_row(Path(given.view3d).resolve(), triangles, matrix, folder)
                peer["ours"] = row["processor"]
                other = pyviewfactor_row(given.radwalk, side, triangles, areas, exact, folder)
                print(peer, other, flush=True)
        for stl in given.stl:
            rows += fetched(given.radwalk, stl, folder)
            print(*rows[-2:], sep="\n", flush=True)
        kills = killed(given.radwalk, int(given.blocks.split(",")[0]), folder, 20)
        version = subprocess.run([given.radwalk, "--version"], capture_output=True, text=True, check=True).stdout.split("\n")[0]
        models = [line.split(":", 1)[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")]
        processor = f"{len(models)} cores of {models[0]}"
        PAGE.write_text(page(version, rows, peer, other, kills, processor))


if __name__ == "__main__":
    main()
