"""Jobs, walked and solved."""

from __future__ import annotations

import os
import sys
import time
import warnings
from typing import NamedTuple

from . import _radwalk
from .overrides import overrides
from .results import ExactResult, Result
from .scene import Scene


class Doubt(UserWarning):
    """A result is open to doubt: light is lost, a sensor lies behind a wall, or a check of the result has failed."""


class Progress(NamedTuple):
    """Where a run stands."""

    paths: int
    """Paths that are in."""
    paths_total: int
    """Paths of the whole job; a target may end it earlier."""
    seconds: float
    """Seconds since the first walk."""
    error: float | None
    """The relative half-width that half of the area is within, at the latest look; None before the first."""

    def __str__(self):
        part = 100.0 * self.paths / max(self.paths_total, 1)
        rate = self.paths / self.seconds if self.seconds > 0.0 else 0.0
        left = "" if rate == 0.0 else f", {clock((self.paths_total - self.paths) / rate)} left"
        error = "" if self.error is None else f", half of the area within {100.0 * self.error:.2g} %"
        return f"{part:3.0f} % of {self.paths_total:,} paths, {rate:,.0f}/s, {clock(self.seconds)}{left}{error}"


def run(job_or_scene, *, threads=None, progress=None, **keys):
    """Walks a job on threads of this process and returns a :class:`Result`.

    :param job_or_scene: the path of a job file, of a scene or of a mesh, or a :class:`Scene`.
    :param threads: how many threads walk; default: one for each core. The answer is the same with any number.
    :param progress: None shows a line in notebooks and terminals, True shows it anywhere, False never does; a function is called some
        times a second with a :class:`Progress`. What it raises ends the run.
    :param keys: keys of the job, which replace those of the file. Dotted keys are written ``**{"method.walk": "gathering"}``, or as
        tables: ``method={"walk": "gathering"}``. ``paths``, ``first_path`` and ``wall_seconds`` are those of ``[budget]``;
        ``target=0.01`` is the relative error of ``[target]``.

    Walks release the interpreter's lock. Ctrl-C ends them with ``KeyboardInterrupt``. What the program refuses raises
    :class:`Error`; what makes a result doubtful warns with :class:`Doubt`.
    """
    typed = overrides(keys)
    shown = show(progress)
    watch = None if shown is None else lambda *stage: shown(Progress(*stage))
    try:
        answer = _radwalk.run(source(job_or_scene), typed, threads, watch)
    finally:
        if isinstance(shown, Line):
            shown.close()
    for warning in answer.warnings:
        warnings.warn(warning, Doubt, stacklevel=2)
    result = Result(answer)
    for check in result.summary["checks"]:
        if check["ok"] is False:
            warnings.warn(f"{check['name']}: {check['message']}", Doubt, stacklevel=2)
    return result


def exact(job_or_scene, **keys):
    """Solves the radiosity system of a small scene without randomness and returns an :class:`ExactResult`.

    The arguments are those of :func:`run`.
    """
    return ExactResult(_radwalk.exact(source(job_or_scene), overrides(keys)))


def load(folder):
    """Opens the output folder of ``radwalk run``, ``coordinate`` or ``merge``, or of :meth:`Result.save`, as a :class:`Result`."""
    return Result(_radwalk.load(os.fspath(folder)))


#: A count has a part that is done, not a number of paths: it is shown as that part of so many.
_PARTS = 1_000_000


def counted(count, job, keys, folder, wanted, *, threads, progress):
    """What the native half says of a count into a folder, of which ``progress`` is told as by :func:`run`."""
    shown = show(progress)
    began = time.monotonic()

    def watch(part):
        shown(Progress(round(part * _PARTS), _PARTS, time.monotonic() - began, None))

    try:
        return count(job, overrides(keys), folder, wanted, threads or os.cpu_count() or 1, None if shown is None else watch)
    finally:
        if isinstance(shown, Line):
            shown.close()


def source(job_or_scene):
    """What the native half makes a job of."""
    if isinstance(job_or_scene, Scene):
        return job_or_scene._mesh
    if hasattr(job_or_scene, "vertices") or hasattr(job_or_scene, "geometry"):
        raise TypeError("a mesh says nothing of reflectances and lamps; give radwalk.Scene.from_trimesh(mesh, reflectance, emittance)")
    return os.fspath(job_or_scene)


def show(progress):
    """What shows progress: a function, a line, or nothing."""
    if callable(progress):
        return progress
    notebook = display_handle() if progress is None or progress else None
    if notebook is not None:
        return Line(notebook)
    if progress or (progress is None and sys.stderr.isatty()):
        return Line(None)
    return None


def display_handle():
    """A place in the output of a notebook's cell; None elsewhere."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    if shell is None or not hasattr(shell, "kernel"):
        return None
    from IPython.display import DisplayHandle

    return DisplayHandle()


class Line:
    """A line that is written over as a run goes on."""

    def __init__(self, handle):
        self.handle = handle
        self.width = 0

    def __call__(self, progress):
        text = str(progress)
        if self.handle is not None:
            shown = {"text/plain": text}
            if self.width == 0:
                self.handle.display(shown, raw=True)
            else:
                self.handle.update(shown, raw=True)
        else:
            sys.stderr.write("\r" + text.ljust(self.width))
            sys.stderr.flush()
        self.width = max(self.width, len(text))

    def close(self):
        """Ends the line."""
        if self.handle is None and self.width > 0:
            sys.stderr.write("\n")
            sys.stderr.flush()


def clock(seconds):
    """Seconds as h:mm:ss or m:ss."""
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"
