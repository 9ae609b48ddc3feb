// Makes a volume, builds a data set of every range from it, and extracts a mesh: build_and_extract OUT.ivm OUT.vtu
#include <intervale/boundary.h>
#include <intervale/build.h>
#include <intervale/mesh_digest.h>
#include <intervale/mesh_writer.h>

#include <cmath>
#include <cstdio>

namespace {

// A ball: the distance from the middle of 64^3 samples, 1 mm apart.
intervale::Volume make_ball() {
  constexpr int kSide = 64;
  intervale::Volume volume;
  volume.name = "ball";
  volume.grid = {{kSide, kSide, kSide}, intervale::Affine::of({1, 1, 1})};
  volume.type = intervale::SampleType::f32;
  volume.labels.unit = "mm";
  volume.bytes.resize(volume.grid.sample_count() * sizeof(float));
  auto* sample = reinterpret_cast<float*>(volume.bytes.data());
  for (int z = 0; z < kSide; ++z)
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) *sample++ = float(std::hypot(x - 31.5, y - 31.5, z - 31.5));
  return volume;
}

int fail(const intervale::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return fail({"usage: build_and_extract OUT.ivm OUT.vtu"});
  const auto ball = intervale::build_data_set(make_ball());
  if (!ball) return fail(ball.error());
  if (auto saved = ball->save(argv[1]); !saved) return fail(saved.error());

  intervale::MeshRequest shell;  // between two distances, within a thousandth of the largest error
  shell.shown.ranges = {{10, 20}};
  shell.lod.error_percent = 0.1;
  const auto mesh = ball->extract(shell);
  if (!mesh) return fail(mesh.error());
  if (auto written = intervale::write_mesh(argv[2], *mesh); !written) return fail(written.error());
  std::printf("%zu tetrahedra, %zu boundary triangles, volume %.6g (the shell's is %.6g)\n", mesh->tets.size(),
              intervale::boundary_triangles(*mesh).size(), intervale::volume_of(*mesh), 4 / 3.0 * 3.14159265358979 * (8000 - 1000));
  std::printf("digest %s\n", intervale::mesh_digest(*mesh).c_str());
}
