#!/usr/bin/env python3
"""Daylight beside Mitsuba: appends to docs/results/daylight.md what radwalk and Mitsuba's path tracer say of a side-lit room under the 15 skies of the CIE.

Usage: scripts/daylight.py RADWALK, in the folder of the sources, with mitsuba and numpy of PyPI. Mitsuba's LLVM variants need a libLLVM on the machine. The skies
of Mitsuba are environment maps by the formula of ISO 15469, written here a second time; those of radwalk are in 2,305 patches.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import tomllib

import mitsuba as mi
import numpy as np

PAGE = pathlib.Path("docs/results/daylight.md")
SCENE = pathlib.Path("configs/scenes/daylit.toml")
HEADING = "## Beside Mitsuba"
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


def main(radwalk):
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
            z = (ours - theirs) / np.hypot(error, their_error)
            change = ours.sum() / theirs.sum() - 1
            of_sum = np.hypot(np.hypot.reduce(error), np.hypot.reduce(their_error)) / theirs.sum()
            rows.append(
                f"| {number + 1} | {ours.mean():.1f} | {theirs.mean():.1f} | {100 * change:+.2f} ± {100 * of_sum:.2f} "
                f"| {np.mean(z**2):.2f} | {np.abs(z).max():.1f} |"
            )
            print(rows[-1], flush=True)
    version = subprocess.run([radwalk, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    section = [
        HEADING, "",
        f"Made by `scripts/daylight.py RADWALK`: {version}, Mitsuba {mi.__version__}. The room of `{SCENE}` at 100 places under the 15 skies of the CIE, the sun "
        f"at {ALTITUDE:.0f}° in the south and left out, {HORIZONTAL:.0f} lx on the ground. Mitsuba traces {RAYS} paths a place to an environment map by the formula of the sky; "
        "radwalk's sky has 2,305 patches. Light is the mean of the places; z is the difference of a place over both standard errors, whose mean square is 1 where both "
        "programs compute the same.", "",
        "| sky | radwalk [lx] | Mitsuba [lx] | difference [%] | mean z² | worst \\|z\\| |", "|---|---|---|---|---|---|", *rows, "",
    ]
    page = PAGE.read_text().split(HEADING)[0].rstrip() + "\n\n" + "\n".join(section)
    PAGE.write_text(page)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve())
