#include "osteo/assessment/ground_truth/point_renderer.h"

#include <charconv>
#include <chrono>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/simulation/haptics/contact.h"
#include "osteo/simulation/haptics/god_object.h"

namespace osteo::inline assessment::truth {
namespace {

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

template <class Field>
class FieldRenderer final : public PointRenderer {
 public:
  /// `feature`: how far the proxy may go along the surface in a step, in units of the render.
  template <class Make>
  FieldRenderer(Make make, const RenderSettings& s, double feature, double size, double grain)
      : begin_(std::chrono::steady_clock::now()), field_(make()), stiffness_(s.stiffness_n_per_mm / s.unit) {
    setup_s_ = seconds_since(begin_);
    grain_mm_ = grain;
    params_ = {
        .friction = s.friction, .static_friction = s.friction, .feature_mm = feature, .tolerance_mm = 2e-7 * size};
  }
  void remember(std::size_t bytes) { memory_bytes_ = bytes; }
  [[nodiscard]] const Field& field() const { return field_; }
  void place(Vec3 device) override { proxy_.place(device); }
  Rendered render(Vec3 device) override {
    const GodObject::Answer a = proxy_.update(field_, device, params_);
    Rendered r{{}, a.proxy_mm, a.contact, a.evaluations};
    if (a.contact) r.force_n = (a.proxy_mm - device) * stiffness_;
    return r;
  }

 private:
  std::chrono::steady_clock::time_point begin_;
  Field field_;
  double stiffness_;
  GodObject proxy_;
  GodObjectParams params_;
};

// The solid itself as a field: what the method does without any sampling.
class ExactField {
 public:
  ExactField(const Solid& solid, double unit) : solid_(&solid), unit_(unit) {}
  [[nodiscard]] Clearance operator()(Vec3 at) const {
    const Vec3 own = at / unit_, gradient = solid_->gradient(own);
    return {solid_->clearance_mm(own) * unit_, gradient, normalized(gradient)};
  }

 private:
  const Solid* solid_;
  double unit_;
};

class BurrRenderer final : public PointRenderer {
 public:
  BurrRenderer(ContactMethod method, const Solid& solid, double h, const RenderSettings& s, const Context& context) {
    const auto begin = std::chrono::steady_clock::now();
    bone_ = sampled_bone(solid, h, context);
    ContactParams p;
    p.method = method;
    p.stiffness_n_per_mm = p.soft_stiffness_n_per_mm = s.stiffness_n_per_mm;
    p.soft_depth_mm = 0;
    p.max_force_n = 100;
    p.friction = p.static_friction = s.friction;
    model_ = make_contact_model(p, h);
    sample_.tool = static_cast<std::uint8_t>(burr_index(BurrKind::cutting, 4));
    sample_.axis = {0.6F, 0, 0.8F};
    setup_s_ = seconds_since(begin);
    memory_bytes_ = bone_.memory_bytes();
    grain_mm_ = h;
  }
  void place(Vec3) override { model_->rest(); }
  Rendered render(Vec3 device) override {
    sample_.position_mm = to_floats(device);
    const ContactResult c = model_->contact(bone_, sample_);
    Rendered r{c.force_n, device, length(c.force_n) > 0, static_cast<int>(c.immersed)};
    if (r.contact) r.contact_mm = device + c.shown_offset_mm - c.normal * 2;
    return r;
  }

 private:
  BrickGrid bone_;
  std::unique_ptr<ContactModel> model_;
  DeviceSample sample_;
};

double number_of(const std::string& what, std::string_view text, double lo, double hi) {
  double v = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), v);
  if (error != std::errc() || end != text.data() + text.size() || !(v >= lo && v <= hi))
    throw Error(ExitCode::usage, "renderer '" + what + "': '" + std::string(text) + "' is no number from " +
                                     std::to_string(lo) + " to " + std::to_string(hi));
  return v;
}

TriangleSoup scaled(TriangleSoup soup, double unit) {
  for (Vec3& p : soup.points_mm) p = p * unit;
  return soup;
}

// Edge of an average triangle.
double edge_of(const TriangleSoup& soup) {
  double area = 0;
  for (const auto& t : soup.triangles)
    area += length(cross(soup.points_mm[t[1]] - soup.points_mm[t[0]], soup.points_mm[t[2]] - soup.points_mm[t[0]])) / 2;
  return soup.triangles.empty() ? 1 : std::sqrt(area / static_cast<double>(soup.triangles.size()) * 2.309);
}

}  // namespace

std::unique_ptr<PointRenderer> make_point_renderer(const std::string& what, const Solid& solid, const RenderSettings& s,
                                                   const Context& context) {
  if (!(s.stiffness_n_per_mm > 0 && s.friction >= 0 && s.unit > 0 && s.rate_hz > 0))
    throw Error(ExitCode::usage, "a renderer needs a stiffness, a unit and a rate above 0");
  const std::size_t colon = what.find(':');
  const std::string kind = what.substr(0, colon), rest = colon == std::string::npos ? "" : what.substr(colon + 1);
  const double size = 2 * solid.half_mm() * s.unit;
  if (kind == "field" || kind == "spline") {
    const int n = static_cast<int>(number_of(what, rest, 4, 1024));
    const double h = 2 * solid.half_mm() / (n - 1);
    const FieldCurve curve = kind == "spline" ? FieldCurve::spline : FieldCurve::catmull_rom;
    // Steps along the surface as long as the field is smooth, but not beyond what is felt.
    auto r = std::make_unique<FieldRenderer<CubicField>>(
        [&] { return sampled_field(solid, n, s.unit, curve, context); }, s, std::min(2.0, 1.5 * h) * s.unit, size, h);
    r->remember(r->field().memory_bytes());
    return r;
  }
  if (kind == "exact") {
    if (!rest.empty()) throw Error(ExitCode::usage, "renderer 'exact' takes no settings");
    return std::make_unique<FieldRenderer<ExactField>>([&] { return ExactField(solid, s.unit); }, s, 0.25 * s.unit,
                                                       size, 0.25);
  }
  if (kind == "triangles" || kind == "shaded") {
    const TriangleSoup mesh = scaled(solid.mesh(static_cast<int>(number_of(what, rest, 4, 1e7))), s.unit);
    auto r = std::make_unique<FieldRenderer<MeshField>>([&] { return MeshField(mesh, kind == "shaded", context); }, s,
                                                        2 * s.unit, size, edge_of(mesh) / s.unit);
    r->remember(mesh.triangles.size() * 240);
    return r;
  }
  if (kind == "voxel") {
    const std::size_t slash = rest.find('/');
    if (slash == std::string::npos)
      throw Error(ExitCode::usage, "renderer '" + what + "' needs voxels and triangles, as in voxel:32/6000");
    const TriangleSoup mesh =
        scaled(solid.mesh(static_cast<int>(number_of(what, rest.substr(slash + 1), 4, 1e7))), s.unit);
    return make_voxel_renderer(mesh, static_cast<int>(number_of(what, rest.substr(0, slash), 4, 512)), solid.half_mm(),
                               s, context);
  }
  if (kind == "cone" || kind == "cone-shaded")
    return make_cone_renderer(scaled(solid.mesh(static_cast<int>(number_of(what, rest, 4, 1e7))), s.unit),
                              kind == "cone-shaded", s);
  if (kind == "process") {
    if (rest.empty()) throw Error(ExitCode::usage, "renderer 'process:' needs a command");
    return make_process_renderer(rest, scaled(solid.mesh(20000), s.unit), s);
  }
  for (std::size_t m = 0; m < EnumNames<ContactMethod>::values.size(); ++m) {
    if (kind != EnumNames<ContactMethod>::values[m]) continue;
    if (s.unit != 1 || s.probe_radius_mm != 2)
      throw Error(
          ExitCode::usage,
          "renderer '" + what + "' is a 4 mm burr in millimetres: the trajectory must be of a probe of 2 mm radius");
    return std::make_unique<BurrRenderer>(static_cast<ContactMethod>(m), solid, number_of(what, rest, 0.2, 2), s,
                                          context);
  }
  throw Error(ExitCode::usage, "there is no renderer '" + what + "'",
              "exact, field:N, spline:N, triangles:N, shaded:N, voxel:N/M, cone:M, cone-shaded:M, overlap:H, proxy:H, "
              "volume:H, rays:H, "
              "process:COMMAND");
}

}  // namespace osteo::inline assessment::truth
