// Textures in the layout of the Penn Haptic Texture Toolkit.
#include <algorithm>
#include <boost/property_tree/xml_parser.hpp>
#include <cmath>
#include <complex>
#include <sstream>

#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/simulation/haptics/texture.h"

namespace osteo::inline simulation {
namespace {

using Tree = boost::property_tree::ptree;

constexpr std::size_t kSteps = 512, kOrder = 40;
constexpr int kForces = 5, kSpeeds = 6;  // of the grid that it is brought to

class HattReader {
 public:
  HattReader(std::string_view xml, std::string name) : name_(std::move(name)) {
    std::istringstream in{std::string(xml)};
    try {
      boost::property_tree::read_xml(in, tree_, boost::property_tree::xml_parser::trim_whitespace);
    } catch (const boost::property_tree::xml_parser_error& e) {
      throw Error(ExitCode::usage, "'" + name_ + "' line " + std::to_string(e.line()) + ": no XML: " + e.message());
    }
    const auto set = tree_.get_child_optional("modelSet");
    if (!set) throw wrong("no <modelSet>: not the layout of the Penn toolkit");
    set_ = &*set;
  }
  [[nodiscard]] Error wrong(const std::string& what) const { return {ExitCode::usage, "'" + name_ + "': " + what}; }
  [[nodiscard]] const Tree& set() const { return *set_; }
  [[nodiscard]] double number(const Tree& at, const char* key) const {
    const auto v = at.get_optional<double>(key);
    if (!v || !std::isfinite(*v)) throw wrong(std::string("<") + key + "> is missing or no number");
    return *v;
  }
  [[nodiscard]] std::vector<double> list(const Tree& at, const std::string& key) const {
    std::vector<double> out;
    for (const auto& [tag, v] : at) {
      if (tag != "value") continue;
      const auto d = v.get_value_optional<double>();
      if (!d || !std::isfinite(*d)) throw wrong("<" + key + "> holds what is no number");
      out.push_back(*d);
    }
    return out;
  }
  void unit(const char* key, const char* wanted) const {
    const auto v = set_->get_optional<std::string>(key);
    if (v && *v != wanted) throw wrong(std::string("<") + key + "> is '" + *v + "', not '" + wanted + "'");
  }

 private:
  std::string name_;
  Tree tree_;
  const Tree* set_ = nullptr;
};

struct Recorded {
  double speed = 0, force = 0;
  std::vector<double> amplitude;  // root of the one-sided power, (m/s^2) / sqrt(Hz)
};

std::complex<double> response(const std::vector<double>& taps, double turns) {
  std::complex<double> sum;
  for (std::size_t i = 0; i < taps.size(); ++i) {
    const auto a = portable::sin_cos_turns(std::fmod(turns * static_cast<double>(i), 1.0));
    sum += taps[i] * std::complex<double>(a.cos, -a.sin);
  }
  return sum;
}

Recorded recorded_of(const HattReader& in, const Tree& m, double rate) {
  Recorded r{in.number(m, "speedMod"), in.number(m, "forceMod"), {}};
  const auto ar = m.get_child_optional("ARcoeff"), ma = m.get_child_optional("MAcoeff");
  if (!ar) throw in.wrong("a <model> has no <ARcoeff>");
  const std::vector<double> below = in.list(*ar, "ARcoeff");
  std::vector<double> above = ma ? in.list(*ma, "MAcoeff") : std::vector<double>{};
  if (below.empty() || std::abs(below[0] - 1) > 1e-9) throw in.wrong("<ARcoeff> does not begin with 1");
  double gain = 1;
  if (above.empty())
    above = {1};
  else
    gain = in.number(m, "gain");
  const double variance = in.number(m, "var");
  if (variance < 0) throw in.wrong("<var> is below 0");
  for (std::size_t i = 0; i <= kSteps; ++i) {
    const double turns = 0.5 * static_cast<double>(i) / kSteps;
    const double down = std::norm(response(below, turns));
    if (!(down > 1e-12)) throw in.wrong("a <model> rings for ever: its spectrum has no end");
    r.amplitude.push_back(std::abs(gain) * std::sqrt(2 * variance / rate * std::norm(response(above, turns)) / down));
  }
  return r;
}

// Where a force and a speed lie in the triangles: models and their weights; outside all, the nearest model.
std::vector<std::pair<std::size_t, double>> weights(const std::vector<Recorded>& models,
                                                    const std::vector<std::array<std::size_t, 3>>& tris, double force,
                                                    double speed, double force_unit, double speed_unit) {
  for (const auto& t : tris) {
    const Recorded &a = models[t[0]], &b = models[t[1]], &c = models[t[2]];
    const double area = (b.speed - a.speed) * (c.force - a.force) - (c.speed - a.speed) * (b.force - a.force);
    if (area == 0) continue;
    const double wb = ((speed - a.speed) * (c.force - a.force) - (c.speed - a.speed) * (force - a.force)) / area;
    const double wc = ((b.speed - a.speed) * (force - a.force) - (speed - a.speed) * (b.force - a.force)) / area;
    if (wb >= -1e-9 && wc >= -1e-9 && wb + wc <= 1 + 1e-9) return {{t[0], 1 - wb - wc}, {t[1], wb}, {t[2], wc}};
  }
  std::size_t nearest = 0;
  const auto off = [&](const Recorded& m) {
    const double f = (m.force - force) / force_unit, s = (m.speed - speed) / speed_unit;
    return f * f + s * s;
  };
  for (std::size_t i = 1; i < models.size(); ++i)
    if (off(models[i]) < off(models[nearest])) nearest = i;
  return {{nearest, 1.0}};
}

}  // namespace

TextureModel parse_hatt(std::string_view xml, const std::string& name, double mass_kg) {
  if (!(mass_kg > 0 && mass_kg <= 10))
    throw Error(ExitCode::usage, "the mass that a texture's acceleration moves lies between 0 and 10 kg");
  const HattReader in(xml, name);
  in.unit("AccelUnits", "m/s^2");
  in.unit("SpeedUnits", "mm/s");
  in.unit("ForceUnits", "N");
  TextureModel t;
  t.rate_hz = in.number(in.set(), "SampleRate");
  if (!(t.rate_hz >= 100 && t.rate_hz <= 20000)) throw in.wrong("<SampleRate> lies outside 100 to 20,000 Hz");
  std::vector<Recorded> models;
  std::vector<std::array<std::size_t, 3>> tris;
  for (const auto& [tag, child] : in.set()) {
    if (tag == "model") models.push_back(recorded_of(in, child, t.rate_hz));
    if (tag != "tri") continue;
    const std::vector<double> corners = in.list(child, "tri");
    if (corners.size() != 3) throw in.wrong("a <tri> has not three corners");
    std::array<std::size_t, 3> tri{};
    for (std::size_t c = 0; c < 3; ++c) {
      if (!(corners[c] >= 1 && corners[c] <= 1e6)) throw in.wrong("a <tri> names a model that is not there");
      tri[c] = static_cast<std::size_t>(corners[c]) - 1;
    }
    tris.push_back(tri);
  }
  if (models.empty()) throw in.wrong("there is no <model>");
  if (static_cast<double>(models.size()) != in.number(in.set(), "numMod"))
    throw in.wrong("there are not <numMod> models");
  double most_force = 0, most_speed = 0;
  for (const Recorded& m : models) {
    most_force = std::max(most_force, m.force);
    most_speed = std::max(most_speed, m.speed);
  }
  for (const auto& tri : tris)
    for (const std::size_t c : tri)
      if (c >= models.size()) throw in.wrong("a <tri> names a model that is not there");
  if (!(most_force > 0 && most_speed > 0)) throw in.wrong("no model was recorded with a force and a speed");
  for (int i = 1; i <= kForces; ++i) t.forces_n.push_back(most_force * i / kForces);
  for (int i = 1; i <= kSpeeds; ++i) t.speeds_mm_s.push_back(most_speed * i / kSpeeds);
  for (const double force : t.forces_n)
    for (const double speed : t.speeds_mm_s) {
      std::vector<double> power(kSteps + 1, 0);
      for (const auto& [m, w] : weights(models, tris, force, speed, most_force, most_speed))
        for (std::size_t i = 0; i <= kSteps; ++i) power[i] += w * models[m].amplitude[i];
      for (double& p : power) p = p * p * mass_kg * mass_kg;
      t.nodes.push_back(node_of_spectrum(power, t.rate_hz, kOrder));
    }
  return t;
}

}  // namespace osteo::inline simulation
