// A second scan onto the first: error at targets against known motions, beside SimpleITK on the same files.
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "bench.h"
#include "folders.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/imaging/registration/register.h"
#include "second_scan.h"

namespace osteo {
namespace {

Image noisy(const Image& image) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 20);
  const auto v = make_voxels<std::int16_t>(image.frame.voxel_count());
  for (std::size_t i = 0; i < image.frame.voxel_count(); ++i)
    v[i] = static_cast<std::int16_t>(std::lround(image.voxels[i] + normal(random)));
  return {image.frame, v};
}

RigidTransform motion(Vec3 axis, double degrees, Vec3 shift) {
  RigidTransform t = rotation_about({5, -10, 3}, normalized(axis), degrees * M_PI / 180);
  t.shift_mm += shift;
  return t;
}

struct Pair {
  const char* name;
  test::SecondScan second;
  bool mr = false;
};

void row(const char* name, const char* who, double error, const Registration* r, double seconds) {
  std::printf("| %s | %s | %.3f | ", name, who, error);
  if (r != nullptr)
    std::printf("%.3f | %.2f, %.2f | ", r->inverse_mm, r->residual.median_mm, r->residual.p90_mm);
  else
    std::printf("| | ");
  std::printf("%.1f |\n", seconds);
  std::fflush(stdout);
}

}  // namespace

void bench_registration(const Context& context) {
  std::printf(
      "## Registration\n\nPhantom head of 1 mm, noise 20 HU; the second scan on other voxels, noise 30. Target: mean "
      "over places within 60 "
      "mm of the "
      "head's middle.\n\n| second scan | method | target off, mean mm | there and back mm | edges: median, 90 %% mm | "
      "s "
      "|\n|---|---|---|---|---|---|\n");
  PhantomParams p;
  p.noise_hu = 0;
  const Phantom clean = make_phantom(p, context);
  const Image first = noisy(clean.ct), mr = test::as_mr(clean.labels);
  const Vec3 ear{58, 12, -20};
  const Pair pairs[] = {
      {"turned 5, moved 10", {.second_from_first = motion({1, 2, -1}, 5, {6, -5, 6}), .spacing_mm = {0.9, 0.9, 1}}},
      {"turned 30, moved 50",
       {.second_from_first = motion({1, 2, -1}, 30, {40, -25, 15}), .spacing_mm = {0.9, 0.9, 1}}},
      {"turned 20, 2 mm slices, 12 mm drilled",
       {.second_from_first = motion({0, 1, 3}, -20, {-30, 10, 38}),
        .spacing_mm = {0.8, 0.8, 2},
        .cavity_mm = ear,
        .cavity_radius_mm = 12}},
      {"turned 15, 5 mm slices", {.second_from_first = motion({1, 1, 0}, 15, {5, 8, 30}), .spacing_mm = {0.7, 0.7, 5}}},
      {"MR, turned 5, moved 10",
       {.second_from_first = motion({1, 1, 0}, 5, {5, 8, -3}), .spacing_mm = {1, 1, 1.5}, .air = 30},
       true},
      {"MR, turned 25, moved 50",
       {.second_from_first = motion({-1, 1, 1}, 25, {20, 30, -34}), .spacing_mm = {1, 1, 2}, .air = 30},
       true},
      {"MR, turned 10, 4 mm slices",
       {.second_from_first = motion({1, 1, 0}, 10, {5, 8, 10}), .spacing_mm = {0.9, 0.9, 4}, .air = 30},
       true},
  };
  const TemporaryFolder folder;
  save_image(first, folder.path() / "first.nrrd");
  for (const Pair& pair : pairs) {
    const Image second = test::scanned_again(pair.mr ? mr : clean.ct, pair.second);
    for (const RegisterMethod method : {RegisterMethod::mutual, RegisterMethod::surface}) {
      if (pair.mr && method == RegisterMethod::surface) continue;
      RegisterParams rp;
      rp.method = method;
      rp.accept_poor = true;
      const auto begin = std::chrono::steady_clock::now();
      const Registration r = register_scans(first, second, rp, context);
      row(pair.name, method == RegisterMethod::mutual ? "osteo, mutual" : "osteo, surface",
          test::target_error_mm(pair.second.second_from_first, r.second_from_first, {}, 60), &r,
          std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    save_image(second, folder.path() / "second.nrrd");
    std::ofstream(folder.path() / "truth.tfm") << itk_transform_text(pair.second.second_from_first);
    const std::string command = source_folder().string() + "/build/peers/bin/python3 " + source_folder().string() +
                                "/tests/bench/peers_registration.py " + folder.path().string() + " '" + pair.name + "'";
    std::fflush(stdout);
    if (std::system(command.c_str()) != 0)
      std::printf("| %s | SimpleITK: not at hand in build/peers | | | | |\n", pair.name);
  }
  const auto data = shared_data() / "dicom_ct_skull_phantom";
  if (std::filesystem::exists(data)) {
    const Image straight = import_ct(data / "S21570" / "S2030", {}).image,
                tilted = import_ct(data / "S21610" / "S2010", {}).image;
    std::printf("\nThe real skull phantom, straight at 1 mm and tilted at 2.4 mm:\n\n");
    for (const RegisterMethod method : {RegisterMethod::mutual, RegisterMethod::surface}) {
      RegisterParams rp;
      rp.method = method;
      const auto begin = std::chrono::steady_clock::now();
      const Registration r = register_scans(straight, tilted, rp, context);
      std::printf(
          "- %s: there and back %.3f mm, edges %.2f and %.2f mm, bone's surfaces %.3f mean, %.3f p95, boundary shifted "
          "%.3f, shape %.3f, "
          "%.1f s\n",
          method == RegisterMethod::mutual ? "mutual" : "surface", r.inverse_mm, r.residual.median_mm,
          r.residual.p90_mm, r.surface_mean_mm, r.surface_p95_mm, r.boundary_shift_mm, r.surface_shape_mm,
          std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::printf("\nPeak memory of all this: %ld MB.\n\n", usage.ru_maxrss / 1024);
}

}  // namespace osteo
