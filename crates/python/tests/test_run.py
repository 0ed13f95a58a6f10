"""Runs: the answers are those of the program, and the interpreter is not in the way."""

import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

import radwalk
from conftest import CONFIGS, assert_same

SENSOR = """
[material.wall]
reflectance = [0.7, 0.5, 0.3]

[material.lamp]
emittance = 100.0
reflectance = 0.1

[[surface]]
material = "wall"
quad = [[0, 0, 0], [2, 0, 0], [0, 2, 0]]
patches = [3, 3]
sides = 2

[[surface]]
material = "lamp"
triangle = [[0, 0, 2], [0, 2, 2], [2, 0, 2]]
patches = 2

[[sensor]]
name = "desk"
quad = [[0.5, 0.5, 0.7], [1.0, 0.5, 0.7], [0.5, 1.0, 0.7]]
patches = [2, 1]
"""


@pytest.fixture
def coloured(tmp_path):
    """A coloured scene of two-sided quads and triangles, with a sensor."""
    scene = tmp_path / "scene.toml"
    scene.write_text(SENSOR)
    return scene


JOBS = [
    ("cube54.toml", {"paths": 300_000}),
    ("cube54.toml", {"paths": 300_000, "seed": 7, "first_path": 5_000, "method": {"walk": "gathering"}}),
    ("cube54.toml", {"paths": 2e6, "method.walk": "jacobi"}),
    ("cube54.toml", {"paths": 1e8, "target": 0.03, "confidence": 0.9}),
    ("cornell.toml", {"paths": 100_000}),
]


@pytest.mark.filterwarnings("ignore::radwalk.Doubt")
@pytest.mark.parametrize("job, keys", JOBS)
def test_the_numbers_are_those_of_the_program(tmp_path, binary, job, keys):
    typed = radwalk.overrides.overrides(keys)
    sets = [word for override in typed for word in ("--set", override)]
    binary("run", CONFIGS / job, *sets, "--out", tmp_path / "out", "--quiet", "--workers", 2)
    for threads in (1, 3):
        result = radwalk.run(CONFIGS / job, threads=threads, **keys)
        assert_same(result.table, tmp_path / "out" / "patches.csv")
    assert result.ending == ("target reached" if "target" in keys else "budget spent")
    loaded = radwalk.load(tmp_path / "out")
    for key in ("tally_hash", "job_hash", "paths", "rays", "headline", "target"):
        assert result.summary[key] == loaded.summary[key], key
    # Whether walks wait beyond a gap when a target ends a run is a matter of when they came in.
    checks = [[check for check in one.summary["checks"] if check["name"] != "gap"] for one in (result, loaded)]
    assert checks[0] == checks[1] and len(checks[0]) > 10
    assert_same(loaded.table, tmp_path / "out" / "patches.csv")


def test_colours_sides_and_sensors_are_those_of_the_program(tmp_path, binary, coloured):
    binary("run", coloured, "--paths", 200_000, "--out", tmp_path / "out", "--quiet", "--workers", 1)
    with pytest.warns(radwalk.Doubt):
        result = radwalk.run(coloured, paths=200_000)
    assert_same(result.table, tmp_path / "out" / "patches.csv")
    assert_same(result.sensors, tmp_path / "out" / "sensors.csv")
    n = 9 * 2 + 4
    assert result.radiosity.shape == (n, 3) and result.interval.shape == (n, 3, 2)
    assert result.side.tolist() == ["front", "back"] * 9 + ["front"] * 4
    assert result.sensors.quantity("irradiance").shape == (2, 3)
    assert (result.faces[:18, 3] >= 0).all() and (result.faces[18:, 3] == -1).all()
    # The centroid of a quad is the mean of its corners, that of a triangle too.
    for corners, centroid in zip(result.faces, result.centroid):
        assert np.allclose(result.vertices[corners[corners >= 0]].mean(axis=0), centroid, atol=1e-12)


KINDS = """
[material.grey]
reflectance = 0.5

[material.black]
reflectance = 0.0

[material.lamp]
emittance = 1.0
reflectance = 0.5

[[surface]]
name = "lit"
material = "grey"
quad = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]

[[surface]]
name = "lamp"
material = "lamp"
quad = [[0, 0, 1], [0, 1, 1], [1, 0, 1]]

[[surface]]
name = "sealed"
material = "grey"
quad = [[0, 0, 5], [1, 0, 5], [0, 1, 5]]

[[surface]]
name = "sealed black"
material = "black"
quad = [[0, 0, 6], [1, 0, 6], [0, 1, 6]]

[[surface]]
name = "tiny"
material = "grey"
quad = [[0.5, 0.5, 0.1], [0.500001, 0.5, 0.1], [0.5, 0.500001, 0.1]]
"""


@pytest.mark.filterwarnings("ignore::radwalk.Doubt")
@pytest.mark.parametrize("walk", ["shooting", "gathering", "jacobi"])
def test_what_is_unknown_is_nan_and_the_table_of_the_program_is_empty_there(tmp_path, binary, walk):
    scene = tmp_path / "kinds.toml"
    scene.write_text(KINDS)
    method = {"method.walk": walk, "scene.patches": "given", "paths": 20_000}
    typed = [word for override in radwalk.overrides.overrides(method) for word in ("--set", override)]
    binary("run", scene, *typed, "--out", tmp_path / "out", "--quiet", "--workers", 1)
    result = radwalk.run(scene, **method)
    assert_same(result.table, tmp_path / "out" / "patches.csv")
    lit, _, sealed, black, _ = range(5)
    assert np.isfinite(result.table["irradiance"][lit])
    for patch in (sealed, black):
        assert all(np.isnan(result.table[name][patch]) for name in ("std_error", "irradiance", "irradiance_error"))
        assert "unsampled" in result.table["flags"][patch]
    assert np.isnan(result.table["radiosity"][sealed]) and result.table["radiosity"][black] == 0.0
    assert result.table["ci_low"][sealed] == 0.0 < result.table["ci_high"][sealed]
    headlines = [one.summary["headline"] for one in (result, radwalk.load(tmp_path / "out"))]
    assert headlines[0] == headlines[1] and headlines[0]["sealed_area"] >= 2.0


def test_what_is_saved_is_a_result_of_the_program(tmp_path, binary):
    binary("run", CONFIGS / "cube54.toml", "--paths", 100_000, "--out", tmp_path / "there", "--quiet")
    result = radwalk.run(CONFIGS / "cube54.toml", paths=100_000)
    result.save(tmp_path / "here", export=["vtu"])
    for file in ("patches.csv", "radiosity.png"):
        assert (tmp_path / "here" / file).read_bytes() == (tmp_path / "there" / file).read_bytes(), file
    assert (tmp_path / "here" / "patches.vtu").exists()
    binary("audit", tmp_path / "here", "--share", 1)
    with pytest.raises(radwalk.Error, match="--force"):
        result.save(tmp_path / "here")
    result.save(tmp_path / "here", force=True)
    with pytest.raises(radwalk.Error, match='no output file "dxf"'):
        result.save(tmp_path / "here", force=True, export=["dxf"])


def test_exact_is_that_of_the_program(tmp_path, binary, coloured):
    binary("exact", CONFIGS / "cube54.toml", "--out", tmp_path / "grey", "--quiet")
    grey = radwalk.exact(CONFIGS / "cube54.toml")
    assert_same(grey.tables[0], tmp_path / "grey" / "exact.csv")
    assert grey.radiosity.shape == (54,) and grey.summary["patches"] == 54
    binary("exact", coloured, "--out", tmp_path / "colour", "--quiet")
    colour = radwalk.exact(coloured)
    for channel, of_channel in zip("rgb", colour.tables):
        assert_same(of_channel, tmp_path / "colour" / f"exact_{channel}.csv")
    assert colour.radiosity.shape == (22, 3) and set(colour.summary) == set("rgb")


def test_errors_have_the_words_of_the_program(tmp_path, binary):
    broken = tmp_path / "broken.toml"
    broken.write_text("scene = 'nowhere.toml'\n[budget]\npaths = 1\n")
    for job, keys in [
        (CONFIGS / "cube54.toml", {"path": 3}),
        (CONFIGS / "cube54.toml", {"method.walk": "shoting"}),
        (tmp_path / "none.toml", {}),
        (broken, {}),
    ]:
        sets = [word for override in radwalk.overrides.overrides(keys) for word in ("--set", override)]
        said = binary("run", job, *sets, "--out", tmp_path / "out", fails=True)
        with pytest.raises(radwalk.Error) as error:
            radwalk.run(job, **keys)
        assert str(error.value) in said
    assert radwalk.Error.__module__ == "radwalk"


def test_doubts_are_warnings():
    with pytest.warns(radwalk.Doubt, match="error: .* a standard error of the irradiance above 10 %"):
        radwalk.run(CONFIGS / "cube54.toml", paths=1_000)


def test_the_wall_clock_leaves_a_prefix():
    result = radwalk.run(CONFIGS / "cube54.toml", paths=1e15, wall_seconds=0.5)
    assert result.ending == "wall clock" and 0 < result.summary["paths"] < 1e15


def test_progress_is_told_and_may_end_the_run():
    told = []
    radwalk.run(CONFIGS / "cube54.toml", paths=1e15, wall_seconds=0.6, progress=told.append)
    assert len(told) > 1 and told == sorted(told, key=lambda stage: stage.paths)
    assert told[-1].paths_total == 1e15 and told[-1].error < 1.0
    assert "of 1,000,000,000,000,000 paths" in str(told[-1])

    def enough(stage):
        raise RuntimeError(f"after {stage.paths} paths")

    with pytest.raises(RuntimeError, match=r"after \d+ paths"):
        radwalk.run(CONFIGS / "cube54.toml", paths=1e15, progress=enough)


def test_a_line_of_progress_goes_to_stderr(capfd):
    radwalk.run(CONFIGS / "cube54.toml", paths=1e15, wall_seconds=1.0, progress=True)
    said = capfd.readouterr().err
    assert said.startswith("\r  0 % of 1,000,000,000,000,000 paths") and said.endswith("\n")
    radwalk.run(CONFIGS / "cube54.toml", paths=1e15, wall_seconds=0.6)
    assert capfd.readouterr().err == ""


def test_walks_release_the_interpreter():
    """Another thread gets on while walks go on: with the lock held it could not take a single step."""
    steps, done = [0], threading.Event()

    def step():
        while not done.wait(0.001):
            steps[0] += 1

    thread = threading.Thread(target=step)
    told = []

    def look(stage):
        told.append((stage.paths, steps[0]))

    thread.start()
    try:
        radwalk.run(CONFIGS / "cube54.toml", paths=1e15, wall_seconds=1.0, progress=look)
    finally:
        done.set()
        thread.join()
    # Between two looks the interpreter is not asked for anything, so what is counted was counted while walks went on.
    assert told[-1][1] > told[0][1] and told[-1][0] > told[0][0]


def test_ctrl_c_ends_a_run():
    script = f"""
import radwalk
def look(stage):
    if stage.paths:
        print("walking", flush=True)
try:
    radwalk.run({str(CONFIGS / "cube54.toml")!r}, paths=1e15, progress=look)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "walking\n"
    os.kill(child.pid, signal.SIGINT)
    # Not a limit on how fast it is: a run that does not hear would go on for years.
    said, _ = child.communicate(timeout=120)
    assert said.splitlines()[-1] == "interrupted" and child.returncode == 0


def test_overrides_are_toml():
    from radwalk.overrides import overrides

    assert overrides({"paths": 1e6, "seed": np.int64(3), "target": 0.05}) == [
        "budget.paths=1000000",
        "seed=3",
        "target.relative_error=0.05",
    ]
    assert overrides({"method": {"walk": "shooting", "infinite": {"end": "cutoff", "threshold": 1e-4}}}) == [
        'method.walk="shooting"',
        'method.infinite.end="cutoff"',
        "method.infinite.threshold=0.0001",
    ]
    assert overrides({"simultaneous": True, "target.patches": (1, 2), "view.eye": np.array([0.5, 1.0, 2.0])}) == [
        "simultaneous=true",
        "target.patches=[1, 2]",
        "view.eye=[0.5, 1, 2]",
    ]
    assert overrides({"import.material": {'La"mp*': {"power": 60.0}}}) == ['import.material={"La\\"mp*" = {"power" = 60}}']
    assert overrides({"name": "naïve\n"}) == ['name="naïve\\n"']
