"""The Python package: python_test.py BUILD SOURCES

BUILD/python has the package; SOURCES is the top folder. The test takes what the programs make for right.
"""

import ast
import asyncio
import os
import subprocess
import sys
import tempfile
import threading
import time
import types
import unittest
from pathlib import Path

import numpy as np

from support import digest_in, run

BUILD, SOURCES = Path(sys.argv.pop(1)).resolve(), Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(BUILD / "python"))
import intervale  # noqa: E402

PROGRAM = BUILD / "bin" / "intervale"
os.environ["INTERVALE_PROGRAM"] = str(PROGRAM)
TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"]


def ball(side=33, dtype="f4"):
    """The distance from the middle, z, y, x; longer along z."""
    z, y, x = np.mgrid[:side, : side - 4, : side - 6].astype(float)
    return np.sqrt((x - 12) ** 2 + (y - 14) ** 2 + (z - 16) ** 2).astype(dtype)


class Package(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = Path(self.temporary.name)

    def tearDown(self):
        self.temporary.cleanup()


class Volumes(Package):
    def test_every_type_and_order_of_axes(self):
        for kind in TYPES:
            array = ball(dtype=kind)
            for axes in ("zyx", "xyz", "yxz"):
                given = array.transpose(["zyx".index(axis) for axis in axes])
                for swapped in (given, given.astype(given.dtype.newbyteorder())):
                    volume = intervale.Volume(swapped, axes=axes, spacing=(1, 2, 3), origin=(4, 5, 6))
                    np.testing.assert_array_equal(volume.array, array)
                    self.assertEqual(volume.spacing, (1, 2, 3))
                    self.assertEqual(volume.origin, (4, 5, 6))
            np.save(self.folder / "array.npy", array)
            read = intervale.read(self.folder / "array.npy")
            np.testing.assert_array_equal(read.array, array)
            self.assertEqual(read.array.dtype, array.dtype)

    def test_arrays_are_views(self):
        array = ball()
        self.assertTrue(np.shares_memory(intervale.Volume(array).array, array))
        mesh = intervale.build(array, (3, 9)).extract()
        points = mesh.points
        self.assertFalse(points.flags.owndata or points.flags.writeable)
        before = points.copy()
        del mesh
        np.testing.assert_array_equal(points, before)

    def test_images_of_other_packages(self):
        array = ball()
        expected = intervale.Volume(array, spacing=(1, 2, 3), origin=(4, 5, 6))
        from vtkmodules.util.numpy_support import numpy_to_vtk
        from vtkmodules.vtkCommonDataModel import vtkImageData

        vtk = vtkImageData()
        vtk.SetDimensions(*reversed(array.shape))
        vtk.SetSpacing(1, 2, 3)
        vtk.SetOrigin(4, 5, 6)
        vtk.GetPointData().SetScalars(numpy_to_vtk(array.ravel(), deep=True))
        affine = np.vstack([expected.affine, [0, 0, 0, 1]])
        nibabel = types.SimpleNamespace(dataobj=array.transpose(2, 1, 0), affine=affine)
        places = {name: first + step * np.arange(n) for name, first, step, n in
                  zip("zyx", (6, 5, 4), (3, 2, 1), array.shape)}
        xarray = types.SimpleNamespace(dims=("z", "y", "x"), coords=places, values=array, name="far", attrs={"units": "HU"})
        sitk = types.SimpleNamespace(GetDirection=lambda: np.eye(3).ravel(), GetSpacing=lambda: (1, 2, 3),
                                     GetOrigin=lambda: (4, 5, 6), GetPixelIDValue=lambda: 8)
        sys.modules["SimpleITK"] = types.SimpleNamespace(GetArrayViewFromImage=lambda image: array)
        for image in (vtk, nibabel, xarray, sitk):
            volume = intervale.Volume.wrap(image)
            np.testing.assert_array_equal(volume.array, array)
            np.testing.assert_allclose(volume.affine, expected.affine)
        self.assertEqual(intervale.Volume.wrap(xarray).field_unit, "HU")
        self.assertEqual([intervale.Volume.wrap(image).space for image in (vtk, nibabel, xarray, sitk)], ["", "RAS", "", "LPS"])
        self.assertEqual(intervale.Volume.wrap(nibabel, space="LPS").space, "LPS")
        self.assertEqual(intervale.Volume.wrap(nibabel, affine=np.eye(4)).space, "")
        places["z"] = places["z"] ** 2
        self.assertRaises(ValueError, intervale.Volume.wrap, xarray)

    def test_wrong_volumes(self):
        for wrong in (np.zeros((3, 3)), np.zeros((5, 5, 5), np.int64), np.zeros((5, 5, 5), complex), np.zeros((1, 5, 5)),
                      np.full((5, 5, 5), np.nan), np.zeros((5, 5, 5, 3)), np.zeros((5, 5, 5, 2))):
            self.assertRaises(ValueError, intervale.build, wrong)
        self.assertRaises(ValueError, intervale.Volume, ball(), affine=np.eye(4), spacing=(1, 1, 1))
        self.assertRaises(ValueError, intervale.Volume, ball(), axes="zzz")
        self.assertRaises(ValueError, intervale.build, intervale.Volume(ball(), spacing=(0, 1, 1)))
        (self.folder / "bad.nrrd").write_bytes(b"NRRD0004\ntype: what\n")
        self.assertRaises(intervale.FormatError, intervale.read, self.folder / "bad.nrrd")


    def test_a_box_of_a_file(self):
        volume = intervale.Volume(ball(), spacing=(1, 2, 3), origin=(4, 5, 6))
        path = self.write_nrrd(ball(), "left-posterior-superior")
        part = intervale.read(path, crop=((2, 20), (0, 28), (7, 8)))
        np.testing.assert_array_equal(part.array, volume.array[7:9, 0:29, 2:21])
        self.assertEqual(part.spacing, (1, 2, 3))
        self.assertEqual(part.origin, (6, 5, 27))
        whole = intervale.read(path, crop=np.array([[0, 26], [0, 28], [0, 32]]))
        np.testing.assert_array_equal(whole.array, volume.array)
        for wrong in (((0, 27), (0, 28), (0, 32)), ((-1, 9), (0, 28), (0, 32)), ((5, 4), (0, 28), (0, 32)),
                      ((5, 5), (0, 28), (0, 32)), ((0, 9), (0, 9)), ((0, 9), (0, 9), (0, 9, 9))):
            self.assertRaises(ValueError, intervale.read, path, crop=wrong)
        self.assertRaises(TypeError, intervale.read, path, crop=((0, 9.5), (0, 9), (0, 9)))
        self.assertRaises(TypeError, intervale.read, path, crop=9)

    def test_where_the_axes_point_to(self):
        path = self.write_nrrd(ball(), "left-posterior-superior")
        self.assertEqual(intervale.read(path).space, "LPS")
        self.assertEqual(intervale.read(path, crop=((0, 9), (0, 9), (0, 9))).space, "LPS")
        data_set = intervale.build(path)
        data_set.save(self.folder / "ball.ivm")
        self.assertEqual([data_set.space, intervale.open(self.folder / "ball.ivm").space], ["LPS", "LPS"])
        self.assertEqual(intervale.build(intervale.Volume(ball(), space="RAS")).space, "RAS")
        self.assertEqual(intervale.build(ball()).space, "")
        self.assertRaises(ValueError, intervale.build, intervale.Volume(ball(), space="x" * 65))

    def test_what_is_not_there(self):
        np.save(self.folder / "ball.npy", ball())
        for call in (intervale.read, intervale.build):
            for name in ("none.npy", "none.h5:/array", "none.zarr:/0/1", "none/ball.npy"):
                for path in (self.folder / name, str(self.folder / name)):
                    with self.assertRaises(FileNotFoundError) as caught:
                        call(path)
                    self.assertEqual(str(caught.exception.filename), str(path).split(":")[0])
        self.assertRaises(FileNotFoundError, intervale.read, self.folder / "none.h5", "/array")
        self.assertRaises(FileNotFoundError, intervale.build, ball(), channels={"flow": self.folder / "none.npy"})
        self.assertRaises(ValueError, intervale.read, f"{self.folder}/ball.npy:/array")

    def write_nrrd(self, array, space):
        """At spacing 1, 2, 3 from 4, 5, 6."""
        path = self.folder / "ball.nrrd"
        sizes = " ".join(map(str, reversed(array.shape)))
        header = ("NRRD0004", "type: float", "dimension: 3", f"space: {space}", f"sizes: {sizes}",
                  "space directions: (1,0,0) (0,2,0) (0,0,3)", "space origin: (4,5,6)", "endian: little", "encoding: raw")
        path.write_bytes("\n".join(header).encode() + b"\n\n" + array.astype("<f4").tobytes())
        return path


class DataSets(Package):
    def test_the_same_as_the_programs(self):
        array = ball()
        np.save(self.folder / "ball.npy", array)
        every = intervale.build(intervale.Volume(array, name="ball"))
        every.save(self.folder / "python.ivm")
        run(PROGRAM, "build", self.folder / "ball.npy", "-o", self.folder / "program.ivm")
        self.assertEqual((self.folder / "python.ivm").read_bytes(), (self.folder / "program.ivm").read_bytes())
        for error in (0, 5):
            text = run(PROGRAM, "extract", self.folder / "program.ivm", "--range", 3, 9, "--error-percent", error, "--digest")
            for data_set in (every, intervale.open(self.folder / "program.ivm"),
                             intervale.decode((self.folder / "program.ivm").read_bytes())):
                mesh = data_set.extract((3, 9), error_percent=error)
                self.assertEqual(mesh.digest, digest_in(text))
        self.assertAlmostEqual(every.enclosed_volume(3, 9), every.extract((3, 9)).volume, delta=20)
        counts, edges = every.histogram()
        self.assertEqual(counts.sum(), array.size)
        self.assertEqual(len(edges), len(counts) + 1)

    def test_a_path_is_what_is_read_there(self):
        path, flow = self.folder / "ball.npy", self.folder / "flow.npy"
        np.save(path, ball())
        np.save(flow, 2 * ball())

        def saved(*arguments, **more):
            intervale.build(*arguments, **more).save(self.folder / "built.ivm")
            return (self.folder / "built.ivm").read_bytes()

        expected = saved(intervale.read(path), (3, 9), channels={"flow": intervale.read(flow)})
        for given in (path, str(path)):
            self.assertEqual(saved(given, range=(3, 9), channels={"flow": type(given)(flow)}), expected)
        (self.folder / "bad.nrrd").write_bytes(b"NRRD0004\ntype: what\n")
        self.assertRaises(intervale.FormatError, intervale.build, self.folder / "bad.nrrd")
        for wrong in (path, str(path)):
            for take in (intervale.Volume.wrap, intervale.Volume):
                with self.assertRaisesRegex(TypeError, r"ball\.npy' is no array or image: intervale\.read\(\) reads files"):
                    take(wrong)

    def test_meshes_as_those_of_other_packages(self):
        flow = np.stack([ball(), 2 * ball(), -ball()], axis=3)
        mesh = intervale.build(ball(), channels={"flow": flow}).extract([(3, 5), (7, 9)], channels=["flow"])
        self.assertEqual(set(mesh.part), {0, 1})
        np.testing.assert_allclose(mesh.channels["flow"][:, 1], 2 * mesh.channels["flow"][:, 0], atol=0.1)
        a, b, c, d = (mesh.points[mesh.tets[:, i]] for i in range(4))
        volumes = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6
        self.assertTrue((volumes > 0).all())
        self.assertAlmostEqual(volumes.sum(), mesh.volume, places=6)
        grid = mesh.to_vtk()
        self.assertEqual((grid.GetNumberOfPoints(), grid.GetNumberOfCells()), (len(mesh.points), len(mesh.tets)))
        self.assertEqual(grid.GetPointData().GetArray("flow").GetNumberOfComponents(), 3)
        other = mesh.to_meshio()
        np.testing.assert_array_equal(other.cells_dict["tetra"], mesh.tets)
        surface = mesh.boundary()
        a, b, c = (surface.points[surface.triangles[:, i]] for i in range(3))
        self.assertAlmostEqual(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6, mesh.volume, places=6)
        np.testing.assert_array_equal(mesh.points[surface.indices], surface.points)
        mesh.save(self.folder / "mesh.vtu")
        self.assertRaises(ValueError, mesh.save, self.folder / "mesh.unknown")
        self.assertRaises(OSError, mesh.save, self.folder / "none" / "mesh.vtu")

    def test_what_there_is_not(self):
        every = intervale.build(ball())
        for wrong in ({}, {"range": (2, 1)}, {"range": [(0, 1)] * 5}, {"range": (0, 1), "channels": ["none"]},
                      {"range": (0, 1), "error": -1}, {"range": (0, 1), "refine": "all"}, {"range": (float("nan"), 1)}):
            self.assertRaises(ValueError, every.extract, **wrong)
        self.assertRaises(TypeError, every.extract, (0, 1), errors=3)
        self.assertRaises(FileNotFoundError, intervale.open, self.folder / "none.ivm")
        self.assertRaises(intervale.FormatError, intervale.decode, b"nothing")
        self.assertRaises(ValueError, intervale.build, ball(), (2, 1))
        self.assertRaises(ValueError, intervale.build, ball(), threads=-1)
        self.assertRaises(ValueError, every.enclosed_volume, 1, 0)
        for wrong in ((1, 2, 3), "ab", 5, [(0, 1), 2]):
            self.assertRaisesRegex(ValueError, r"^a range is \(low, high\), not ", every.extract, wrong)
        for wrong in ({"max_tets": -1}, {"max_updates": -1}, {"error": 1, "error_percent": 1}):
            self.assertRaises(ValueError, every.extract, (0, 1), **wrong)

    def test_other_threads_run_meanwhile(self):
        ticks, fractions, stop = [], [], threading.Event()

        def tick():
            while not stop.is_set():
                ticks.append(time.monotonic())
                time.sleep(0.001)

        ticker = threading.Thread(target=tick)
        ticker.start()
        begin = time.monotonic()
        data_set = intervale.build(np.random.default_rng(1).random((90, 90, 90)), progress=fractions.append)
        data_set.extract((0.2, 0.4))
        end = time.monotonic()
        stop.set()
        ticker.join()
        self.assertGreater(len(fractions), 1)
        self.assertLess(max(np.diff([begin, *ticks, end])), 0.5 * (end - begin))

        def fail(_):
            raise KeyError("stop")

        self.assertRaises(KeyError, intervale.build, ball(65), progress=fail)


class Streams(Package):
    def test_coarse_to_fine_and_other_ranges(self):
        every = intervale.build(intervale.Volume(ball(65), name="the ball", space="RAS"))
        with intervale.serve(every) as server:
            self.assertIn(server.url, server._repr_html_())
            (listed,) = intervale.data_sets(server.address)
            url = f"{server.address}/{listed['name']}"
            with intervale.connect(url, (3, 9)) as stream:
                self.assertEqual((stream.dims, stream.space), (every.dims, "RAS"))
                updates = [state.updates for state in stream]
                self.assertEqual(updates, sorted(updates))
                self.assertEqual(stream.mesh.digest, every.extract((3, 9)).digest)
                stream.set_range(5, 12)
                self.assertEqual(stream.finish().digest, every.extract((5, 12)).digest)
                self.assertRaises(ValueError, stream.set_range, 2, 1)

                async def finest():
                    stream.look(error_percent=1)
                    async for state in stream:
                        mesh = state.mesh
                    return mesh

                self.assertEqual(asyncio.run(finest()).tets.shape[1], 4)
                self.assertIsNone(stream.wait(0.01))
            self.assertRaises(ValueError, stream.wait, 1)
            self.assertEqual(intervale.fetch(url, (3, 9), error_percent=5).digest, every.extract((3, 9), error_percent=5).digest)
            self.assertRaises(ConnectionError, intervale.connect, f"{server.address}/none", (0, 1))
            self.assertRaises(ValueError, intervale.connect, url)
            stream = intervale.connect(url, (3, 9), reconnect=0)
            stream.finish()
        with self.assertRaises(ConnectionError):
            stream.wait()
        self.assertRaises(ConnectionError, intervale.data_sets, server.address)
        self.assertRaises(ValueError, intervale.connect, "http://x", (0, 1))
        self.assertRaises(OSError, intervale.serve, self.folder / "none.ivm")


class Distribution(Package):
    def test_types(self):
        """mypy accepts a typed program, and the stub names what there is."""
        stub = BUILD / "python" / "intervale" / "__init__.pyi"
        for node in ast.parse(stub.read_text(encoding="utf-8")).body:
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not node.name.startswith("_"):
                self.assertTrue(getattr(intervale, node.name).__doc__ or node.name in ("Camera", "Mesh", "MeshState"), node.name)
                for member in getattr(node, "body", []) if isinstance(node, ast.ClassDef) else []:
                    if isinstance(member, ast.FunctionDef):
                        self.assertTrue(hasattr(getattr(intervale, node.name), member.name), f"{node.name}.{member.name}")
        try:
            import mypy  # noqa: F401
        except ImportError:
            self.skipTest("mypy is missing")
        run(sys.executable, "-m", "mypy", "--strict", "--cache-dir", self.folder, Path(__file__).with_name("typed_use.py"),
            env={**os.environ, "MYPYPATH": str(BUILD / "python")})

    def test_the_wheel_works_elsewhere(self):
        try:
            import build  # noqa: F401
        except ImportError:
            self.skipTest("python3-build is missing")
        sources = self.folder / "sources" / "client" / "python"
        sources.parent.mkdir(parents=True)
        (sources.parents[1] / "CMakeLists.txt").write_bytes((SOURCES / "CMakeLists.txt").read_bytes())
        run("cp", "-r", SOURCES / "client" / "python", sources)
        run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", self.folder, sources,
            env={**os.environ, "INTERVALE_BUILD": str(BUILD)})
        (wheel,) = self.folder.glob("intervale-*.whl")
        run(sys.executable, "-m", "zipfile", "-e", wheel, self.folder / "site")
        for program in (self.folder / "site" / "intervale" / "libexec" / "intervale").glob("*"):
            program.chmod(0o755)  # as pip does
        text = ("import intervale; v = intervale.sample('gyroid', 20); m = intervale.build(v).extract((0, 1)); "
                "print(intervale.__file__, len(m.tets))")
        out = subprocess.run([sys.executable, "-c", text], cwd=self.folder, env={"PYTHONPATH": str(self.folder / "site")},
                             capture_output=True, text=True, check=True).stdout.split()
        self.assertTrue(out[0].startswith(str(self.folder)))
        self.assertGreater(int(out[1]), 100)


if __name__ == "__main__":
    unittest.main(verbosity=1)
