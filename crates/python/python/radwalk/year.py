"""Daylight of a year, in arrays."""

from __future__ import annotations

import os
import tempfile
import warnings
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from . import _radwalk
from .running import Doubt, counted, source

#: The arrays that are no figures.
_ARRAYS = ("sensor", "cell", "middle", "walks", "coefficients", "coefficients_error", "time", "light", "light_error")


@dataclass(frozen=True, eq=False)
class Daylight:
    """The daylight of the places of a scene, each a row of every array, in the order of ``annual.csv``.

    ``coefficients`` [sr] has a column for the ground and one for each patch of the sky, ``light`` [lx] one for each hour; ``_error`` are standard
    errors. ``time`` has a row for each hour: month, day, and the hour that ends. ``figures`` has, under each name of ``annual.csv``, the estimate and
    the ends of its interval in three columns.
    """

    sensor: np.ndarray
    cell: np.ndarray
    middle: np.ndarray
    walks: np.ndarray
    coefficients: np.ndarray
    coefficients_error: np.ndarray
    time: np.ndarray
    light: np.ndarray
    light_error: np.ndarray
    figures: dict[str, np.ndarray]
    #: Whether every place met the tolerance before the budget was spent.
    reached: bool


def daylight(
    job_or_scene,
    weather,
    *,
    sky_patches=145,
    ground=0.2,
    channel=None,
    tolerance=0.05,
    enough=300.0,
    threads=None,
    progress=None,
    **keys,
):
    """Counts the daylight coefficients of a scene's sensors and returns a :class:`Daylight`.

    :param job_or_scene: as of :func:`run`; the places are its sensors, planes and points.
    :param weather: the path of an EPW file.
    :param sky_patches: 145, 577 or 2305.
    :param ground: the reflectance of the ground below the horizon.
    :param channel: of a scene in colour: the channel whose reflectances hold.
    :param tolerance: a place ends its walks where the half-width of its yearly mean is this part of the mean.
    :param enough: the illuminance that autonomy asks for [lx].
    :param threads: how many threads walk; default: one for each core. The answer is the same with any number.
    :param progress: as of :func:`run`.
    :param keys: keys of the job, as of :func:`run`.
    """
    wanted = SimpleNamespace(
        weather=os.fspath(weather),
        sky_patches=int(sky_patches),
        ground=float(ground),
        channel=channel,
        tolerance=float(tolerance),
        enough=float(enough),
    )
    with tempfile.TemporaryDirectory(prefix="radwalk-") as folder:
        job = source(job_or_scene)
        reached, doubts = counted(_radwalk.daylight, job, keys, folder, wanted, threads=threads, progress=progress)
        with np.load(os.path.join(folder, "daylight.npz")) as found:
            arrays = {name: found[name] for name in found.files}
    for doubt in doubts:
        warnings.warn(doubt, Doubt, stacklevel=2)
    known = {name: arrays.pop(name) for name in _ARRAYS}
    known["walks"] = known["walks"][:, 0].astype(np.int64)
    known["cell"], known["time"] = known["cell"].astype(np.int64), known["time"].astype(np.int64)
    return Daylight(**known, figures=arrays, reached=reached)
