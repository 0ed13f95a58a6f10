from collections.abc import Callable, Iterable, Iterator, Mapping
from os import PathLike
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

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

__version__: str
__git__: str

class Error(Exception): ...
class Doubt(UserWarning): ...

class Progress(NamedTuple):
    paths: int
    paths_total: int
    seconds: float
    error: float | None

class Table(Mapping[str, NDArray[Any]]):
    def __init__(self, columns: Iterable[tuple[str, str, Any]]) -> None: ...
    def __getitem__(self, name: str) -> NDArray[Any]: ...
    def __iter__(self) -> Iterator[str]: ...
    def __len__(self) -> int: ...
    def quantity(self, name: str) -> NDArray[Any]: ...
    def interval(self) -> NDArray[np.float64]: ...
    def to_pandas(self) -> Any: ...

class Result:
    def __init__(self, answer: Any) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def ending(self) -> str | None: ...
    @property
    def table(self) -> Table: ...
    @property
    def sensors(self) -> Table | None: ...
    @property
    def sources(self) -> dict[str, Table] | None: ...
    @property
    def factors(self) -> dict[str, float]: ...
    def combine(self, factors: Mapping[str, float] | None = ..., /, **named: float) -> Result: ...
    @property
    def sensitivities(self) -> dict[str, dict[str, Table]] | None: ...
    @property
    def summary(self) -> dict[str, Any]: ...
    @property
    def reflectance(self) -> NDArray[np.float64]: ...
    @property
    def emittance(self) -> NDArray[np.float64]: ...
    @property
    def radiosity(self) -> NDArray[np.float64]: ...
    @property
    def std_error(self) -> NDArray[np.float64]: ...
    @property
    def irradiance(self) -> NDArray[np.float64]: ...
    @property
    def irradiance_error(self) -> NDArray[np.float64]: ...
    @property
    def interval(self) -> NDArray[np.float64]: ...
    @property
    def area(self) -> NDArray[np.float64]: ...
    @property
    def centroid(self) -> NDArray[np.float64]: ...
    @property
    def patch(self) -> NDArray[np.int64]: ...
    @property
    def surface(self) -> NDArray[np.object_]: ...
    @property
    def side(self) -> NDArray[np.object_] | None: ...
    @property
    def hits(self) -> NDArray[Any]: ...
    @property
    def flags(self) -> NDArray[np.object_]: ...
    @property
    def rows(self) -> NDArray[np.int64]: ...
    @property
    def vertices(self) -> NDArray[np.float64]: ...
    @property
    def faces(self) -> NDArray[np.int64]: ...
    def to_pandas(self) -> Any: ...
    def to_pyvista(self) -> Any: ...
    def save(self, folder: str | PathLike[str], *, force: bool = ..., export: Iterable[str] = ...) -> None: ...

class ExactResult:
    summary: dict[str, Any]
    def __init__(self, channels: Iterable[Any]) -> None: ...
    @property
    def tables(self) -> list[Table]: ...
    def quantity(self, name: str) -> NDArray[Any]: ...
    @property
    def radiosity(self) -> NDArray[np.float64]: ...
    @property
    def irradiance(self) -> NDArray[np.float64]: ...
    @property
    def radiosity_error(self) -> NDArray[np.float64]: ...

_Values = ArrayLike | Mapping[str, ArrayLike]

class Scene:
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    name: str
    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        reflectance: _Values = ...,
        emittance: _Values = ...,
        *,
        material: Iterable[str] | None = ...,
        sides: _Values | None = ...,
        name: str = ...,
    ) -> None: ...
    @classmethod
    def from_trimesh(
        cls,
        mesh: Any,
        reflectance: _Values = ...,
        emittance: _Values = ...,
        *,
        sides: _Values | None = ...,
        name: str | None = ...,
    ) -> Scene: ...

def run(
    job_or_scene: str | PathLike[str] | Scene,
    *,
    threads: int | None = ...,
    progress: bool | Callable[[Progress], object] | None = ...,
    **keys: Any,
) -> Result: ...
def exact(job_or_scene: str | PathLike[str] | Scene, **keys: Any) -> ExactResult: ...
def load(folder: str | PathLike[str]) -> Result: ...
def factors(
    mesh: Any,
    *,
    rays: int = ...,
    sides: int = ...,
    sky: int | None = ...,
    periodic: tuple[float, float] | None = ...,
    reflections: bool = ...,
    reflectance: ArrayLike = ...,
    drop: float = ...,
    tolerance: float | None = ...,
    groups: str | PathLike[str] | None = ...,
    channel: int | None = ...,
    intervals: bool = ...,
    smooth: bool = ...,
    threads: int | None = ...,
    progress: bool | Callable[[Progress], object] | None = ...,
    **keys: Any,
) -> Any: ...

class Daylight:
    sensor: NDArray[np.str_]
    cell: NDArray[np.int64]
    middle: NDArray[np.float64]
    walks: NDArray[np.int64]
    coefficients: NDArray[np.float64]
    coefficients_error: NDArray[np.float64]
    time: NDArray[np.int64]
    light: NDArray[np.float64]
    light_error: NDArray[np.float64]
    figures: dict[str, NDArray[np.float64]]
    reached: bool

def daylight(
    job_or_scene: str | PathLike[str] | Scene,
    weather: str | PathLike[str],
    *,
    sky_patches: int = ...,
    ground: float = ...,
    channel: int | None = ...,
    tolerance: float = ...,
    enough: float = ...,
    threads: int | None = ...,
    progress: bool | Callable[[Progress], object] | None = ...,
    **keys: Any,
) -> Daylight: ...
