"""View factors as sparse matrices."""

from __future__ import annotations

import os
import tempfile
import warnings
from types import SimpleNamespace

import numpy as np

from . import _radwalk
from .running import Doubt, counted, source
from .scene import Scene


def factors(
    mesh,
    *,
    rays=10_000,
    sides=1,
    sky=None,
    periodic=None,
    reflections=False,
    reflectance=0.0,
    drop=0.0,
    tolerance=None,
    groups=None,
    channel=None,
    intervals=False,
    smooth=False,
    threads=None,
    progress=None,
    **keys,
):
    """Counts view factors and returns a ``scipy.sparse.csr_array``: a row for each face, of which each sends ``rays`` walks.

    :param mesh: a ``trimesh`` or ``meshio`` mesh, a pair ``(vertices, faces)``, a :class:`Scene`, or the path of a mesh, a scene or a job.
    :param sides: of meshes and pairs: 1 where only fronts count (counter-clockwise), 2 where both sides of a face have a row each.
    :param sky: 145, 577 or 2305: what leaves upwards is told apart by so many patches of the sky (+z is up, +y is north).
    :param periodic: the steps ``(x, y)`` [m] at which the mesh repeats without end, 0 where it does not.
    :param reflections: count where walks are absorbed after reflections (Gebhart's factors); ``reflectance`` is that of meshes and pairs,
        a number or one for each face.
    :param drop: factors below this are left out; a last column holds their sum.
    :param tolerance: each row ends where it is known so well; ``rays`` is then the most.
    :param groups: rows of groups of faces: ``"by-surface"``, ``"by-material"``, or a file of ``[[group]]`` tables.
    :param intervals: return three matrices: the factors, and the lower and the upper ends of their 95 % intervals.
    :param smooth: return the factors nearest to the counts that are reciprocal and whose rows add up to 1; not with ``drop`` or ``intervals``.
    :param threads: how many threads walk; default: one for each core. The answer is the same with any number.
    :param progress: as of :func:`run`.
    :param keys: keys of the job, as of :func:`run`.

    Behind the n columns of the faces stand what ends on backs, what escapes, the patches of the sky, and what was dropped, where these are
    asked for. Each row adds up to 1. ``scipy`` must be installed.
    """
    from scipy.sparse import csr_array

    if smooth and (drop or intervals):
        raise ValueError("smooth factors have no intervals of their own, and none is dropped: leave out smooth, or drop and intervals")
    wanted = SimpleNamespace(
        rays=int(rays),
        drop=float(drop),
        sky=None if sky is None else int(sky),
        reflections=bool(reflections),
        channel=channel,
        groups=None if groups is None else os.fspath(groups),
        tolerance=tolerance,
        smooth=bool(smooth),
        periods=None if periodic is None else [float(step) for step in periodic],
    )
    with tempfile.TemporaryDirectory(prefix="radwalk-") as folder:
        job = source(as_scene(mesh, sides, reflectance))
        doubts = counted(_radwalk.factors, job, keys, folder, wanted, threads=threads, progress=progress)
        adjusted = os.path.join(folder, "smoothed.npz")
        # Without it, a warning has said that no such factors were found.
        path = adjusted if os.path.exists(adjusted) else os.path.join(folder, "factors.npz")
        with np.load(path) as arrays:
            names = ("data", "ci_low", "ci_high") if intervals else ("data",)
            indices, indptr, shape = arrays["indices"], arrays["indptr"], tuple(arrays["shape"])
            found = [csr_array((arrays[name], indices, indptr), shape=shape) for name in names]
    for doubt in doubts:
        warnings.warn(doubt, Doubt, stacklevel=2)
    return tuple(found) if intervals else found[0]


def as_scene(mesh, sides, reflectance):
    """What :func:`source` takes, made of arrays where the mesh is one in memory."""
    if isinstance(mesh, Scene):
        return mesh
    if hasattr(mesh, "cells_dict"):
        return Scene(mesh.points, triangles(mesh), reflectance, sides=sides)
    if hasattr(mesh, "vertices") or hasattr(mesh, "geometry"):
        return Scene.from_trimesh(mesh, reflectance, sides=sides)
    if isinstance(mesh, tuple):
        return Scene(*mesh, reflectance, sides=sides)
    return mesh


def triangles(mesh):
    """The triangles of a meshio mesh; each of its quads is two."""
    cells = mesh.cells_dict
    quads = cells.get("quad", np.empty((0, 4), dtype=int))
    halves = np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    return np.concatenate([cells.get("triangle", np.empty((0, 3), dtype=int)), halves])
