"""The patches of a scene file of radwalk, as arrays."""

import tomllib

import numpy as np


def read(path):
    """Corner, two edges, whether it is a triangle, reflectance and emittance of every patch, in radwalk's order; sides of each."""
    with open(path, "rb") as file:
        scene = tomllib.load(file)
    rows = [row for surface in scene["surface"] for row in cells(surface, scene["material"])]
    corner, edges, triangle, reflectance, emittance, sides = zip(*rows)
    arrays = np.array(corner), np.array(edges), np.array(triangle), np.array(reflectance), np.array(emittance)
    return *arrays, np.array(sides)


def cells(surface, materials):
    """The cells of a surface, row by row."""
    material = materials[surface["material"]]
    reflectance, emittance = channels(material["reflectance"]), channels(material.get("emittance", 0.0))
    emit = {tuple(entry["cell"]): channels(entry["emittance"]) for entry in surface.get("emit", [])}
    sides = surface.get("sides", 1)
    if "quad" in surface:
        a, b, c = np.array(surface["quad"], dtype=float)
        count = surface.get("patches", [1, 1])
        u, v = (b - a) / count[0], (c - a) / count[1]
        for j in range(count[1]):
            for i in range(count[0]):
                yield a + i * u + j * v, (u, v), False, reflectance, emit.get((i, j), emittance), sides
        return
    a, b, c = np.array(surface["triangle"], dtype=float)
    count = surface.get("patches", 1)
    u, v = (b - a) / count, (c - a) / count
    for row in range(count):
        for position in range(2 * row + 1):
            j, inverted = divmod(position, 2)
            i = row - j
            at, (along, across) = (a + i * u + (j + 1) * v, (-u, -v)) if inverted else (a + i * u + j * v, (u, v))
            yield at, (along, across), True, reflectance, emittance, sides


def channels(value):
    """Three channels of a number or a list."""
    return np.broadcast_to(np.array(value, dtype=float), 3)
