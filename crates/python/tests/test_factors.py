"""View factors: those of the program, of every kind of mesh, in matrices that scipy makes sums and products of."""

import numpy as np
import pytest

import radwalk
from conftest import CONFIGS, FACES, VERTICES

sparse = pytest.importorskip("scipy.sparse")


def test_the_matrix_is_that_of_the_program(tmp_path, binary):
    job = CONFIGS / "cube54.toml"
    found = radwalk.factors(job, rays=2000, seed=5, progress=False)
    binary("factors", job, "--sparse", "--rays", 2000, "--seed", 5, "--quiet", "--export", "npz,mtx", "--out", tmp_path / "out")
    npz = sparse.load_npz(tmp_path / "out" / "factors.npz")
    assert found.shape == npz.shape == (54, 56) and (abs(found - npz)).nnz == 0
    from scipy.io import mmread

    assert (abs(found - sparse.csr_array(mmread(tmp_path / "out" / "factors.mtx")))).nnz == 0
    with np.load(tmp_path / "out" / "factors.npz") as arrays:
        assert list(arrays["extra"]) == ["back", "escape"] and arrays["count"].sum() == 54 * 2000
        assert np.allclose(arrays["count"] / 2000, arrays["data"], rtol=0, atol=2.0**-51)


def test_netcdf_is_read_as_udales_reads_it(tmp_path, binary):
    io = pytest.importorskip("scipy.io")
    words = ("--sparse", "--rays", 500, "--quiet", "--export", "npz,udales-netcdf")
    binary("factors", CONFIGS / "cube54.toml", *words, "--out", tmp_path / "out")
    factors = sparse.load_npz(tmp_path / "out" / "factors.npz").toarray()[:, :54].astype(np.float32)
    with io.netcdf_file(tmp_path / "out" / "vf.nc.inp", mmap=False) as file:
        # Fortran counts the last dimension first: its vf(i, j) is that of C at [j][i].
        assert file.variables["view factor"].dimensions == ("columns", "rows")
        assert (file.variables["view factor"][:].T == factors).all()


def test_streets_repeat():
    # An endless canyon, 2 m wide and 3 m high, with a roof of 1 m: the ground sees the sky by crossed strings.
    corners = [(0, 0, 0), (2, 0, 0), (2, 1.5, 0), (0, 1.5, 0), (0, 0, 3), (0, 1.5, 3), (2, 0, 3), (2, 1.5, 3), (3, 0, 3), (3, 1.5, 3)]
    quads = [(0, 1, 2, 3), (0, 3, 5, 4), (1, 6, 7, 2), (6, 8, 9, 7)]
    faces = [(q[0], q[i], q[i + 1]) for q in quads for i in (1, 2)]
    factors = radwalk.factors((np.array(corners, float), np.array(faces)), rays=20_000, periodic=(3.0, 1.5), progress=False).toarray()
    assert np.abs(factors.sum(axis=1) - 1.0).max() < 1e-15
    sky = np.sqrt(1.0 + 1.5**2) - 1.5
    # Both triangles together, within six standard errors.
    assert abs(factors[:2, 9].mean() - sky) < 6.0 * np.sqrt(sky * (1.0 - sky) / 40_000)
    assert (factors[6:, 9] == 1.0).all() and factors[:, 8].sum() == 0.0


def test_rows_add_up_and_are_reciprocal():
    factors, low, high = radwalk.factors((VERTICES, FACES), rays=4096, intervals=True, threads=2, progress=False)
    assert np.abs(factors.sum(axis=1) - 1.0).max() == 0.0
    square = factors[:, :12].toarray()
    # Triangles of one area in a closed cube: pairs differ by less than six standard errors.
    assert np.abs(square - square.T).max() < 6.0 * np.sqrt(2.0 * 0.25 / 4096)
    assert (low.data <= factors.data).all() and (factors.data <= high.data).all()
    # The floor's two triangles see the ceiling by 0.19982 (Howell, C-11).
    opposed = square[:2, 2:4].sum(axis=1).mean()
    assert abs(opposed - 0.199_825) < 6.0 * np.sqrt(0.16 / 8192)


def test_smooth_factors_are_reciprocal():
    smooth = radwalk.factors((VERTICES, FACES), rays=4096, smooth=True, threads=2, progress=False)
    assert np.abs(smooth.sum(axis=1) - 1.0).max() < 1e-12
    square = smooth[:, :12].toarray()
    # Triangles of one area.
    assert np.abs(square - square.T).max() < 1e-15
    with pytest.raises(ValueError, match="leave out smooth"):
        radwalk.factors((VERTICES, FACES), smooth=True, drop=0.1)


def test_every_mesh_is_taken(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    meshio = pytest.importorskip("meshio")
    arrays = radwalk.factors((VERTICES, FACES), rays=500, progress=False)
    mesh = trimesh.Trimesh(VERTICES, FACES, process=False)
    mesh.export(tmp_path / "cube.stl")
    for other in (mesh, meshio.Mesh(VERTICES, [("triangle", FACES)]), radwalk.Scene(VERTICES, FACES, 0.0, sides=1)):
        assert (abs(radwalk.factors(other, rays=500, progress=False) - arrays)).nnz == 0
    file = radwalk.factors(tmp_path / "cube.stl", rays=500, progress=False, **{"import.sides": 1})
    assert file.shape == arrays.shape
    quads = meshio.Mesh(VERTICES, [("quad", np.array([[0, 1, 3, 2]]))])
    assert radwalk.factors(quads, rays=100, sky=145, progress=False).shape == (2, 2 + 2 + 145)


def test_heed_is_paid_to_what_python_asks():
    seen = []
    radwalk.factors((VERTICES, FACES), rays=2_000_000, progress=seen.append)
    assert seen and all(0.0 <= stage.paths / stage.paths_total <= 1.0 for stage in seen)

    def stop(_):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        radwalk.factors((VERTICES, FACES), rays=50_000_000, progress=stop)
    with pytest.raises(radwalk.Error):
        radwalk.factors((VERTICES, FACES + 10), rays=10)
