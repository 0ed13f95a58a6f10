"""Results for other packages."""

import ast
import inspect
from pathlib import Path

import numpy as np
import pytest

import radwalk
from conftest import CONFIGS


@pytest.fixture(scope="module")
def result():
    return radwalk.run(CONFIGS / "cube54.toml", paths=100_000)


def test_pandas_has_the_columns_of_the_table(result, tmp_path):
    pandas = pytest.importorskip("pandas")
    result.save(tmp_path / "out")
    words = pandas.read_csv(tmp_path / "out" / "patches.csv", dtype=str, keep_default_na=False)
    frame = result.to_pandas()
    assert list(frame) == list(words) and len(frame) == 54
    for name in frame:
        if frame[name].dtype == np.float64:
            read = np.array([float(word or "nan") for word in words[name]])
            assert frame[name].to_numpy().tobytes() == read.tobytes(), name
        else:
            assert frame[name].astype(str).tolist() == words[name].tolist(), name


def test_pyvista_has_the_faces_and_their_numbers(result):
    pytest.importorskip("pyvista")
    mesh = result.to_pyvista()
    assert mesh.n_cells == 54
    assert np.asarray(mesh.cell_data["radiosity"]).tobytes() == result.radiosity.tobytes()
    sizes = mesh.compute_cell_sizes(length=False, volume=False)["Area"]
    assert np.allclose(sizes, result.area, rtol=1e-6)
    assert np.allclose(mesh.cell_centers().points, result.centroid, atol=1e-6)


def test_arrays_are_read_only(result):
    with pytest.raises(ValueError):
        result.radiosity[0] = 1.0


def test_a_result_says_what_it_is(result):
    assert repr(result).startswith("<radwalk.Result of 'cube54': 54 rows from 100,000 paths, median relative half-width ")
    assert repr(result.table).startswith("<radwalk.Table of 54 rows: patch, surface, u, v, x,")
    assert result.sensors is None and result.side is None
    with pytest.raises(KeyError):
        result.table.quantity("brightness")


def test_stubs_and_docstrings_know_every_name():
    """The stub has the names of the package with the parameters that they have, and everything public says what it does."""
    stub = ast.parse(Path(radwalk.__file__).with_name("__init__.pyi").read_text())
    nodes = {node.name: node for node in stub.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    for name in radwalk.__all__:
        if name.startswith("__"):
            continue
        thing = getattr(radwalk, name)
        assert inspect.getdoc(thing), name
        if inspect.isfunction(thing):
            check_parameters(thing, nodes[name])
            continue
        members = {node.name: node for node in nodes[name].body if isinstance(node, ast.FunctionDef)}
        fields = {node.target.id for node in nodes[name].body if isinstance(node, ast.AnnAssign)}
        for member, value in vars(thing).items():
            if member.startswith("_") or member in fields or not (callable(value) or isinstance(value, (property, classmethod))):
                continue
            assert member in members, f"{name}.{member} is not in the stub"
            assert inspect.getdoc(getattr(thing, member)), f"{name}.{member} has no docstring"
            if not isinstance(value, property):
                check_parameters(getattr(value, "__func__", value), members[member])


def check_parameters(function, node):
    """The parameters of a function are those of its stub."""
    arguments = node.args
    named = [argument.arg for argument in arguments.posonlyargs + arguments.args + arguments.kwonlyargs]
    named += [argument.arg for argument in (arguments.vararg, arguments.kwarg) if argument]
    assert sorted(inspect.signature(function).parameters) == sorted(named), function
