// What a picture of bone costs, by level, beside a plain VTK viewer of the same triangles; not a test. Prints what
// docs/validation/accuracy.md holds. usage: picture_bench CASE [--pictures FOLDER] [--size WxH] [--rounds N]
#include <sys/resource.h>

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkDepthOfFieldPass.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkLight.h>
#include <vtkLightKit.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderStepsPass.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/display/view/world_view.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/imaging/io/vtk_data.h"
#include "osteo/session/scene/case.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/bone/world.h"

using namespace osteo;

namespace {

double cpu_ms() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  const auto ms = [](const timeval& t) {
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_usec);
  };
  return ms(u.ru_utime) + ms(u.ru_stime);
}
double wall_ms() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Viewer {
  std::string name;
  OffscreenWindow window;
  vtkNew<vtkRenderer> renderer;
  std::unique_ptr<WorldView> world;
  std::function<void()> before = [] {};
  std::vector<double> wall, cpu;
  std::size_t triangles = 0;
  Viewer(std::string n, int w, int h) : name(std::move(n)), window(w, h) { window.window()->AddRenderer(renderer); }
};

// What a fifteenth of a second of drilling costs before it can be drawn: triangles, normals, colours, chunks. A 4 mm
// burr that moves over the surface by 0.5 mm a picture and takes half a millimetre.
void drill(const World& world, Vec3 centre, Vec3 eye, int rounds) {
  BrickGrid bone = world.bodies().front().body->bone;
  LiveSurface surface(bone, {});
  surface.shade({});
  vtkNew<vtkRenderer> renderer;
  BoneView view(renderer, nullptr, world.bodies().front().body->hardness);
  view.show(surface);
  Vec3 at = centre + eye * 60;
  while (!(bone.nearest(at) > 0.5F) && length(at - centre) > 1) at += eye * -0.2;
  const Vec3 along = any_perpendicular(eye);
  const double h = bone.frame().spacing_mm.x;
  std::vector<double> ms, settle_ms;
  for (int n = 0; n < 3 * rounds; ++n) {
    Vec3 burr = at + along * (0.5 * n - 6) + eye * 1.5;
    const Vec3 x = bone.frame().index_from_world(burr);
    const int r = static_cast<int>(2 / h) + 2;
    for (int k = -r; k <= r; ++k)
      for (int j = -r; j <= r; ++j)
        for (int i = -r; i <= r; ++i) {
          const int q[3] = {static_cast<int>(x.x) + i, static_cast<int>(x.y) + j, static_cast<int>(x.z) + k};
          const VoxelKey key = bone.find(q[0], q[1], q[2]);
          if (key == BrickGrid::kNone || !(bone.value(key) > 0)) continue;
          if (length(bone.frame().world_from_index({1.0 * q[0], 1.0 * q[1], 1.0 * q[2]}) - burr) > 2) continue;
          bone.set(key, 0);
          surface.mark(key);
        }
    double before = cpu_ms();
    view.update(surface, surface.update());
    ms.push_back(cpu_ms() - before);
    if (n % 4 != 3) continue;
    before = cpu_ms();
    view.update(surface, surface.settle());
    settle_ms.push_back(cpu_ms() - before);
  }
  std::sort(ms.begin(), ms.end());
  std::sort(settle_ms.begin(), settle_ms.end());
  double before = cpu_ms();
  view.refresh(surface);
  std::printf(
      "an edit's triangles, normals, colours and chunks: CPU ms %.1f (most %.1f); four times a second beside it %.1f; "
      "at rest once %.1f\n",
      ms[ms.size() / 2], ms.back(), settle_ms[settle_ms.size() / 2], cpu_ms() - before);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2)
    return std::printf(
               "usage: picture_bench CASE [--pictures FOLDER] [--size WxH] [--rounds N] [--plain]      --plain: the "
               "plain viewer alone\n"),
           2;
  std::string pictures;
  int width = 1040, height = 1000, rounds = 15;
  const bool plain = std::strcmp(argv[argc - 1], "--plain") == 0;
  for (int n = 2; n + 1 < argc; n += 2) {
    if (std::strcmp(argv[n], "--pictures") == 0) pictures = argv[n + 1];
    if (std::strcmp(argv[n], "--size") == 0) std::sscanf(argv[n + 1], "%dx%d", &width, &height);
    if (std::strcmp(argv[n], "--rounds") == 0) rounds = std::atoi(argv[n + 1]);
  }
  const Context context;
  const QuietVtk quiet;  // GLEW's complaint that there is no X display, once for each window
  const Case the_case = load_case(argv[1]);
  HapticSetup setup;
  const Anatomy anatomy = anatomy_of(the_case, setup, context);
  const World world = world_of(the_case, anatomy);
  SceneReaders readers(world, {}, 1000, context);
  readers.surface->shade();
  const TriMesh mesh = readers.surface->surface(world.bodies().front().body->id)->joined().mesh;
  Vec3 lo{1e9, 1e9, 1e9}, hi = lo * -1;
  for (const auto& q : mesh.points_mm)
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], static_cast<double>(q[a]));
      hi[a] = std::max(hi[a], static_cast<double>(q[a]));
    }
  const Vec3 eye = normalized({0.94, -0.25, 0.22});
  const double radius = 0.36 * length(hi - lo);

  std::vector<std::unique_ptr<Viewer>> viewers;
  const auto add = [&](const std::string& name, int w, int h) -> Viewer& {
    return *viewers.emplace_back(std::make_unique<Viewer>(name, w, h));
  };
  const auto plain_mesh = to_vtk(mesh);
  const auto show_mesh = [&](Viewer& v) {
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(plain_mesh);
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    v.renderer->AddActor(actor);
    v.triangles = mesh.triangles.size();
    return actor;
  };
  show_mesh(add("plain VTK viewer", width, height));
  if (!plain) {
    Viewer& v = add("light kit of five lamps, all triangles", width, height);
    v.renderer->AutomaticLightCreationOff();
    vtkNew<vtkLightKit> kit;
    kit->AddLightsToRenderer(v.renderer);
    v.renderer->GradientBackgroundOn();
    show_mesh(v)->GetProperty()->BackfaceCullingOn();
  }
  struct Level {
    const char* name;
    PictureStyle style;
    bool turn, coarse;
  };
  for (const Level& level : {Level{"moving: coarse, full size", {false, 1}, true, true},
                             {"moving: coarse, 0.7", {false, 0.7}, true, true},
                             {"moving: coarse, 0.5", {false, 0.5}, true, true},
                             {"moving: all triangles, full size", {false, 1}, true, false},
                             {"drilling: camera at rest, full size", {false, 1}, false, true},
                             {"drilling: camera at rest, 0.7", {false, 0.7}, false, true},
                             {"at rest: occlusion and smooth edges", {true, 1}, false, true}}) {
    if (plain) break;
    const int w = static_cast<int>(width * level.style.scale), h = static_cast<int>(height * level.style.scale);
    Viewer& v = add(level.name, w, h);
    set_up_scene(v.renderer);
    v.world = std::make_unique<WorldView>(v.renderer, nullptr);
    v.world->update(world, readers);
    look_at(v.renderer, (lo + hi) * 0.5, radius, eye);
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    v.world->update(world, readers);
    // Twice at rest: the first makes what can be seen, the other what stands for it while it moves.
    while (!v.world->rest(w, h)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      v.world->update(world, readers);
    }
    if (level.turn) {
      WorldView* const view = v.world.get();
      vtkRenderer* const renderer = v.renderer;
      while (view->making_coarse()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        view->rest(w, h, level.coarse);
      }
      v.before = [view, renderer, w, h, coarse = level.coarse] {
        renderer->GetActiveCamera()->Azimuth(0.4);
        view->rest(w, h, coarse);
      };
    }
    v.before();
    set_depth(v.renderer, level.style);
    v.triangles = v.world->drawn_triangles();
  }
  // A lens of 16 mm before the eye, as an operating microscope has, focused on the middle of the picture: as at rest,
  // and without occlusion, which goes by passes of the renderer's own.
  if (!plain) {
    Viewer& v = add("at rest: VTK's depth of field", width, height);
    set_up_scene(v.renderer);
    v.world = std::make_unique<WorldView>(v.renderer, nullptr);
    v.world->update(world, readers);
    look_at(v.renderer, (lo + hi) * 0.5, radius, eye);
    v.renderer->GetActiveCamera()->SetFocalDisk(16);
    vtkNew<vtkRenderStepsPass> steps;
    vtkNew<vtkDepthOfFieldPass> lens;
    lens->SetDelegatePass(steps);
    v.renderer->SetPass(lens);
    v.triangles = v.world->drawn_triangles();
  }
  if (!plain) drill(world, (lo + hi) * 0.5, eye, rounds);
  for (int round = -2; round < rounds; ++round) {
    for (const auto& v : viewers) {
      v->window.make_current();
      if (!v->world) look_at(v->renderer, (lo + hi) * 0.5, radius, eye);
      v->before();
      v->renderer->ResetCameraClippingRange();
      const double w0 = wall_ms(), c0 = cpu_ms();
      v->window.window()->Render();
      v->window.finish();
      if (round < 0) continue;
      v->wall.push_back(wall_ms() - w0);
      v->cpu.push_back(cpu_ms() - c0);
    }
  }
  std::printf("%d x %d pixels, %.2f M triangles in all; %d rounds, one after the other in each\n", width, height,
              static_cast<double>(mesh.triangles.size()) / 1e6, rounds);
  std::printf("%-40s %9s %9s %9s %9s\n", "", "M drawn", "best ms", "median", "CPU ms");
  for (const auto& v : viewers) {
    std::sort(v->wall.begin(), v->wall.end());
    std::sort(v->cpu.begin(), v->cpu.end());
    std::printf("%-40s %9.3f %9.1f %9.1f %9.1f\n", v->name.c_str(), static_cast<double>(v->triangles) / 1e6,
                v->wall.front(), v->wall[v->wall.size() / 2], v->cpu[v->cpu.size() / 2]);
    if (!pictures.empty()) {
      v->window.make_current();
      look_at(v->renderer, (lo + hi) * 0.5, radius, eye);
      save_picture(v->window.render(), pictures + "/" + std::to_string(&v - viewers.data()) + ".png");
    }
  }
  for (const auto& v : viewers) {
    v->window.make_current();
    v->world.reset();
  }
}
