// Our side of vtk_clip.py: what VTK is to clip, written to files, and our extraction, timed.
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/ivm/extraction.h"
#include "common/ivm/ivm_file.h"
#include "common/mesh/io/mesh_writer.h"
#include "common/patch/visit_samples.h"
#include "common/program/program.h"
#include "server/builder/field_hierarchy.h"
#include "tests/bench/cases.h"
#include "tests/bench/timing.h"

namespace intervale::bench {
namespace {

struct LebTets {
  std::vector<Vertex> points;  // samples
  std::vector<std::array<std::uint32_t, 4>> tets;
};

// The leaves of the full mesh that the interval meets: the halves that split diamonds leave to children that are never
// split. Those wholly inside too, which are as large as the mesh has them.
LebTets leaves_of(const FieldHierarchy& hierarchy) {
  const Domain& domain = hierarchy.domain();
  const SupercubeSet& set = hierarchy.set();
  const Vertex last = domain.last();
  constexpr auto kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number((std::size_t(last.x) + 1) * (std::size_t(last.y) + 1) * (std::size_t(last.z) + 1), kNone);
  LebTets leaves;
  const auto add = [&](const Diamond& d, const std::array<std::uint8_t, 4>& local) {
    const auto positions = domain.positions(d, local);
    unsigned sides = 0;
    for (const Vertex p : positions) sides |= 1u << unsigned(hierarchy.side(p));
    constexpr unsigned kBelow = 1, kAbove = 4;
    if (sides == kBelow || sides == kAbove || !Domain::exists(positions)) return;
    std::array<std::uint32_t, 4> tet;
    for (int i = 0; i < 4; ++i) {
      const Vertex p = positions[i];
      std::uint32_t& n = number[(std::size_t(p.z) * std::size_t(last.y + 1) + std::size_t(p.y)) * std::size_t(last.x + 1) + std::size_t(p.x)];
      if (n == kNone) {
        n = std::uint32_t(leaves.points.size());
        leaves.points.push_back(p);
      }
      tet[i] = n;
    }
    leaves.tets.push_back(tet);
  };
  const Diamond root(domain.root());
  for (int i = 0; i < root.row->tets && set.size() == 0; ++i) add(root, root.row->tet(i));
  set.for_each_down([&](const Place& p) {
    const Diamond d(set.centre(p));
    const unsigned tets = domain.tets(d);
    for (int k = 0; k < d.row->children; ++k) {
      if (d.has_children()) {
        const Vertex c = d.child(k);
        if ((c.x | c.y | c.z) >= 0 && set.find(c)) continue;
      }
      for (const Duet::Half& half : d.row->child[k].half) {
        if (!(tets >> half.tet & 1)) continue;
        auto local = d.row->tet(half.tet);
        local[1 - half.end] = kCentre;
        add(d, local);
      }
    }
  });
  return leaves;
}

template <class T>
Result<void> write_array(const std::filesystem::path& path, const std::vector<T>& values) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(values.data()), std::streamsize(values.size() * sizeof(T)));
  if (!file.flush()) return fail("'" + path.string() + "' cannot be written");
  return {};
}

// Samples as floats where that changes none.
template <class To>
std::vector<To> samples_as(const Volume& volume) {
  return visit_samples(volume, [](auto samples) {
    std::vector<To> values(samples.size());
    std::transform(samples.begin(), samples.end(), values.begin(), [](auto v) { return To(v); });
    return values;
  });
}

Result<void> prepare(const std::string& text, const std::filesystem::path& folder) {
  const auto c = read_case(text);
  if (!c) return tl::unexpected(c.error());
  const FieldHierarchy hierarchy(*c->volume, {c->range, c->refine, {}});
  const auto sigma = hierarchy.compact(c->format);
  if (!sigma) return tl::unexpected(sigma.error());
  if (auto saved = save_ivm(folder / "volume.ivm", *sigma); !saved) return saved;
  const LebTets leaves = leaves_of(hierarchy);
  if (auto written = write_array(folder / "points.i32", leaves.points); !written) return written;
  if (auto written = write_array(folder / "tets.u32", leaves.tets); !written) return written;
  const bool as_doubles = c->volume->type == SampleType::u32 || c->volume->type == SampleType::i32 || c->volume->type == SampleType::f64;
  const auto samples = folder / (as_doubles ? "samples.f64" : "samples.f32");
  const auto written = as_doubles ? write_array(samples, samples_as<double>(*c->volume)) : write_array(samples, samples_as<float>(*c->volume));
  if (!written) return written;
  const Grid& g = c->volume->grid;
  const auto bound = [](double v) { return std::isfinite(v) ? nlohmann::ordered_json(v) : nlohmann::ordered_json(v < 0 ? "-inf" : "inf"); };
  return print_json({{"name", c->name},
                     {"title", c->name + " " + range_text(c->range, c->refine)},
                     {"dims", g.dims},
                     {"spacing", g.affine.spacing()},
                     {"range", {bound(c->range.alpha), bound(c->range.beta)}},
                     {"samples", samples.filename().string()},
                     {"points", leaves.points.size()},
                     {"leb_tets", leaves.tets.size()}});
}

Result<void> extract_once(const std::filesystem::path& path) {
  const tbb::global_control one_core(tbb::global_control::max_allowed_parallelism, 1);
  const auto volume = load_ivm(path);
  if (!volume) return tl::unexpected(volume.error());
  Mesh mesh;
  Result<void> outcome;
  const double time = seconds([&] {
    const auto extraction = extract(**volume, Lod{});
    if (!extraction) {
      outcome = tl::unexpected(extraction.error());
    } else {
      mesh = extraction->front.mesh();
    }
    return 0;
  });
  if (!outcome) return outcome;
  return print_json({{"seconds", time}, {"vertices", mesh.points.size()}, {"tets", mesh.tets.size()}, {"volume", volume_of(mesh)}});
}

}  // namespace
}  // namespace intervale::bench

int main(int argc, char** argv) {
  using namespace intervale;
  Program program("bench_leb", "Our side of vtk_clip.py");
  std::string text, folder, file;
  CLI::App& prepare =
      program.add_command("prepare", "Writes what VTK is to clip: the samples, and the tetrahedra of our full refinement that the interval meets",
                          [&] { return bench::prepare(text, folder); });
  prepare.add_option("CASE", text, bench::kCaseSyntax)->required();
  prepare.add_option("FOLDER", folder, "Where volume.ivm, samples.*, points.i32 (x, y, z of each) and tets.u32 (four points of each) go")->required();
  CLI::App& extract = program.add_command("extract", "Extracts the full mesh on one core", [&] { return bench::extract_once(file); });
  extract.add_option("FILE", file, "Interval volume (.ivm)")->required();
  return program.run(argc, argv);
}
