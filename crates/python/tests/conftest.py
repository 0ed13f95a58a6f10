"""What the tests share: the binary whose answers they hold the package's against, and the jobs of the repository."""

import csv
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

CONFIGS = Path(__file__).resolve().parents[3] / "configs"


@pytest.fixture(scope="session")
def radwalk_binary():
    """The program, built from the same sources."""
    binary = os.environ.get("RADWALK") or shutil.which("radwalk")
    assert binary, "set RADWALK to the binary that was built from these sources"
    return binary


@pytest.fixture
def binary(radwalk_binary):
    """Runs the program; returns what it said on stderr, where it failed."""

    def run(*arguments, fails=False):
        done = subprocess.run([radwalk_binary, *map(str, arguments)], capture_output=True, text=True)
        assert (done.returncode not in (0, 1)) == fails, done.stderr
        return done.stderr

    return run


def table(path):
    """A CSV file as lists of words, by column."""
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return {name: [row[i] for row in rows[1:]] for i, name in enumerate(rows[0])}


def assert_same(table_of_result, path):
    """Holds a table against a CSV file: the same columns in the same order, numbers equal to the last bit."""
    words = table(path)
    assert list(table_of_result) == list(words)
    for name, column in table_of_result.items():
        if column.dtype == object:
            assert list(column) == words[name], name
        elif column.dtype == np.dtype("<i8"):
            assert column.tolist() == [int(word) for word in words[name]], name
        else:
            read = np.array([float(word) if word else np.nan for word in words[name]])
            assert column.tobytes() == read.tobytes(), name


#: A closed cube; faces look inwards.
VERTICES = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
FACES = np.array(
    [
        [0, 1, 3],
        [0, 3, 2],
        [4, 7, 5],
        [4, 6, 7],
        [0, 5, 1],
        [0, 4, 5],
        [2, 3, 7],
        [2, 7, 6],
        [0, 2, 6],
        [0, 6, 4],
        [1, 7, 3],
        [1, 5, 7],
    ]
)
