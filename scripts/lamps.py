#!/usr/bin/env python3
"""Lamps beside other programs: a room of 24 luminaires beside Mitsuba 3, and catalogue files beside other readers. Writes both into
docs/results/lamps.md, behind what radwalk-lab has written there.

    scripts/lamps.py RADWALK FILES [--ies2rad PROGRAM]

FILES is a folder of .ies and .ldt files. Needs `pip install mitsuba numpy luxpy eulumdat-py`; Mitsuba's LLVM variants need a libLLVM on the
machine. ies2rad is of Radiance, built from its sources (https://github.com/NREL/Radiance) by whoever measures.
"""

import argparse
import csv
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

PAGE = Path(__file__).resolve().parent.parent / "docs" / "results" / "lamps.md"
BEGINS = "## Beside other programs"

SIZE = np.array([12.0, 8.0, 3.0])
REFLECTANCES = {"floor": 0.2, "ceiling": 0.7, "walls": 0.5, "cupboard": 0.4}
CUPBOARD = (np.array([4.0, 0.0, 0.0]), np.array([3.0, 0.8, 2.2]))
LAMPS = [(1.0 + 2.0 * i, 1.0 + 2.0 * j, 2.8) for i in range(6) for j in range(4)]
HEIGHT = 0.8

# Lamps hang without a turn: C = 0 is x, C = 90 is y, and γ = 0 points down.
GAMMA, PLANES = np.arange(0.0, 91.0, 5.0), np.arange(0.0, 361.0, 15.0)


def candela():
    """Intensities [cd] of a luminaire without symmetry: planes in rows."""
    c, gamma = np.radians(PLANES)[:, None], np.radians(GAMMA)[None, :]
    return np.round(800.0 * (1.0 + 0.5 * np.sin(c)) * np.cos(gamma) * (1.0 + 1.5 * np.sin(2.0 * gamma) ** 2) + 1e-9)


def write_ies(path):
    rows = "\n".join(" ".join(f"{x:g}" for x in row) for row in candela())
    angles = [" ".join(f"{x:g}" for x in some) for some in (GAMMA, PLANES)]
    path.write_text(f"IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 {len(GAMMA)} {len(PLANES)} 1 2 0 0 0\n1 1 10\n{angles[0]}\n{angles[1]}\n{rows}\n")


def points():
    """500 points at the height of desks, none of them in or near the cupboard."""
    x, y = np.meshgrid((np.arange(26) + 0.5) * SIZE[0] / 26, (np.arange(20) + 0.5) * SIZE[1] / 20)
    all_points = np.stack([x.ravel(), y.ravel(), np.full(x.size, HEIGHT)], axis=1)
    corner, size = CUPBOARD
    inside = ((all_points > corner - 0.05) & (all_points < corner + size + 0.05)).all(axis=1)
    return all_points[~inside][:500]


def quads():
    """Corner, edges and name of each surface; the fronts (u × v) look into the room."""
    def box(corner, size, names, inwards):
        x, y, z = np.diag(size)
        sides = [(corner, x, y, names[0]), (corner + z, y, x, names[1])]
        sides += [(corner, z, x, names[2]), (corner + y, x, z, names[2]), (corner, y, z, names[2]), (corner + x, z, y, names[2])]
        return [(c, u, v, n) if inwards else (c, v, u, n) for c, u, v, n in sides]

    room = box(np.zeros(3), SIZE, ("floor", "ceiling", "walls"), True)
    cupboard = box(*CUPBOARD, ("cupboard",) * 3, False)
    # The cupboard stands on the floor.
    return room + cupboard[1:]


def radwalk_room(binary, folder, paths, cell=0.2):
    """Illuminances at the points, and their standard errors."""
    write_ies(folder / "lamp.ies")
    numbers = lambda point: "[" + ", ".join(f"{x:.12g}" for x in point) + "]"
    text = "".join(f"[material.{name}]\nreflectance = {r}\n" for name, r in REFLECTANCES.items())
    for place, (corner, u, v, name) in enumerate(quads()):
        cells = [max(1, round(np.linalg.norm(edge) / cell)) for edge in (u, v)]
        quad = ", ".join(map(numbers, (corner, corner + u, corner + v)))
        text += f'[[surface]]\nname = "{name}{place}"\nmaterial = "{name}"\nquad = [{quad}]\npatches = {cells}\n'
    for lamp in LAMPS:
        text += f'[[lamp]]\nfile = "lamp.ies"\nposition = {numbers(lamp)}\n'
    text += '[[points]]\nname = "desk"\nfile = "desk.pts"\n'
    np.savetxt(folder / "desk.pts", np.hstack([points(), np.tile([0.0, 0.0, 1.0], (500, 1))]), fmt="%.17g")
    (folder / "room.toml").write_text(text)
    (folder / "job.toml").write_text(f'scene = "room.toml"\nseed = 24\n[budget]\npaths = {paths}\n[method]\nwalk = "shooting"\n')
    run(binary, folder)
    rows = list(csv.DictReader(open(folder / "out" / "planes.csv")))
    return np.array([[float(row[name]) for name in ("illuminance", "std_error")] for row in rows]).T


def run(binary, folder):
    words = [binary, "run", folder / "job.toml", "--out", folder / "out", "--force", "--quiet"]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def mitsuba_room(folder, samples):
    """Illuminances at the points by Mitsuba's path tracer, and their standard errors: cosine-distributed rays from each point, and a shadow
    ray to every lamp."""
    import drjit as dr
    import mitsuba as mi

    mi.set_variant("llvm_ad_mono")
    scene = mi.load_dict(mitsuba_scene(mi))
    direct = np.zeros(500)
    for lamp in LAMPS:
        away = points() - np.array(lamp)
        distance = np.linalg.norm(away, axis=1)
        towards = -away / distance[:, None]
        ray = mi.Ray3f(mi.Point3f(points().T), mi.Vector3f(towards.T), maxt=mi.Float(0.999 * distance), time=0.0, wavelengths=[])
        free = ~np.array(scene.ray_test(ray))
        direct += free * intensity(away) * towards[:, 2] / distance**2
    integrator = mi.load_dict({"type": "path", "max_depth": 200, "rr_depth": 8})
    sums = np.zeros((2, 500))
    per_pass = 1 << 11
    for turn in range(samples // per_pass):
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(turn, 500 * per_pass)
        place = dr.arange(mi.UInt32, 500 * per_pass) // per_pass
        origin = dr.gather(mi.Point3f, mi.Point3f(points().T), place)
        direction = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
        ray = mi.RayDifferential3f(mi.Ray3f(origin, direction))
        light, _, _ = integrator.sample(scene, sampler, ray, None, True)
        light = np.pi * np.array(light, dtype=float).reshape(500, per_pass)
        means = light.mean(axis=1)
        sums += [means, means**2]
    turns = samples // per_pass
    mean = sums[0] / turns
    error = np.sqrt((sums[1] / turns - mean**2) / (turns - 1))
    return direct + mean, error


def intensity(away):
    """Intensities [cd] towards these directions of any length, by the table, interpolated in C and γ."""
    gamma = np.degrees(np.arccos(np.clip(-away[:, 2] / np.linalg.norm(away, axis=1), -1.0, 1.0)))
    c = np.degrees(np.arctan2(away[:, 1], away[:, 0])) % 360.0
    i, j = np.minimum((c / 15.0).astype(int), 23), np.minimum((gamma / 5.0).astype(int), 17)
    s, t, table = c / 15.0 - i, gamma / 5.0 - j, candela()
    found = (1 - s) * ((1 - t) * table[i, j] + t * table[i, j + 1]) + s * ((1 - t) * table[i + 1, j] + t * table[i + 1, j + 1])
    return np.where(gamma <= 90.0, found, 0.0)


def mitsuba_scene(mi):
    """The room with lamps of a class of their own, since Mitsuba has none with a table of intensities."""
    import drjit as dr

    table = candela()

    class Luminaire(mi.Emitter):
        def __init__(self, props):
            super().__init__(props)
            self.place = mi.Point3f(props["x"], props["y"], props["z"])
            self.table = mi.Float(table.ravel().astype(np.float32))
            self.m_flags = +mi.EmitterFlags.DeltaPosition

        def sample_direction(self, it, sample, active=True):
            away = it.p - self.place
            distance = dr.norm(away)
            direction = away / distance
            ds = dr.zeros(mi.DirectionSample3f)
            ds.p, ds.n, ds.uv, ds.time, ds.pdf, ds.delta = self.place, -direction, 0.0, it.time, 1.0, True
            ds.emitter, ds.d, ds.dist = mi.EmitterPtr(self), -direction, distance
            gamma = dr.rad2deg(dr.acos(dr.clip(-direction.z, -1.0, 1.0)))
            c = dr.rad2deg(dr.atan2(direction.y, direction.x))
            c = dr.select(c < 0.0, c + 360.0, c)
            i, j = mi.UInt32(dr.clip(c / 15.0, 0.0, 23.0)), mi.UInt32(dr.clip(gamma / 5.0, 0.0, 17.0))
            s, t = c / 15.0 - mi.Float(i), gamma / 5.0 - mi.Float(j)
            at = lambda di, dj: dr.gather(mi.Float, self.table, (i + di) * len(GAMMA) + j + dj, active)
            found = (1 - s) * ((1 - t) * at(0, 0) + t * at(0, 1)) + s * ((1 - t) * at(1, 0) + t * at(1, 1))
            found = dr.select(gamma <= 90.0, found, 0.0)
            return ds, mi.Spectrum(found / distance**2) & active

        def pdf_direction(self, it, ds, active=True):
            return mi.Float(0.0)

        def eval_direction(self, it, ds, active=True):
            return mi.Spectrum(0.0)

        def eval(self, si, active=True):
            return mi.Spectrum(0.0)

        def bbox(self):
            return mi.BoundingBox3f()

    mi.register_emitter("luminaire", Luminaire)
    scene = {"type": "scene"}
    for place, (corner, u, v, name) in enumerate(quads()):
        # The rectangle has corners at ±1.
        middle, normal = corner + 0.5 * (u + v), np.cross(u, v) / np.linalg.norm(np.cross(u, v))
        to_world = np.eye(4)
        to_world[:3, 0], to_world[:3, 1], to_world[:3, 2], to_world[:3, 3] = 0.5 * u, 0.5 * v, normal, middle
        bsdf = {"type": "diffuse", "reflectance": {"type": "uniform", "value": REFLECTANCES[name]}}
        scene[f"surface{place}"] = {"type": "rectangle", "to_world": mi.ScalarTransform4f(to_world), "bsdf": bsdf}
    for place, (x, y, z) in enumerate(LAMPS):
        scene[f"lamp{place}"] = {"type": "luminaire", "x": x, "y": y, "z": z}
    return scene


def beside_mitsuba(binary, paths, samples):
    import mitsuba as mi

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        ours, our_error = radwalk_room(binary, folder, paths)
        began = time.process_time()
        theirs, their_error = mitsuba_room(folder, samples)
        seconds = time.process_time() - began
    off = ours - theirs
    z = off / np.hypot(our_error, their_error)
    scale = np.sqrt(np.mean(z**2))
    print(f"means {ours.mean()} {theirs.mean()}, rms z {scale}, {seconds} s", flush=True)
    return (
        f"A room of 12 × 8 × 3 m with a cupboard, 24 lamps of one table (25 planes of 19 angles), 500 points at 0.8 m, in patches of 0.2 m: {paths:,} walks beside the\n"
        f"path tracer of Mitsuba {mi.__version__} with {samples:,} paths from each point. The means are {ours.mean():.2f} and {theirs.mean():.2f} lx. The differences at the points are {np.sqrt(np.mean(off**2)):.3f} lx\n"
        f"in the root of the mean square and {np.abs(off).max():.2f} lx at most; over the errors of both ({np.sqrt(np.mean(our_error**2)):.3f} and {np.sqrt(np.mean(their_error**2)):.3f} lx) their root mean square is {scale:.3f}, where 1 is expected\n"
        f"but for what patches of 0.2 m leave out.\n"
    )


def directions(number=10_000):
    """Directions spread over the sphere, none of them at an edge of a table."""
    k = np.arange(number) + 0.5
    z, azimuth = 1.0 - 2.0 * k / number, np.pi * (1.0 + 5.0**0.5) * k
    across = np.sqrt(1.0 - z**2)
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), z], axis=1)


def radwalk_intensities(binary, file, folder):
    """Intensities [cd] as a lamp in a scene has them: the illuminance of points at 1 m that face it, of which nothing but its own light is
    known, so that the lower limit is the light that comes straight."""
    ways = directions()
    np.savetxt(folder / "sphere.pts", np.hstack([ways, -ways]), fmt="%.17g")
    (folder / "scene.toml").write_text(
        "[material.black]\nreflectance = 0.0\n[[surface]]\nname = 'far'\nmaterial = 'black'\nquad = [[-1, -1, -20], [1, -1, -20], [-1, 1, -20]]\n"
        f"[[lamp]]\nfile = '{file}'\nposition = [0, 0, 0]\n[[points]]\nname = 'sphere'\nfile = 'sphere.pts'\n"
    )
    (folder / "job.toml").write_text("scene = 'scene.toml'\nseed = 1\n[budget]\npaths = 128\n")
    run(binary, folder)
    rows = csv.DictReader(open(folder / "out" / "planes.csv"))
    return np.array([float(row["ci_low"]) for row in rows])


def angles(ways):
    """C and γ [°] of directions."""
    gamma = np.degrees(np.arctan2(np.hypot(ways[:, 0], ways[:, 1]), -ways[:, 2]))
    return np.degrees(np.arctan2(ways[:, 1], ways[:, 0])) % 360.0, gamma


def interpolated(planes, gammas, table, ways):
    """Intensities by a table that goes round: planes in rows. Outside of its γ it is dark."""
    c, gamma = angles(ways)
    i = np.clip(np.searchsorted(planes, c, side="right") - 1, 0, len(planes) - 2)
    j = np.clip(np.searchsorted(gammas, gamma, side="right") - 1, 0, len(gammas) - 2)
    s, t = (c - planes[i]) / (planes[i + 1] - planes[i]), (gamma - gammas[j]) / (gammas[j + 1] - gammas[j])
    found = (1 - s) * ((1 - t) * table[i, j] + t * table[i, j + 1]) + s * ((1 - t) * table[i + 1, j] + t * table[i + 1, j + 1])
    return np.where((gamma >= gammas[0]) & (gamma <= gammas[-1]), found, 0.0)


def full_circle(planes, table):
    """A table completed by its symmetry, which its last plane tells."""
    planes, table, last = np.asarray(planes, float), np.asarray(table, float), planes[-1]
    if len(planes) == 1:
        return np.array([0.0, 360.0]), np.vstack([table, table])
    if planes[0] == 90.0 and last == 270.0:
        # About the plane C90–C270: what is at C is at 180° − C.
        planes, table = np.concatenate([planes, 540.0 - planes[-2::-1]]), np.vstack([table, table[-2::-1]])
        turned = np.concatenate([planes - 360.0, planes])
        rows = np.vstack([table, table])
        keep = np.unique(turned.round(9), return_index=True)[1]
        return turned[keep], rows[keep]
    if last == 90.0:
        planes, table = np.concatenate([planes, 180.0 - planes[-2::-1]]), np.vstack([table, table[-2::-1]])
        last = 180.0
    if last == 180.0:
        planes, table = np.concatenate([planes, 360.0 - planes[-2::-1]]), np.vstack([table, table[-2::-1]])
        last = 360.0
    if last < 360.0:
        planes, table = np.append(planes, 360.0), np.vstack([table, table[:1]])
    return planes, table


def by_ies2rad(program, file, folder):
    """Intensities by the data file that ies2rad writes, in an unknown unit."""
    subprocess.run([program, "-o", folder / "found", file], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    words = (folder / "found.dat").read_text().split()
    dimensions, at, axes = int(words[0]), 1, []
    for _ in range(dimensions):
        first, last, number = float(words[at]), float(words[at + 1]), int(words[at + 2])
        at += 3
        if first == last:
            axes.append(np.array(words[at : at + number], float))
            at += number
        else:
            axes.append(np.linspace(first, last, number))
    # Of one dimension where the light is alike round about; else horizontal angles come first.
    gammas, planes = axes[-1], axes[0] if dimensions == 2 else np.array([0.0])
    table = np.array(words[at:], float).reshape(len(planes), len(gammas))
    planes, table = full_circle(planes, table)
    return interpolated(planes, gammas, table, directions())


def by_eulumdat_py(file):
    """Intensities [cd] by the package eulumdat-py."""
    from pyldt import LdtReader

    ldt = LdtReader.read(str(file))
    header = ldt.header
    flux = sum(float(x) for x in header.lamp_flux[:1])
    table = np.array(ldt.intensities, float) * flux * header.conv_factor / 1000.0
    planes, gammas = np.asarray(header.c_angles, float)[: len(table)], np.asarray(header.g_angles, float)
    planes, table = full_circle(planes, table)
    return interpolated(planes, gammas, table, directions())


def by_luxpy(file):
    """Intensities by luxpy, in the unit of the file."""
    from luxpy.toolboxes.iolidfiles import read_lamp_data

    lid = read_lamp_data(str(file), verbosity=0)
    planes, gammas = (np.asarray(lid[name], float) for name in ("h_angs", "v_angs"))
    planes, table = full_circle(planes, lid["candela_2d"])
    return interpolated(planes, gammas, table, directions())


def is_type_b(file):
    """Whether a file of LM-63 has photometry of type B, whose angles go round other axes."""
    lines = file.read_bytes().decode("latin-1").splitlines()
    tilt = next((place for place, line in enumerate(lines) if line.startswith("TILT=")), None)
    return tilt is not None and " ".join(lines[tilt + 1 :]).replace(",", " ").split()[5] == "2"


def beside_readers(binary, files, ies2rad):
    lines = [
        "Intensities in 10,000 directions of a lamp in a scene, beside those of a reader's table, interpolated. The largest difference, in parts of the peak; where a reader has",
        "another unit, both are scaled to their sums. ies2rad writes seven digits. luxpy begins files of symmetry 3 at another plane (C270 by the format), and reads no photometry of type",
        "B, for which ies2rad has other axes. A dash stands where a reader fails.",
        "",
        "| file | luxpy | ies2rad of Radiance, or eulumdat-py |",
        "|---|---:|---:|",
    ]
    off = lambda ours, theirs: np.abs(ours / ours.sum() - theirs / theirs.sum()).max() / (ours.max() / ours.sum())

    def told(reader):
        try:
            return f"{reader():.0e}"
        except Exception as fault:
            print(fault, flush=True)
            return "–"

    for file in files:
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            try:
                ours = radwalk_intensities(binary, file, folder)
            except subprocess.CalledProcessError:
                lines.append(f"| {file.name} | refused by radwalk | |")
                continue
            second = (lambda: by_eulumdat_py(file)) if file.suffix.lower() == ".ldt" else (lambda: by_ies2rad(ies2rad, file, folder))
            row = f"| {file.name} | {told(lambda: off(ours, by_luxpy(file)))} | {told(lambda: off(ours, second()))} |"
            if is_type_b(file):
                row = f"| {file.name} | type B | type B |"
            print(row, flush=True)
            lines.append(row)
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("radwalk")
    parser.add_argument("files", type=Path)
    parser.add_argument("--ies2rad", default="ies2rad")
    parser.add_argument("--paths", type=int, default=8_000_000)
    parser.add_argument("--samples", type=int, default=1 << 16)
    given = parser.parse_args()
    files = sorted(file.resolve() for file in given.files.iterdir() if file.suffix.lower() in (".ies", ".ldt"))
    readers = beside_readers(given.radwalk, files, given.ies2rad)
    room = beside_mitsuba(given.radwalk, given.paths, given.samples)
    version = subprocess.run([given.radwalk, "--version"], capture_output=True, text=True, check=True).stdout.split("\n")[0]
    text = PAGE.read_text().split(BEGINS)[0].rstrip("\n")
    PAGE.write_text(
        f"{text}\n\n{BEGINS}\n\nMade by `scripts/lamps.py RADWALK FILES`, {version}.\n\n### Mitsuba\n\n{room}\n### Readers\n\n{readers}"
    )


if __name__ == "__main__":
    main()
