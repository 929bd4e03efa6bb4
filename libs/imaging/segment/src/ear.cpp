#include "osteo/imaging/segment/ear.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <sstream>

#include "ear_parts.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/imaging/image/threshold.h"

namespace osteo::inline imaging {
namespace {

using namespace segment;

constexpr std::array<std::string_view, kEarStructures> kTitles{
    "external ear canal", "air cells and middle ear", "sigmoid sinus", "tegmen", "dura", "labyrinth"};
constexpr std::array<std::array<std::uint8_t, 3>, kEarStructures> kColours{
    {{111, 184, 210}, {150, 200, 230}, {60, 110, 210}, {230, 150, 90}, {220, 130, 170}, {128, 174, 128}}};

std::vector<EarStructure> parse_what(const std::string& what) {
  std::array<bool, kEarStructures> asked{};
  constexpr auto& names = EnumNames<EarStructure>::values;
  std::stringstream words(what);
  std::string word;
  while (std::getline(words, word, ',')) {
    word.erase(std::remove(word.begin(), word.end(), ' '), word.end());
    if (word == "all") {
      asked.fill(true);
      continue;
    }
    const auto it = std::find(names.begin(), names.end(), word);
    if (it == names.end()) {
      std::vector<std::string> known(names.begin(), names.end());
      known.emplace_back("all");
      const std::string near = nearest_name(word, known);
      std::string all;
      for (const std::string& k : known) all += (all.empty() ? "" : ", ") + k;
      throw Error(
          ExitCode::usage,
          "--what: there is no finder for '" + word + "'" + (near.empty() ? "" : "; did you mean '" + near + "'?"),
          all);
    }
    asked[static_cast<std::size_t>(it - names.begin())] = true;
  }
  std::vector<EarStructure> list;
  for (std::size_t i = 0; i < asked.size(); ++i)
    if (asked[i]) list.push_back(static_cast<EarStructure>(i));
  if (list.empty()) throw Error(ExitCode::usage, "--what names no structure");
  return list;
}

/// The same CT with left and right exchanged.
Image mirrored(const Image& ct) {
  Image m = ct;
  m.frame.origin_mm.x *= -1;
  for (Vec3& c : m.frame.direction.column) c.x *= -1;
  return m;
}

/// Noise that would hide what is looked for is smoothed away, and thin walls with it.
void quieten(Field& f, double noise_hu, int threads) {
  constexpr double kBearable = 45;
  if (noise_hu <= kBearable) return;
  // A Gaussian of s voxels leaves (2 sqrt(pi) s)^-1.5 of white noise.
  const double s = std::max(0.45, std::pow(noise_hu / kBearable, 2.0 / 3) / (2 * std::sqrt(3.14159265358979)));
  f.v = smoothed(f.v, f.n, s, threads);
}

double fine_spacing(const Vec3& s) {
  const double least = std::min({s.x, s.y, s.z});
  if (least < 0.4) return std::max(0.4, least);
  return least / std::max(1.0, std::round(least / 0.5));
}

/// A point within the labyrinth, where one was given; checked where it is wanted.
std::optional<Vec3> labyrinth_point(const Image& ct, const EarParams& params, bool wanted) {
  std::optional<Vec3> point;
  if (const auto& at = params.labyrinth_mm) point = Vec3{(*at)[0], (*at)[1], (*at)[2]};
  if (!wanted) return point;
  if (!point && params.what.find("all") == std::string::npos)
    throw Error(ExitCode::usage, "the labyrinth needs a point within it",
                "--labyrinth-mm X,Y,Z (LPS), in the vestibule");
  if (!point) return point;
  const Vec3 x = ct.frame.index_from_world(*point);
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(x[a] >= 0 && x[a] <= ct.frame.dims[a] - 1))
      throw Error(ExitCode::usage, "--labyrinth-mm lies outside the CT");
  }
  return point;
}

/// Nothing: the scan has no soft tissue and bone to go by.
std::optional<Levels> levels_of(const Image& ct, const Context& context) {
  Levels levels;
  try {
    const BoneGuide guide = guide_threshold(ct, context.threads);
    levels.soft_hu = guide.soft_tissue_hu;
    levels.bone_hu = guide.dense_bone_hu;
  } catch (const Error& e) {
    if (e.code() != ExitCode::failed) throw;
    return std::nullopt;
  }
  levels.noise_hu = noise_of(ct);
  levels.bone_above = 0.5 * (levels.soft_hu + levels.bone_hu);
  levels.air_below = 0.5 * (levels.soft_hu - 1000);
  levels.cell_below = 0.5 * (levels.bone_hu - 1000);
  context.report("soft_tissue_hu", levels.soft_hu);
  context.report("bone_hu", levels.bone_hu);
  context.report("noise_hu", levels.noise_hu);
  return levels;
}

/// The canal of a large image, looked for at 1 mm in its left half.
Canal coarse_canal(const Image& ct, Vec3 lo, Vec3 hi, const Levels& levels, const Context& context) {
  Vec3 half = lo;
  if (hi.x - lo.x > 120) {
    // The side of the middle of what is no air.
    double sum = 0, count = 0;
    const Field coarse = make_field(ct, lo, hi, 4, context.threads);
    for (std::size_t i = 0; i < coarse.size(); ++i) {
      if (static_cast<double>(coarse.v[i]) < levels.bone_above) continue;
      const auto p = coarse.place(i);
      sum += coarse.world(p[0], p[1], p[2]).x;
      count += 1;
    }
    half.x = (count > 0 ? sum / count : 0.5 * (lo.x + hi.x)) + 18;
  }
  Field coarse = make_field(ct, half, hi, 1.0, context.threads);
  quieten(coarse, levels.noise_hu, context.threads);
  return find_canal(coarse, levels, context);
}

/// Structures of one ear, the left one as the finders see it.
struct EarParts {
  std::array<Part, kEarStructures> of;
  std::vector<EarStructure> asked;

  [[nodiscard]] bool wants(EarStructure s) const { return std::find(asked.begin(), asked.end(), s) != asked.end(); }
  Part& operator[](EarStructure s) { return of[static_cast<std::size_t>(s)]; }
  const Part& operator[](EarStructure s) const { return of[static_cast<std::size_t>(s)]; }
};

/// What is placed by the canal has no place without it.
void leave_without_canal(EarParts& parts, const Canal& canal, std::initializer_list<EarStructure> placed_by_it) {
  for (const EarStructure s : placed_by_it) {
    parts[s].why = "no ear canal, by which it is placed: " + canal.why;
    parts[s].by_canal = true;
  }
}

/// Finds what the canal is the landmark of.
void find_by_canal(EarParts& parts, const Field& f, const Levels& levels, const Canal& canal, const Context& context) {
  using enum EarStructure;
  if (!canal.found) {
    leave_without_canal(parts, canal, {air_cells, sigmoid_sinus, tegmen, dura});
    return;
  }
  if (parts.wants(air_cells) || parts.wants(tegmen))
    parts[air_cells] = find_air_cells(f, levels, canal, context.sub(0.4, 0.5));
  if (!parts.wants(sigmoid_sinus) && !parts.wants(tegmen) && !parts.wants(dura)) return;
  const Brain brain = find_brain(f, levels, canal, context.sub(0.5, 0.6));
  for (const EarStructure s : {sigmoid_sinus, tegmen, dura}) parts[s].why = brain.why;
  if (!brain.found) return;
  parts[sigmoid_sinus] = find_sinus(f, levels, canal, context.sub(0.6, 0.9));
  const Part &air = parts[air_cells], &sinus = parts[sigmoid_sinus];
  if (air.found) {
    parts[tegmen] = find_tegmen(f, levels, canal, brain, air.mask, context);
  } else {
    parts[tegmen].why = air.why;
  }
  Mask none;
  if (!sinus.found) none.assign(f.size(), 0);
  parts[dura] = find_dura(f, levels, canal, brain, sinus.found ? sinus.mask : none, context.sub(0.9, 1));
}

/// Into the CT's voxels: those of which at least half lies in the part get `value`. `ct` as the finders saw it.
void paint(std::uint8_t* voxels, std::uint8_t value, const Part& part, const Field& f, const Frame& ct,
           const Context& context) {
  Field mask = f;
  for (std::size_t i = 0; i < mask.v.size(); ++i) mask.v[i] = part.mask[i] != 0 ? 1.0F : 0.0F;
  Vec3 lo, hi;
  bounds_of(f.frame(), lo, hi);
  const auto nx = static_cast<std::size_t>(ct.dims[0]), ny = static_cast<std::size_t>(ct.dims[1]);
  parallel_for(ct.voxel_count() / nx, 64, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      for (std::size_t i = 0; i < nx; ++i) {
        const Vec3 p =
            ct.world_from_index({static_cast<double>(i), static_cast<double>(r % ny), static_cast<double>(r / ny)});
        if (p.x < lo.x || p.y < lo.y || p.z < lo.z || p.x > hi.x || p.y > hi.y || p.z > hi.z) continue;
        if (mask.sample(p) >= 0.5) voxels[r * nx + i] = value;
      }
    }
  });
}

/// Labels and findings of what was asked for. `f`: null when nothing could be looked for.
void write_findings(EarFindings& result, const EarParts& parts, const Field* f, const Frame& ct, double min_quality,
                    const Context& context) {
  const Frame& frame = result.labels.frame;
  const std::size_t n = frame.voxel_count();
  const auto voxels = make_voxels<std::uint8_t>(n);
  std::fill(voxels.get(), voxels.get() + n, std::uint8_t{0});
  std::array<double, kEarStructures> volume{};
  if (f != nullptr) {
    // Of two that claim a voxel the last of this order has it.
    using enum EarStructure;
    constexpr std::array<EarStructure, kEarStructures> kOrder{dura,      tegmen,    air_cells,
                                                              ear_canal, labyrinth, sigmoid_sinus};
    for (const EarStructure s : kOrder) {
      const Part& part = parts[s];
      if (!parts.wants(s) || !part.found || part.quality < min_quality) continue;
      paint(voxels.get(), static_cast<std::uint8_t>(1 + static_cast<int>(s)), part, *f, ct, context);
    }
    for (std::size_t i = 0; i < n; ++i)
      if (voxels[i] != 0) volume[voxels[i] - 1U] += frame.voxel_volume_mm3();
  }
  for (const EarStructure s : parts.asked) {
    const auto at = static_cast<std::size_t>(s);
    const Part& part = parts[s];
    EarFinding finding{s, part.found && part.quality >= min_quality, part.quality, part.why, volume[at], part.by_canal};
    if (part.found && !finding.found)
      finding.why =
          "quality " + format_number(std::round(part.quality * 100) / 100) + " is below --min-quality; " + part.why;
    if (finding.found)
      result.labels.structures.push_back({static_cast<std::uint8_t>(1 + at), std::string(kTitles[at]), kColours[at]});
    result.findings.push_back(finding);
  }
  result.labels.voxels = voxels;
  context.progress(1.0);
}

}  // namespace

EarFindings find_ear_structures(const Image& given, const EarParams& params, const Context& context) {
  EarParts parts{{}, parse_what(params.what)};
  const std::optional<Vec3> labyrinth_at = labyrinth_point(given, params, parts.wants(EarStructure::labyrinth));
  const bool right = params.side == Side::right;
  const Image ct = right ? mirrored(given) : given;
  const auto flip = [&](Vec3 p) { return right ? Vec3{-p.x, p.y, p.z} : p; };

  EarFindings result;
  result.labels.frame = given.frame;
  const auto give_up = [&](const std::string& why) {
    for (Part& p : parts.of) p.why = why;
    write_findings(result, parts, nullptr, ct.frame, params.min_quality, context);
    return result;
  };
  const std::optional<Levels> levels = levels_of(ct, context);
  if (!levels) return give_up("no soft tissue and bone to go by (a dry skull?)");

  // Where the canal is: in a large image at 1 mm first.
  Vec3 lo, hi;
  bounds_of(ct.frame, lo, hi);
  const Vec3 size = hi - lo;
  if (std::min({size.x, size.y, size.z}) < 10) return give_up("the image is smaller than an ear");
  if (size.x > 100 || size.y > 130 || size.z > 110) {
    const Canal canal = coarse_canal(ct, lo, hi, *levels, context.sub(0, 0.2));
    if (!canal.found) {
      using enum EarStructure;
      parts[ear_canal] = canal;
      leave_without_canal(parts, canal, {air_cells, sigmoid_sinus, tegmen, dura, labyrinth});
      write_findings(result, parts, nullptr, ct.frame, params.min_quality, context);
      return result;
    }
    lo = canal.drum_mm + Vec3{-38, -40, -45};
    hi = canal.drum_mm + Vec3{42, 65, 42};
  }
  Field f = make_field(ct, lo, hi, fine_spacing(ct.frame.spacing_mm), context.threads);
  quieten(f, levels->noise_hu, context.threads);
  const Canal canal = find_canal(f, *levels, context.sub(0.2, 0.4));
  result.drum_mm = flip(canal.drum_mm);
  if (parts.wants(EarStructure::labyrinth)) {
    Part& part = parts[EarStructure::labyrinth];
    if (labyrinth_at) {
      part = find_labyrinth(f, *levels, flip(*labyrinth_at), context);
    } else {
      part.why = "no point within it was given (--labyrinth-mm)";
    }
  }
  parts[EarStructure::ear_canal] = canal;
  find_by_canal(parts, f, *levels, canal, context);
  write_findings(result, parts, &f, ct.frame, params.min_quality, context);
  return result;
}

}  // namespace osteo::inline imaging
