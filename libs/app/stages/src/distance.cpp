#include "distance.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/data/points_io.h"
#include "osteo/geometry/distance/distance_methods.h"
#include "osteo/geometry/grid/brick_places.h"

namespace osteo::inline app {

Frame GridParams::frame(const TriangleSoup& surface) const {
  return spacing_mm > 0 ? frame_around_mm(surface, spacing_mm, margin_voxels)
                        : frame_around(surface, resolution, margin_voxels);
}

namespace {

const Frame* frame_of(const Data& data) {
  if (const auto* image = std::get_if<Image>(&data)) return &image->frame;
  if (const auto* labels = std::get_if<Labels>(&data)) return &labels->frame;
  if (const auto* grid = std::get_if<SparseGrid>(&data)) return &grid->frame;
  return nullptr;
}

void report_inside(const InsideReport& r, const Context& context) {
  context.report("sign_by", std::string(r.closed ? "whole winding number" : "generalized winding number"));
  context.report("open_edges", static_cast<std::int64_t>(r.open_edges));
  if (!r.closed) {
    context.report("voxels_by_solid_angle", static_cast<std::int64_t>(r.by_solid_angle));
    context.warn("the surface is open at " + std::to_string(r.open_edges) +
                 " edges: inside is where its winding number exceeds one half; 'osteo mesh-repair' can close it");
  }
}

// Distances that another method found, in the form of the exact map.
DistanceMap as_map(const Frame& frame, const VoxelBits& wanted, const VoxelBits& inside,
                   const std::vector<double>& unsigned_mm, const DistanceMapOptions& o) {
  DistanceMap map;
  map.frame = frame;
  std::size_t at = 0;
  const auto blocks = [&](std::size_t a) { return (frame.dims[a] + 7) / 8; };
  // In scan order the wanted voxels are numbered; find each brick's part.
  std::vector<std::size_t> row_first;
  for (int k = 0; k < frame.dims[2]; ++k) {
    for (int j = 0; j < frame.dims[1]; ++j) {
      row_first.push_back(at);
      for (std::size_t w = 0; w < wanted.words_per_row; ++w)
        at += static_cast<std::size_t>(__builtin_popcountll(wanted.words[wanted.row(j, k) + w]));
    }
  }
  const auto number = [&](int i, int j, int k) {
    std::size_t n =
        row_first[static_cast<std::size_t>(k) * static_cast<std::size_t>(frame.dims[1]) + static_cast<std::size_t>(j)];
    for (int w = 0; w < i / 64; ++w)
      n += static_cast<std::size_t>(__builtin_popcountll(wanted.words[wanted.row(j, k) + static_cast<std::size_t>(w)]));
    return n + static_cast<std::size_t>(__builtin_popcountll(
                   wanted.words[wanted.row(j, k) + static_cast<std::size_t>(i / 64)] & ((1ULL << (i % 64)) - 1)));
  };
  for (int bk = 0; bk < blocks(2); ++bk) {
    for (int bj = 0; bj < blocks(1); ++bj) {
      for (int bi = 0; bi < blocks(0); ++bi) {
        std::array<std::uint64_t, 8> stored{};
        std::array<double, 512> d;
        d.fill(std::numeric_limits<double>::quiet_NaN());
        for (int v = 0; v < 512; ++v) {
          const int i = bi * 8 + (v & 7), j = bj * 8 + (v >> 3 & 7), k = bk * 8 + (v >> 6);
          if (i >= frame.dims[0] || j >= frame.dims[1] || k >= frame.dims[2] || !wanted.at(i, j, k)) continue;
          const double x = unsigned_mm[number(i, j, k)];
          const bool in = inside.at(i, j, k);
          if (o.region == DistanceRegion::band && x > (in ? o.band_inside_mm : o.band_outside_mm)) continue;
          stored[static_cast<std::size_t>(v >> 6)] |= 1ULL << (v & 63);
          d[static_cast<std::size_t>(v)] = in ? -x : x;
        }
        if (std::all_of(stored.begin(), stored.end(), [](std::uint64_t w) { return w == 0; })) continue;
        map.bricks.push_back({bi, bj, bk});
        map.stored.insert(map.stored.end(), stored.begin(), stored.end());
        map.distance_mm.insert(map.distance_mm.end(), d.begin(), d.end());
      }
    }
  }
  map.triangle.assign(map.distance_mm.size(), ClosestPoint::kNone);
  return map;
}

VoxelBits whole(const Frame& frame) {
  VoxelBits all(frame);
  for (int k = 0; k < frame.dims[2]; ++k) {
    for (int j = 0; j < frame.dims[1]; ++j) {
      for (int i = 0; i < frame.dims[0]; i += 64) {
        const int n = std::min(64, frame.dims[0] - i);
        all.words[all.row(j, k) + static_cast<std::size_t>(i / 64)] = n == 64 ? ~0ULL : (1ULL << n) - 1;
      }
    }
  }
  return all;
}

std::vector<std::uint8_t> values_of(const Labels& labels, const std::string& wanted) {
  std::vector<std::uint8_t> values;
  std::string known;
  for (const Structure& s : labels.structures) {
    known += (known.empty() ? "" : ", ") + s.name + " (" + std::to_string(s.value) + ")";
    if (wanted.empty() || lower_case(s.name) == lower_case(wanted) || std::to_string(s.value) == wanted)
      values.push_back(s.value);
  }
  if (wanted.empty()) {
    values.clear();
    for (int v = 1; v < 256; ++v) values.push_back(static_cast<std::uint8_t>(v));
  } else if (values.empty()) {
    int v = 0;
    const auto [end, problem] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), v);
    if (problem != std::errc() || end != wanted.data() + wanted.size() || v < 1 || v > 255) {
      throw Error(ExitCode::usage, "there is no structure '" + wanted + "' in the labels",
                  known.empty() ? "give its value, 1 to 255" : "there are: " + known);
    }
    values.push_back(static_cast<std::uint8_t>(v));
  }
  return values;
}

}  // namespace

StageInfo DistanceStage::info() {
  return {
      .name = "distance",
      .version = 1,
      .synopsis = "signed distance from voxels to a surface or to a structure",
      .description =
          "Of a surface: the exact distance to its triangles, negative inside, in double precision, with the nearest "
          "triangle as a second "
          "grid when wanted. Inside is where the winding number says so: a whole number for closed surfaces, the "
          "generalized one for "
          "open ones; the report says which. Of labels: the exact Euclidean distance between voxel centres.",
      .inputs = {{"subject", {DataKind::surface, DataKind::labels}, "surface, mask or label map"},
                 {"like",
                  {DataKind::image, DataKind::labels, DataKind::grid},
                  "put the voxels where this volume's are",
                  true}},
      .outputs =
          {{"distance",
            {DataKind::grid},
            "distance in mm, negative inside; far voxels are not stored (.nrrd and .vti: have the background's value)"},
           {"nearest",
            {DataKind::grid},
            "index of the nearest triangle, or with --name-nearest value of the nearest structure, in the same voxels",
            true}},
      .references =
          {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 6.3",
           "A. Jacobson et al., Robust Inside-Outside Segmentation using Generalized Winding Numbers, SIGGRAPH 2013",
           "P. Felzenszwalb and D. Huttenlocher, Distance Transforms of Sampled Functions, Theory of Computing 2012"},
      .example = "osteo distance bone.ply distance.vdb --spacing-mm 0.5 --region band"};
}

std::vector<Data> DistanceStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const DistanceMapOptions options{p.region, p.band_inside_mm, p.band_outside_mm};
  if (const auto* labels = std::get_if<Labels>(&inputs[0])) {
    if (frame_of(inputs[1]) != nullptr) throw Error(ExitCode::usage, "labels bring their own voxels; leave out --like");
    const std::vector<std::uint8_t> values = values_of(*labels, p.structure);
    MaskDistance found = mask_distance(*labels, values, options, p.name_nearest, context);
    context.report("voxels", static_cast<std::int64_t>(found.distance.active_voxels));
    context.report("sign_by", std::string("mask"));
    Data nearest;
    if (p.name_nearest) nearest = std::move(found.nearest);
    return {std::move(found.distance), std::move(nearest)};
  }
  const TriangleSoup surface = soup_of(*std::get<Surface>(inputs[0]));
  const Frame* const like = frame_of(inputs[1]);
  const Frame frame = like != nullptr ? *like : p.grid.frame(surface);
  DistanceMap map;
  if (p.method == DistanceMethod::exact) {
    const DistanceMapper mapper(surface, frame, context.sub(0, 0.3));
    report_inside(mapper.inside_report(), context);
    map = mapper.map(options, context.sub(0.3, 0.9));
  } else {
    InsideReport report;
    const VoxelBits inside = voxels_inside(surface, frame, context.sub(0, 0.2), &report);
    report_inside(report, context);
    const VoxelBits wanted = p.region == DistanceRegion::interior ? inside : whole(frame);
    std::vector<double> d;
    if (p.method == DistanceMethod::swept) {
      const std::vector<double> all = swept_distance_mm(surface, frame, context.sub(0.2, 0.9));
      for (int k = 0; k < frame.dims[2]; ++k) {
        for (int j = 0; j < frame.dims[1]; ++j) {
          for (int i = 0; i < frame.dims[0]; ++i) {
            if (wanted.at(i, j, k)) {
              d.push_back(all[(static_cast<std::size_t>(k) * static_cast<std::size_t>(frame.dims[1]) +
                               static_cast<std::size_t>(j)) *
                                  static_cast<std::size_t>(frame.dims[0]) +
                              static_cast<std::size_t>(i)]);
            }
          }
        }
      }
    } else {
      std::vector<Vec3> points;
      for (int k = 0; k < frame.dims[2]; ++k) {
        for (int j = 0; j < frame.dims[1]; ++j) {
          for (int i = 0; i < frame.dims[0]; ++i) {
            if (wanted.at(i, j, k)) points.push_back(frame.world_from_index({double(i), double(j), double(k)}));
          }
        }
      }
      d = ThesisDistance(surface).distances_mm(points, {p.tree_ascend_n, p.breadth_first, p.bound_as_printed}, context);
    }
    map = as_map(frame, wanted, inside, d, options);
  }
  if (map.bricks.empty())
    throw Error(ExitCode::failed, "no voxel lies in the region that gets distances",
                "choose smaller voxels or a wider band");
  double lo = 0, hi = 0;
  for (const double d : map.distance_mm) {
    if (d < lo) lo = d;
    if (d > hi) hi = d;
  }
  context.report("voxels", static_cast<std::int64_t>(map.count()));
  context.report("deepest_mm", lo);
  context.report("farthest_mm", hi);
  Data nearest;
  if (p.method == DistanceMethod::exact) {
    if (surface.triangles.size() >= (1U << 24)) {
      context.warn(
          "more than 2^24 triangles: the grid of nearest triangles cannot tell neighbours apart and is left out");
    } else {
      std::vector<float> ids(map.triangle.begin(), map.triangle.end());
      nearest = to_sparse(map.frame, "nearest_triangle", map.bricks, map.stored, ids, -1);
    }
  }
  context.progress(1.0);
  return {to_sparse(map), std::move(nearest)};
}

StageInfo DistanceAtStage::info() {
  return {
      .name = "distance-at",
      .version = 1,
      .synopsis = "signed distance and closest point at given points",
      .description =
          "For each point of a text file (x, y, z in LPS mm a line; commas, blanks or tabs between) the exact distance "
          "to the surface, "
          "negative inside, the closest point and its triangle.",
      .inputs = {{"surface", {DataKind::surface}, "triangles"},
                 {"points", {DataKind::source}, "points: a text file, or .mrk.json or .fcsv of 3D Slicer"}},
      .outputs = {{"distances", {DataKind::document}, "one entry a point, in JSON"}},
      .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 6.3"},
      .example = "osteo distance-at bone.ply points.csv distances.json"};
}

std::vector<Data> DistanceAtStage::run(const Params&, std::span<const Data> inputs, const Context& context) {
  const TriangleSoup surface = soup_of(*std::get<Surface>(inputs[0]));
  const std::vector<Vec3> points = load_points(std::get<Source>(inputs[1]).path);
  const SignedDistance distance(surface, context);
  const std::vector<SignedDistance::Answer> answers = distance.at(points, context);
  Json j;
  const std::string sign_by = distance.closed() ? "whole winding number" : "generalized winding number";
  j["sign_by"] = sign_by;
  j["points"] = Json::list();
  double lo = 1e300;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& a = answers[i];
    const Vec3 c = a.closest.point_mm;
    j["points"].push_back({{"point_mm", {points[i].x, points[i].y, points[i].z}},
                           {"distance_mm", a.signed_mm},
                           {"closest_mm", {c.x, c.y, c.z}},
                           {"triangle", a.closest.triangle}});
    lo = std::min(lo, a.signed_mm);
  }
  context.report("points", static_cast<std::int64_t>(points.size()));
  context.report("smallest_mm", lo);
  context.report("sign_by", sign_by);
  return {Document{j.dump(1) + "\n"}};
}

StageInfo VoxelizeStage::info() {
  return {
      .name = "voxelize",
      .version = 1,
      .synopsis = "which voxels lie inside a surface",
      .description =
          "Labels interior and border voxels; the rest is exterior. Counts crossings of rows of voxels in a way that "
          "never leaks at shared "
          "edges; open surfaces are decided by the generalized winding number. Self-intersecting, duplicated and "
          "inside-out triangles "
          "do no harm.",
      .inputs = {{"surface", {DataKind::surface}, "triangles"},
                 {"like",
                  {DataKind::image, DataKind::labels, DataKind::grid},
                  "put the voxels where this volume's are",
                  true}},
      .outputs = {{"labels", {DataKind::labels}, "1 interior, 2 border"},
                  {"grid", {DataKind::grid}, "the same, sparse", true}},
      .references =
          {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 5.2.2",
           "A. Jacobson et al., Robust Inside-Outside Segmentation using Generalized Winding Numbers, SIGGRAPH 2013"},
      .example = "osteo voxelize bone.ply voxels.seg.nrrd --resolution 195"};
}

std::vector<Data> VoxelizeStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const TriangleSoup surface = soup_of(*std::get<Surface>(inputs[0]));
  const Frame* const like = frame_of(inputs[1]);
  const Frame frame = like != nullptr ? *like : p.grid.frame(surface);
  InsideReport report;
  const VoxelBits inside = voxels_inside(surface, frame, context.sub(0, 0.6), &report);
  report_inside(report, context);
  // The border: exact, inside voxels with a face neighbour outside; thesis, the other way round.
  VoxelBits outside(frame);
  const VoxelBits all = whole(frame);
  for (std::size_t w = 0; w < all.words.size(); ++w) outside.words[w] = all.words[w] & ~inside.words[w];
  const VoxelBits near = p.margin == VoxelMargin::exact ? outside.dilated() : inside.dilated();
  Labels labels;
  labels.frame = frame;
  const auto voxels = make_voxels<std::uint8_t>(frame.voxel_count());
  std::int64_t interior = 0, border = 0;
  std::size_t at = 0;
  std::vector<Ijk> bricks;
  for (int k = 0; k < frame.dims[2]; ++k) {
    for (int j = 0; j < frame.dims[1]; ++j) {
      for (int i = 0; i < frame.dims[0]; ++i, ++at) {
        const bool in = inside.at(i, j, k), edge = near.at(i, j, k) && (p.margin == VoxelMargin::exact ? in : !in);
        voxels[at] = edge ? 2 : in ? 1 : 0;
        interior += in && !edge ? 1 : 0;
        border += edge ? 1 : 0;
      }
    }
  }
  if (interior + border == 0) {
    throw Error(ExitCode::failed, "no voxel's centre is inside the surface",
                "choose smaller voxels, or --margin thesis for plates thinner than a voxel");
  }
  labels.voxels = voxels;
  labels.structures = {{1, "interior", {230, 210, 170}}, {2, "border", {200, 90, 60}}};
  context.report("interior_voxels", interior);
  context.report("border_voxels", border);
  context.report("volume_mm3", static_cast<double>(inside.count()) * frame.voxel_volume_mm3());
  // Sparse: bricks with anything in them.
  std::vector<std::uint64_t> stored;
  std::vector<float> values;
  for (int bk = 0; bk * 8 < frame.dims[2]; ++bk) {
    for (int bj = 0; bj * 8 < frame.dims[1]; ++bj) {
      for (int bi = 0; bi * 8 < frame.dims[0]; ++bi) {
        std::array<std::uint64_t, 8> mask{};
        std::array<float, 512> value{};
        bool any = false;
        for (int v = 0; v < 512; ++v) {
          const int i = bi * 8 + (v & 7), j = bj * 8 + (v >> 3 & 7), k = bk * 8 + (v >> 6);
          if (i >= frame.dims[0] || j >= frame.dims[1] || k >= frame.dims[2] || labels.at(i, j, k) == 0) continue;
          mask[static_cast<std::size_t>(v >> 6)] |= 1ULL << (v & 63);
          value[static_cast<std::size_t>(v)] = labels.at(i, j, k);
          any = true;
        }
        if (!any) continue;
        bricks.push_back({bi, bj, bk});
        stored.insert(stored.end(), mask.begin(), mask.end());
        values.insert(values.end(), value.begin(), value.end());
      }
    }
  }
  context.progress(1.0);
  SparseGrid sparse = to_sparse(frame, "voxels", bricks, stored, values, 0);
  return {std::move(labels), std::move(sparse)};
}

}  // namespace osteo::inline app
