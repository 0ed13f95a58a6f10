"""The picture of a run of radwalk by Mitsuba 3: the same surfaces, materials and camera."""

import resource
import xml.etree.ElementTree as xml
from base64 import b64decode

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

QUAD = 9
SIDES_APART = 1e-5
TYPES = {"Float64": np.float64, "Int64": np.int64}


class PathTracer:
    """A scene ready to be drawn: the middle of a camera's picture, of so many pixels."""

    def __init__(self, grid, camera, window, folder):
        arrays = read_grid(grid)
        shapes, least, most = shapes_of(arrays, folder)
        self.scene = mi.load_dict({"type": "scene", "sensor": sensor(camera, window, least, most), **shapes})
        self.draw(1, 0)

    def draw(self, samples, seed, depth=-1):
        """Radiance of each pixel by paths of at most so many surfaces, and the processor time that they took [s]."""
        integrator = mi.load_dict({"type": "path", "max_depth": depth})
        before = processor_seconds()
        image = mi.render(self.scene, integrator=integrator, spp=samples, seed=seed).numpy()[:, :, :3]
        return image, processor_seconds() - before

    def guides(self, samples=4):
        """Reflectance and normals of what is in sight, for a denoiser."""
        integrator = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"})
        image = mi.render(self.scene, integrator=integrator, spp=samples).numpy()
        return np.ascontiguousarray(image[:, :, -6:-3]), np.ascontiguousarray(image[:, :, -3:])


def processor_seconds():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def read_grid(path):
    """The arrays of an unstructured grid as radwalk writes it."""
    arrays = {}
    for array in xml.parse(path).getroot().iter("DataArray"):
        values = np.frombuffer(b64decode(array.text), TYPES[array.get("type")], offset=8)
        arrays[array.get("Name")] = values
    return arrays


def shapes_of(arrays, folder):
    """A mesh for each kind of surface, and the corners of the box around all."""
    points = arrays["Points"].reshape(-1, 3)
    ends = arrays["offsets"]
    corners = [arrays["connectivity"][np.maximum(ends - k, 0)] for k in (1, 2, 3, 4)]
    is_quad = arrays["types"] == QUAD
    first = np.where(is_quad, corners[3], corners[2])
    is_back = arrays.get("side", np.zeros_like(ends)) == 1
    has_back = np.isin(arrays["patch"], arrays["patch"][is_back])
    colours = np.concatenate([channels(arrays, "reflectance"), channels(arrays, "emittance")], axis=1)
    size = np.abs(points).max()
    is_drawn = ~is_back | colours[:, 3:].any(axis=1)
    kinds, kind_of = np.unique(np.hstack([colours, is_back[:, None], has_back[:, None]]), axis=0, return_inverse=True)
    shapes = {}
    for number, kind in enumerate(kinds):
        cells = np.flatnonzero((kind_of.ravel() == number) & is_drawn)
        if len(cells) == 0:
            continue
        quads = cells[is_quad[cells]]
        before = np.where(is_quad, corners[2], corners[1])
        triangles = np.stack([first[cells], before[cells], np.where(is_quad, corners[1], corners[0])[cells]], axis=1)
        triangles = np.concatenate([triangles, np.stack([first[quads], corners[1][quads], corners[0][quads]], axis=1)])
        places = points[triangles]
        if kind[6]:
            normals = np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0])
            places = places + SIDES_APART * size * (normals / np.linalg.norm(normals, axis=1)[:, None])[:, None]
        shapes[f"kind{number}"] = mesh(places.reshape(-1, 3), kind, str(folder / f"kind{number}.ply"))
    return shapes, points.min(axis=0), points.max(axis=0)


def channels(arrays, name):
    """Three channels of a column."""
    return np.stack([arrays[name if name in arrays else f"{name}_{c}"] for c in "rgb"], axis=1)


def mesh(places, kind, path):
    shape = mi.Mesh("mesh", len(places), len(places) // 3)
    parameters = mi.traverse(shape)
    parameters["vertex_positions"] = places.astype(np.float32).ravel()
    parameters["faces"] = np.arange(len(places), dtype=np.uint32)
    parameters.update()
    shape.write_ply(path)
    surface = {"type": "diffuse", "reflectance": spectrum(kind[:3])}
    if kind[7]:
        surface = {"type": "twosided", "bsdf": surface}
    told = {"type": "ply", "filename": path, "face_normals": True, "bsdf": surface}
    if kind[3:6].any():
        told["emitter"] = {"type": "area", "radiance": spectrum(kind[3:6] / np.pi)}
    return told


def spectrum(values):
    return {"type": "rgb", "value": [float(value) for value in values]}


def sensor(camera, window, least, most):
    """The camera of a summary. From outside it looks through the nearest wall, as radwalk does through backs of one-sided surfaces."""
    eye, target = np.array(camera["eye"]), np.array(camera["look_at"])
    ahead = (target - eye) / np.linalg.norm(target - eye)
    box = np.array([[x, y, z] for x in (least[0], most[0]) for y in (least[1], most[1]) for z in (least[2], most[2])])
    depth = ((box - eye) @ ahead).min()
    size = np.linalg.norm(most - least)
    return {
        "type": "perspective",
        "to_world": mi.ScalarTransform4f().look_at(origin=camera["eye"], target=camera["look_at"], up=camera["up"]),
        "fov": camera["fov"],
        "fov_axis": "y",
        "near_clip": float(max(depth, 0.0) + 1e-4 * size),
        "far_clip": float(100.0 * size),
        "film": {
            "type": "hdrfilm",
            "width": camera["size"][0],
            "height": camera["size"][1],
            "crop_width": window[0],
            "crop_height": window[1],
            "crop_offset_x": (camera["size"][0] - window[0]) // 2,
            "crop_offset_y": (camera["size"][1] - window[1]) // 2,
            "pixel_format": "rgb",
            "rfilter": {"type": "box"},
        },
    }
