"""The radiosity of all patches by Mitsuba 3, in the way that was found to be its best.

All patches are sampled in one wavefront. Each sample begins just in front of a uniform point of a patch and looks at it, so that the
integrator `path` sees the light that leaves there, with emitter sampling and multiple importance sampling from the first
reflection on. An irradiance meter for each patch does the same work in a kernel launch of its own.
"""

import resource
import time

import drjit as dr
import numpy as np

SAMPLES_AT_ONCE = 1 << 22
DEPTHS_OF_ROULETTE = (2, 5)


def run(patches, seconds, folder):
    """Mean and squared standard error of each patch and channel, core-seconds, by the better depth of Russian roulette."""
    import mitsuba as mi

    colour = any(np.ptp(array, axis=1).max() > 0.0 for array in patches[3:5])
    mi.set_variant("llvm_ad_rgb" if colour else "llvm_ad_mono")
    scene = mi.load_dict(geometry(mi, patches, folder))
    best = None
    for depth in DEPTHS_OF_ROULETTE:
        found = estimate(mi, scene, patches, depth, seconds / len(DEPTHS_OF_ROULETTE), 3 if colour else 1)
        if best is None or merit(found) > merit(best):
            best = found
    return best


def merit(found):
    """The figure by which one way of using Mitsuba is preferred."""
    mean, squared_error, core_seconds = found
    seen = mean > 0.0
    return 1.0 / (np.mean(squared_error[seen] / mean[seen] ** 2) * core_seconds)


def geometry(mi, patches, folder):
    """A mesh for each pair of reflectance and emittance."""
    corner, edges, triangle, reflectance, emittance, sides = patches
    kinds, kind_of = np.unique(np.hstack([reflectance, emittance, sides[:, None]]), axis=0, return_inverse=True)
    scene = {"type": "scene"}
    for number, kind in enumerate(kinds):
        of_kind = kind_of.ravel() == number
        scene[f"kind{number}"] = mesh(mi, corner[of_kind], edges[of_kind], triangle[of_kind], kind, folder, f"kind{number}")
    return scene


def mesh(mi, corner, edges, triangle, kind, folder, name):
    """The patches of one kind."""
    u, v = edges[:, 0], edges[:, 1]
    vertices = np.stack([corner, corner + u, corner + v, corner + u + v], axis=1).reshape(-1, 3)
    first = 4 * np.arange(len(corner))
    faces = np.stack([first, first + 1, first + 2], axis=1)
    quads = first[~triangle]
    faces = np.concatenate([faces, np.stack([quads + 1, quads + 3, quads + 2], axis=1)])
    shape = mi.Mesh(name, len(vertices), len(faces))
    parameters = mi.traverse(shape)
    parameters["vertex_positions"] = vertices.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    shape.write_ply(str(folder / f"{name}.ply"))
    diffuse = {"type": "diffuse", "reflectance": spectrum(kind[:3])}
    bsdf = {"type": "twosided", "bsdf": diffuse} if kind[6] == 2 else diffuse
    told = {"type": "ply", "filename": str(folder / f"{name}.ply"), "face_normals": True, "bsdf": bsdf}
    if kind[3:6].any():
        told["emitter"] = {"type": "area", "radiance": spectrum(kind[3:6] / np.pi)}
    return told


def spectrum(values):
    """A colour, or a number where all channels are alike."""
    return {"type": "rgb", "value": [float(value) for value in values]}


def estimate(mi, scene, patches, depth, seconds, channels):
    """Passes over all patches until the time is over, after one that compiles the kernel."""
    corner, edges, triangle, _, _, _ = patches
    count = len(corner)
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    size = np.abs(corner).max()
    table = [mi.Point3f(np.ascontiguousarray(array.T, dtype=np.float32)) for array in (corner, edges[:, 0], edges[:, 1], normal)]
    is_triangle = mi.Bool(np.ascontiguousarray(triangle))
    integrator = mi.load_dict({"type": "path", "max_depth": -1, "rr_depth": depth})
    samples = max(1, SAMPLES_AT_ONCE // count)
    sums = np.zeros((2, channels, count))

    def one_pass(seed):
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed, count * samples)
        patch = dr.arange(mi.UInt32, count * samples) // samples
        origin, u, v, facing = (dr.gather(mi.Point3f, array, patch) for array in table)
        x, y = sampler.next_1d(), sampler.next_1d()
        fold = dr.gather(mi.Bool, is_triangle, patch) & (x + y > 1.0)
        x, y = dr.select(fold, 1.0 - x, x), dr.select(fold, 1.0 - y, y)
        ray = mi.Ray3f(origin + x * u + y * v + 1e-4 * size * facing, -facing)
        light, _, _ = integrator.sample(scene, sampler, ray)
        for channel in range(channels):
            radiosity = np.pi * light[channel].numpy().astype(float).reshape(count, samples)
            sums[0, channel] += radiosity.sum(axis=1)
            sums[1, channel] += (radiosity**2).sum(axis=1)

    one_pass(0)
    sums[:] = 0.0
    passes, began, cpu = 0, time.time(), core_seconds()
    while passes < 2 or time.time() - began < seconds:
        passes += 1
        one_pass(passes)
    n = passes * samples
    mean = sums[0] / n
    return mean, (sums[1] / n - mean**2) / (n - 1), core_seconds() - cpu


def core_seconds():
    """Processor time of this process."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime
