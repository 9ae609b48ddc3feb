// A window that shows a data set, which refines as its updates arrive. OpenGL 2.1 and GLFW; drag to turn, wheel to zoom.
//   refining_view URL LOW HIGH [PICTURE.ppm]    PICTURE.ppm: writes the finished picture and ends
#include <GLFW/glfw3.h>
#include <intervale/boundary.h>
#include <intervale/live_mesh.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

namespace {

using intervale::Vec3;

// The window, and its camera on a sphere around the middle of the box.
struct Window {
  GLFWwindow* handle = nullptr;
  double yaw = 0.6, pitch = 0.4, distance = 1, x = 0, y = 0;
  Vec3 middle{};
  bool is_moved = true;
  Vec3 eye() const {
    return {middle[0] + distance * std::cos(pitch) * std::sin(yaw), middle[1] + distance * std::sin(pitch),
            middle[2] + distance * std::cos(pitch) * std::cos(yaw)};
  }
};

// Triangles, with the normals of their faces.
struct Surface {
  std::vector<float> points, normals, colours;
};

Surface surface_of(const intervale::Mesh& mesh) {
  Surface surface;
  for (const auto& triangle : intervale::boundary_triangles(mesh)) {
    const Vec3 a = mesh.points[triangle[0]], b = mesh.points[triangle[1]], c = mesh.points[triangle[2]];
    const Vec3 n = intervale::normalized(intervale::cross(intervale::subtract(b, a), intervale::subtract(c, a)));
    for (const auto i : triangle) {
      const bool is_alpha = mesh.surface[i] == intervale::Surface::alpha;
      const float colour[3] = {is_alpha ? 0.35f : 0.9f, 0.6f, is_alpha ? 0.9f : 0.4f};
      for (int k = 0; k < 3; ++k) {
        surface.points.push_back(float(mesh.points[i][k]));
        surface.normals.push_back(float(n[k]));
        surface.colours.push_back(colour[k]);
      }
    }
  }
  return surface;
}

void look_from(const intervale::Camera& camera) {
  const double aspect = double(camera.viewport[0]) / camera.viewport[1];
  const Vec3 ahead = intervale::subtract(camera.look_at, camera.eye);
  const double far = 4 * intervale::length(ahead), near = far / 1000, top = near * std::tan(camera.fov * 3.14159265358979 / 360);
  glMatrixMode(GL_PROJECTION), glLoadIdentity();
  glFrustum(-top * aspect, top * aspect, -top, top, near, far);
  const Vec3 f = intervale::normalized(ahead), s = intervale::normalized(intervale::cross(f, camera.up)), u = intervale::cross(s, f);
  const double turn[16] = {s[0], u[0], -f[0], 0, s[1], u[1], -f[1], 0, s[2], u[2], -f[2], 0, 0, 0, 0, 1};
  glMatrixMode(GL_MODELVIEW), glLoadMatrixd(turn);
  glTranslated(-camera.eye[0], -camera.eye[1], -camera.eye[2]);
}

void draw(const Surface& surface, const intervale::Camera& camera) {
  glViewport(0, 0, camera.viewport[0], camera.viewport[1]);
  glClearColor(1, 1, 1, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  for (const auto capability : {GL_DEPTH_TEST, GL_LIGHTING, GL_LIGHT0, GL_COLOR_MATERIAL}) glEnable(capability);
  look_from(camera);
  for (const auto array : {GL_VERTEX_ARRAY, GL_NORMAL_ARRAY, GL_COLOR_ARRAY}) glEnableClientState(array);
  glVertexPointer(3, GL_FLOAT, 0, surface.points.data());
  glNormalPointer(GL_FLOAT, 0, surface.normals.data());
  glColorPointer(3, GL_FLOAT, 0, surface.colours.data());
  glDrawArrays(GL_TRIANGLES, 0, GLsizei(surface.points.size() / 3));
}

void write_picture(const char* path, int width, int height) {
  std::vector<unsigned char> pixels(std::size_t(3) * width * height);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
  std::FILE* const file = std::fopen(path, "wb");
  if (file == nullptr) return std::perror(path);
  std::fprintf(file, "P6 %d %d 255\n", width, height);
  for (int y = height - 1; y >= 0; --y) std::fwrite(&pixels[std::size_t(3) * width * y], 3, std::size_t(width), file);
  std::fclose(file);
}

Window& window_of(GLFWwindow* handle) { return *static_cast<Window*>(glfwGetWindowUserPointer(handle)); }

void on_mouse(GLFWwindow* handle, double x, double y) {
  Window& window = window_of(handle);
  if (glfwGetMouseButton(handle, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS) {
    window.yaw -= 0.01 * (x - window.x);
    window.pitch = std::clamp(window.pitch + 0.01 * (y - window.y), -1.5, 1.5);
    window.is_moved = true;
  }
  window.x = x, window.y = y;
}

void on_wheel(GLFWwindow* handle, double /*x*/, double y) {
  window_of(handle).distance *= std::pow(0.9, y);
  window_of(handle).is_moved = true;
}

int fail(const char* text) { return std::fprintf(stderr, "%s\n", text), 1; }

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4 || argc > 5) return fail("usage: refining_view URL LOW HIGH [PICTURE.ppm]");
  Window window;
  if (!glfwInit() || !(window.handle = glfwCreateWindow(800, 600, argv[1], nullptr, nullptr))) return fail("no window: is there a display?");
  glfwMakeContextCurrent(window.handle);
  glfwSetWindowUserPointer(window.handle, &window);
  glfwSetCursorPosCallback(window.handle, on_mouse), glfwSetScrollCallback(window.handle, on_wheel);
  // At first coarse, and without a camera: where the data set lies is not known yet.
  intervale::MeshRequest request;
  request.shown.ranges = {{std::atof(argv[2]), std::atof(argv[3])}};
  request.lod.error_percent = 20;
  auto live = intervale::LiveMesh::connect(argv[1], request);
  if (!live) return fail(live.error().message.c_str());
  const intervale::Box box = intervale::box_of(live->info().grid);
  window.middle = intervale::lerp(box.min, box.max, 0.5);
  window.distance = 1.5 * intervale::length(intervale::subtract(box.max, box.min));
  request.lod = {};

  Surface surface;
  bool is_done = false;
  while (!glfwWindowShouldClose(window.handle) && !(is_done && argc == 5)) {
    intervale::Camera camera{.eye = window.eye(), .look_at = window.middle};
    glfwGetFramebufferSize(window.handle, &camera.viewport[0], &camera.viewport[1]);
    if (std::exchange(window.is_moved, false)) {
      request.lod.camera = camera;
      if (auto looked = live->look(request); !looked) return fail(looked.error().message.c_str());
    }
    if (const auto state = live->poll(); !state) {
      return fail(state.error().message.c_str());
    } else if (*state) {
      surface = surface_of(*(*state)->mesh);
      is_done = (*state)->is_done;
      std::printf("%llu updates, %zu tetrahedra%s\n", static_cast<unsigned long long>((*state)->updates), (*state)->mesh->tets.size(),
                  is_done ? ", done" : "");
    }
    draw(surface, camera);
    if (is_done && argc == 5) write_picture(argv[4], camera.viewport[0], camera.viewport[1]);
    glfwSwapBuffers(window.handle), glfwWaitEventsTimeout(0.01);
  }
  glfwTerminate();
}
