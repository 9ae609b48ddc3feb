#!/usr/bin/python3
"""Times what one would do without interval volumes: VTK's two chained vtkTableBasedClipDataSet, which is ParaView's IsoVolume.

For each CASE (a volume and a range) on one thread, in turn:
  image  VTK clips the samples as vtkImageData, voxel by voxel;
  LEB    VTK clips the tetrahedra of our full refinement that the interval meets, as vtkUnstructuredGrid: what our mesh is made from;
  ours   the full mesh from the interval volume (.ivm): error 0, to an indexed mesh.
What VTK's clip makes is no tetrahedral mesh: wedges, pyramids and hexahedra are among its cells. So each is shown twice: as it is, its cells also counted
as the tetrahedra that they would be (a wedge 3, a hexahedron or a voxel 5, a pyramid 2), and made into tetrahedra by vtkDataSetTriangleFilter, which is
ParaView's Tetrahedralize.

Wants Debian's python3-vtk9 and python3-numpy, which deploy/install does not install, and bench_leb of a release build.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

os.environ["VTK_SMP_BACKEND_IN_USE"] = "Sequential"  # the clip is of one thread anyway; nothing beside it may use more

try:
    import numpy as np
    from vtkmodules.util import numpy_support
    from vtkmodules.vtkCommonCore import vtkPoints, vtkVersion
    from vtkmodules.vtkCommonDataModel import (VTK_HEXAHEDRON, VTK_PYRAMID, VTK_TETRA, VTK_VOXEL, VTK_WEDGE, vtkCellArray,
                                               vtkImageData, vtkUnstructuredGrid)
    from vtkmodules.vtkFiltersGeneral import vtkDataSetTriangleFilter, vtkTableBasedClipDataSet
    from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
except ImportError as missing:
    sys.exit(f"vtk_clip.py: {missing}; install python3-vtk9 and python3-numpy, and run this with /usr/bin/python3")

TETS_IN = {VTK_TETRA: 1, VTK_PYRAMID: 2, VTK_WEDGE: 3, VTK_HEXAHEDRON: 5, VTK_VOXEL: 5}
NAMES = {VTK_TETRA: "tets", VTK_PYRAMID: "pyramids", VTK_WEDGE: "wedges", VTK_HEXAHEDRON: "hexahedra", VTK_VOXEL: "voxels"}


def image_of(case, samples):
    image = vtkImageData()
    image.SetDimensions(case["dims"])
    image.GetPointData().SetScalars(samples)
    return image


def leb_tets_of(case, folder, samples):
    """The tetrahedra in sample units, values at their points."""
    points = np.fromfile(folder / "points.i32", np.int32).reshape(-1, 3)
    tets = np.fromfile(folder / "tets.u32", np.uint32).reshape(-1, 4).astype(np.int64)
    nx, ny, _ = case["dims"]
    values = samples[points[:, 0] + nx * (points[:, 1] + ny * points[:, 2].astype(np.int64))]
    corners = points[tets].astype(np.float64)
    edges = corners[:, 1:] - corners[:, :1]
    negative = np.linalg.det(edges) < 0
    tets[negative] = tets[negative][:, [0, 1, 3, 2]]
    cells = vtkCellArray()
    cells.SetData(4, numpy_support.numpy_to_vtkIdTypeArray(tets.ravel(), deep=True))
    vtk_points = vtkPoints()
    vtk_points.SetData(numpy_support.numpy_to_vtk(points.astype(np.float32), deep=True))
    grid = vtkUnstructuredGrid()
    grid.SetPoints(vtk_points)
    grid.SetCells(VTK_TETRA, cells)
    grid.GetPointData().SetScalars(numpy_support.numpy_to_vtk(values, deep=True))
    return grid


def clip(data, low, high, to_tets):
    """Seconds, and the part of the data whose values are within low and high. No clip where a bound is infinite."""
    filters = []
    for bound, keep_below in ((low, False), (high, True)):
        if np.isinf(bound):
            continue
        step = vtkTableBasedClipDataSet()
        if filters:
            step.SetInputConnection(filters[-1].GetOutputPort())
        else:
            step.SetInputData(data)
        step.SetInsideOut(keep_below)
        step.SetUseValueAsOffset(False)
        step.SetValue(bound)
        filters.append(step)
    if to_tets:
        step = vtkDataSetTriangleFilter()
        step.SetInputConnection(filters[-1].GetOutputPort())
        step.TetrahedraOnlyOn()
        filters.append(step)
    start = time.perf_counter()
    filters[-1].Update()
    return time.perf_counter() - start, filters[-1].GetOutput()


def volume_of(grid):
    sizes = vtkCellSizeFilter()
    sizes.SetInputData(grid)
    sizes.SetComputeVertexCount(False)
    sizes.SetComputeLength(False)
    sizes.SetComputeArea(False)
    sizes.Update()
    return float(numpy_support.vtk_to_numpy(sizes.GetOutput().GetCellData().GetArray("Volume")).sum())


def count_of(grid):
    kinds, numbers = np.unique(numpy_support.vtk_to_numpy(grid.GetCellTypesArray()), return_counts=True)
    unknown = set(kinds) - set(TETS_IN)
    if unknown:
        sys.exit(f"vtk_clip.py: VTK made cells of type {unknown}, which nobody counted on")
    cells = dict(zip((int(k) for k in kinds), (int(n) for n in numbers)))
    return sum(cells.values()), sum(TETS_IN[k] * n for k, n in cells.items()), ", ".join(f"{n:,} {NAMES[k]}" for k, n in cells.items())


def run_json(*command):
    done = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(f"vtk_clip.py: {command[0]} failed")
    return json.loads(done.stdout)


def measure(bench_leb, text, runs, folder):
    """The rows of one case, and how many times as many tetrahedra a second ours makes as each of VTK's ways."""
    case = run_json(bench_leb, "prepare", text, folder)
    low, high = (float(bound) for bound in case["range"])
    samples = np.fromfile(folder / case["samples"], np.float32 if case["samples"].endswith("f32") else np.float64)
    inputs = {"image": image_of(case, numpy_support.numpy_to_vtk(samples, deep=True)), "LEB": leb_tets_of(case, folder, samples)}
    ways = [(name, to_tets) for name in inputs for to_tets in (False, True)]
    times = {way: [] for way in ways}
    ours_times = []
    results = {}
    for _ in range(runs):
        for name, to_tets in ways:
            results.pop((name, to_tets), None)  # its memory is not given back within the next one's time
            seconds, results[name, to_tets] = clip(inputs[name], low, high, to_tets)
            times[name, to_tets].append(seconds)
        ours = run_json(bench_leb, "extract", folder / "volume.ivm")
        ours_times.append(ours["seconds"])
    ours_volume = ours["volume"] / float(np.prod(case["spacing"]))  # VTK's is in sample units
    ours_seconds = statistics.median(ours_times)
    ours_speed = ours["tets"] / ours_seconds
    rows, ratios = [], {}
    for name, to_tets in ways:
        seconds = statistics.median(times[name, to_tets])
        cells, tets, kinds = count_of(results[name, to_tets])
        volume = volume_of(results[name, to_tets])
        off = 100 * (volume / ours_volume - 1) if ours_volume > 0 else 0
        ratios[name, to_tets] = ours_speed / (tets / seconds)
        title = ("VTK: image" if name == "image" else f"VTK: {case['leb_tets']:,} LEB tetrahedra") + (", to tetrahedra" if to_tets else "")
        rows.append((case["title"], title, f"{1e3 * seconds:.0f}", kinds, f"{tets:,}", f"{cells / seconds / 1e6:.2f}", f"{tets / seconds / 1e6:.2f}",
                     f"{seconds / ours_seconds:.1f}", f"{ratios[name, to_tets]:.1f}", f"{off:+.2f} %"))
        if name == "LEB" and abs(off) > 2:
            print(f"vtk_clip.py: {case['title']}: VTK's volume is {off:+.1f} % off ours", file=sys.stderr)
    speed = f"{ours_speed / 1e6:.2f}"
    rows.append((case["title"], "ours", f"{1e3 * ours_seconds:.0f}", "tetrahedra", f"{ours['tets']:,}", speed, speed, "", "", ""))
    return rows, ratios


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", metavar="CASE", nargs="+", help="PATH,LO,HI and more: see bench_leb prepare --help")
    parser.add_argument("--bench-leb", default="build/release/bin/bench_leb", type=pathlib.Path, metavar="PROGRAM", help="default: %(default)s")
    parser.add_argument("--runs", default=5, type=int, help="of which the medians are shown; default: %(default)s")
    options = parser.parse_args()
    if options.runs < 1:
        parser.error("--runs: at least 1")
    print(f"VTK {vtkVersion.GetVTKVersion()} with one thread; Intervale on one core; medians of {options.runs} interleaved runs.\n")
    print("| volume, range | | ms | cells | as tetrahedra | M cells/s | M tetrahedra/s | time of VTK / ours | our tetrahedra/s / VTK's | VTK's volume |")
    print("|---|---|--:|--:|--:|--:|--:|--:|--:|--:|")
    all_ratios = []
    for text in options.cases:
        with tempfile.TemporaryDirectory() as folder:
            rows, ratios = measure(options.bench_leb, text, options.runs, pathlib.Path(folder))
        all_ratios.append(ratios)
        for row in rows:
            print("| " + " | ".join(row) + " |", flush=True)
    print("\nAs tetrahedra: a wedge counts 3, a hexahedron or voxel 5, a pyramid 2. Volume: relative to ours; in an image VTK\ninterpolates differently.")
    for to_tets, what in ((True, "converted to tetrahedra"), (False, "with mixed cells")):
        of_leb = [ratios["LEB", to_tets] for ratios in all_ratios]
        print(f"\nTetrahedra a second, ours over VTK's two clips of the same LEB tetrahedra, {what}: {min(of_leb):.1f} to {max(of_leb):.1f}.")


if __name__ == "__main__":
    main()
