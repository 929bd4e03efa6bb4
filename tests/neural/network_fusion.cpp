// A network's labels, what is found without training, and both joined, beside the truth of unseen phantoms: the table
// of docs/how-to/segment-network.md. Not a test. usage: network_fusion MODEL_FOLDER FIRST LAST CACHE_FOLDER [ruined]
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/image/structures.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/imaging/neural/detail/trust.h"
#include "osteo/imaging/neural/segment_network.h"
#include "osteo/imaging/segment/ear.h"

using namespace osteo;

namespace {

// Values of the phantom by value of the shipped network (phantoms.py).
constexpr std::array<std::array<int, 2>, 9> kTruth{
    {{0, 0}, {6, 6}, {7, 7}, {12, 12}, {5, 5}, {18, 18}, {19, 19}, {17, 17}, {15, 15}}};

/// As calibrate.py ruins: blurred by 0.6 to 1.5 mm, with noise of 80 to 250 HU.
Image ruined(const Image& ct, int individual) {
  std::mt19937 random(static_cast<unsigned>(7000 + individual));
  const double sigma = std::uniform_real_distribution(0.6, 1.5)(random) / ct.frame.spacing_mm.x,
               noise = std::uniform_real_distribution(80.0, 250.0)(random);
  std::vector<float> v(ct.span().begin(), ct.span().end()), w(v.size());
  const int reach = static_cast<int>(std::ceil(3.5 * sigma));
  std::vector<float> kernel;
  float sum = 0;
  for (int r = -reach; r <= reach; ++r) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * r * r / (sigma * sigma))));
    sum += kernel.back();
  }
  const auto& d = ct.frame.dims;
  const std::array<std::size_t, 3> step{1, static_cast<std::size_t>(d[0]),
                                        static_cast<std::size_t>(d[0]) * static_cast<std::size_t>(d[1])};
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t n = 0; n < v.size(); ++n) {
      const int at = static_cast<int>(n / step[a] % static_cast<std::size_t>(d[a]));
      float x = 0;
      for (int r = -reach; r <= reach; ++r) {
        const int to = std::clamp(at + r, 0, d[a] - 1);
        x += kernel[static_cast<std::size_t>(r + reach)] *
             v[n + static_cast<std::size_t>(to) * step[a] - static_cast<std::size_t>(at) * step[a]];
      }
      w[n] = x / sum;
    }
    std::swap(v, w);
  }
  const auto out = make_voxels<std::int16_t>(v.size());
  std::normal_distribution<float> spread(0, static_cast<float>(noise));
  for (std::size_t n = 0; n < v.size(); ++n)
    out[static_cast<std::ptrdiff_t>(n)] =
        static_cast<std::int16_t>(std::clamp(v[n] + spread(random), -1024.0F, 3071.0F));
  return {ct.frame, out};
}

double dice(std::span<const std::uint8_t> labels, std::span<const std::uint8_t> truth,
            const std::vector<std::uint8_t>& values) {
  double ours = 0, theirs = 0, both = 0;
  for (std::size_t v = 0; v < labels.size(); ++v) {
    bool in = false, is = false;
    for (const std::uint8_t value : values) {
      in = in || labels[v] == value;
      is = is || truth[v] == kTruth[value][0];
    }
    ours += in, theirs += is, both += in && is;
  }
  return 2 * both / std::max(1.0, ours + theirs);
}

/// Dice of what find_ear_structures() finds without the network.
double dice_without(const Labels& truth, const ComparedStructure& s, const EarFindings& ear) {
  const auto is = [&](const char* word) { return s.name.find(word) != std::string::npos; };
  const int value = is("canal") ? 1 : is("cells") ? 2 : is("sinus") ? 3 : 0;
  if (value == 0) return 0;
  const std::size_t n = truth.span().size();
  std::vector<std::uint8_t> voxels(n);
  for (std::size_t v = 0; v < n; ++v) voxels[v] = ear.labels.voxels[v] == value ? s.values.front() : 0;
  return dice(voxels, truth.span(), s.values);
}

/// By class of the network and by what the other method says: how many places, how many are right to 0.3, 0.6, 1.2 mm.
struct Held {
  double places = 0;
  std::array<double, 3> right{};
};
std::map<std::string, std::map<std::pair<int, int>, Held>> held;

int band(int apart) {
  return apart == 255 ? 9 : apart == 0 ? 0 : apart <= 4 ? 1 : apart <= 7 ? 2 : apart <= 13 ? 3 : 4;
}

void hold(const Labels& labels, const Labels& classes, const EarComparison& c, const Labels& truth) {
  for (const ComparedStructure& s : c.structures) {
    if (!s.labelled || s.values.size() != 1) continue;
    const std::uint8_t value = s.values.front();
    std::vector<std::uint8_t> is(truth.span().size()), wall(is.size());
    const auto& d = truth.frame.dims;
    for (std::size_t v = 0; v < is.size(); ++v) is[v] = truth.voxels[v] == kTruth[value][0] ? 1 : 0;
    for (int k = 1; k + 1 < d[2]; ++k)
      for (int j = 1; j + 1 < d[1]; ++j)
        for (int i = 1; i + 1 < d[0]; ++i) {
          const std::size_t v = truth.offset(i, j, k);
          if (is[v] != 0)
            wall[v] = !(is[v - 1] && is[v + 1] && is[truth.offset(i, j - 1, k)] && is[truth.offset(i, j + 1, k)] &&
                        is[truth.offset(i, j, k - 1)] && is[truth.offset(i, j, k + 1)])
                          ? 1
                          : 0;
        }
    const auto to_in = squared_distance_mm2(is, truth.frame, 1), to_out = squared_distance_mm2(is, truth.frame, 0);
    for (std::size_t v = 0; v < is.size(); ++v) {
      if (labels.voxels[v] != value || classes.voxels[v] == 0) continue;
      const double off = wall[v] != 0   ? 0
                         : to_in[v] > 0 ? std::sqrt(static_cast<double>(to_in[v]))
                                        : std::sqrt(static_cast<double>(to_out[v])) - truth.frame.spacing_mm.x;
      Held& h = held[s.name][{classes.voxels[v], band(c.apart[v])}];
      h.places += 1;
      for (std::size_t n = 0; n < 3; ++n) h.right[n] += off <= kUncertaintyMm[n] + 1e-6 ? 1 : 0;
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) return 2;
  const bool ruin = argc > 5 && std::strcmp(argv[5], "ruined") == 0;
  std::filesystem::create_directories(argv[4]);
  try {
    for (int individual = std::atoi(argv[2]); individual <= std::atoi(argv[3]); ++individual) {
      PhantomParams p;
      p.region = PhantomRegion::temporal;
      p.spacing_mm = 0.5;
      p.individual = individual;
      p.noise_hu = 30;
      const Phantom phantom = make_phantom(p);
      const Image ct = ruin ? ruined(phantom.ct, individual) : phantom.ct;
      const auto at = [&](const char* what) {
        return std::filesystem::path(argv[4]) / (std::to_string(individual) + (ruin ? "r" : "") + what);
      };
      NetworkLabels found;
      if (std::filesystem::exists(at("l.seg.nrrd"))) {
        found.structures = load_labels(at("l.seg.nrrd"));
        found.uncertainty = load_labels(at("u.seg.nrrd"));
      } else {
        NetworkParams params;
        params.mirror = false;
        params.step = 0.8;
        found = segment_with_network(ct, argv[1], params);
        save_labels(found.structures, at("l.seg.nrrd"));
        save_labels(found.uncertainty, at("u.seg.nrrd"));
      }
      const EarComparison c = compare_with_ear(ct, found.structures);
      // What the table of shapes says of the truth and of the network's labels.
      for (const Structure& known : found.structures.structures) {
        const int truth = known.value < kTruth.size() ? kTruth[known.value][0] : 0;
        if (truth == 0 || !structure_limits(known.name)) continue;
        for (const bool of_truth : {true, false}) {
          const Labels& l = of_truth ? phantom.labels : found.structures;
          const auto value = of_truth ? static_cast<std::uint8_t>(truth) : known.value;
          const StructureShape shape = shape_of(l, value);
          std::printf("%d%s | shape of %s, %s: %.0f mm3, %.1f mm long, %.2f wide, %.3f in one piece%s %s\n", individual,
                      ruin ? " ruined" : "", known.name.c_str(), of_truth ? "true" : "network", shape.volume_mm3,
                      shape.length_mm, shape.width_mm, shape.largest_share, shape.cut_off ? ", cut off" : "",
                      implausible_shape(l, {.value = value, .name = known.name}).c_str());
        }
      }
      EarParams all;
      all.what = "ear_canal,air_cells,sigmoid_sinus";
      const EarFindings ear = find_ear_structures(ct, all);
      for (const ComparedStructure& s : c.structures) {
        const double alone = dice(found.structures.span(), phantom.labels.span(), s.values),
                     fused = dice(c.fused.span(), phantom.labels.span(), s.values);
        std::printf("%d%s | %-30s | network %.3f | without %.3f | fused %.3f | both %.3f | within %.2f | %s%s",
                    individual, ruin ? " ruined" : "", s.name.c_str(), alone, dice_without(phantom.labels, s, ear),
                    fused, s.dice, s.within_mm, s.labelled ? "" : "no label; ",
                    s.found ? "" : ("not found: " + s.why).c_str());
        for (const Structure& known : found.structures.structures)
          if (known.value == s.values.front() && !known.doubt.empty()) std::printf(" doubted;");
        for (const DifferingPlace& place : s.places)
          std::printf(" [%.1f over %.1f at %.1f %.1f %.1f]", place.apart_mm, place.along_mm, place.at_mm.x,
                      place.at_mm.y, place.at_mm.z);
        std::printf("\n");
      }
      hold(c.fused, found.uncertainty, c, phantom.labels);
      std::fflush(stdout);
    }
    for (const auto& [name, rows] : held) {
      for (const auto& [key, h] : rows)
        std::printf("%-16s class %d band %d: %8.0f places, right %.3f %.3f %.3f\n", name.c_str(), key.first, key.second,
                    h.places, h.right[0] / h.places, h.right[1] / h.places, h.right[2] / h.places);
    }
  } catch (const Error& error) {
    std::fprintf(stderr, "network_fusion: %s\n", error.what());
    return 1;
  }
  return 0;
}
