"""Scenes of arrays."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from . import _radwalk


class Scene:
    """A scene of triangles in memory.

    :param vertices: points [m], shape (v, 3).
    :param faces: indices of vertices, shape (n, 3), counter-clockwise as seen from the front.
    :param reflectance: in [0, 1): a number, a triple (red, green, blue), an array of shape (n,) or (n, 3), or, where ``material`` is
        given, a dict from names of materials to numbers or triples.
    :param emittance: radiant exitance [W/m²] of each active side, in the same forms. In a dict, materials may be missing: they do
        not emit.
    :param material: the name of each face's material, n of them.
    :param sides: 1 where only fronts reflect and emit, 2 where both sides do; also as an array of shape (n,), or a dict. Default: 2.
    :param name: names the scene in messages, in the column ``surface`` and in the output folder.

    Keys of ``[import]`` apply as they do to files: ``run(scene, **{"import.patch_size": 0.1})`` cuts faces into patches, and
    ``"import.material"`` changes materials by name.
    """

    def __init__(self, vertices, faces, reflectance=0.5, emittance=0.0, *, material=None, sides=None, name="mesh"):
        self.vertices = rows(vertices, "vertices", "<f8")
        self.faces = rows(faces, "faces", "<i8")
        self.name = str(name)
        n = len(self.faces)
        if material is None:
            of_face, names = np.zeros(n, dtype="<i8"), ["material"]
        else:
            names, of_face = np.unique(np.asarray(material, dtype=str), return_inverse=True)
            if of_face.shape != (n,):
                raise ValueError(f"material has the shape {of_face.shape} (each face has one); give {n} names")
        values = np.column_stack(
            [
                per_face(reflectance, "reflectance", n, names, of_face),
                per_face(emittance, "emittance", n, names, of_face, missing=0.0),
                per_face(0 if sides is None else sides, "sides", n, names, of_face, missing=0)[:, :1],
                of_face,
            ]
        )
        kinds, self._of_face = np.unique(values, axis=0, return_inverse=True)
        self._materials = [described(kind, names, len(kinds) > len(names), i) for i, kind in enumerate(kinds)]
        self._mesh = _radwalk.Mesh(
            self.name,
            self.vertices.tobytes(),
            self.faces.tobytes(),
            self._of_face.reshape(-1).astype("<i8").tobytes(),
            self._materials,
        )

    @classmethod
    def from_trimesh(cls, mesh, reflectance=0.5, emittance=0.0, *, sides=None, name=None):
        """The scene of a ``trimesh.Trimesh``, or of a ``trimesh.Scene``, whose geometries are materials by their names.

        Values have the forms that :class:`Scene` takes. Colours of the mesh are for the eye and are not taken for reflectances.
        """
        if not hasattr(mesh, "geometry"):
            return cls(mesh.vertices, mesh.faces, reflectance, emittance, sides=sides, name=name or "mesh")
        vertices, faces, material, count = [], [], [], 0
        for node in mesh.graph.nodes_geometry:
            transform, geometry = mesh.graph[node]
            part = mesh.geometry[geometry]
            if not hasattr(part, "faces"):
                continue
            transform = np.asarray(transform)
            turned = np.asarray(part.vertices) @ transform[:3, :3].T + transform[:3, 3]
            corners = np.asarray(part.faces)
            # A reflection would turn fronts to backs.
            corners = corners[:, ::-1] if np.linalg.det(transform[:3, :3]) < 0.0 else corners
            vertices.append(turned)
            faces.append(corners + count)
            material += [geometry] * len(corners)
            count += len(turned)
        if not faces:
            raise ValueError("the trimesh scene has no triangles (light needs surfaces to meet); add a mesh")
        name = name or "mesh"
        vertices, faces = np.concatenate(vertices), np.concatenate(faces)
        return cls(vertices, faces, reflectance, emittance, material=material, sides=sides, name=name)

    def __repr__(self):
        return f"<radwalk.Scene {self.name!r}: {len(self.faces):,} triangles, {len(self._materials):,} materials>"


def rows(values, what, dtype):
    """An array of three columns."""
    array = np.asarray(values)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{what} has the shape {array.shape} (rows have three columns); give an array of shape (n, 3)")
    if dtype == "<i8" and not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{what} is of {array.dtype} (vertices are named by index); give integers")
    return np.ascontiguousarray(array, dtype=dtype)


def per_face(values, what, n, names, of_face, missing=None):
    """Values as an array of shape (n, 3)."""
    if isinstance(values, Mapping):
        unknown = [name for name in values if name not in names]
        if unknown:
            known = ", ".join(map(repr, map(str, names)))
            raise ValueError(f"{what} names the material {unknown[0]!r} (no face has it); the materials are {known}")
        lacking = [str(name) for name in names if name not in values]
        if lacking and missing is None:
            raise ValueError(f"{what} lacks the material {lacking[0]!r} (some face has it); add it to the dict")
        of_material = [np.broadcast_to(np.asarray(values.get(name, missing), dtype=float), 3) for name in names]
        return np.stack(of_material)[of_face]
    array = np.asarray(values, dtype=float)
    # A triple is a colour, also in a scene of three faces.
    if array.shape == (n,) and array.shape != (3,):
        array = array[:, None]
    if array.shape not in ((), (3,), (n, 1), (n, 3)):
        shapes = f"a number, a triple, or an array of shape ({n},) or ({n}, 3)"
        raise ValueError(f"{what} has the shape {array.shape} (there are {n} faces); give {shapes}")
    return np.broadcast_to(array, (n, 3))


def described(kind, names, numbered, number):
    """A material as the native half takes it; materials of one name that differ are numbered."""
    sides, name = int(kind[6]), str(names[int(kind[7])])
    name = f"{name} {number}" if numbered else name
    return name, kind[:3].tolist(), kind[3:6].tolist(), sides or None
