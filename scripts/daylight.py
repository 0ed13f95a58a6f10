#!/usr/bin/env python3
"""Daylight beside other programs: appends to docs/results/daylight.md what radwalk, Mitsuba's path tracer and Radiance say of a side-lit room.

Usage: scripts/daylight.py RADWALK [WEATHER.epw], in the folder of the sources, with numpy, mitsuba and pyradiance of PyPI. Where one of the two is not
installed its part is left out, and the script says so. Mitsuba's LLVM variants need a libLLVM on the machine. The skies of Mitsuba are environment maps by the formula of
ISO 15469, written here a second time; those of radwalk are in 2,305 patches. pyradiance brings the binaries of Radiance. Without WEATHER the year is that of
configs/weather/made.epw.
"""

import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import tomllib

import numpy as np

try:
    import mitsuba as mi
except ImportError:
    mi = None
try:
    import pyradiance
except ImportError:
    pyradiance = None

PAGE = pathlib.Path("docs/results/daylight.md")
SCENE = pathlib.Path("configs/scenes/daylit.toml")
WEATHER = pathlib.Path("configs/weather/made.epw")
HEADINGS = MITSUBA, MATRICES, RADIANCE, COST = "## Beside Mitsuba", "## Skies beside gendaymtx", "## Beside Radiance", "## Cost beside Radiance"
ALTITUDE, HORIZONTAL = 40.0, 10_000.0
RAYS = 1 << 14
# a, b, c, d, e of ISO 15469, table 1.
SKIES = [
    (4, -0.70, 0, -1, 0), (4, -0.70, 2, -1.5, 0.15), (1.1, -0.8, 0, -1, 0), (1.1, -0.8, 2, -1.5, 0.15),
    (0, -1, 0, -1, 0), (0, -1, 2, -1.5, 0.15), (0, -1, 5, -2.5, 0.30), (0, -1, 10, -3, 0.45),
    (-1, -0.55, 2, -1.5, 0.15), (-1, -0.55, 5, -2.5, 0.30), (-1, -0.55, 10, -3, 0.45), (-1, -0.32, 10, -3, 0.45),
    (-1, -0.32, 16, -3, 0.30), (-1, -0.15, 16, -3, 0.30), (-1, -0.15, 24, -2.8, 0.15),
]


def luminance(sky, direction):
    """Relative luminance of a sky in directions (x east, y north, z up); 0 below the horizon."""
    a, b, c, d, e = sky
    altitude = np.radians(ALTITUDE)
    sun = np.array([0, -np.cos(altitude), np.sin(altitude)])
    chi = np.arccos(np.clip(direction @ sun, -1, 1))
    z = direction[..., 2]
    gradation = 1 + a * np.exp(b / np.maximum(z, 1e-9))
    indicatrix = 1 + c * (np.exp(d * chi) - np.exp(d * np.pi / 2)) + e * np.cos(chi) ** 2
    return np.where(z > 0, gradation * indicatrix, 0.0)


def environment(sky, width=2048):
    """An environment map of the sky that gives a horizontal plane HORIZONTAL lx; columns from the north over the east, rows from the zenith down."""
    height = width // 2
    theta = (np.arange(height) + 0.5) / height * np.pi
    azimuth = (np.arange(width) + 0.5) / width * 2 * np.pi
    theta, azimuth = np.meshgrid(theta, azimuth, indexing="ij")
    direction = np.stack([np.sin(theta) * np.sin(azimuth), np.sin(theta) * np.cos(azimuth), np.cos(theta)], axis=-1)
    values = luminance(sky, direction)
    solid_angle = np.sin(theta) * (np.pi / height) * (2 * np.pi / width)
    values *= HORIZONTAL / np.sum(values * np.cos(theta) * solid_angle)
    return np.repeat(values[..., None], 3, axis=2).astype(np.float32)


def room(text):
    """The surfaces of the scene file as Mitsuba has them."""
    scene = tomllib.loads(text)
    shapes = {}
    for surface in scene["surface"]:
        corner, corner_u, corner_v = (np.array(point, float) for point in surface["quad"])
        u, v = (corner_u - corner) / 2, (corner_v - corner) / 2
        normal = np.cross(u, v)
        matrix = np.eye(4)
        matrix[:3, :] = np.stack([u, v, normal / np.linalg.norm(normal), corner + u + v], axis=1)
        reflectance = scene["material"][surface["material"]]["reflectance"]
        shapes[surface["name"]] = {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f(matrix),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "spectrum", "value": reflectance}},
        }
    return shapes


def by_mitsuba(text, cells, number):
    """The illuminance of each cell under a sky, and its standard error."""
    bitmap = mi.Bitmap(environment(SKIES[number]))
    up = mi.ScalarTransform4f().rotate([1, 0, 0], 90)
    sky = {"type": "envmap", "bitmap": bitmap, "to_world": up}
    scene = mi.load_dict({"type": "scene", "sky": sky, **room(text)})
    rng = np.random.default_rng(number)
    corner, u, v = cells
    count = len(corner)
    place = rng.random((2, count, RAYS, 1))
    origin = corner[:, None] + place[0] * u + place[1] * v
    square, turn = rng.random((2, count, RAYS))
    radius, turn = np.sqrt(square), 2 * np.pi * turn
    direction = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - square)], axis=-1)
    flat = lambda of: np.ascontiguousarray(of.reshape(-1, 3).T.astype(np.float32))
    ray = mi.Ray3f(mi.Point3f(flat(origin)), mi.Vector3f(flat(direction)))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(number, count * RAYS)
    integrator = mi.load_dict({"type": "path", "max_depth": -1})
    found, _, _ = integrator.sample(scene, sampler, mi.RayDifferential3f(ray))
    light = np.pi * np.array(found)[0].reshape(count, RAYS).astype(float)
    return light.mean(1), light.std(1, ddof=1) / np.sqrt(RAYS)


def by_radwalk(radwalk, folder, text):
    """The coefficients of each cell and its walks."""
    (folder / "scene.toml").write_text(text)
    words = [folder / "scene.toml", "--weather", "configs/weather/made.epw", "--sky-patches", "2305", "--tolerance", "0.005", "--paths", "1e9"]
    subprocess.run([radwalk, "daylight", *words, "--export", "npz", "--out", folder / "out", "--quiet"], check=False)
    arrays = np.load(folder / "out" / "daylight.npz")
    walks = np.genfromtxt(folder / "out" / "annual.csv", delimiter=",", names=True, dtype=None, encoding="utf8")["walks"]
    return arrays["coefficients"], walks


def vector(radwalk, folder, number):
    """A sky in patches, the ground aside [cd/m²]."""
    out = folder / f"{number}.mtx"
    words = ["--cie", str(number + 1), "--altitude", str(ALTITUDE), "--azimuth", "180", "--horizontal", str(HORIZONTAL)]
    subprocess.run([radwalk, "sky", *words, "--sky-patches", "2305", "--ground", "0", "--quiet", "--out", out], check=True)
    body = out.read_text().split("\n\n", 1)[1]
    return 179 * np.array(body.split(), float)[::3]


def compared(sky, ours, theirs):
    """A row of a table: the light of the places under a sky by two programs, each with its standard errors."""
    (light, error), (other, other_error) = ours, theirs
    z = (light - other) / np.hypot(error, other_error)
    change = light.sum() / other.sum() - 1
    of_sum = np.hypot(np.hypot.reduce(error), np.hypot.reduce(other_error)) / other.sum()
    return (
        f"| {sky} | {light.mean():.1f} | {other.mean():.1f} | {100 * change:+.2f} ± {100 * of_sum:.2f} | {np.mean(z**2):.2f} | {np.abs(z).max():.1f} |"
    )


def beside_mitsuba(radwalk, version):
    mi.set_variant("llvm_ad_mono")
    text = SCENE.read_text()
    text, changed = re.subn(r"patches = \[6, 10\]", "patches = [10, 10]", text)
    assert changed == 1, "the sensor of the scene is cut otherwise"
    desk = tomllib.loads(text)["sensor"][0]["quad"]
    corner, corner_u, corner_v = (np.array(point, float) for point in desk)
    u, v = (corner_u - corner) / 10, (corner_v - corner) / 10
    corners = np.array([corner + i * u + j * v for i in range(10) for j in range(10)])
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        coefficients, walks = by_radwalk(radwalk, folder, text)
        parts = coefficients / np.pi
        for number in range(len(SKIES)):
            scores = np.pi * vector(radwalk, folder, number)
            ours = parts @ scores
            error = np.sqrt((parts @ scores**2 - ours**2) / walks)
            theirs, their_error = by_mitsuba(text, (corners, u, v), number)
            rows.append(compared(number + 1, (ours, error), (theirs, their_error)))
            print(rows[-1], flush=True)
    return [
        MITSUBA, "",
        f"Made by `scripts/daylight.py RADWALK`: {version}, Mitsuba {mi.__version__}. The room of `{SCENE}` at 100 places under the 15 skies of the CIE, the sun "
        f"at {ALTITUDE:.0f}° in the south and left out, {HORIZONTAL:.0f} lx on the ground. Mitsuba traces {RAYS} paths a place to an environment map by the formula of the sky. "
        "radwalk's sky has 2,305 patches. Light is the mean of the places. z is the difference of a place over both standard errors. Its mean square is 1 where both "
        "programs compute the same.", "",
        "| sky | radwalk [lx] | Mitsuba [lx] | difference [%] | mean z² | worst \\|z\\| |", "|---|---|---|---|---|---|", *rows, "",
    ]

def radiance(*words, given=None):
    """What a program of Radiance writes."""
    home = pathlib.Path(pyradiance.__file__).parent
    known = os.environ | {"PATH": f"{home / 'bin'}:{os.environ['PATH']}", "RAYPATH": str(home / "lib")}
    return subprocess.run([str(word) for word in words], input=given, capture_output=True, env=known, check=True).stdout


def numbers(bytes_of_file):
    """The first channel of a matrix of 32-bit numbers."""
    head, body = bytes_of_file.split(b"\n\n", 1)
    known = dict(line.split(b"=", 1) for line in head.splitlines() if b"=" in line)
    shape = int(known[b"NROWS"]), int(known[b"NCOLS"]), 3
    return np.frombuffer(body, np.float32, shape[0] * shape[1] * 3).reshape(shape)[..., 0].astype(float)


def processor_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def matrix(radwalk, folder, weather, patches, *words):
    """The skies of a year, the ground first, in columns [cd/m² over 179]."""
    out = folder / "sky.mtx"
    subprocess.run([radwalk, "sky", "--weather", weather, "--sky-patches", str(patches), "--binary", "--force", "--quiet", "--out", out, *words], check=True)
    return numbers(out.read_bytes())


def beside_gendaymtx(radwalk, version, weather):
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for patches, m in ((145, 1), (577, 2), (2305, 4)):
            for word, ours, theirs in (("sky", ["--no-sun"], ["-s"]), ("sky and sun", [], [])):
                a = matrix(radwalk, folder, weather, patches, *ours)
                b = numbers(radiance("gendaymtx", "-m", m, "-of", "-c", 1, 1, 1, "-g", 0.2, 0.2, 0.2, *theirs, weather))
                assert a.shape == b.shape == (patches + 1, a.shape[1])
                apart = np.abs(a - b)
                hours = b[1:].sum(axis=0) > 0
                rows.append(
                    f"| {patches} | {word} | {100 * (a[1:].sum() / b[1:].sum() - 1):+.2f} | {100 * apart[1:].sum() / b[1:].sum():.2f} "
                    f"| {100 * np.median(apart[1:, hours].sum(axis=0) / b[1:, hours].sum(axis=0)):.2f} | {(hours != (a[1:].sum(axis=0) > 0)).sum()} |"
                )
                print(rows[-1], flush=True)
    return [
        MATRICES, "",
        f"Made by `scripts/daylight.py RADWALK WEATHER`: {version}, Radiance {radiance_version()}, `{weather.name}`, {a.shape[1]} hours. `gendaymtx -c 1 1 1 -g .2 .2 .2` and "
        "`radwalk sky --weather` write the same matrix. Sum: of all patches and hours, radwalk's over Radiance's. Apart: Σ|difference| over the sum, of the year and of the "
        "median hour. Both have Perez's sky, and each its own position of the sun. Hours: those that one program calls dark and the other does not.", "",
        "| patches | what | sum [%] | apart, year [%] | apart, median hour [%] | hours |", "|---|---|---|---|---|---|", *rows, "",
    ]


def radiance_version():
    return radiance("rcontrib", "-version").decode().split()[1]


def radiance_room(folder, text):
    """The surfaces of the scene file, and the sky as a receiver."""
    scene = tomllib.loads(text)
    lines = []
    for name, material in scene["material"].items():
        grey = " ".join([str(material["reflectance"])] * 3)
        lines.append(f"void plastic {name} 0 0 5 {grey} 0 0")
    for surface in scene["surface"]:
        a, b, d = (np.array(point, float) for point in surface["quad"])
        corners = " ".join(str(x) for point in (a, b, b + d - a, d) for x in point)
        lines.append(f"{surface['material']} polygon {surface['name']} 0 0 12 {corners}")
    (folder / "room.rad").write_text("\n".join(lines) + "\n")


def by_rfluxmtx(folder, m, points, words):
    """Coefficients of points."""
    sky = [f"#@rfluxmtx h={kind} u=+Y\nvoid glow {name} 0 0 4 1 1 1 0\n{name} source {name}_source 0 0 4 0 0 {z} 180" for kind, name, z in (("u", "ground", -1), (f"r{m}", "sky", 1))]
    (folder / "sky.rad").write_text("\n".join(sky) + "\n")
    given = "".join(" ".join(str(x) for x in (*point, 0, 0, 1)) + "\n" for point in points).encode()
    words = ["-I+", "-y", len(points), *words, "-faf", "-", folder / "sky.rad", folder / "room.rad"]
    return numbers(radiance("rfluxmtx", *words, given=given))


def with_points(folder, text, points):
    """The scene of the file, with points in place of its sensor."""
    start = text.index("[[sensor]]")
    (folder / "desk.pts").write_text("".join(" ".join(str(x) for x in (*point, 0, 0, 1)) + "\n" for point in points))
    (folder / "scene.toml").write_text(text[:start] + '[[points]]\nfile = "desk.pts"\n')


def coefficients(radwalk, folder, weather, patches, points, walks):
    """Those of points by this number of walks each, and what `daylight.json` says."""
    words = ["--weather", weather, "--sky-patches", str(patches), "--tolerance", "1e-9", "--paths", str(walks * len(points))]
    subprocess.run([radwalk, "daylight", folder / "scene.toml", *words, "--export", "npz", "--force", "--out", folder / "out", "--quiet"], check=False, stderr=subprocess.DEVNULL)
    said = json.loads((folder / "out" / "daylight.json").read_text())
    assert said["walks"] == walks * len(points), said
    with np.load(folder / "out" / "daylight.npz") as arrays:
        return arrays["coefficients"], said


def grid(text, columns, rows):
    corner, corner_u, corner_v = (np.array(point, float) for point in tomllib.loads(text)["sensor"][0]["quad"])
    u, v = (corner_u - corner) / columns, (corner_v - corner) / rows
    return [corner + (i + 0.5) * u + (j + 0.5) * v for i in range(columns) for j in range(rows)]


REPEATS, WALKS = 32, 1 << 20
FINE = ["-ab", "40", "-lr", "-40", "-ad", "2048", "-lw", "1e-5"]


def beside_radiance(radwalk, version):
    text, rows = SCENE.read_text(), []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        points = grid(text, 10, 10)
        radiance_room(folder, text)
        with_points(folder, text, points)
        ours, _ = coefficients(radwalk, folder, WEATHER, 2305, points, WALKS)
        theirs = by_rfluxmtx(folder, 4, points * REPEATS, FINE).reshape(REPEATS, len(points), -1)
        year = 179 * matrix(radwalk, folder, WEATHER, 2305, "--no-sun")
        lit = np.flatnonzero(year.sum(axis=0) > 0)
        skies = [(f"CIE {number + 1}", vector(radwalk, folder, number)) for number in range(len(SKIES))]
        skies += [(f"hour {hour + 1}", year[:, hour]) for hour in lit[:: len(lit) // 5][:5]]
        parts = ours / np.pi
        for name, sky in skies:
            scores = np.pi * sky
            light = parts @ scores
            error = np.sqrt((parts @ scores**2 - light**2) / WALKS)
            each = theirs @ sky
            other, other_error = each.mean(axis=0), each.std(axis=0, ddof=1) / np.sqrt(REPEATS)
            rows.append(compared(name, (light, error), (other, other_error)))
            print(rows[-1], flush=True)
    return [
        RADIANCE, "",
        f"Made by `scripts/daylight.py RADWALK WEATHER`: {version}, Radiance {radiance_version()}. The room of `{SCENE}` at 100 points under 20 skies: the 15 of the CIE as above, and "
        f"five hours of `{WEATHER}`, all in 2,305 patches. radwalk walks {WALKS} times from each point. Radiance: `rfluxmtx -I+ {' '.join(FINE)}`, {REPEATS} times, "
        "whose scatter is its standard error. It cuts reflections after 40, and ends rays below the limit weight by Russian roulette.", "",
        "| sky | radwalk [lx] | Radiance [lx] | difference [%] | mean z² | worst \\|z\\| |", "|---|---|---|---|---|---|", *rows, "",
    ]


def beside_cost(radwalk, version, weather):
    text, rows = SCENE.read_text(), []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        points = grid(text, 10, 20)
        radiance_room(folder, text)
        with_points(folder, text, points)
        year = 179 * matrix(radwalk, folder, weather, 145)
        year = year[:, year.sum(axis=0) > 0]
        truth = coefficients(radwalk, folder, weather, 145, points, 1 << 19)[0] @ year
        error = lambda found: np.median(np.abs(found @ year / truth - 1))
        for walks in (1 << 12, 1 << 13, 1 << 14):
            began = processor_seconds()
            found, said = coefficients(radwalk, folder, weather, 145, points, walks)
            whole = processor_seconds() - began
            rows.append(["radwalk", f"{walks} walks", error(found), said["cpu_seconds"], whole])
        for rays in (64, 256, 1024):
            began = processor_seconds()
            found = by_rfluxmtx(folder, 1, points, ["-ab", 20, "-ad", rays, "-lw", 0.1 / rays])
            rows.append(["Radiance", f"-ad {rays}", error(found), processor_seconds() - began, None])
    body = [f"| {program} | {what} | {100 * part:.2f} | {walking:.2f} | {'' if whole is None else f'{whole:.1f}'} | {walking * (part / 0.05) ** 2:.2f} |" for program, what, part, walking, whole in rows]
    return [
        COST, "",
        f"Made by `scripts/daylight.py RADWALK WEATHER`: {version}, Radiance {radiance_version()}, `{weather.name}`. Coefficients of 145 patches at 200 points of the room, and what they "
        f"say of {year.shape[1]} hours with light, sun among the patches. Error: the median over points and hours of the difference from {1 << 19} walks a point. Radiance: `rfluxmtx -I+ -ab 20`, "
        "limit weight a tenth of a ray's. Processor time of the coefficients, of the whole command (radwalk's: figures with intervals and all files), and of the coefficients "
        "at an error of 5 %, since time goes as the inverse square of the error. radwalk takes 4,096 walks at least.", "",
        "| program | a point | median error [%] | coefficients [s] | whole command [s] | at 5 % [s] |", "|---|---|---|---|---|---|", *body, "",
    ]


def put(section):
    """Puts a section into the page, in place of an older one."""
    parts = re.split(r"(?m)^(?=## )", PAGE.read_text())
    kept = [part.rstrip() + "\n" for part in parts if not part.startswith(section[0] + "\n")]
    order = lambda part: next((1 + i for i, heading in enumerate(HEADINGS) if part.startswith(heading + "\n")), 0)
    PAGE.write_text("\n".join(sorted([*kept, "\n".join(section).rstrip() + "\n"], key=order)))


def main(radwalk, weather):
    version = subprocess.run([radwalk, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    if mi is None:
        print("daylight.py: mitsuba is not installed, the part about Mitsuba is left out", file=sys.stderr)
    else:
        put(beside_mitsuba(radwalk, version))
    if pyradiance is None:
        print("daylight.py: pyradiance is not installed, the parts about Radiance are left out", file=sys.stderr)
        return
    put(beside_gendaymtx(radwalk, version, weather))
    put(beside_radiance(radwalk, version))
    put(beside_cost(radwalk, version, weather))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else WEATHER))
