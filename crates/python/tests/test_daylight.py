"""Daylight: the arrays are those of the program."""

import numpy as np
import pytest

import radwalk
from conftest import CONFIGS, table

JOB = CONFIGS / "daylit.toml"
WEATHER = CONFIGS / "weather" / "made.epw"


def test_the_arrays_are_those_of_the_program(tmp_path, binary):
    found = radwalk.daylight(JOB, WEATHER, seed=5, threads=2, progress=False)
    binary("daylight", JOB, "--weather", WEATHER, "--seed", 5, "--quiet", "--export", "npz", "--out", tmp_path / "out")
    assert found.reached and found.light.shape == (60, 576) and found.coefficients.shape == (60, 146)
    with np.load(tmp_path / "out" / "daylight.npz") as arrays:
        for name in ("sensor", "middle", "coefficients", "coefficients_error", "time", "light", "light_error"):
            assert (getattr(found, name) == arrays[name]).all(), name
        for name, figure in found.figures.items():
            assert (figure == arrays[name]).all() and (figure[:, 1] <= figure[:, 0]).all() and (figure[:, 0] <= figure[:, 2]).all()
    rows = table(tmp_path / "out" / "annual.csv")
    assert found.walks.tolist() == [int(word) for word in rows["walks"]]
    assert found.figures["autonomy"][:, 1].tolist() == [float(word) for word in rows["autonomy_low"]]


def test_light_is_a_product_of_the_coefficients_where_there_is_no_sun(tmp_path, binary):
    found = radwalk.daylight(JOB, WEATHER, tolerance=0.2, threads=1, progress=False)
    binary("sky", "--weather", WEATHER, "--quiet", "--out", tmp_path / "sky.mtx")
    body = (tmp_path / "sky.mtx").read_text().split("\n\n", 1)[1]
    sky = 179.0 * np.array(body.split(), float)[::3].reshape(146, 576)
    dull = found.time[:, 1] == 20
    assert dull.sum() == 288 and found.light[:, dull].max() > 100.0
    # The matrix is written with six digits or so.
    assert np.allclose(found.coefficients @ sky[:, dull], found.light[:, dull], rtol=1e-4, atol=1e-6)


def test_what_cannot_be_is_refused(tmp_path):
    with pytest.raises(ValueError, match="145, 577 or 2305"):
        radwalk.daylight(JOB, WEATHER, sky_patches=146, progress=False)
    with pytest.raises(radwalk.Error):
        radwalk.daylight(JOB, tmp_path / "none.epw", progress=False)
    with pytest.warns(radwalk.Doubt, match="the budget ended"):
        assert not radwalk.daylight(JOB, WEATHER, tolerance=1e-4, paths=60 * 4096, progress=False).reached


def test_a_watcher_hears_and_may_give_up():
    parts = []
    radwalk.daylight(JOB, WEATHER, tolerance=0.2, progress=parts.append)
    assert parts and all(0 < part.paths <= part.paths_total for part in parts)

    def trouble(part):
        raise KeyError("enough")

    with pytest.raises(KeyError):
        radwalk.daylight(JOB, WEATHER, progress=trouble)
