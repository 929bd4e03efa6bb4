#include "osteo/imaging/image/structures.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"

namespace osteo::inline imaging {
namespace {

std::map<int, std::string> parse_names(std::string_view rest) {
  std::map<int, std::string> names;
  while (!trimmed(rest).empty()) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const std::string_view item = trimmed(rest.substr(0, comma));
    rest.remove_prefix(std::min(comma + 1, rest.size()));
    const std::size_t equals = item.find('=');
    const std::string value(trimmed(item.substr(0, equals)));
    const bool number =
        !value.empty() && value.find_first_not_of("0123456789") == std::string::npos && value.size() < 4;
    const int v = number ? std::atoi(value.c_str()) : 0;
    const std::string name(equals == std::string_view::npos ? "" : trimmed(item.substr(equals + 1)));
    if (v < 1 || v > 255 || name.empty()) {
      throw Error(ExitCode::usage, "--names: '" + std::string(item) + "' is not VALUE=NAME with a value from 1 to 255",
                  "like --names '1=facial nerve, 2=sigmoid sinus'");
    }
    names[v] = name;
  }
  return names;
}

// Nerves yellow, arteries red, veins blue, as atlases have it; the rest in turn.
std::array<std::uint8_t, 3> colour_for(const std::string& name, std::size_t n) {
  const std::string low = lower_case(name);
  const auto has = [&](const char* word) { return low.find(word) != std::string::npos; };
  if (has("nerve") || has("nerv") || has("chorda")) return {244, 214, 49};
  if (has("arter") || has("carotid")) return {216, 60, 50};
  if (has("vein") || has("sinus") || has("jugular") || has("ven")) return {60, 110, 210};
  if (has("bone") || has("ossicle") || has("malleus") || has("incus") || has("stapes")) return {241, 232, 210};
  static constexpr std::array<std::array<std::uint8_t, 3>, 6> kTurn{
      {{128, 174, 128}, {183, 156, 220}, {230, 150, 90}, {111, 184, 210}, {220, 130, 170}, {160, 160, 80}}};
  return kTurn[n % kTurn.size()];
}

// The facial canal: labyrinthine part 0.97 +- 0.35 mm wide, ganglion 2.07 +- 0.42 (194 petrous bones, S. Fondjo et al.,
// African J. Neurol. Sci.), so 1.5 mm of radius hold all but the widest ganglia; it is 33.3 +- 2.0 mm long (47 people,
// doi 10.15953/j.ctta.2026.163), and its segments 21 to 36 mm in all (docs/validation/phantom.md, as all that follows).
// The mandibular canal is 70.7 +- 5.2 mm long (Diagnostics 2024, 14, 1914) and 2 to 3 wide. Most volumes are those of a
// tube as wide and long as that with a quarter more, and for the others twice what anatomies give. Sigmoid sinus: 8 to
// 12 mm wide, with bulb and vein. Ear canal: its bony part 16 mm long, 7 to 9 wide, and as much of cartilage. Ossicles:
// from malleus to stapes about 12 mm. Labels of a nerve or a vessel may go on out of the bone, so they may be three
// times as long as their part in it.
constexpr std::array<StructureLimits, 12> kLimits{{{"facial nerve", 1.5, 300, 20, {20, 110}, {0.8, 2.4}, true},
                                                   {"chorda tympani", 0.6, 45},
                                                   {"alveolar nerve", 2.5, 1800},
                                                   {"mandibular canal", 2.5, 1800},
                                                   {"malleus", 0, 60},
                                                   {"incus", 0, 70},
                                                   {"stapes", 0, 30},
                                                   {"ossicle", 0, 160, 8, {5, 25}, {}, false},
                                                   {"cochlea", 0, 300},
                                                   {"labyrinth", 0, 600, 60, {12, 60}, {}, true},
                                                   {"sigmoid sinus", 0, 25000, 500, {20, 160}, {4, 18}, true},
                                                   {"ear canal", 0, 5000, 200, {10, 60}, {4, 14}, true}}};

}  // namespace

std::string plain_name(std::string_view name) {
  std::string words;
  bool apart = false;
  for (const char c : lower_case(std::string(name))) {
    // Letters beyond ASCII are parts of words.
    const bool letter = static_cast<unsigned char>(c) >= 0x80 || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    if (letter && apart && !words.empty()) words += ' ';
    if (letter) words += c;
    apart = !letter;
  }
  return words;
}

bool is_called(std::string_view name, std::string_view term) {
  static constexpr std::array<std::string_view, 6> kSomethingElse{"segment", "segments", "part",
                                                                  "artery",  "arteries", "internal"};
  const std::string words = ' ' + plain_name(name) + ' ', whole = ' ' + std::string(term);
  if (words.find(whole + ' ') == std::string::npos && words.find(whole + "s ") == std::string::npos) return false;
  return std::none_of(kSomethingElse.begin(), kSomethingElse.end(), [&](std::string_view word) {
    const std::string other = ' ' + std::string(word) + ' ';
    return words.find(other) != std::string::npos && (whole + ' ').find(other) == std::string::npos;
  });
}

std::optional<StructureLimits> structure_limits(std::string_view name) {
  for (const StructureLimits& l : kLimits)
    if (is_called(name, l.name)) return l;
  return std::nullopt;
}

std::string implausible_volume(std::string_view name, double volume_mm3) {
  const auto limits = structure_limits(name);
  if (!limits || volume_mm3 <= limits->volume_mm3) return {};
  return std::string(name) + " has " + format_number(std::round(volume_mm3)) + " mm3, no " + std::string(limits->name) +
         " has more than " + format_number(limits->volume_mm3) + ": look at it, or at its name";
}

Labels name_structures(const Labels& labels, const StructuresParams& params, const Image* ct, const Context& context) {
  const auto given = parse_names(params.names);
  std::array<std::uint64_t, 256> count{}, inside{};
  const Frame& f = labels.frame;
  std::size_t at = 0;
  for (int k = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      for (int i = 0; i < f.dims[0]; ++i, ++at) {
        const std::uint8_t v = labels.voxels[at];
        if (v == 0) continue;
        ++count[v];
        if (ct == nullptr) continue;
        const Vec3 x = ct->frame.index_from_world(
            f.world_from_index({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)}));
        bool in = true;
        for (std::size_t a = 0; a < 3; ++a) in = in && x[a] > -0.5 && x[a] < ct->frame.dims[a] - 0.5;
        inside[v] += in ? 1 : 0;
      }
    }
  }
  std::uint64_t all = 0, all_inside = 0;
  for (std::size_t v = 1; v < 256; ++v) {
    all += count[v];
    all_inside += inside[v];
  }
  if (all == 0) throw Error(ExitCode::failed, "the label map is empty: no voxel is above 0");
  if (ct != nullptr && all_inside == 0) {
    throw Error(ExitCode::failed,
                "no labelled voxel lies inside the CT: the label map is of another scan, or its frame is wrong",
                "'osteo info' shows where each lies (LPS mm)");
  }
  if (ct != nullptr && 2 * all_inside < all) context.warn("more than half of the labelled voxels lie outside the CT");
  for (const auto& [value, name] : given) {
    if (count[static_cast<std::size_t>(value)] == 0)
      context.warn("no voxel has the value " + std::to_string(value) + " (" + name + ")");
  }
  Labels result = labels;
  result.structures.clear();
  bool left_out = false;
  for (std::size_t v = 1; v < 256; ++v) {
    if (count[v] == 0) continue;
    Structure s{static_cast<std::uint8_t>(v), "structure " + std::to_string(v), {}};
    bool named = false;
    for (const Structure& own : labels.structures) {
      if (own.value == v) s = own;
      named |= own.value == v;
    }
    if (const auto it = given.find(static_cast<int>(v)); it != given.end()) {
      s.name = it->second;
      named = true;
    }
    if (params.only_named && !named) {
      count[v] = 0;
      left_out = true;
      continue;
    }
    if (s.rgb == std::array<std::uint8_t, 3>{}) s.rgb = colour_for(s.name, result.structures.size());
    const double volume = static_cast<double>(count[v]) * f.voxel_volume_mm3();
    context.report(s.name + " mm3", volume);
    if (ct != nullptr && !s.doubt.empty())
      context.warn(s.name + " is not to be trusted here, as what drew it says: " + s.doubt);
    if (const std::string why = implausible_shape(labels, s); !why.empty()) context.warn(why);
    result.structures.push_back(std::move(s));
  }
  if (result.structures.empty())
    throw Error(ExitCode::failed, "no value of the label map has a name", "give --names, or leave --only-named out");
  if (left_out) {
    auto kept = make_voxels<std::uint8_t>(f.voxel_count());
    for (std::size_t v = 0; v < f.voxel_count(); ++v) kept[v] = count[labels.voxels[v]] > 0 ? labels.voxels[v] : 0;
    result.voxels = std::move(kept);
  }
  return result;
}

}  // namespace osteo::inline imaging
