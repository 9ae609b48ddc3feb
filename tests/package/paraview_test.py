"""The plugin for ParaView: paraview_test.py BUILD PLUGIN

With pvbatch on the PATH, ParaView itself draws a picture. Without it, what ParaView calls is called here: its own
decorators are replaced by such that do nothing.
"""

import importlib.util
import os
import shutil
import sys
import tempfile
import types
import unittest
from pathlib import Path

from support import run, serving

BUILD, PLUGIN = Path(sys.argv.pop(1)).resolve(), Path(sys.argv.pop(1)).resolve()
PROGRAM = BUILD / "bin" / "intervale"
sys.path.insert(0, str(BUILD / "python"))

SCRIPT = """
import inspect
inspect.getargspec = inspect.getfullargspec  # ParaView 5.11 with Python 3.11
from paraview.simple import *
LoadPlugin({plugin!r}, remote=False, ns=globals())
mesh = OpenDataFile({file!r})
mesh.Range = [0.2, 1]
mesh.ErrorPercent = 2
UpdatePipeline(proxy=mesh)
print("cells", mesh.GetDataInformation().GetNumberOfCells())
Show(mesh)
Render()
SaveScreenshot({picture!r})
"""


def plugin():
    """The plugin's module, with stand-ins of ParaView's decorators."""
    from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase

    class Nothing:
        def __getattr__(self, name):
            return lambda *_, **__: (lambda decorated: decorated)

    vtk_algorithm = types.ModuleType("paraview.util.vtkAlgorithm")
    vtk_algorithm.VTKPythonAlgorithmBase = VTKPythonAlgorithmBase
    vtk_algorithm.smproxy = vtk_algorithm.smproperty = vtk_algorithm.smdomain = Nothing()
    for name in ("paraview", "paraview.util"):
        sys.modules[name] = types.ModuleType(name)
    sys.modules["paraview.util.vtkAlgorithm"] = vtk_algorithm
    spec = importlib.util.spec_from_file_location("intervale_paraview", PLUGIN)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Plugin(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = Path(self.temporary.name)
        run(PROGRAM, "sample", "gyroid", "--size", 33, "-o", self.folder / "gyroid.nrrd")
        self.every, self.one = self.folder / "every.ivm", self.folder / "one.ivm"
        run(PROGRAM, "build", self.folder / "gyroid.nrrd", "-o", self.every, "--channel", f"again={self.folder / 'gyroid.nrrd'}")
        run(PROGRAM, "build", self.folder / "gyroid.nrrd", "-o", self.one, "--range", 0, 0.5)

    def tearDown(self):
        self.temporary.cleanup()

    def cells(self, source):
        source.Update()
        return source.GetOutputDataObject(0).GetNumberOfCells()

    @unittest.skipIf(shutil.which("pvbatch"), "ParaView itself is there")
    def test_reader_and_stream(self):
        import intervale

        module, every = plugin(), intervale.open(self.every)
        reader = module.IntervaleReader()
        reader.SetFileName(str(self.every))
        reader.SetErrorPercent(0)
        reader.SetRange(0.2, 1)
        self.assertEqual(self.cells(reader), len(every.extract((0.2, 1)).tets))
        self.assertEqual(reader.GetValueRange(), tuple(every.values))
        self.assertIsNone(reader.GetOutputDataObject(0).GetPointData().GetArray("again"))
        reader.GetChannels().EnableArray("again")
        self.cells(reader)
        self.assertIsNotNone(reader.GetOutputDataObject(0).GetPointData().GetArray("again"))
        reader.SetUseRegion(1)
        reader.SetRegion(-1, 0, -1, 0, -1, 0)
        self.assertLess(self.cells(reader), len(every.extract((0.2, 1)).tets))
        reader.SetFileName(str(self.one))
        reader.SetUseRegion(0)
        self.assertEqual(self.cells(reader), len(intervale.open(self.one).extract().tets))
        with serving(PROGRAM, self.every, self.one) as address:
            stream = module.IntervaleStream()
            stream.SetURL(f"ws://{address}/every")
            stream.SetErrorPercent(0)
            for low, high in ((0.2, 1), (-0.3, 0.1)):
                stream.SetRange(low, high)
                self.assertEqual(self.cells(stream), len(every.extract((low, high)).tets))
            stream.SetURL(f"ws://{address}/one")
            self.assertEqual(self.cells(stream), len(intervale.open(self.one).extract().tets))

    @unittest.skipUnless(shutil.which("pvbatch") and shutil.which("xvfb-run"), "ParaView is not there")
    def test_paraview_draws_it(self):
        script, picture = self.folder / "script.py", self.folder / "picture.png"
        script.write_text(SCRIPT.format(plugin=str(PLUGIN), file=str(self.every), picture=str(picture)), encoding="utf-8")
        # -noreset: a library of MPI's looks at the display before ParaView does. The server would begin anew when that is
        # gone, and now and then refuse ParaView meanwhile.
        out = run("xvfb-run", "-a", "-s", "-screen 0 1280x1024x24 -noreset", "pvbatch", script,
                  env={**os.environ, "PYTHONPATH": str(BUILD / "python"), "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"})
        self.assertRegex(out, r"cells [1-9]\d{3,}")
        self.assertGreater(picture.stat().st_size, 5000)


if __name__ == "__main__":
    unittest.main(verbosity=1)
