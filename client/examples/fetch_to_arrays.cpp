// Fetches a mesh from a server into arrays: fetch_to_arrays ws://HOST:PORT/NAME LOW HIGH ERROR_PERCENT
#include <intervale/fetch_mesh.h>
#include <intervale/mesh_digest.h>

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: %s URL LOW HIGH ERROR_PERCENT\n", argv[0]);
    return 2;
  }
  intervale::MeshRequest request;
  request.shown.ranges = {{std::atof(argv[2]), std::atof(argv[3])}};
  request.lod.error_percent = std::atof(argv[4]);

  const auto fetched = intervale::fetch_mesh(argv[1], request);
  if (!fetched) {
    std::fprintf(stderr, "%s\n", fetched.error().message.c_str());
    return 1;
  }
  // points[i] is x, y, z; value[i] the field there; tets[t] are four indices into points.
  const intervale::Mesh& mesh = fetched->mesh;
  std::printf("%zu points, %zu tetrahedra, volume %.9g, %llu bytes received\n", mesh.points.size(), mesh.tets.size(), intervale::volume_of(mesh),
              static_cast<unsigned long long>(fetched->bytes));
  std::printf("digest %s\n", intervale::mesh_digest(mesh).c_str());
}
