// Opens an .ivm file and writes the mesh of a range, within a share of the largest error: extract_to_file IN.ivm LOW
// HIGH PERCENT OUT.vtu
#include <intervale/data_set.h>
#include <intervale/mesh_digest.h>
#include <intervale/mesh_writer.h>

#include <cstdio>
#include <cstdlib>

namespace {

int fail(const intervale::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) return fail({"usage: extract_to_file IN.ivm LOW HIGH PERCENT OUT.vtu"});
  const auto data_set = intervale::DataSet::open(argv[1]);
  if (!data_set) return fail(data_set.error());

  intervale::MeshRequest request;
  request.shown.ranges = {{std::atof(argv[2]), std::atof(argv[3])}};
  request.lod.error_percent = std::atof(argv[4]);
  const auto mesh = data_set->extract(request);
  if (!mesh) return fail(mesh.error());
  if (auto written = intervale::write_mesh(argv[5], *mesh); !written) return fail(written.error());
  std::printf("%zu tetrahedra, volume %.6g of %.6g\n", mesh->tets.size(), intervale::volume_of(*mesh),
              data_set->enclosed_volume(request.shown.ranges[0]).value_or(intervale::volume_of(*mesh)));
  std::printf("digest %s\n", intervale::mesh_digest(*mesh).c_str());
}
