#include "osteo/simulation/haptics/texture.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/portable_math.h"

namespace osteo::inline simulation {
namespace {

// Levinson's recursion backwards: false where the model is not stable.
bool to_reflection(std::vector<double> a, std::vector<double>& k) {
  k.assign(a.size(), 0);
  for (std::size_t m = a.size(); m > 0; --m) {
    const double last = a[m - 1];
    if (!(std::abs(last) < 1)) return false;
    k[m - 1] = last;
    std::vector<double> shorter(m - 1);
    for (std::size_t i = 0; i + 1 < m; ++i) shorter[i] = (a[i] - last * a[m - 2 - i]) / (1 - last * last);
    a = std::move(shorter);
  }
  return true;
}
std::vector<double> to_ar(const std::vector<double>& k) {
  std::vector<double> a;
  for (std::size_t m = 0; m < k.size(); ++m) {
    std::vector<double> longer(m + 1);
    for (std::size_t i = 0; i < m; ++i) longer[i] = a[i] + k[m] * a[m - 1 - i];
    longer[m] = k[m];
    a = std::move(longer);
  }
  return a;
}

// Where a value lies between the nodes of an axis: the lower one and the share of the upper.
struct Between {
  std::size_t low = 0, high = 0;
  double share = 0;
};
Between between(const std::vector<double>& axis, double v) {
  if (!(v > axis.front())) return {};
  if (v >= axis.back()) return {axis.size() - 1, axis.size() - 1, 0};
  std::size_t high = 1;
  while (axis[high] <= v) ++high;
  return {high - 1, high, (v - axis[high - 1]) / (axis[high] - axis[high - 1])};
}

}  // namespace

TextureModel parse_texture(std::string_view text, const std::string& name) {
  const JsonFile file(text, name);
  const JsonValue& root = file.root();
  file.require_format("osteotome_texture");
  file.allow(
      root, "",
      std::vector<std::string>{"osteotome_texture", "about", "source", "rate_hz", "force_n", "speed_mm_s", "models"});
  TextureModel t;
  t.rate_hz = file.number(file.need(root, "", "rate_hz"), "\"rate_hz\"", 100, 20000);
  const auto axis = [&](const char* key, double most) {
    std::vector<double> v;
    const JsonValue& list = file.need(root, "", key);
    for (const JsonValue& item : file.list(list, std::string("\"") + key + "\"")) {
      v.push_back(file.number(item, std::string("an item of \"") + key + "\"", 0, most));
      if (v.size() > 1 && !(v.back() > v[v.size() - 2]))
        throw file.wrong(item, std::string("\"") + key + "\" must rise");
    }
    if (v.empty()) throw file.wrong(list, std::string("\"") + key + "\" is empty");
    return v;
  };
  t.forces_n = axis("force_n", 100);
  t.speeds_mm_s = axis("speed_mm_s", 2000);
  t.nodes.resize(t.forces_n.size() * t.speeds_mm_s.size());
  std::vector<bool> there(t.nodes.size());
  std::size_t order = 0;
  int number = 0;
  const JsonValue& models = file.need(root, "", "models");
  for (const JsonValue& m : file.list(models, "\"models\"")) {
    const std::string where = "model " + std::to_string(++number);
    file.allow(m, where, std::vector<std::string>{"force_n", "speed_mm_s", "ar", "noise_n2"});
    const auto place = [&](const char* key, const std::vector<double>& values) {
      const JsonValue& v = file.need(m, where, key);
      const double at = file.number(v, where + ": \"" + key + "\"");
      const auto found = std::find(values.begin(), values.end(), at);
      if (found == values.end()) throw file.wrong(v, where + ": \"" + key + "\" is not one of those at the top");
      return static_cast<std::size_t>(found - values.begin());
    };
    const std::size_t at = place("force_n", t.forces_n) * t.speeds_mm_s.size() + place("speed_mm_s", t.speeds_mm_s);
    if (there[at]) throw file.wrong(m, where + ": this force and speed are there twice");
    there[at] = true;
    std::vector<double> ar;
    const JsonValue& list = file.need(m, where, "ar");
    for (const JsonValue& v : file.list(list, where + ": \"ar\""))
      ar.push_back(file.number(v, where + ": an item of \"ar\""));
    if (number == 1) order = ar.size();
    if (ar.size() != order || ar.size() > TextureModel::kMaxOrder)
      throw file.wrong(list, where + ": \"ar\" must have as many coefficients as the first, at most 64");
    if (!to_reflection(ar, t.nodes[at].reflection))
      throw file.wrong(list, where + " is not stable: what rings would grow");
    t.nodes[at].noise_n2 = file.number(file.need(m, where, "noise_n2"), where + ": \"noise_n2\"", 0, 100);
  }
  if (const auto missing = std::find(there.begin(), there.end(), false); missing != there.end())
    throw file.wrong(
        models, "\"models\" needs one for each force and speed: " + std::to_string(t.nodes.size()) + ", all different");
  return t;
}

std::string texture_json(const TextureModel& model, const std::string& source) {
  Json models = Json::list();
  const std::size_t wide = model.speeds_mm_s.size();
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    models.push_back(Json{{"force_n", model.forces_n[i / wide]},
                          {"speed_mm_s", model.speeds_mm_s[i % wide]},
                          {"ar", Json(to_ar(model.nodes[i].reflection))},
                          {"noise_n2", model.nodes[i].noise_n2}});
  const Json j{{"osteotome_texture", 1},
               {"source", source},
               {"rate_hz", model.rate_hz},
               {"force_n", Json(model.forces_n)},
               {"speed_mm_s", Json(model.speeds_mm_s)},
               {"models", models}};
  return j.dump(1);
}

TextureModel load_texture(const std::filesystem::path& path, double mass_kg) {
  const std::string text = read_text(path);
  const std::size_t first = text.find_first_not_of("\xEF\xBB\xBF \t\r\n");
  if (first != std::string::npos && text[first] == '<') return parse_hatt(text, path.string(), mass_kg);
  return parse_texture(text, path.string());
}

TextureModel::Node node_of_spectrum(const std::vector<double>& power, double rate, std::size_t order) {
  if (order < 1 || order > TextureModel::kMaxOrder || power.size() < 17 || power.size() <= order || !(rate > 0))
    throw Error(ExitCode::usage,
                "a texture's model takes 1 to 64 coefficients, and a spectrum of more values than that");
  // Autocorrelation: the trapezoid of power times cosine.
  const std::size_t n = power.size() - 1;
  std::vector<double> r(order + 1, 0);
  for (std::size_t m = 0; m <= order; ++m)
    for (std::size_t i = 0; i <= n; ++i) {
      const double weight = (i == 0 || i == n ? 0.5 : 1) * rate / 2 / static_cast<double>(n);
      r[m] += weight * power[i] *
              portable::sin_cos_turns(std::fmod(static_cast<double>(m * i) / static_cast<double>(2 * n), 1.0)).cos;
    }
  TextureModel::Node node;
  node.reflection.assign(order, 0);
  if (!(r[0] > 0) || !std::isfinite(r[0])) {
    if (r[0] == 0) return node;
    throw Error(ExitCode::usage, "a texture's spectrum must be of numbers from 0 on");
  }
  r[0] *= 1 + 1e-9;  // bands of nothing at all leave rounding to decide
  double left = r[0];
  std::vector<double> a;
  for (std::size_t m = 1; m <= order; ++m) {
    double sum = r[m];
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * r[m - 1 - i];
    const double k = std::clamp(-sum / left, -0.9999, 0.9999);
    node.reflection[m - 1] = k;
    left *= 1 - k * k;
    std::vector<double> longer(m);
    for (std::size_t i = 0; i + 1 < m; ++i) longer[i] = a[i] + k * a[m - 2 - i];
    longer[m - 1] = k;
    a = std::move(longer);
  }
  node.noise_n2 = left;
  return node;
}

TextureModel at_rate(const TextureModel& model, double rate) {
  if (!(rate > 0)) throw Error(ExitCode::usage, "a texture is played at a rate above 0");
  if (std::abs(rate - model.rate_hz) < 1e-3 * model.rate_hz || model.nodes.empty()) return model;
  TextureModel out = model;
  out.rate_hz = rate;
  constexpr std::size_t kSteps = 1024;
  for (TextureModel::Node& node : out.nodes) {
    std::vector<double> power(kSteps + 1, 0);
    double most = 0;
    for (std::size_t i = 0; i <= kSteps; ++i) {
      const double hz = static_cast<double>(i) * rate / 2 / kSteps;
      if (hz <= model.rate_hz / 2) power[i] = spectrum_n2_per_hz(node, hz, model.rate_hz);
      most = std::max(most, power[i]);
    }
    for (double& v : power)
      v = std::max(v, 1e-4 * most);  // 40 dB below the loudest: what a model of so few numbers can hold
    node = node_of_spectrum(power, rate, TextureModel::kMaxOrder);
  }
  return out;
}

TextureModel::Node texture_node(const std::vector<double>& samples, std::size_t order) {
  if (order < 1 || order > TextureModel::kMaxOrder || samples.size() <= 4 * order)
    throw Error(ExitCode::usage, "a texture's model takes 1 to 64 coefficients and more than four samples for each");
  TextureModel::Node node;
  std::vector<double> forward = samples, backward = samples;
  double power = 0;
  for (const double v : samples) power += v * v / static_cast<double>(samples.size());
  for (std::size_t m = 1; m <= order; ++m) {
    double cross = 0, both = 0;
    for (std::size_t i = m; i < samples.size(); ++i) {
      cross += forward[i] * backward[i - 1];
      both += forward[i] * forward[i] + backward[i - 1] * backward[i - 1];
    }
    const double k = both > 0 ? -2 * cross / both : 0;
    for (std::size_t i = samples.size() - 1; i >= m; --i) {
      const double f = forward[i], b = backward[i - 1];
      forward[i] = f + k * b;
      backward[i] = b + k * f;
    }
    power *= 1 - k * k;
    node.reflection.push_back(k);
  }
  node.noise_n2 = power;
  return node;
}

double spectrum_n2_per_hz(const TextureModel::Node& node, double hz, double rate) {
  const std::vector<double> a = to_ar(node.reflection);
  double re = 1, im = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto turn = portable::sin_cos_turns(std::fmod(hz * static_cast<double>(i + 1) / rate, 1.0));
    re += a[i] * turn.cos;
    im -= a[i] * turn.sin;
  }
  return 2 * node.noise_n2 / rate / (re * re + im * im);
}

Texture::Texture(TextureModel model, std::uint64_t seed) : model_(std::move(model)), state_(seed) {
  const std::size_t count = model_.forces_n.size() * model_.speeds_mm_s.size();
  bool sound = count > 0 && model_.nodes.size() == count && model_.order() <= TextureModel::kMaxOrder;
  for (const auto& n : model_.nodes) sound = sound && n.reflection.size() == model_.order();
  if (!sound) throw Error(ExitCode::usage, "a texture needs a model of one order for each force and speed");
}

// Normal, by Box and Muller from SplitMix64.
double Texture::noise() noexcept {
  if (spare_) {
    spare_ = false;
    return spare_value_;
  }
  const auto uniform = [&] {
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return (static_cast<double>((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-53;
  };
  const double far = std::sqrt(-2 * portable::log(uniform()));
  const portable::SinCos turn = portable::sin_cos_turns(uniform());
  spare_ = true;
  spare_value_ = far * turn.sin;
  return far * turn.cos;
}

double Texture::step(double force_n, double speed_mm_s) noexcept {
  const bool touching = force_n > 0;
  const Between f = between(model_.forces_n, force_n), s = between(model_.speeds_mm_s, speed_mm_s);
  const std::size_t wide = model_.speeds_mm_s.size();
  const std::array<const TextureModel::Node*, 4> node{
      &model_.nodes[f.low * wide + s.low], &model_.nodes[f.low * wide + s.high], &model_.nodes[f.high * wide + s.low],
      &model_.nodes[f.high * wide + s.high]};
  const std::array<double, 4> weight{(1 - f.share) * (1 - s.share), (1 - f.share) * s.share, f.share * (1 - s.share),
                                     f.share * s.share};
  // Amplitudes are interpolated, not powers: what is halfway sounds halfway.
  double amplitude = 0;
  for (std::size_t i = 0; i < 4; ++i) amplitude += weight[i] * std::sqrt(node[i]->noise_n2);
  const double lowest = model_.speeds_mm_s.front();
  if (lowest > 0 && speed_mm_s < lowest) amplitude *= std::max(0.0, speed_mm_s) / lowest;
  double now = touching ? amplitude * noise() : 0;
  const std::size_t order = model_.order();
  for (std::size_t m = order; m > 0; --m) {
    double k = 0;
    for (std::size_t i = 0; i < 4; ++i) k += weight[i] * node[i]->reflection[m - 1];
    now -= k * back_[m - 1];
    back_[m] = back_[m - 1] + k * now;
  }
  back_[0] = now;
  return touching ? now : 0;
}

SlidingTexture::SlidingTexture(const TextureModel& model, std::uint64_t seed, double dt_s)
    : texture_(at_rate(model, 1 / dt_s), seed), dt_s_(dt_s), share_(1 - portable::exp(-dt_s / kSmoothS)) {}

Vec3 SlidingTexture::step(Vec3 at, Vec3 normal, double pressed_n) noexcept {
  const Vec3 moved = placed_ ? at - last_mm_ : Vec3{};
  last_mm_ = at;
  placed_ = true;
  velocity_mm_s_ += (moved / dt_s_ - velocity_mm_s_) * share_;
  const Vec3 along = velocity_mm_s_ - normal * dot(velocity_mm_s_, normal);
  const double speed = length(along), shake = texture_.step(pressed_n, speed);
  return pressed_n > 0 && speed > 1e-6 ? cross(normal, along) * (shake / speed) : Vec3{};
}

}  // namespace osteo::inline simulation
