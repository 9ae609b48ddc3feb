"""Interval volumes in ParaView: a reader of .ivm files, and a source for data sets of servers (ws://, wss://).

Load it by Tools, Manage Plugins, Load New; or name its folder in PV_PLUGIN_PATH before ParaView starts. It needs the
Python package intervale, which is installed with it.
"""

import inspect
import os
import sys
from pathlib import Path

if not hasattr(inspect, "getargspec"):  # ParaView 5.11 with Python 3.11
    inspect.getargspec = inspect.getfullargspec

from paraview.util.vtkAlgorithm import VTKPythonAlgorithmBase, smdomain, smproperty, smproxy  # noqa: E402
from vtkmodules.vtkCommonCore import vtkDataArraySelection  # noqa: E402
from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid  # noqa: E402

try:
    import intervale
except ImportError:  # this is PREFIX/share/intervale/paraview
    sys.path.append(str(Path(__file__).resolve().parents[3] / "lib" / "python3" / "dist-packages"))
    import intervale


class MeshSource(VTKPythonAlgorithmBase):
    """What the reader and the source have in common: the properties of a mesh, and its making."""

    def __init__(self):
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkUnstructuredGrid")
        self.data = None  # the DataSet or Stream, once it is known
        self.range = None
        self.request = {"error_percent": 1.0, "refine": None}
        self.region, self.uses_region = (0.0, 1.0, 0.0, 1.0, 0.0, 1.0), False
        self.channels = vtkDataArraySelection()
        self.channels.AddObserver("ModifiedEvent", lambda *_: self.Modified())

    def connect(self):
        """The data set, with its description."""
        raise NotImplementedError

    def mesh(self, range_of_values, request):
        """A mesh of it."""
        raise NotImplementedError

    def known(self):
        """The data set; the names of its channels are among the properties then."""
        if self.data is None:
            self.data = self.connect()
            for name in self.data.channels:
                self.channels.AddArray(name, False)
        return self.data

    def change(self, **values):
        """Attributes and parts of the request, from properties."""
        for name, value in values.items():
            target = self.__dict__ if name in self.__dict__ else self.request
            if target.get(name) != value:
                target[name] = value
                self.Modified()

    def RequestInformation(self, request, inputs, outputs):
        self.known()
        return 1

    def RequestData(self, request, inputs, outputs):
        data, wanted = self.known(), dict(self.request)
        if self.uses_region:
            wanted["roi"] = (self.region[0::2], self.region[1::2])
        wanted["channels"] = [name for name in data.channels if self.channels.ArrayIsEnabled(name)]
        shown = self.range
        if data.range is not None:
            shown = None  # the only one that it has
        elif shown is None:
            shown = (sum(data.values) / 2, data.values[1])
        vtkUnstructuredGrid.GetData(outputs, 0).ShallowCopy(self.mesh(shown, wanted).to_vtk())
        return 1

    @smproperty.doublevector(name="ValueRange", information_only="1")
    def GetValueRange(self):
        data = self.data
        return (0.0, 1.0) if data is None else tuple(data.values if data.range is None else data.range)

    @smproperty.xml("""
        <DoubleVectorProperty name="Range" label="Range" command="SetRange" number_of_elements="2" default_values="0 1">
          <DoubleRangeDomain name="range" default_mode="mid,max">
            <RequiredProperties><Property name="ValueRange" function="RangeInfo"/></RequiredProperties>
          </DoubleRangeDomain>
          <Documentation>The closed range of values. A data set that was built for one range shows that one.</Documentation>
        </DoubleVectorProperty>""")
    def SetRange(self, low, high):
        self.change(range=(low, high))

    @smproperty.doublevector(name="ErrorPercent", default_values=1.0)
    @smdomain.doublerange(min=0.0, max=100.0)
    def SetErrorPercent(self, percent):
        self.change(error_percent=percent)

    @smproperty.xml("""
        <IntVectorProperty name="RefineInside" command="SetRefineInside" number_of_elements="1" default_values="0">
          <BooleanDomain name="bool"/>
          <Documentation>Refines the inside of the range, too, and not its surfaces only.</Documentation>
        </IntVectorProperty>""")
    def SetRefineInside(self, inside):
        self.change(refine="uniform" if inside else None)

    @smproperty.xml("""
        <IntVectorProperty name="UseRegion" command="SetUseRegion" number_of_elements="1" default_values="0">
          <BooleanDomain name="bool"/>
          <Documentation>Refines within the region only.</Documentation>
        </IntVectorProperty>""")
    def SetUseRegion(self, uses):
        self.change(uses_region=bool(uses))

    @smproperty.doublevector(name="Region", default_values=[0.0, 1.0, 0.0, 1.0, 0.0, 1.0])
    def SetRegion(self, x0, x1, y0, y1, z0, z1):
        self.change(region=(x0, x1, y0, y1, z0, z1))

    @smproperty.dataarrayselection(name="Channels")
    def GetChannels(self):
        return self.channels


def with_mesh_properties(kind):
    """ParaView looks for properties in a class itself, and not in those that it inherits from."""
    for name, member in vars(MeshSource).items():
        if callable(member) and name.startswith(("Get", "Set")):
            setattr(kind, name, member)
    return kind


@smproxy.reader(name="IntervaleReader", label="Intervale data set", extensions="ivm", file_description="Intervale data sets")
@with_mesh_properties
class IntervaleReader(MeshSource):
    """Extracts a mesh from an .ivm file."""

    file = None

    @smproperty.stringvector(name="FileName")
    @smdomain.filelist()
    def SetFileName(self, name):
        if name and name != self.file:
            self.file, self.data = name, None
            self.Modified()

    def connect(self):
        return intervale.open(self.file)

    def mesh(self, range_of_values, request):
        return self.data.extract(range_of_values, **request)


@smproxy.source(name="IntervaleStream", label="Intervale stream")
@with_mesh_properties
class IntervaleStream(MeshSource):
    """Receives a mesh from a server. It stays connected: another range or error brings only what is missing."""

    url, stream = None, None

    @smproperty.stringvector(name="URL", default_values="ws://127.0.0.1:8080/NAME")
    def SetURL(self, url):
        if url != self.url:
            self.url, self.data = url, None
            self.Modified()

    def connect(self):
        # As coarsely as can be, for the description.
        options = {"error_percent": 100, "token": os.environ.get("INTERVALE_TOKEN")}
        try:
            return intervale.connect(self.url, **options)
        except ValueError:  # it has every range
            return intervale.connect(self.url, (float("-inf"), float("inf")), **options)

    def mesh(self, range_of_values, request):
        self.data.look(range=range_of_values, **request)
        return self.data.finish()
