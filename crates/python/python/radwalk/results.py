"""Results as arrays."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

CHANNELS = ("r", "g", "b")


class Table(Mapping):
    """The columns of a table by name, in the order of its file; each is a read-only numpy array.

    Missing numbers are NaN. A quantity of a coloured scene has three columns, such as ``radiosity_r``; :meth:`quantity` joins them.
    """

    def __init__(self, columns):
        self._columns = {}
        for name, kind, cells in columns:
            array = np.array(cells, dtype=object) if kind == "str" else np.frombuffer(cells, dtype=kind)
            array.flags.writeable = False
            self._columns[name] = array

    @classmethod
    def _of(cls, columns):
        """A table of arrays."""
        table = cls(())
        for name, array in columns.items():
            array.flags.writeable = False
            table._columns[name] = array
        return table

    def _by(self, *names):
        """The rows as a dict of dicts: a table for each value of the named columns, in the order of the rows."""
        if not names:
            return self
        first, *others = names
        column = self._columns[first]
        parts = {}
        for value in dict.fromkeys(column):
            kept = {name: array[column == value] for name, array in self._columns.items() if name != first}
            parts[value] = Table._of(kept)._by(*others)
        return parts

    def __getitem__(self, name):
        return self._columns[name]

    def __iter__(self):
        return iter(self._columns)

    def __len__(self):
        return len(self._columns)

    def __repr__(self):
        rows = len(next(iter(self._columns.values()), ()))
        return f"<radwalk.Table of {rows} rows: {', '.join(self._columns)}>"

    def quantity(self, name):
        """A column of shape (n,), or of shape (n, 3) where there is one for red, green and blue."""
        if name in self._columns:
            return self._columns[name]
        if f"{name}_{CHANNELS[0]}" not in self._columns:
            raise KeyError(name)
        return np.stack([self._columns[f"{name}_{channel}"] for channel in CHANNELS], axis=-1)

    def interval(self):
        """Confidence intervals, of shape (n, 2), or (n, 3, 2) in colour: lower and upper ends."""
        return np.stack([self.quantity("ci_low"), self.quantity("ci_high")], axis=-1)

    def to_pandas(self):
        """A pandas DataFrame of the same columns."""
        import pandas

        return pandas.DataFrame(dict(self._columns))


def quantity(name, unit, words):
    """A property that is a quantity of the table."""

    def get(self):
        return self.table.quantity(name)

    return property(get, doc=f"{words}{f' [{unit}]' if unit else ''}: shape (n,), in colour (n, 3).")


class Result:
    """What a run has come to: a row for each patch, two (front and back) for each patch of a two-sided surface.

    Rows are those of ``patches.csv``, and so are the numbers.
    """

    def __init__(self, answer):
        self._answer = answer
        self._table = None
        self._corners = None
        self._summary = None
        self._sensors = None
        self._sources = None
        self._sensitivities = None

    @property
    def name(self):
        """The name of the job."""
        return self._answer.name

    @property
    def ending(self):
        """Why the walks ended: ``"budget spent"``, ``"target reached"`` or ``"wall clock"``; None for a result that was loaded."""
        return self._answer.ending

    @property
    def table(self):
        """The columns of ``patches.csv``: a :class:`Table`."""
        if self._table is None:
            self._table = Table(self._answer.patches())
        return self._table

    @property
    def sensors(self):
        """The columns of ``sensors.csv``: a :class:`Table`, or None where the scene has no sensors."""
        if self._sensors is None:
            columns = self._answer.sensors()
            self._sensors = None if columns is None else Table(columns)
        return self._sensors

    @property
    def sources(self):
        """The light of each source alone, by name: a dict of :class:`Table` whose rows are those of the result, or None where the job
        names no sources. ``result.sources["lamp"].quantity("radiosity")`` has shape (n,), in colour (n, 3)."""
        if self._sources is None:
            columns = self._answer.sources()
            self._sources = None if columns is None else Table(columns)._by("source")
        return self._sources

    @property
    def factors(self):
        """What the emittance of each source is multiplied by: a dict, empty where the job names no sources."""
        return dict(self._answer.factors())

    def combine(self, factors=None, /, **named):
        """The :class:`Result` where sources emit other multiples of what the job gives to them, as ``radwalk combine`` makes it: no ray is
        traced, and intervals hold for the mixture. ``result.combine(left=0.3)``, or ``result.combine({"lamp 1": 0.3})``; sources that
        are not named keep their factor."""
        return Result(self._answer.combine([(str(name), float(x)) for name, x in {**(factors or {}), **named}.items()]))

    @property
    def sensitivities(self):
        """Derivatives of the radiosity by material and by what is changed of it (``"reflectance"``, ``"emittance"``): a dict of dicts of
        :class:`Table` whose rows are those of the result, or None where the job asks for none.
        ``result.sensitivities["wall"]["reflectance"].quantity("derivative")`` has shape (n,), in colour (n, 3)."""
        if self._sensitivities is None:
            columns = self._answer.sensitivities()
            self._sensitivities = None if columns is None else Table(columns)._by("material", "property")
        return self._sensitivities

    @property
    def summary(self):
        """What ``summary.json`` says, but for the picture: a dict."""
        if self._summary is None:
            self._summary = json.loads(self._answer.summary())
        return self._summary

    reflectance = quantity("reflectance", "", "Reflectance")
    emittance = quantity("emittance", "W/m²", "Emittance E")
    radiosity = quantity("radiosity", "W/m²", "Radiosity B")
    std_error = quantity("std_error", "W/m²", "Standard error of the radiosity")
    irradiance = quantity("irradiance", "W/m²", "Irradiance H")
    irradiance_error = quantity("irradiance_error", "W/m²", "Standard error of the irradiance")

    @property
    def interval(self):
        """Confidence intervals of the radiosity [W/m²]: shape (n, 2), in colour (n, 3, 2); lower and upper ends."""
        return self.table.interval()

    @property
    def area(self):
        """Areas [m²], shape (n,)."""
        return self.table["area"]

    @property
    def centroid(self):
        """Centroids [m], shape (n, 3)."""
        return np.stack([self.table[axis] for axis in "xyz"], axis=-1)

    @property
    def patch(self):
        """Numbers of patches, shape (n,)."""
        return self.table["patch"]

    @property
    def surface(self):
        """Names of surfaces, shape (n,)."""
        return self.table["surface"]

    @property
    def side(self):
        """``"front"`` or ``"back"``, shape (n,); None where no surface has two sides."""
        return self.table.get("side")

    @property
    def hits(self):
        """Scores of each patch, shape (n,)."""
        return self.table["hits"]

    @property
    def flags(self):
        """Flags of each patch, joined by ``|``, shape (n,)."""
        return self.table["flags"]

    def _geometry(self):
        if self._corners is None:
            points, counts, rows = self._answer.corners()
            points = np.frombuffer(points, dtype="<f8").reshape(-1, 3)
            counts = np.frombuffer(counts, dtype="<i8")
            starts = np.cumsum(counts) - counts
            faces = starts[:, None] + np.arange(4)
            faces[counts == 3, 3] = -1
            self._corners = points, faces, np.frombuffer(rows, dtype="<i8")
        return self._corners

    @property
    def vertices(self):
        """Corners of the rows [m], shape (m, 3)."""
        return self._geometry()[0]

    @property
    def faces(self):
        """Indices of the :attr:`vertices` of each row, shape (n, 4), counter-clockwise; the last is -1 where a row is a triangle.

        Where patches are groups of cells, there is a face for each cell, and :attr:`rows` tells the row of each.
        """
        return self._geometry()[1]

    @property
    def rows(self):
        """The row of each of the :attr:`faces`: 0 … n - 1 where every cell is a patch."""
        return self._geometry()[2]

    def to_pandas(self):
        """A pandas DataFrame with the rows and columns of ``patches.csv``. Needs pandas."""
        return self.table.to_pandas()

    def to_pyvista(self):
        """A pyvista PolyData whose cells are the :attr:`faces` of the rows; every column of numbers is cell data. Needs pyvista."""
        import pyvista

        faces = self.faces
        corners = np.where(faces[:, 3] < 0, 3, 4)
        padded = np.column_stack([corners, faces])
        mesh = pyvista.PolyData(np.array(self.vertices), padded[padded >= 0])
        names = dict.fromkeys(name.removesuffix("_r") if name.endswith("_r") else name for name in self.table)
        for name in names:
            if name.endswith(("_g", "_b")) or name in ("x", "y", "z"):
                continue
            values = self.table.quantity(name)
            if values.dtype != object:
                mesh.cell_data[name] = np.array(values)[self.rows]
        return mesh

    def save(self, folder, *, force=False, export=()):
        """Writes the output folder that ``radwalk run`` writes, from which ``radwalk`` can audit, merge and report.

        ``force`` replaces results that are there; ``export`` names further files, such as ``["vtu", "glb", "parquet"]``.
        """
        self._answer.save(folder, force, list(export))

    def __repr__(self):
        summary = self.summary
        error = summary["headline"]["median"]
        known = "" if error is None else f", median relative half-width {100 * error:.2g} %"
        return f"<radwalk.Result of {self.name!r}: {len(self.area):,} rows from {summary['paths']:,} paths{known}>"


class ExactResult:
    """The deterministic solution of a scene, with the variance that one walk of each estimator would have."""

    def __init__(self, channels):
        self._tables = [Table(columns) for columns, _ in channels]
        summaries = [json.loads(summary) for _, summary in channels]
        self.summary = summaries[0] if len(summaries) == 1 else dict(zip(CHANNELS, summaries))

    @property
    def tables(self):
        """The columns of ``exact.csv``: a :class:`Table` for each channel."""
        return self._tables

    def quantity(self, name):
        """A column of ``exact.csv``: shape (n,), in colour (n, 3)."""
        columns = [table[name] for table in self._tables]
        return columns[0] if len(columns) == 1 else np.stack(columns, axis=-1)

    @property
    def radiosity(self):
        """Radiosity B [W/m²]: shape (n,), in colour (n, 3)."""
        return self.quantity("radiosity")

    @property
    def irradiance(self):
        """Irradiance H [W/m²]: shape (n,), in colour (n, 3)."""
        return self.quantity("irradiance")

    @property
    def radiosity_error(self):
        """How far the radiosity may be off [W/m²]: shape (n,), in colour (n, 3)."""
        return self.quantity("radiosity_error")

    def __repr__(self):
        return f"<radwalk.ExactResult of {len(self._tables[0]['patch']):,} rows>"
