// Tubes and structures of the ear against their truth: the tables of docs/validation/structures.md. Not a test.
//   osteo_bench_segment tubes
//   osteo_bench_segment shapes [FIRST LAST MAX_RADIUS MAX_UNSURE] | fields [FIRST LAST SPACING NOISE]
//   osteo_bench_segment nerves|ears [FIRST LAST SPACING SLICE NOISE SCALE]
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <random>
#include <string>

#include "osteo/core/base/error.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/segment/ear.h"
#include "osteo/imaging/segment/tube.h"
#include "segment/ear_truth.h"
#include "segment/nerve_shapes.h"
#include "segment/tube_ct.h"

using namespace osteo;
using namespace osteo::test;

namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double cpu() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  return static_cast<double>(u.ru_utime.tv_sec + u.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
}

void tubes() {
  std::printf(
      "| tube | diameter mm | CT | mean mm | worst mm | radius mean mm | confidence | CPU s "
      "|\n|---|---|---|---|---|---|---|---|\n");
  const char* const names[] = {"straight", "helix", "genu"};
  for (int shape = 0; shape < 3; ++shape) {
    for (const double d : {0.6, 1.0, 1.5, 2.0, 3.0}) {
      const Line line = shape == 0 ? straight_line(d / 2) : shape == 1 ? helix(d / 2) : genu(d / 2);
      for (int kind = 0; kind < 6; ++kind) {
        TubeCt s;
        if (kind == 1) s.cellular = true;
        if (kind == 2) s.spacing_mm = {0.5, 0.5, 1};
        if (kind == 3) s.oblique = true;
        if (kind == 4) s.spacing_mm = {0.3, 0.3, 0.3};
        if (kind == 5) s.cellular = true, s.spacing_mm = {0.5, 0.5, 1}, s.oblique = true;
        const char* const ct_names[] = {"cortical", "cellular", "0.5x0.5x1",
                                        "oblique",  "0.3",      "cellular, 0.5x0.5x1, oblique"};
        const Image ct = make_tube_ct(line, s);
        const std::size_t n = line.points.size();
        std::vector<Vec3> points{line.points[3], line.points[n - 4]};
        if (shape == 1) points = {line.points[3], line.points[n / 3], line.points[2 * n / 3], line.points[n - 4]};
        const double c = cpu();
        try {
          const Tube t = trace_tube(ct, points, {});
          Line part{{line.points.begin() + 3, line.points.end() - 3}, line.radius_mm};
          const LineError e = line_error(t, part);
          std::printf("| %s | %.1f | %s | %.3f | %.2f | %.2f | %.2f | %.1f |\n", names[shape], d, ct_names[kind],
                      e.mean_mm, e.worst_mm, t.radius_mean_mm, t.confidence, cpu() - c);
        } catch (const Error& e) {
          std::printf("| %s | %.1f | %s | %s |\n", names[shape], d, ct_names[kind], e.what());
        }
        std::fflush(stdout);
      }
    }
  }
}

Line part_of(std::span<const TubePoint> t, double from, double to) {
  Line l;
  double arc = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (i > 0) arc += length(t[i].at_mm - t[i - 1].at_mm);
    if (arc >= from && arc <= to) l.points.push_back(t[i].at_mm), l.radius_mm += t[i].radius_mm;
  }
  l.radius_mm = (l.radius_mm - 1) / static_cast<double>(l.points.size());
  return l;
}

void nerves(int first, int last, double spacing, double slice, double noise) {
  std::printf(
      "| individual | nerve | mm | mean mm | worst mm | radius mm | true | confidence | unsure | CPU s "
      "|\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (int who = first; who <= last; ++who) {
    const HeadAnatomy head(static_cast<std::uint64_t>(who));
    for (const PhantomRegion region : {PhantomRegion::temporal, PhantomRegion::mandible}) {
      if (region == PhantomRegion::mandible && getenv("NOJAW")) continue;
      PhantomParams p;
      p.region = region;
      p.spacing_mm = spacing;
      p.slice_mm = slice;
      p.noise_hu = noise;
      p.individual = who;
      const Image ct = make_phantom(p).ct;
      struct Task {
        const char* name;
        Line line;
        std::vector<double> clicks;  // shares of the way
        double max_radius_mm = 2.5;
      };
      std::vector<Task> tasks;
      if (region == PhantomRegion::temporal) {
        const auto m = head.facial_nerve_marks();
        tasks.push_back({"facial", part_of(head.facial_nerve(), m.fundus_mm, m.foramen_mm), {0, 0.13, 0.5, 1}});
        tasks.push_back(
            {"facial, from the genu", part_of(head.facial_nerve(), m.geniculate_mm, m.foramen_mm), {0, 0.42, 1}});
        tasks.push_back({"facial, mastoid part", part_of(head.facial_nerve(), m.second_genu_mm, m.foramen_mm), {0, 1}});
        tasks.push_back({"chorda, in bone", part_of(head.chorda_tympani(), 1, 6.5), {0, 0.5, 1}, 0.6});
        tasks.push_back(
            {"chorda", part_of(head.chorda_tympani(), 1, 20), {0, 0.14, 0.28, 0.42, 0.58, 0.72, 0.86, 1}, 0.6});
      } else {
        tasks.push_back({"alveolar", part_of(head.alveolar_nerve(), 2, 1000), {0, 0.5, 1}});
      }
      for (const Task& t : tasks) {
        std::vector<Vec3> clicks;
        for (const double c : t.clicks)
          clicks.push_back(t.line.points[static_cast<std::size_t>(c * static_cast<double>(t.line.points.size() - 1))]);
        const double c0 = cpu();
        try {
          TubeParams tp;
          tp.max_radius_mm = t.max_radius_mm;
          const Tube tube = trace_tube(ct, clicks, tp);
          const LineError e = line_error(tube, t.line);
          std::string unsure;
          for (const auto& u : tube.unsure_mm) {
            char text[40];
            std::snprintf(text, sizeof text, "%.1f-%.1f ", u[0], u[1]);
            unsure += text;
          }
          std::printf("| %d | %s | %.1f | %.3f | %.2f | %.2f | %.2f | %.2f | %s | %.1f |\n", who, t.name,
                      tube.length_mm, e.mean_mm, e.worst_mm, tube.radius_mean_mm, t.line.radius_mm, tube.confidence,
                      unsure.c_str(), cpu() - c0);
        } catch (const Error& e) {
          std::printf("| %d | %s | %s |\n", who, t.name, e.what());
        }
        std::fflush(stdout);
      }
    }
  }
}

/// Calibration of the confidence on nerves by seed: of the places that say so much, how many are right.
void shapes(int first, int last, double max_radius_mm, double max_uncertain_mm) {
  constexpr int kBins = 10;
  std::array<int, kBins> n{}, right{}, outside{};
  std::array<double, kBins> said{};
  std::vector<double> volume_ratio;
  int refused = 0, traced = 0, walled = 0, walled_right = 0, walled_out = 0;
  double seconds = 0;
  for (int seed = first; seed <= last; ++seed) {
    const NerveShape s = make_nerve_shape(static_cast<std::uint64_t>(seed));
    TubeParams p;
    p.max_radius_mm = max_radius_mm;
    p.max_uncertain_mm = max_uncertain_mm;
    const double c = cpu();
    try {
      const Tube t = trace_tube(s.ct, s.clicks, p);
      seconds += cpu() - c;
      ++traced;
      for (const TubeStation& x : t.stations) {
        const auto b = static_cast<std::size_t>(std::clamp(x.confidence * kBins, 0.0, kBins - 1.0));
        const std::size_t at = nearest_on(s, x.at_mm);
        if (x.walls >= 0.5) {
          ++walled;
          walled_right += is_right(s, x) ? 1 : 0;
          walled_out += length(s.line[at] - x.at_mm) > s.radius[at] + 1 ? 1 : 0;
        }
        ++n[b];
        said[b] += x.confidence;
        right[b] += is_right(s, x) ? 1 : 0;
        outside[b] += length(s.line[at] - x.at_mm) > s.radius[at] + 1 ? 1 : 0;
      }
      double drawn = 0;
      const Labels labels = draw_tube(t, s.ct.frame, "facial nerve");
      for (const std::uint8_t v : labels.span()) drawn += v != 0 ? s.ct.frame.voxel_volume_mm3() : 0;
      volume_ratio.push_back(drawn / s.volume_mm3);
    } catch (const Error&) {
      ++refused;
    }
  }
  std::printf("| confidence | places | mean of it | right | more than 1 mm outside |\n|---|---|---|---|---|\n");
  int sure = 0, sure_right = 0, sure_out = 0;
  for (std::size_t b = 0; b < kBins; ++b) {
    if (n[b] == 0) continue;
    std::printf("| %.1f to %.1f | %d | %.2f | %.2f | %.3f |\n", 0.1 * static_cast<double>(b),
                0.1 * static_cast<double>(b + 1), n[b], said[b] / n[b], static_cast<double>(right[b]) / n[b],
                static_cast<double>(outside[b]) / n[b]);
    if (b >= kBins / 2) sure += n[b], sure_right += right[b], sure_out += outside[b];
  }
  std::sort(volume_ratio.begin(), volume_ratio.end());
  const auto part = [&](double q) {
    return volume_ratio.empty()
               ? 0
               : volume_ratio[static_cast<std::size_t>(q * static_cast<double>(volume_ratio.size() - 1))];
  };
  std::printf("0.5 and more: %d places, %.3f right, %.3f more than 1 mm outside\n", sure,
              static_cast<double>(sure_right) / std::max(1, sure), static_cast<double>(sure_out) / std::max(1, sure));
  std::printf("by walls alone, 0.5 and more: %d places, %.3f right, %.3f more than 1 mm outside\n", walled,
              static_cast<double>(walled_right) / std::max(1, walled),
              static_cast<double>(walled_out) / std::max(1, walled));
  std::printf("volume drawn by true: 5 %% %.2f, median %.2f, 95 %% %.2f; traced %d, refused %d; %.2f s of CPU each\n",
              part(0.05), part(0.5), part(0.95), traced, refused, seconds / std::max(1, traced));
}

void ears(int first, int last, double spacing, double slice, double noise, double scale) {
  std::printf(
      "| individual | structure | Dice | surface distance, mean mm | 95 %% mm | quality | mm3 | true mm3 "
      "|\n|---|---|---|---|---|---|---|---|\n");
  struct Sum {
    double dice = 0, worst = 1, mean = 0, p95 = 0, worst95 = 0;
    int n = 0, missing = 0;
  };
  std::array<Sum, kEarStructures> sums;
  double seconds = 0;
  for (int who = first; who <= last; ++who) {
    PhantomParams p;
    p.region = PhantomRegion::temporal;
    p.spacing_mm = spacing;
    p.slice_mm = slice;
    p.noise_hu = noise;
    p.individual = who;
    Phantom phantom = make_phantom(p);
    if (scale != 1) phantom.ct = scaled(phantom.ct, scale);
    const HeadAnatomy head(static_cast<std::uint64_t>(who));
    EarParams e;
    e.what = "all";
    e.labyrinth_mm = {36.8, 3.1, -16.4};
    const double c = cpu();
    const EarFindings found = find_ear_structures(phantom.ct, e);
    seconds += cpu() - c;
    for (const EarFinding& f : found.findings) {
      Sum& sum = sums[static_cast<std::size_t>(f.what)];
      const char* const name = EnumNames<EarStructure>::values[static_cast<std::size_t>(f.what)].data();
      if (!f.found) {
        std::printf("| %d | %s | not found: %s (%.2f) |\n", who, name, f.why.c_str(), f.quality);
        ++sum.missing;
        continue;
      }
      const std::vector<std::uint8_t> truth = ear_truth(phantom.labels, head, f.what);
      const Overlap o = overlap(found.labels, static_cast<std::uint8_t>(1 + static_cast<int>(f.what)), truth);
      std::printf("| %d | %s | %.3f | %.2f | %.2f | %.2f | %.0f | %.0f | %s\n", who, name, o.dice, o.mean_mm, o.p95_mm,
                  f.quality, f.volume_mm3, o.true_mm3, f.why.c_str());
      std::fflush(stdout);
      sum.dice += o.dice, sum.mean += o.mean_mm, sum.p95 += o.p95_mm, ++sum.n;
      sum.worst = std::min(sum.worst, o.dice);
      sum.worst95 = std::max(sum.worst95, o.p95_mm);
    }
  }
  std::printf(
      "\n| structure | Dice mean | least | surface distance mean mm | 95 %%, mean mm | 95 %%, worst mm | not found "
      "|\n|---|---|---|---|---|---|---|\n");
  for (int s = 0; s < kEarStructures; ++s) {
    const Sum& m = sums[static_cast<std::size_t>(s)];
    if (m.n + m.missing == 0) continue;
    const double n = std::max(1, m.n);
    std::printf("| %s | %.3f | %.3f | %.2f | %.2f | %.2f | %d |\n",
                EnumNames<EarStructure>::values[static_cast<std::size_t>(s)].data(), m.dice / n, m.worst, m.mean / n,
                m.p95 / n, m.worst95, m.missing);
  }
  std::printf("CPU %.1f s an ear\n", seconds / (last - first + 1));
}

// Fields of 40 to 60 mm, as temporal bones are scanned: cubes about the drum, the middle moved by up to 4 mm each way.
// `inward`: the middle lies over the petrous bone, so that the canal's mouth is cut off; else the mouth is in the
// field. With and without the drum.
void fields(int first, int last, double spacing, double noise) {
  constexpr double kRight = 0.7;  // by Dice
  struct Sum {
    int right = 0, wrong = 0;
    double wrong_quality = 0, least_right = 1;
    std::map<std::string, int> reasons;
  };
  std::map<std::string, Sum> sums;
  for (int who = first; who <= last; ++who) {
    PhantomParams p;
    p.region = PhantomRegion::temporal;
    p.spacing_mm = spacing;
    p.noise_hu = noise;
    p.individual = who;
    const Phantom phantom = make_phantom(p);
    const HeadAnatomy head(static_cast<std::uint64_t>(who));
    std::array<std::vector<std::uint8_t>, kEarStructures> truth;
    for (int s = 0; s < 5; ++s)
      truth[static_cast<std::size_t>(s)] = ear_truth(phantom.labels, head, static_cast<EarStructure>(s));
    for (const double size : {40.0, 49.0, 60.0}) {
      for (const bool inward : {false, true}) {
        for (const bool drum : {true, false}) {
          std::mt19937 random(static_cast<unsigned>(who));
          const auto moved = [&] { return static_cast<double>(random()) / 4294967296.0 * 8 - 4; };
          const double dx = moved(), dy = moved(), dz = moved();
          const Vec3 middle = kTrueDrum + Vec3{(inward ? -4 : 10) + dx, 6 + dy, 2 + dz};
          const Frame& whole = phantom.ct.frame;
          std::array<int, 3> from{}, n{};
          for (std::size_t a = 0; a < 3; ++a) {
            from[a] = std::max(0, static_cast<int>((middle[a] - size / 2 - whole.origin_mm[a]) / spacing));
            n[a] = std::min(whole.dims[a], from[a] + static_cast<int>(size / spacing)) - from[a];
          }
          Frame f = whole;
          f.dims = n;
          f.origin_mm = whole.world_from_index({double(from[0]), double(from[1]), double(from[2])});
          const auto v = make_voxels<std::int16_t>(f.voxel_count());
          std::array<std::vector<std::uint8_t>, kEarStructures> here;
          for (auto& h : here) h.resize(f.voxel_count());
          std::size_t at = 0;
          for (int k = 0; k < n[2]; ++k)
            for (int j = 0; j < n[1]; ++j)
              for (int i = 0; i < n[0]; ++i, ++at) {
                const std::size_t q = phantom.ct.offset(from[0] + i, from[1] + j, from[2] + k);
                v[at] = phantom.ct.voxels[q];
                for (std::size_t s = 0; s < 5; ++s) here[s][at] = truth[s][q];
                const auto t = static_cast<Tissue>(phantom.labels.voxels[q]);
                const Vec3 x = f.world_from_index({double(i), double(j), double(k)});
                if (!drum && length(x - kTrueDrum) < 5.5 && !is_bone(t) && v[at] < 300) v[at] = -1000;
              }
          EarParams e;
          const EarFindings found = find_ear_structures({f, v}, e);
          for (const EarFinding& x : found.findings) {
            const auto s = static_cast<std::size_t>(x.what);
            Sum& sum = sums[std::to_string(static_cast<int>(size)) + (inward ? " inward" : " mouth") +
                            (drum ? " | " : " no drum | ") + std::string(EnumNames<EarStructure>::values[s])];
            if (!x.found) {
              std::string why;
              for (const char c : x.why)
                why += c >= '0' && c <= '9' ? (why.ends_with('#') ? "" : "#") : std::string(1, c);
              ++sum.reasons[why];
              continue;
            }
            const Overlap o = overlap(found.labels, static_cast<std::uint8_t>(1 + s), here[s]);
            if (o.dice >= kRight) {
              ++sum.right;
              sum.least_right = std::min(sum.least_right, x.quality);
            } else {
              ++sum.wrong;
              sum.wrong_quality = std::max(sum.wrong_quality, x.quality);
              std::printf("wrong: %d %.0f %s %s %s Dice %.2f quality %.2f %.0f of %.0f mm3 %s\n", who, size,
                          inward ? "inward" : "mouth", drum ? "drum" : "no drum",
                          EnumNames<EarStructure>::values[s].data(), o.dice, x.quality, x.volume_mm3, o.true_mm3,
                          x.why.c_str());
              std::fflush(stdout);
            }
          }
        }
      }
    }
  }
  std::printf(
      "\n| field | structure | right | least quality | wrong | most quality | not found, why "
      "|\n|---|---|---|---|---|---|---|\n");
  for (const auto& [name, sum] : sums) {
    std::printf("| %s | %d | %.2f | %d | %.2f |", name.c_str(), sum.right, sum.least_right, sum.wrong,
                sum.wrong_quality);
    for (const auto& [why, n] : sum.reasons) std::printf(" %d: %s;", n, why.c_str());
    std::printf(" |\n");
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const auto arg = [&](int i, double other) { return argc > i ? std::atof(argv[i]) : other; };
  const double t = now();
  if (what == "tubes") {
    tubes();
  } else if (what == "shapes") {
    shapes(static_cast<int>(arg(2, 1001)), static_cast<int>(arg(3, 1200)), arg(4, 1.5), arg(5, 4));
  } else if (what == "nerves") {
    nerves(static_cast<int>(arg(2, 6)), static_cast<int>(arg(3, 15)), arg(4, 0.5), arg(5, 0), arg(6, 30));
  } else if (what == "ears") {
    ears(static_cast<int>(arg(2, 6)), static_cast<int>(arg(3, 15)), arg(4, 0.5), arg(5, 0), arg(6, 30), arg(7, 1));
  } else if (what == "fields") {
    fields(static_cast<int>(arg(2, 16)), static_cast<int>(arg(3, 35)), arg(4, 0.5), arg(5, 30));
  } else {
    std::fprintf(stderr,
                 "osteo_bench_segment ears [FIRST LAST SPACING SLICE NOISE SCALE] | tubes | nerves [FIRST LAST SPACING "
                 "SLICE NOISE] | shapes [FIRST LAST MAX_RADIUS MAX_UNSURE] | fields [FIRST LAST SPACING NOISE]\n");
    return 2;
  }
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  std::printf("%.0f s, %.0f MB\n", now() - t, static_cast<double>(u.ru_maxrss) / 1024);
  return 0;
}
