#include "pictures.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/display/view/pictures.h"
#include "osteo/display/view/slices.h"
#include "osteo/geometry/grid/sampler.h"

namespace osteo::inline assessment::case_report {
namespace {

using Rgb8 = std::array<std::uint8_t, 3>;
constexpr Rgb8 kOutline{255, 105, 10}, kGone{224, 60, 40};

void put(Picture& p, int x, int y, Rgb8 c, double share = 1) {
  if (x < 0 || y < 0 || x >= p.width || y >= p.height) return;
  std::uint8_t* const at = p.rgb.data() + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width) +
                                               static_cast<std::size_t>(x));
  for (std::size_t a = 0; a < 3; ++a) at[a] = static_cast<std::uint8_t>(std::lround(at[a] + share * (c[a] - at[a])));
}

// Grey of a HU value under a window.
GreyAt grey_under(const Subject& s, double from_hu, double to_hu) {
  const auto grey = [from_hu, to_hu](double hu) {
    return std::clamp((hu - from_hu) / (to_hu - from_hu), 0.0, 1.0) * 255;
  };
  if (s.scan != nullptr) {
    const Image* const ct = &s.scan->ct;
    const Mat3 inv = inverse(ct->frame.direction);
    return [ct, inv, grey](Vec3 p) {
      const Frame& f = ct->frame;
      const Vec3 v = inv * (p - f.origin_mm), x{v.x / f.spacing_mm.x, v.y / f.spacing_mm.y, v.z / f.spacing_mm.z};
      for (std::size_t a = 0; a < 3; ++a) {
        if (x[a] < -0.5 || x[a] > f.dims[a] - 0.5) return 0.0;
      }
      return grey(sample_linear(*ct, x));
    };
  }
  if (s.hu != nullptr) {
    const auto sampler = std::make_shared<GridSampler>(*s.hu);
    const auto background = static_cast<float>(s.hu->background);
    return [sampler, background, grey](Vec3 p) {
      const float v = sampler->nearest(p);
      return v == background ? 0.0 : grey(static_cast<double>(v));
    };
  }
  return [&s](Vec3 p) { return s.bone->nearest(p) >= 0.5F ? 200.0 : 0.0; };
}

// 0: no bone; 1: bone, interpolated between voxels. Then the structure there.
std::vector<std::uint8_t> kinds(const SliceView& view, const std::function<int(Vec3)>& kind) {
  std::vector<std::uint8_t> out(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
  std::size_t at = 0;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) out[at++] = static_cast<std::uint8_t>(kind(view.world(x, y)));
  }
  return out;
}

// Draws where a kind ends, on its inner side.
void outline(Picture& p, const std::vector<std::uint8_t>& kind, const std::function<Rgb8(int)>& colour, int thick) {
  const auto of = [&](int x, int y) {
    return kind[static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width) + static_cast<std::size_t>(x)];
  };
  for (int y = 1; y + 1 < p.height; ++y) {
    for (int x = 1; x + 1 < p.width; ++x) {
      const int k = of(x, y);
      if (k == 0 || (of(x - 1, y) == k && of(x + 1, y) == k && of(x, y - 1) == k && of(x, y + 1) == k)) continue;
      for (int dy = 0; dy < thick; ++dy) {
        for (int dx = 0; dx < thick; ++dx) put(p, x + dx, y + dy, colour(k));
      }
    }
  }
}

void write_letters(Picture& p, Plane plane) {
  const char* const letters = plane == Plane::axial ? "RLAP" : plane == Plane::coronal ? "RLHF" : "APHF";
  const int size = std::max(12, p.width / 22);
  const auto letter = [&](int n, int x, int y) { write_text(p, std::string_view(letters + n, 1), x, y, size); };
  letter(0, 6, p.height / 2);
  letter(1, p.width - 6 - size * 3 / 4, p.height / 2);
  letter(2, p.width / 2, size + 6);
  letter(3, p.width / 2, p.height - 8);
}

Picture cut(const Subject& s, const SliceView& view, double from_hu, double to_hu, bool letters, int thick) {
  Picture p = draw_slice(view, grey_under(s, from_hu, to_hu));
  const Frame& f = s.bone->frame();
  const Mat3 inv = inverse(f.direction);
  outline(
      p,
      kinds(view,
            [&](Vec3 w) {
              const Vec3 v = inv * (w - f.origin_mm);
              return linear_at(*s.bone, {v.x / f.spacing_mm.x, v.y / f.spacing_mm.y, v.z / f.spacing_mm.z}) >= 0.5F ? 1
                                                                                                                    : 0;
            }),
      [](int) { return kOutline; }, thick);
  if (s.structures != nullptr) {
    const Frame& l = s.structures->frame;
    const Mat3 back = inverse(l.direction);
    const auto kind = kinds(view, [&](Vec3 w) {
      const Vec3 v = back * (w - l.origin_mm);
      int x[3];
      for (std::size_t a = 0; a < 3; ++a) {
        x[a] = static_cast<int>(std::floor(v[a] / l.spacing_mm[a] + 0.5));
        if (x[a] < 0 || x[a] >= l.dims[a]) return 0;
      }
      return static_cast<int>(s.structures->at(x[0], x[1], x[2]));
    });
    const auto colour = [&](int k) {
      for (const Structure& each : s.structures->structures) {
        if (each.value == k) return each.rgb;
      }
      return Rgb8{0, 200, 200};
    };
    for (std::size_t i = 0; i < kind.size(); ++i) {
      if (kind[i] != 0) put(p, static_cast<int>(i) % p.width, static_cast<int>(i) / p.width, colour(kind[i]), 0.35);
    }
    outline(p, kind, colour, thick);
  }
  if (letters) {
    write_letters(p, view.plane);
    write_scale_bar(p, view.mm_per_pixel, 255);
  }
  return p;
}

constexpr double kMarginMm = 6;  // around the bone: soft tissue at its edge, no more of a face

// The index axis and its sense that go along a direction of the body.
std::pair<std::size_t, bool> axis_along(const Frame& f, Vec3 direction) {
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a) {
    if (std::abs(dot(f.direction.column[a], direction)) > std::abs(dot(f.direction.column[axis], direction))) axis = a;
  }
  return {axis, dot(f.direction.column[axis], direction) > 0};
}

}  // namespace

std::pair<Vec3, Vec3> bounds_of_bone(const BrickGrid& bone) {
  Ijk lo{1 << 30, 1 << 30, 1 << 30}, hi{-1, -1, -1};
  for (VoxelKey key = 0; key < bone.brick_count() * BrickGrid::kVoxels; ++key) {
    if (bone.value(key) < 0.5F) continue;
    const Ijk c = bone.coordinate(key);
    lo = {std::min(lo.i, c.i), std::min(lo.j, c.j), std::min(lo.k, c.k)};
    hi = {std::max(hi.i, c.i), std::max(hi.j, c.j), std::max(hi.k, c.k)};
  }
  if (hi.i < 0) lo = hi = {0, 0, 0};
  Vec3 a{1e30, 1e30, 1e30}, b{-1e30, -1e30, -1e30};
  for (int c = 0; c < 8; ++c) {
    const Vec3 p = bone.frame().world_from_index(
        {double((c & 1) != 0 ? hi.i : lo.i), double((c & 2) != 0 ? hi.j : lo.j), double((c & 4) != 0 ? hi.k : lo.k)});
    for (std::size_t n = 0; n < 3; ++n) {
      a[n] = std::min(a[n], p[n]);
      b[n] = std::max(b[n], p[n]);
    }
  }
  return {a, b};
}

Vec3 cut_point(const Subject& s) {
  return s.measures.empty() ? (s.lo_mm + s.hi_mm) * 0.5 : s.measures.front().middle_mm;
}

void draw_cuts(const Subject& s, Pictures& into, const Context& context) {
  constexpr int kLong = 560;
  const Vec3 size = s.hi_mm - s.lo_mm + Vec3{2 * kMarginMm, 2 * kMarginMm, 2 * kMarginMm};
  constexpr const char* kPlanes[] = {"axial", "coronal", "sagittal"};
  for (int n = 0; n < 3; ++n) {
    context.check_cancelled();
    SliceView view;
    view.plane = static_cast<Plane>(n);
    view.centre_mm = (s.lo_mm + s.hi_mm) * 0.5;
    view.through_mm = cut_point(s);
    const double w = n == 2 ? size.y : size.x, h = n == 0 ? size.y : size.z;
    view.mm_per_pixel = std::max(w, h) / kLong;
    view.width = static_cast<int>(std::lround(w / view.mm_per_pixel));
    view.height = static_cast<int>(std::lround(h / view.mm_per_pixel));
    if (s.scan != nullptr) into[std::string("soft-") + kPlanes[n]] = cut(s, view, -160, 240, true, 1);
    into[std::string("bone-") + kPlanes[n]] = cut(s, view, -500, 1500, true, 1);
  }
}

void draw_slices(const Subject& s, Pictures& into) {
  constexpr int kSlices = 8, kWide = 250;
  const Vec3 size = s.hi_mm - s.lo_mm + Vec3{2 * kMarginMm, 2 * kMarginMm, 0};
  for (int n = 0; n < kSlices; ++n) {
    SliceView view;
    view.centre_mm = (s.lo_mm + s.hi_mm) * 0.5;
    view.through_mm = view.centre_mm;
    view.through_mm.z = s.lo_mm.z + (n + 0.5) / kSlices * (s.hi_mm.z - s.lo_mm.z);
    view.mm_per_pixel = size.x / kWide;
    view.width = kWide;
    view.height = static_cast<int>(std::lround(size.y / view.mm_per_pixel));
    into["slice-" + std::to_string(n + 1)] = cut(s, view, -500, 1500, false, 1);
  }
}

void draw_bone(const Subject& s, std::span<const float> below, Pictures& into) {
  if (s.surface == nullptr || s.surface->triangles.empty()) return;
  std::vector<Rgb8> rgb(below.size());
  for (std::size_t p = 0; p < rgb.size(); ++p) {
    // Red below half a millimetre, yellow at one, bone from two on.
    const double t = static_cast<double>(below[p]);
    const auto mix = [](Rgb8 a, Rgb8 b, double share) {
      Rgb8 c{};
      for (std::size_t n = 0; n < 3; ++n)
        c[n] = static_cast<std::uint8_t>(std::lround(a[n] + std::clamp(share, 0.0, 1.0) * (b[n] - a[n])));
      return c;
    };
    constexpr Rgb8 kRed{205, 45, 35}, kYellow{245, 190, 60}, kBone{237, 226, 200};
    rgb[p] = t < 1 ? mix(kRed, kYellow, 2 * (t - 0.5)) : mix(kYellow, kBone, (t - 1) / (kPaleMm - 1));
  }
  const Vec3 size = s.hi_mm - s.lo_mm, centre = (s.lo_mm + s.hi_mm) * 0.5;
  constexpr int kPixels = 440;
  const double mm_per_pixel = 1.04 * std::max({size.x, size.y, size.z, 1.0}) / kPixels;
  // From the corner the box is as wide as its diagonal.
  const double across = std::hypot(size.x, size.y),
               thin_mm_per_pixel = 1.02 * std::max({across, size.z + 0.25 * across, 1.0}) / kPixels;
  std::vector<SideView> views;
  for (const ViewFrom from :
       {ViewFrom::front, ViewFrom::back, ViewFrom::left, ViewFrom::right, ViewFrom::above, ViewFrom::below})
    views.push_back({from, mm_per_pixel});
  const std::size_t sides = views.size();
  if (below.size() == s.surface->points_mm.size()) {
    for (const ViewFrom from : {ViewFrom::left_front, ViewFrom::below})
      views.push_back({from, thin_mm_per_pixel, true});
  }
  std::vector<Picture> pictures = draw_sides(*s.surface, views, centre, kPixels, rgb);
  for (std::size_t n = 0; n < pictures.size(); ++n) {
    std::string name(EnumNames<ViewFrom>::values[static_cast<std::size_t>(views[n].from)]);
    if (n >= sides) {
      std::replace(name.begin(), name.end(), '_', '-');
      into["thin-" + name] = std::move(pictures[n]);
      continue;
    }
    Picture& p = pictures[n];
    const std::string_view letters = sides_of(views[n].from);
    write_text(p, letters.substr(0, 1), 20, 44, 26, {60, 70, 90});
    write_text(p, letters.substr(1, 1), kPixels - 44, 44, 26, {60, 70, 90});
    write_scale_bar(p, mm_per_pixel, 40);
    into["side-" + name] = std::move(p);
  }
}

void draw_structures(const Subject& s, Pictures& into, const Context& context) {
  if (s.surface == nullptr || s.surface->triangles.empty() || s.structures == nullptr) return;
  const Vec3 size = s.hi_mm - s.lo_mm, centre = (s.lo_mm + s.hi_mm) * 0.5;
  SnapshotParams view;
  view.width = view.height = 560;
  const Vec3 where = s.measures.empty() ? centre : s.measures.front().middle_mm;
  view.view = where.x < centre.x - 0.1 * size.x   ? ViewFrom::right
              : where.x > centre.x + 0.1 * size.x ? ViewFrom::left
                                                  : ViewFrom::left_front;
  into["structures"] = snapshot({Surface(s.surface), *s.structures, Surface(s.surface)}, view, context);
}

void draw_removed(const Subject& s, Pictures& into) {
  if (s.scan == nullptr) return;
  const Image& ct = s.scan->ct;
  const Labels& mask = s.scan->mask;
  const Frame& f = ct.frame;
  struct View {
    const char* name;
    Vec3 right, down;
  };
  constexpr std::array<View, 3> kViews{{{"removed-axial", {1, 0, 0}, {0, 1, 0}},
                                        {"removed-front", {1, 0, 0}, {0, 0, -1}},
                                        {"removed-side", {0, 1, 0}, {0, 0, -1}}}};
  // Voxels that were bone by their value and are not in the mask.
  struct Projection {
    std::size_t right, down;
    bool right_forward, down_forward;
    std::vector<std::uint32_t> kept, gone;
    int w, h;
  };
  std::vector<Projection> projections;
  for (const View& v : kViews) {
    const auto [r, rf] = axis_along(f, v.right);
    auto [d, df] = axis_along(f, v.down);
    if (d == r) return;  // a scan that lies at 45 degrees to everything
    Projection p{r, d, rf, df, {}, {}, f.dims[r], f.dims[d]};
    p.kept.resize(static_cast<std::size_t>(p.w) * static_cast<std::size_t>(p.h));
    p.gone.resize(p.kept.size());
    projections.push_back(std::move(p));
  }
  std::size_t at = 0, removed = 0;
  for (int k = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      for (int i = 0; i < f.dims[0]; ++i, ++at) {
        const bool kept = mask.voxels[at] != 0,
                   gone = !kept && ct.voxels[at] >= s.lower_hu && ct.voxels[at] <= s.upper_hu;
        if (!kept && !gone) continue;
        removed += gone ? 1 : 0;
        const std::array<int, 3> x{i, j, k};
        for (Projection& p : projections) {
          const int px = p.right_forward ? x[p.right] : p.w - 1 - x[p.right],
                    py = p.down_forward ? x[p.down] : p.h - 1 - x[p.down];
          ++(kept
                 ? p.kept
                 : p.gone)[static_cast<std::size_t>(py) * static_cast<std::size_t>(p.w) + static_cast<std::size_t>(px)];
        }
      }
    }
  }
  if (removed == 0) return;
  for (std::size_t v = 0; v < kViews.size(); ++v) {
    const Projection& p = projections[v];
    const double sr = f.spacing_mm[p.right], sd = f.spacing_mm[p.down], mm = std::max(p.w * sr, p.h * sd) / 380;
    Picture picture{std::max(1, static_cast<int>(std::lround(p.w * sr / mm))),
                    std::max(1, static_cast<int>(std::lround(p.h * sd / mm))),
                    {}};
    picture.rgb.assign(static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height) * 3, 255);
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        // The most of what falls on the pixel: a wire a voxel wide must not get lost between two pixels.
        const int x0 = static_cast<int>(x * mm / sr), x1 = std::max(x0 + 1, static_cast<int>((x + 1) * mm / sr));
        const int y0 = static_cast<int>(y * mm / sd), y1 = std::max(y0 + 1, static_cast<int>((y + 1) * mm / sd));
        std::uint32_t kept = 0, gone = 0;
        for (int b = y0; b < std::min(y1, p.h); ++b) {
          for (int a = x0; a < std::min(x1, p.w); ++a) {
            const auto c = static_cast<std::size_t>(b) * static_cast<std::size_t>(p.w) + static_cast<std::size_t>(a);
            kept = std::max(kept, p.kept[c]);
            gone = std::max(gone, p.gone[c]);
          }
        }
        const auto grey = static_cast<std::uint8_t>(std::lround(255 - std::min(150.0, 30 * std::log2(1.0 + kept))));
        put(picture, x, y, {grey, grey, grey});
        if (gone > 0) put(picture, x, y, kGone, std::min(1.0, 0.55 + 0.1 * gone));
      }
    }
    write_scale_bar(picture, mm, 40);
    into[kViews[v].name] = std::move(picture);
  }
}

std::vector<double> histogram_of(const Image& ct) {
  std::vector<double> bins(static_cast<std::size_t>((kHistogramTo - kHistogramFrom) / kHistogramStep));
  for (const std::int16_t v : ct.span()) {
    if (v >= kHistogramFrom && v < kHistogramTo)
      bins[static_cast<std::size_t>((v - kHistogramFrom) / kHistogramStep)] += 1;
  }
  const double most = std::max(2.0, *std::max_element(bins.begin(), bins.end()));
  for (double& b : bins) b = b < 1 ? 0 : std::round(1000 * std::log1p(b) / std::log1p(most)) / 1000;
  return bins;
}

}  // namespace osteo::inline assessment::case_report
