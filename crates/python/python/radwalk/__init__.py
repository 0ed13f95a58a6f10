"""Radiosity by random walks, with confidence intervals that are true.

    >>> import radwalk
    >>> result = radwalk.run("configs/cube54.toml", paths=1e6)
    >>> result.radiosity, result.interval

:func:`run` walks a job on threads of this process, :func:`exact` solves a small scene without randomness, :func:`load` opens the
output folder of ``radwalk run``, and :class:`Scene` is a scene of arrays.
:func:`factors` counts view factors into a sparse matrix, :func:`daylight` the daylight of a year into arrays. The answer is a function of the job: the numbers are those of
``radwalk run`` with the same job, to the last bit, on any number of threads.
"""

from ._radwalk import Error, __git__, __version__
from .results import ExactResult, Result, Table
from .running import Doubt, Progress, exact, load, run
from .scene import Scene
from .view_factors import factors
from .year import Daylight, daylight

__all__ = [
    "Daylight",
    "Doubt",
    "Error",
    "ExactResult",
    "Progress",
    "Result",
    "Scene",
    "Table",
    "__git__",
    "__version__",
    "daylight",
    "exact",
    "factors",
    "load",
    "run",
]
