"""Scenes of arrays."""

import numpy as np
import pytest

import radwalk
from conftest import FACES, VERTICES, assert_same


def write_ply(path):
    """The cube as a PLY file."""
    head = f"ply\nformat ascii 1.0\nelement vertex {len(VERTICES)}\nproperty double x\nproperty double y\nproperty double z\n"
    head += f"element face {len(FACES)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(str, vertex)) for vertex in VERTICES.tolist()]
    rows += [f"3 {a} {b} {c}" for a, b, c in FACES]
    path.write_text(head + "\n".join(rows) + "\n")


def test_arrays_are_the_file_that_holds_them(tmp_path, binary):
    """The same mesh as a PLY file has the same hash, and so the same answer to the last bit."""
    write_ply(tmp_path / "mesh.ply")
    lamp = 'import.material={"*" = {emittance = 3, reflectance = 0.5}}'
    sets = ["--set", lamp, "--set", "import.sides=1", "--set", "import.patch_size=0.5"]
    binary("run", tmp_path / "mesh.ply", *sets, "--paths", 50_000, "--out", tmp_path / "out", "--quiet")
    scene = radwalk.Scene(VERTICES, FACES, 0.5, 3.0, sides=1)
    result = radwalk.run(scene, paths=50_000, **{"import.patch_size": 0.5})
    assert_same(result.table, tmp_path / "out" / "patches.csv")
    assert result.name == "mesh" and result.surface[0] == "mesh:0"
    assert result.summary["job_hash"] == radwalk.load(tmp_path / "out").summary["job_hash"]


def test_a_furnace_of_arrays_has_its_closed_form():
    """B = E/(1 − R) on every face of a closed room of one material. χ² of 12 faces over 12 stays below 3: by chance it is
    above once in 1,700 seeds, and the seed is fixed."""
    scene = radwalk.Scene(VERTICES, FACES, reflectance=0.6, emittance=2.0, sides=1)
    result = radwalk.run(scene, paths=200_000, seed=5)
    z = (result.radiosity - 2.0 / (1.0 - 0.6)) / result.std_error
    assert np.mean(z**2) < 3.0
    assert np.allclose(radwalk.exact(scene).radiosity, 5.0, rtol=1e-9)


def test_values_come_in_many_forms():
    n = len(FACES)
    material = ["lamp" if i in (2, 3) else "wall" for i in range(n)]
    lamp = np.array([name == "lamp" for name in material])
    by_dict = radwalk.Scene(VERTICES, FACES, {"lamp": 0.1, "wall": 0.7}, {"lamp": 50.0}, material=material, sides=1)
    by_array = radwalk.Scene(VERTICES, FACES, np.where(lamp, 0.1, 0.7), np.where(lamp, 50.0, 0.0), sides=np.ones(n))
    one, other = (radwalk.run(scene, paths=20_000) for scene in (by_dict, by_array))
    assert one.radiosity.tobytes() == other.radiosity.tobytes()
    assert one.summary["scene_hash"] == other.summary["scene_hash"]
    grey = np.repeat(np.where(lamp, 0.1, 0.7)[:, None], 3, axis=1)
    coloured = grey * [1.0, 0.9, 0.8]
    result = radwalk.run(radwalk.Scene(VERTICES, FACES, coloured, {"a": (1, 2, 3)}, material=["a"] * n), paths=20_000)
    assert result.reflectance.tobytes() == np.repeat(coloured, 2, axis=0).tobytes(), "two sides of each face"
    assert result.emittance[0].tolist() == [1.0, 2.0, 3.0]


def test_what_cannot_be_a_scene_is_refused():
    scene = lambda **changes: radwalk.Scene(**{"vertices": VERTICES, "faces": FACES, **changes})
    for changes, error, words in [
        ({"faces": FACES + 1}, radwalk.Error, "mesh: face 2: there is no vertex 8 .there are 8 vertices"),
        ({"faces": FACES[:0]}, radwalk.Error, "mesh: there are no faces"),
        ({"vertices": VERTICES * np.nan}, radwalk.Error, "mesh: vertex 0: .* is no point"),
        ({"faces": FACES.astype(float)}, ValueError, "faces is of float64"),
        ({"vertices": VERTICES[:, :2]}, ValueError, r"vertices has the shape \(8, 2\)"),
        ({"reflectance": [0.1, 0.2]}, ValueError, r"reflectance has the shape \(2,\)"),
        ({"material": ["wall"]}, ValueError, r"material has the shape \(1,\)"),
        ({"reflectance": {"wal": 0.5}, "material": ["wall"] * 12}, ValueError, "names the material 'wal' .no face has it"),
        ({"reflectance": {}, "material": ["wall"] * 12}, ValueError, "lacks the material 'wall'"),
        ({"sides": 3}, radwalk.Error, "sides = 3"),
    ]:
        with pytest.raises(error, match=words):
            scene(**changes)
    with pytest.raises(radwalk.Error, match=r"reflectance.* is not below 1|reflectance.*1"):
        radwalk.run(scene(reflectance=1.0, emittance=1.0), paths=1)
    with pytest.raises(radwalk.Error, match="the scene is given already"):
        radwalk.run(scene(), scene="other.toml")


@pytest.mark.filterwarnings("ignore::radwalk.Doubt")
def test_trimesh(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.Trimesh(VERTICES, FACES, process=False)
    one = radwalk.run(radwalk.Scene.from_trimesh(box, 0.5, 1.0, sides=1), paths=10_000)
    assert one.radiosity.tobytes() == radwalk.run(radwalk.Scene(VERTICES, FACES, 0.5, 1.0, sides=1), paths=10_000).radiosity.tobytes()
    with pytest.raises(TypeError, match="from_trimesh"):
        radwalk.run(box)
    room = trimesh.Scene()
    room.add_geometry(box, geom_name="room")
    shift = np.eye(4)
    shift[:3, 3] = [0.25, 0.25, 0.9]
    lamp = trimesh.Trimesh([[0, 0, 0], [0, 0.5, 0], [0.5, 0, 0]], [[0, 1, 2]], process=False)
    room.add_geometry(lamp, geom_name="lamp", transform=shift)
    scene = radwalk.Scene.from_trimesh(room, {"room": 0.5, "lamp": 0.0}, {"lamp": 100.0})
    result = radwalk.run(scene, paths=20_000)
    emitting = result.emittance > 0.0
    assert emitting.sum() == 2 and np.allclose(result.centroid[emitting, 2], 0.9)
    mirrored = trimesh.Scene()
    mirrored.add_geometry(lamp, geom_name="lamp", transform=np.diag([1.0, 1.0, -1.0, 1.0]))
    assert radwalk.Scene.from_trimesh(mirrored, 0.5, 1.0).faces.tolist() == [[2, 1, 0]]
