// Time and memory of each correction at 512 x 512 x 600, for docs/validation/accuracy.md; not a test. usage: edit_bench [NX NY NZ]
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "cut_picture.h"
#include "edit_worker.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/parallel.h"
#include "osteo/imaging/edit/edit_file.h"

namespace {

using namespace osteo;

double timed(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

// A skull with diploe, cells, soft tissue and noise of 25 HU.
Image head(std::array<int, 3> dims) {
  Image ct{{dims, {0.4, 0.4, 0.4}, {-100, -100, -120}, {}}, nullptr};
  const auto v = make_voxels<std::int16_t>(ct.frame.voxel_count());
  parallel_for(static_cast<std::size_t>(dims[2]), 1, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      std::uint32_t state = static_cast<std::uint32_t>(k) * 2654435761U + 1;
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i) {
          const double x = (2.0 * i / dims[0] - 1) / 0.78, y = (2.0 * j / dims[1] - 1) / 0.92,
                       z = (2.0 * static_cast<double>(k) / dims[2] - 1) / 0.95;
          const double r = std::sqrt(x * x + y * y + z * z);
          double hu = r > 1 ? -1000 : r > 0.93 ? 60 : r > 0.91 || (r < 0.88 && r > 0.86) ? 1100 : r > 0.86 ? 450 : 40;
          if (r > 0.86 && r < 0.93 &&
              std::sin(i * 0.5) * std::sin(j * 0.5) * std::sin(static_cast<double>(k) * 0.5) > 0.7)
            hu = -600;
          double noise = -2;
          for (int n = 0; n < 4; ++n) {
            state = state * 1664525U + 1013904223U;
            noise += static_cast<double>(state >> 8) / (1 << 24);
          }
          v[static_cast<std::ptrdiff_t>(ct.offset(i, j, static_cast<int>(k)))] =
              static_cast<std::int16_t>(hu + 43 * noise);
        }
      }
    }
  });
  ct.voxels = v;
  return ct;
}

}  // namespace

int main(int argc, char** argv) {
  std::array<int, 3> dims{512, 512, 600};
  for (int a = 0; a < 3 && a + 1 < argc; ++a) dims[static_cast<std::size_t>(a)] = std::atoi(argv[a + 1]);
  const Image ct = head(dims);
  std::printf("%d x %d x %d voxels\n", dims[0], dims[1], dims[2]);
  std::optional<EditDocument> made;
  {
    Labels start;
    start.frame = ct.frame;
    const auto v = make_voxels<std::uint8_t>(ct.frame.voxel_count());
    BitMask(ct, 300, 32767).to_bytes(v.get());
    start.voxels = v;
    std::printf("open                  %8.1f ms\n", timed([&] { made.emplace(ct, start); }));
  }
  EditDocument& d = *made;
  const Vec3 c = ct.frame.centre_mm();
  const auto step = [&](const char* name, const EditOperation& o) {
    EditOutcome done;
    std::optional<BonePlan> plan;
    const std::size_t before = d.history_bytes();
    if (changes_bone(o) && !std::holds_alternative<BrushEdit>(o)) {
      const double beside = timed([&] { plan = d.plan({o}); }),
                   commit = timed([&] { done = d.commit(std::move(*plan)); });
      std::printf("%-22s%8.1f ms beside, %6.1f ms in the window", name, beside, commit);
    } else {
      std::printf("%-22s                    %6.1f ms in the window", name, timed([&] { done = d.apply(o); }));
    }
    const double bytes = static_cast<double>(d.history_bytes() - before);
    const double back = timed([&] { d.undo(); }), again = timed([&] { d.redo(); });
    std::printf(", undo %6.1f, redo %6.1f ms, history %8.1f kB, %.0f mm3 added, %.0f removed\n", back, again,
                bytes / 1e3, done.added_mm3, done.removed_mm3);
  };
  step("threshold", ThresholdEdit{350, 32767});
  step("threshold, noisy", ThresholdEdit{60, 32767});
  step("threshold", ThresholdEdit{300, 32767});
  const Vec3 shell = ct.frame.world_from_index({dims[0] / 2.0, dims[1] / 2.0, dims[2] / 2.0 * (1 + 0.95 * 0.92)});
  step("piece", IslandEdit{{shell.x, shell.y, shell.z}, IslandChoice::keep});
  step("small pieces", IslandSizeEdit{10, 0});
  step("box", BoxEdit{{c.x - 30, c.y - 120, c.z - 30}, {c.x + 30, c.y + 120, c.z + 30}, BoxChoice::clear_inside});
  step("fill", FillEdit{50});
  step("smooth 0.4 mm", SmoothEdit{0.4});
  step("smooth 1.2 mm", SmoothEdit{1.2});
  step("brush dab 4 mm", BrushEdit{0, false, 2, {c}});
  step("brush 20 mm, 40 mm long", BrushEdit{0, false, 10, {c, c + Vec3{40, 0, 0}}});
  step("add structure", AddStructureEdit{1, "nerve", {255, 220, 60}, StructureRole::at_risk});
  step("structure 4 mm, 40 mm", BrushEdit{1, false, 2, {c, c + Vec3{40, 0, 0}}});
  step("delete structure", DeleteStructureEdit{1});
  d.undo();
  d.undo();
  std::vector<std::uint32_t> pixels;
  for (const auto& [w, h] : {std::pair{365, 318}, {493, 369}, {1134, 688}}) {
    double all = 0, live = 0;
    for (int p = 0; p < 3; ++p) {
      SliceView view{static_cast<Plane>(p), c, c, 0.3, w, h};
      CutLook look;
      all += timed([&] { draw_cut(view, d, look, pixels); });
      look.live = ThresholdEdit{300, 32767};
      live += timed([&] { draw_cut(view, d, look, pixels); });
    }
    std::printf("three slices of %4d x %3d          %6.1f ms, with live threshold %6.1f ms\n", w, h, all, live);
  }
  for (const std::size_t most : {600'000U, 3'000'000U}) {
    PreviewRequest request{ct, std::nullopt, std::make_shared<const BitMask>(d.bone()), {}, most};
    Preview made_preview;
    const double bone = timed([&] { made_preview = make_preview(request); });
    request.live = ThresholdEdit{350, 32767};
    const double live = timed([&] { made_preview = make_preview(request); });
    std::printf("3D of %7zu coarse voxels, beside  %6.1f ms, of a live threshold %6.1f ms, %zu triangles\n", most, bone,
                live, made_preview.bone.triangles.size());
  }
  std::string text;
  std::printf("what is saved                       %6.1f ms\n", timed([&] { text = edits_text(recipe_of(d)); }));
  std::printf("history %.1f MB in %zu steps, peak memory %.0f MB\n", static_cast<double>(d.history_bytes()) / 1e6,
              d.steps(), peak_memory_mb());
  while (d.undo()) {
  }
  std::printf("undone to the start: %s\n", d.hash() == d.start_hash() ? "the start" : "NOT the start");
  return d.hash() == d.start_hash() ? 0 : 1;
}
