// Experiments on bone that changes, and on what a running burr shakes the hand with.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "osteo/core/base/parallel.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/simulation/bone/hardness.h"
#include "osteo/simulation/haptics/contact.h"
#include "osteo/simulation/haptics/device.h"
#include "osteo/simulation/haptics/renderer.h"
#include "osteo/simulation/haptics/texture.h"
#include "osteo/simulation/haptics/vibration.h"
#include "tables.h"

namespace osteo::inline assessment::truth {
namespace {

constexpr std::array kMethods{ContactMethod::overlap, ContactMethod::proxy, ContactMethod::volume, ContactMethod::rays};

// Bone below z = top, 24 x 24 x 16 mm.
BrickGrid block(double h) {
  Frame f;
  f.dims = {static_cast<int>(24 / h), static_cast<int>(24 / h), static_cast<int>(20 / h)};
  f.spacing_mm = {h, h, h};
  f.origin_mm = {-12 + h / 2, -12 + h / 2, -16 + h / 2};
  return BrickGrid::dense(f);
}
// The share of each voxel below `top`, in the layers between.
void fill_to(BrickGrid& g, double top, double from, double to) {
  const Frame& f = g.frame();
  const double h = f.spacing_mm.x;
  for (int k = 0; k < f.dims[2]; ++k) {
    const double low = f.origin_mm.z + (k - 0.5) * h;
    if (low + h < from || low > to) continue;
    const auto share = static_cast<float>(std::clamp((top - low) / h, 0.0, 1.0));
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i) g.set(g.find(i, j, k), share);
  }
}

// Amplitude of one frequency in a signal, by Goertzel's sum under Hann's window.
double amplitude(const std::vector<double>& signal, double hz, double rate) {
  double re = 0, im = 0, weight = 0;
  const double n = static_cast<double>(signal.size());
  for (std::size_t i = 0; i < signal.size(); ++i) {
    const double w = 0.5 - 0.5 * portable::sin_cos_turns(static_cast<double>(i) / n).cos;
    const double turns = std::fmod(hz * static_cast<double>(i) / rate, 1.0);
    const auto a = portable::sin_cos_turns(turns);
    re += w * signal[i] * a.cos;
    im -= w * signal[i] * a.sin;
    weight += w;
  }
  return 2 * std::sqrt(re * re + im * im) / weight;
}

}  // namespace

void run_receding(const RunAll& run) {
  ResultTable table{"receding",
                    "Bone taken away under the burr",
                    "Flat bone sinks under a burr of 4 mm that follows it half a millimetre deep, 4 N/mm, voxels of "
                    "0.5 mm; every tick the "
                    "voxels of the face lose their share. "
                    "The truth is the depth times the stiffness.",
                    {"method", "mm/s", "mean N", "max N", "lost ms", "largest change in a tick N", "the truth's own"},
                    {},
                    {}};
  const std::vector<double> speeds{0.2, 1, 5};
  table.cells.resize(kMethods.size() * speeds.size());
  parallel_for(table.cells.size(), 1, run.context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const ContactMethod method = kMethods[i / speeds.size()];
      const double speed = speeds[i % speeds.size()];
      BrickGrid bone = block(0.5);
      fill_to(bone, 0, -20, 20);
      ContactParams p;
      p.method = method;
      p.stiffness_n_per_mm = p.soft_stiffness_n_per_mm = 4;
      p.soft_depth_mm = 0;
      p.max_force_n = 100;
      p.friction = p.static_friction = 0;
      const auto model = make_contact_model(p, 0.5);
      DeviceSample pose;
      pose.tool = static_cast<std::uint8_t>(burr_index(BurrKind::cutting, 4));
      pose.axis = {0.6F, 0, 0.8F};
      double off = 0, most = 0, change = 0, due_change = 0, last = 0, last_due = 0;
      int lost = 0, ticks = 0;
      const int count = static_cast<int>(std::max(200.0, 2000 * std::min(1.0, run.options.share)));
      for (int t = 0; t < count; ++t) {
        const double top = -speed * t * 1e-3;
        fill_to(bone, top, top - 0.5, top + 1);
        // The hand follows with a sway of a tenth of a millimetre.
        const double depth = 0.4 + 0.1 * portable::sin_cos(0.02 * t).sin;
        pose.position_mm = {0.13F, 0.21F, static_cast<float>(top + 2 - depth)};
        const double felt = model->contact(bone, pose).force_n.z, due = 4 * depth;
        if (t > 20) {
          off += std::abs(felt - due);
          most = std::max(most, std::abs(felt - due));
          change = std::max(change, std::abs(felt - last));
          due_change = std::max(due_change, std::abs(due - last_due));
          lost += felt <= 0 ? 1 : 0;
          ++ticks;
        }
        last = felt;
        last_due = due;
      }
      table.cells[i] = {std::string(EnumNames<ContactMethod>::values[static_cast<std::size_t>(method)]),
                        digits(speed, 2),
                        fixed(off / ticks, 4),
                        fixed(most, 4),
                        std::to_string(lost),
                        fixed(change, 4),
                        fixed(due_change, 4)};
    }
  });
  run.result.tables.push_back(std::move(table));
}

void run_layers(const RunAll& run) {
  ResultTable table{
      "layers",
      "Drilling through two layers",
      "A 4 mm burr on its side, fed down at 1 mm/s through 5 mm of 1500 HU into 500 HU, a third as hard. Its lowest "
      "point "
      "meets the soft bone at 5 mm, its middle at 7 mm. Force is not asked to fall to a third, since the hole is wider "
      "in "
      "soft bone; what is removed is bounded by what the burr swept: a closed form.",
      {"voxels mm", "Hz", "N in hard bone", "N in soft bone", "a tenth of the step at mm", "removed over swept"},
      {},
      {}};
  struct Case {
    double h, hz;
  };
  const std::vector<Case> cases{{0.5, 1000}, {0.5, 500}, {0.7, 1000}, {0.35, 500}};
  table.cells.resize(cases.size());
  parallel_for(cases.size(), 1, run.context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      const auto [h, hz] = cases[c];
      BrickGrid bone = block(h);
      fill_to(bone, 0, -20, 20);
      BrickGrid hu(bone);
      for (VoxelKey v = 0; v < hu.brick_count() * BrickGrid::kVoxels; ++v)
        hu.set(v,
               hu.frame().world_from_index({0, 0, static_cast<double>(hu.coordinate(v).k)}).z > -5 ? 1500.0F : 500.0F);
      const auto hardness = std::make_shared<const Hardness>(bone, to_sparse(hu, "hu"));
      HapticSetup setup;
      setup.params.effects.vibration = setup.params.effects.shaft = false;
      setup.device = SpringHand::traits();
      HapticRenderer renderer(setup, bone, {hardness, nullptr, nullptr}, 1 / hz);
      std::vector<double> deep_mm, force;
      double removed = 0;
      DeviceSample pose;
      pose.tool = static_cast<std::uint8_t>(burr_index(BurrKind::cutting, 4));
      pose.axis = {1, 0, 0};
      pose.pedal = 255;
      for (int t = 0; t < static_cast<int>(9 * hz); ++t) {
        const double deep = t / hz;
        pose.position_mm = {0, 0, static_cast<float>(2 - deep)};
        const TickRecord record = renderer.step(pose).record;
        removed += static_cast<double>(record.removed_mm3);
        deep_mm.push_back(deep);
        force.push_back(static_cast<double>(record.normal_force_n));
      }
      const auto mean = [&](double from, double to) {
        double sum = 0;
        int n = 0;
        for (std::size_t i = 0; i < force.size(); ++i)
          if (deep_mm[i] > from && deep_mm[i] < to) sum += force[i], ++n;
        return sum / std::max(1, n);
      };
      const double hard = mean(4, 4.9), soft = mean(8, 8.9);
      // From the first tick on after which the mean over a quarter of a second stays a tenth of the step below.
      double begins = 0;
      for (double at = 4; at < 8; at += 0.02)
        if (mean(at, at + 0.25) < hard - 0.1 * (hard - soft)) {
          begins = at + 0.125;
          break;
        }
      // A ball that went straight down `deep`: half a ball and a cylinder, less what is above the face.
      const double r = 2, deep = deep_mm.back(),
                   swept = std::numbers::pi * r * r * (deep - r) + 2.0 / 3 * std::numbers::pi * r * r * r;
      table.cells[c] = {digits(h, 2),   digits(hz, 4),    fixed(hard, 2),
                        fixed(soft, 2), fixed(begins, 2), fixed(removed / swept, 3)};
    }
  });
  run.result.tables.push_back(std::move(table));
}

void run_vibration(const RunAll& run) {
  ResultTable table{"vibration",
                    "The drill's vibration against its file",
                    "Each peak of the built-in file below 500 Hz, from the forces of 8 s, pressed with 0, 1 and 3 N at "
                    "full and at half "
                    "speed; the largest difference over rates of 1, 2 and 5 kHz. "
                    "Peaks above 0.45 of the rate are not played.",
                    {"burr", "pressed N", "speed", "peaks", "largest difference dB"},
                    {},
                    {}};
  double worst = 0;
  const VibrationSpectrum& spectrum = default_vibration();
  for (std::size_t index = 0; index < kBurrKinds.size(); ++index)
    for (const double pressed : {0.0, 1.0, 3.0})
      for (const double speed : {1.0, 0.5}) {
        double most = 0;
        int peaks = 0;
        for (const double rate : {1000.0, 2000.0, 5000.0}) {
          Vibration v(spectrum);
          std::vector<double> signal;
          for (int i = 0; i < static_cast<int>(8 * rate); ++i)
            signal.push_back(v.step(static_cast<BurrKind>(index), pressed, 1 / rate, speed)[0]);
          peaks = 0;
          for (const auto& peak : spectrum.by_kind[index]) {
            const double hz = speed * peak.frequency_hz, due = speed * (peak.idle_n + peak.per_n * pressed);
            if (hz >= 500 || hz / rate > 0.45) continue;
            ++peaks;
            most = std::max(most, std::abs(20 * std::log10(amplitude(signal, hz, rate) / due)));
          }
        }
        worst = std::max(worst, most);
        table.cells.push_back({std::string(kBurrKinds[index].name), digits(pressed, 2), digits(speed, 2),
                               std::to_string(peaks), fixed(most, 3)});
      }
  run.result.bars.push_back(
      {"vibration of the drill against its file, below 500 Hz", "1 dB", fixed(worst, 3) + " dB", worst <= 1});
  run.result.tables.push_back(std::move(table));
}

void run_texture(const RunAll& run) {
  // Two resonances whose place and strength go by speed and force; a model, not a surface that was recorded.
  constexpr double kRate = 2000;
  TextureModel model;
  model.rate_hz = kRate;
  model.forces_n = {0.5, 2};
  model.speeds_mm_s = {20, 80};
  const auto node_of = [&](double first_hz, double second_hz, double noise) {
    // Poles by pairs; their product is the polynomial, and a recording of it is what the model is made from.
    std::vector<double> a{1};
    for (const auto& [hz, radius] : {std::pair{first_hz, 0.95}, {second_hz, 0.93}}) {
      const double b1 = -2 * radius * portable::sin_cos_turns(hz / kRate).cos, b2 = radius * radius;
      std::vector<double> next(a.size() + 2, 0.0);
      for (std::size_t i = 0; i < a.size(); ++i) {
        next[i] += a[i];
        next[i + 1] += b1 * a[i];
        next[i + 2] += b2 * a[i];
      }
      a = next;
    }
    std::string text =
        R"({"osteotome_texture": 1, "rate_hz": 2000, "force_n": [1], "speed_mm_s": [1], "models": [{"force_n": 1, "speed_mm_s": 1, "ar": [)";
    for (std::size_t i = 1; i < a.size(); ++i) text += (i > 1 ? ", " : "") + digits(a[i], 17);
    return parse_texture(text + R"(], "noise_n2": )" + digits(noise, 17) + "}]}", "the texture of the test").nodes[0];
  };
  model.nodes = {node_of(60, 220, 1e-5), node_of(140, 380, 4e-5), node_of(70, 240, 4e-5), node_of(160, 420, 1.6e-4)};
  ResultTable table{"texture",
                    "A texture against its file",
                    "A model of vibration at four pairs of force and speed, played for 400 s; Welch's spectrum (Hann, "
                    "1024 samples at 2 kHz) against the "
                    "model's own, every "
                    "8 Hz from 16 to 496 Hz. What such a mean of 781 spectra is off by chance: 0.16 dB each, about 0.5 "
                    "dB the worst of 61. 'Found "
                    "again': Burg's method on what was played.",
                    {"pressed N", "mm/s", "largest difference dB", "mean difference dB", "rms N", "rms of the file N",
                     "found again, largest dB"},
                    {},
                    {}};
  const std::size_t samples = static_cast<std::size_t>(std::max(40.0, 400 * std::min(1.0, run.options.share)) * kRate),
                    window = 1024;
  table.cells.resize(4);
  std::array<double, 4> largest{};
  parallel_for(4, 1, run.context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const double force = model.forces_n[n / 2], speed = model.speeds_mm_s[n % 2];
      Texture texture(model, run.options.seed);
      std::vector<double> signal(samples);
      for (int i = 0; i < 500; ++i) static_cast<void>(texture.step(force, speed));
      double power = 0;
      for (double& v : signal) {
        v = texture.step(force, speed);
        power += v * v / static_cast<double>(samples);
      }
      double most = 0, mean = 0, again = 0, due_power = 0;
      const TextureModel::Node found = texture_node(signal, 4);
      for (double hz = 0.5; hz < kRate / 2; hz += 1) due_power += spectrum_n2_per_hz(model.nodes[n], hz, kRate);
      int count = 0;
      std::vector<double> re(window), im(window);
      for (double hz = 16; hz < 500; hz += 8) {
        double weight = 0;
        for (std::size_t i = 0; i < window; ++i) {
          const double w =
              0.5 - 0.5 * portable::sin_cos_turns(static_cast<double>(i) / static_cast<double>(window)).cos;
          const auto turn = portable::sin_cos_turns(std::fmod(hz * static_cast<double>(i) / kRate, 1.0));
          re[i] = w * turn.cos;
          im[i] = w * turn.sin;
          weight += w * w;
        }
        double sum = 0;
        const std::size_t windows = samples / window;
        for (std::size_t s = 0; s < windows; ++s) {
          double a = 0, b = 0;
          for (std::size_t i = 0; i < window; ++i) {
            a += re[i] * signal[s * window + i];
            b += im[i] * signal[s * window + i];
          }
          sum += a * a + b * b;
        }
        const double due = spectrum_n2_per_hz(model.nodes[n], hz, kRate);
        const double off = 10 * std::log10(2 * sum / static_cast<double>(windows) / (weight * kRate) / due);
        most = std::max(most, std::abs(off));
        mean += off;
        ++count;
        again = std::max(again, std::abs(10 * std::log10(spectrum_n2_per_hz(found, hz, kRate) / due)));
      }
      largest[n] = most;
      table.cells[n] = {digits(force, 2),       digits(speed, 3),           fixed(most, 2),
                        fixed(mean / count, 3), fixed(std::sqrt(power), 4), fixed(std::sqrt(due_power), 4),
                        fixed(again, 2)};
    }
  });
  const double worst = *std::max_element(largest.begin(), largest.end());
  run.result.bars.push_back(
      {"texture's spectrum against its file, below 500 Hz", "1 dB", fixed(worst, 2) + " dB", worst <= 1});
  run.result.tables.push_back(std::move(table));
}

}  // namespace osteo::inline assessment::truth
