"""Sources, mixtures and sensitivities: their numbers are those of the program."""

import csv

import numpy as np
import pytest

import radwalk
from conftest import CONFIGS, assert_same, table

LAMPS = CONFIGS / "lamps.toml"


@pytest.fixture(scope="module")
def result():
    return radwalk.run(LAMPS, paths=100_000)


@pytest.fixture
def folder(tmp_path, binary):
    """What the program makes of the job."""
    binary("run", LAMPS, "--paths", 100_000, "--out", tmp_path / "out", "--quiet", "--workers", 1)
    return tmp_path / "out"


def assert_rows(of_result, path, **chosen):
    """Holds a table against those rows of a file whose columns have the chosen words, which the table leaves out."""
    words = table(path)
    rows = [row for row in range(len(words["patch"])) if all(words[name][row] == word for name, word in chosen.items())]
    part = path.with_name("part.csv")
    names = [name for name in words if name not in chosen]
    with open(part, "w", newline="") as file:
        csv.writer(file).writerows([names, *[[words[name][row] for name in names] for row in rows]])
    assert len(rows) == len(of_result["patch"])
    assert_same(of_result, part)


@pytest.mark.filterwarnings("ignore::radwalk.Doubt")
def test_sources_are_those_of_the_program(result, folder):
    assert list(result.sources) == ["left", "right", "rest"] and result.factors == {"left": 1.0, "right": 1.0, "rest": 1.0}
    for name, of_source in result.sources.items():
        assert_rows(of_source, folder / "sources.csv", source=name)
    # What no walk has hit is not a number.
    together = sum(np.nan_to_num(of_source.quantity("radiosity")) for of_source in result.sources.values())
    assert np.allclose(together, np.nan_to_num(result.radiosity), rtol=1e-12)


@pytest.mark.filterwarnings("ignore::radwalk.Doubt")
def test_mixtures_are_those_of_the_program(result, folder, tmp_path, binary):
    mixed = result.combine({"left": 0.3}, right=0)
    binary("combine", folder, "--set", "left=0.3", "--set", "right=0", "--out", tmp_path / "mix", "--quiet")
    assert_same(mixed.table, tmp_path / "mix" / "patches.csv")
    assert mixed.factors == {"left": 0.3, "right": 0.0, "rest": 1.0}
    # Factors multiply what the job gives, not what a mixture has.
    assert_same(mixed.combine(left=1, right=1).table, folder / "patches.csv")
    with pytest.raises(radwalk.Error, match='it has no source "door"'):
        result.combine(door=2)


@pytest.mark.filterwarnings("ignore::radwalk.Doubt")
def test_sensitivities_are_those_of_the_program(result, folder):
    found = [(name, what) for name, of_material in result.sensitivities.items() for what in of_material]
    words = table(folder / "sensitivities.csv")
    assert found == list(dict.fromkeys(zip(words["material"], words["property"])))
    for material, what in found:
        of = result.sensitivities[material][what]
        assert_rows(of, folder / "sensitivities.csv", material=material, property=what)
        assert of.interval().shape == (*of.quantity("derivative").shape, 2)


@pytest.mark.filterwarnings("ignore::radwalk.Doubt")
def test_jobs_without_sources_have_none():
    plain = radwalk.run(CONFIGS / "cube54.toml", paths=1_000)
    assert plain.sources is None and plain.sensitivities is None and plain.factors == {}
    with pytest.raises(radwalk.Error, match="not told apart by source"):
        plain.combine(left=1)
