#!/usr/bin/env python3
"""Compares the reflectances that radwalk reads of meshes with those that Mitsuba 3 has of the same files, and writes docs/results/means.md.

    scripts/means.py FOLDER FILE… [--radwalk PROGRAM] [--out PAGE]

The files, in the folder of scripts/meshes.py, are OBJ, GLB, glTF without compression, and scenes of Mitsuba. Needs `pip install mitsuba trimesh
pillow`. Mitsuba draws points of each material evenly over the area of its faces and tells the diffuse reflectance there, of its own
look-up of the image, transparent ones aside; trimesh reads faces and materials of OBJ and glTF, Mitsuba its own scenes. A material counts by its area.
"""
import argparse
import json
import re
import subprocess
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np
import trimesh

mi.set_variant("scalar_rgb")
POINTS = 20_000
HERE = Path(__file__).resolve().parent


def told(program, file):
    """The reflectances and areas of the materials by name, as radwalk tells them without its limit."""
    command = [program, "check", str(file), "--json", "--set", "import.reflectance_limit=0.999999", "--set", "import.faults=report"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    rows = {}
    for row in json.loads(done.stdout)["materials"]:
        if row["name"] in ("sky", "assumed lamp"):
            continue
        area, colour = rows.get(row["name"], (0.0, np.zeros(3)))
        rows[row["name"]] = (area + row["area"], colour + row["area"] * np.array(row["reflectance"]))
    return {name: (area, colour / area) for name, (area, colour) in rows.items()}


def mean_of(shape, bsdf):
    """The mean diffuse reflectance over the area of a shape, by points drawn evenly."""
    rng = np.random.default_rng(7)
    total = np.zeros(3)
    for u, v in rng.random((POINTS, 2)):
        place = shape.sample_position(0.0, mi.Point2f(u, v))
        hit = mi.SurfaceInteraction3f()
        hit.p, hit.uv, hit.n = place.p, place.uv, place.n
        hit.wi = mi.Vector3f(0, 0, 1)
        hit.sh_frame = mi.Frame3f(place.n)
        total += np.array(bsdf.eval_diffuse_reflectance(hit, True)).reshape(3)
    return total / POINTS


def mesh_of(triangles, places):
    """A mesh of Mitsuba, with three vertices for each triangle."""
    count = len(triangles)
    mesh = mi.Mesh("part", 3 * count, count, has_vertex_texcoords=True)
    params = mi.traverse(mesh)
    params["vertex_positions"] = np.ascontiguousarray(triangles, dtype=np.float32).ravel()
    params["vertex_texcoords"] = np.ascontiguousarray(places, dtype=np.float32).ravel()
    params["faces"] = np.arange(3 * count, dtype=np.uint32)
    params.update()
    return mesh


def by_trimesh(file):
    """Areas and means by the names of materials of an OBJ or glTF file."""
    loaded = trimesh.load(file, force="scene", process=False, split_object=False)
    rows = {}
    for node in loaded.graph.nodes_geometry:
        matrix, name = loaded.graph[node]
        part = loaded.geometry[name]
        if not isinstance(part, trimesh.Trimesh) or not len(part.faces):
            continue
        material = getattr(part.visual, "material", None)
        if getattr(material, "alphaMode", None) in ("BLEND", "MASK"):
            continue
        points = trimesh.transform_points(part.vertices, matrix)
        triangles = points[part.faces]
        areas = 0.5 * np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
        uv = getattr(part.visual, "uv", None)
        places = (uv if uv is not None else np.zeros((len(points), 2)))[part.faces]
        colour, image = properties(material)
        if image is not None:
            # trimesh counts v from the last row of an image upwards, a bitmap of Mitsuba from the first downwards.
            bitmap = mi.Bitmap(np.array(image.convert("RGB")))
            texture = {"type": "bitmap", "bitmap": bitmap, "raw": False, "filter_type": "nearest"}
            bsdf = mi.load_dict({"type": "diffuse", "reflectance": texture})
            keep = areas > 0
            places = np.stack([places[..., 0], 1.0 - places[..., 1]], axis=-1)
            colour = colour * mean_of(mesh_of(triangles[keep], places[keep]), bsdf)
        key = getattr(material, "name", None) or "default"
        area, sums = rows.get(key, (0.0, np.zeros(3)))
        rows[key] = (area + areas.sum(), sums + areas.sum() * colour)
    return {name: (area, sums / area) for name, (area, sums) in rows.items() if area > 0}


def properties(material):
    """Diffuse colour and image of a material of trimesh, as linear numbers."""
    if isinstance(material, trimesh.visual.material.PBRMaterial):
        factor = material.baseColorFactor
        factor = np.ones(3) if factor is None else np.array(factor[:3]) / (255.0 if np.array(factor).dtype.kind == "u" else 1.0)
        metal = material.metallicFactor if material.metallicFactor is not None and material.metallicRoughnessTexture is None else 0.0
        return factor * (1.0 - metal), material.baseColorTexture
    colour = np.array(material.kwargs["kd"][:3], dtype=float) if "kd" in getattr(material, "kwargs", {}) else np.full(3, 0.5)
    image = getattr(material, "image", None)
    if image is not None and not colour.any():
        colour = np.ones(3)
    return colour, image


def by_mitsuba(file):
    """Areas and means by the ids of materials of a scene of Mitsuba."""
    rows = {}
    # Cameras and integrators of older versions are not all known to Mitsuba 3.
    text = re.sub(r"<(integrator|sensor)\b.*?</\1>", "", file.read_text(), flags=re.DOTALL)
    mi.file_resolver().prepend(str(file.parent))
    for shape in mi.load_string(text).shapes():
        bsdf, area = shape.bsdf(), float(shape.surface_area())
        key = bsdf.id()
        total, sums = rows.get(key, (0.0, np.zeros(3)))
        rows[key] = (total + area, sums + area * mean_of(shape, bsdf))
    return {name: (area, sums / area) for name, (area, sums) in rows.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("files", nargs="+")
    parser.add_argument("--radwalk", default=str(HERE.parent / "target/release/radwalk"))
    parser.add_argument("--out", type=Path, default=HERE.parent / "docs/results/means.md")
    args = parser.parse_args()
    lines = []
    for name in args.files:
        file = args.folder / name
        ours = told(args.radwalk, file)
        theirs = by_mitsuba(file) if file.suffix == ".xml" else by_trimesh(file)
        common = [key for key in ours if key in theirs]
        known = sum(ours[key][0] for key in common)
        off = {key: np.abs(ours[key][1] - theirs[key][1]).max() for key in common}
        if not common:
            print("no common material:", name, list(ours)[:5], list(theirs)[:5], file=sys.stderr)
            continue
        worst = max(off, key=off.get)
        mean = sum(ours[key][0] * off[key] for key in common) / known
        part = 100 * known / sum(area for area, _ in ours.values())
        show = lambda colour: " ".join(f"{channel:.3f}" for channel in colour)
        lines.append(f"| {name} | {len(common)} of {len(ours)} | {part:.0f} % | {mean:.4f} | {off[worst]:.4f} | {worst}: {show(ours[worst][1])}, {show(theirs[worst][1])} |")
        print(lines[-1], flush=True)
    args.out.write_text(f"""# Reflectances against Mitsuba

Written by `scripts/means.py FOLDER FILE…` with Mitsuba {mi.__version__}, {POINTS:,} points a material. *Off* is the largest difference among the channels of a
material's reflectance, a number in [0, 1]; its mean is by area. The last column has the material that is off most: here, and by Mitsuba.

| file | materials compared | of the area | mean off | most off | worst: radwalk, Mitsuba |
|---|---|---|---|---|---|
""" + "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
