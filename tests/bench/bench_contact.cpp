// Contact models and the god-object against the truth: speed against error.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include "duck.h"
#include "haptics_tables.h"
#include "osteo/simulation/haptics/fields.h"
#include "solid.h"

namespace osteo::haptics_tables {
namespace {

/// A surface by its signed distance (negative inside), exact near it, and a cube of it around `centre`.
struct Body {
  const char* name;
  std::function<double(Vec3)> distance;
  Vec3 centre;
  std::function<Vec3(std::mt19937&)>
      place;  ///< of a burr's centre at a given clearance 0: a point of the surface to press on
};

Vec3 slope_of(const std::function<double(Vec3)>& f, Vec3 x) {
  const double e = 1e-4;
  return {(f(x + Vec3{e, 0, 0}) - f(x - Vec3{e, 0, 0})) / (2 * e),
          (f(x + Vec3{0, e, 0}) - f(x - Vec3{0, e, 0})) / (2 * e),
          (f(x + Vec3{0, 0, e}) - f(x - Vec3{0, 0, e})) / (2 * e)};
}

BrickGrid voxels_of(const Body& body, double h) {
  return test::solid(
      h, 9, [&](Vec3 p) { return body.distance(p + body.centre) < 0; }, body.centre, 8);
}

/// Volume of the body in a ball and the push of its surface, by 64^3 points of the ball and 20,000 of its surface:
/// within 0.2 %.
struct Truth {
  double volume = 0;
  Vec3 normal;
};
Truth truth_of(const Body& body, Vec3 x, double r) {
  Truth t;
  const int n = 64;
  const double step = 2 * r / n;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const Vec3 o{(i + 0.5) * step - r, (j + 0.5) * step - r, (k + 0.5) * step - r};
        if (dot(o, o) < r * r && body.distance(x + o) < 0) t.volume += step * step * step;
      }
  Vec3 push;
  const int m = 20000;
  for (int s = 0; s < m; ++s) {
    const double z = 1 - (2 * s + 1.0) / m, a = s * M_PI * (3 - std::sqrt(5.0)), q = std::sqrt(1 - z * z);
    const Vec3 d{q * std::cos(a), q * std::sin(a), z};
    if (body.distance(x + d * r) < 0) push -= d;
  }
  t.normal = normalized(push);
  return t;
}

template <class Field>
void duck_row(const char* what, const Field& field, double megabytes, double friction, double scale = 1) {
  const auto recording = test::duck_recording(friction);
  GodObject proxy;
  GodObjectParams p{
      .friction = friction, .static_friction = friction, .feature_mm = 2 * scale, .tolerance_mm = 1e-5 * scale};
  proxy.place(recording.front().surface_mm * scale);
  Spread error, us;
  int lost = 0;
  std::size_t n = 0;
  for (const auto& tick : recording) {
    const Vec3 device = tick.device_mm * scale;
    const auto begin = std::chrono::steady_clock::now();
    const auto a = proxy.update(field, device, p);
    us.add(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() * 1e6);
    if (n++ >= 100) error.add(length((a.proxy_mm - device) * (test::kDuckStiffness / scale) - tick.force_n));
    lost += a.contact ? 0 : 1;
  }
  std::printf("| %s | %.1f | %.1f | %.5f | %.5f | %.4f | %d | %.2f | %.2f |\n", what, megabytes, friction, error.mean(),
              error.at(0.95), error.at(1), lost, us.at(0.5), us.at(0.999));
  std::fflush(stdout);
}

}  // namespace

void bench_contact() {
  std::printf(
      "### Contact models against the truth\n\nA 4 mm ball pressed 0.1 to 1.2 mm deep into a body known in closed "
      "form, 200 places; "
      "stiffness 4 N/mm. The truth "
      "for rays, volume and overlap: the law of the depth of a flat cut of the exact volume, along the exact push; for "
      "the proxy: the law "
      "of the exact "
      "distance of the ball from the surface.\n\n| body | voxels mm | method | mean force N | mean error N | p99 error "
      "N | direction off, "
      "degrees | us p50 | us p99 "
      "|\n|---|---|---|---|---|---|---|---|---|\n");
  const double s3 = std::sin(M_PI / 6), c3 = std::cos(M_PI / 6);
  const std::vector<Body> bodies{{"plane",
                                  [](Vec3 p) {
                                    return dot(p, normalized({0.3, 0.2, 1})) + 0.13;
                                  },
                                  {},
                                  [](std::mt19937& r) {
                                    std::uniform_real_distribution<double> u(-4, 4);
                                    const Vec3 n = normalized({0.3, 0.2, 1});
                                    const Vec3 q{u(r), u(r), 0};
                                    return q - n * (dot(q, n) + 0.13);
                                  }},
                                 {"ball of 6.3 mm",
                                  [](Vec3 p) { return length(p) - 6.3; },
                                  {},
                                  [](std::mt19937& r) {
                                    std::uniform_real_distribution<double> u(-1, 1);
                                    return normalized({u(r), u(r), u(r)}) * 6.3;
                                  }},
                                 // Its edge along y, 60 degrees; pressed on the edge and beside it.
                                 {"wedge of 60 degrees",
                                  [s3, c3](Vec3 p) { return std::max(p.x * c3 + p.z * s3, -p.x * c3 + p.z * s3) - 1; },
                                  {},
                                  [s3](std::mt19937& r) {
                                    std::uniform_real_distribution<double> u(-4, 4);
                                    return Vec3{0.15 * u(r), u(r), 1 / s3};
                                  }},
                                 // Where a surgeon drills most: concave bone, and a rim.
                                 {"pit of 2.5 mm",
                                  [](Vec3 p) { return p.z > 2 ? p.z : 2.5 - length(p); },
                                  {},
                                  [](std::mt19937& r) {
                                    std::uniform_real_distribution<double> u(-0.5, 0.5);
                                    return normalized({u(r), u(r), -1}) * 2.5;
                                  }},
                                 {"groove of 120 degrees",
                                  [s3, c3](Vec3 p) { return std::min(p.z * c3 - p.x * s3, p.z * c3 + p.x * s3); },
                                  {},
                                  [](std::mt19937& r) {  // where the ball touches both sides
                                    std::uniform_real_distribution<double> u(-4, 4);
                                    return Vec3{0.05 * u(r), u(r), 2 / std::cos(M_PI / 6) - 2};
                                  }},
                                 {"edge of 90 degrees",
                                  [](Vec3 p) { return std::max(p.x, p.z); },
                                  {},
                                  [](std::mt19937& r) {
                                    std::uniform_real_distribution<double> u(-4, 4);
                                    return Vec3{-0.25 + 0.05 * u(r), u(r), 0};
                                  }},
                                 {"closed smooth shape",
                                  [](Vec3 p) { return test::duck(p) / std::max(length(slope_of(test::duck, p)), 0.5); },
                                  {30, 0, 0},
                                  [](std::mt19937& r) {
                                    std::uniform_real_distribution<double> u(-0.12, 0.12);
                                    const Vec3 d = normalized({1, u(r), u(r)});
                                    return d * test::duck_radius(d);
                                  }}};
  const double r = 2;
  for (const Body& body : bodies) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> deep(0.1, 1.2);
    struct Pose {
      Vec3 x, along;
      Truth truth;
      double clearance;
      Vec3 out;
    };
    std::vector<Pose> poses;
    while (poses.size() < 200) {
      const Vec3 p = body.place(random), n = normalized(slope_of(body.distance, p + Vec3{1e-3, 2e-3, 3e-3}));
      const Vec3 away = std::strcmp(body.name, "wedge of 60 degrees") == 0 || body.name[0] == 'g' ? Vec3{0, 0, 1} : n;
      const double d = deep(random);
      const Vec3 x = p + away * (r - d);
      // The float pose is the true one.
      const Vec3 exact{static_cast<double>(static_cast<float>(x.x)), static_cast<double>(static_cast<float>(x.y)),
                       static_cast<double>(static_cast<float>(x.z))};
      poses.push_back({exact, away, truth_of(body, exact, r), 0, {}});
      // Distance by the nearest point found from the signed distance; for the wedge's outside near the edge the edge
      // itself is nearest.
      double sd = body.distance(exact);
      Vec3 out = normalized(slope_of(body.distance, exact));
      if (std::strcmp(body.name, "wedge of 60 degrees") == 0) {
        const Vec3 q{exact.x, 0, exact.z - 1 / s3};
        const bool edge =
            q.z > 0 && std::abs(q.x) * c3 < q.z * s3 * 1.0 + 1e-9 && std::abs(q.x) < q.z * std::tan(M_PI / 3);
        if (edge) {
          sd = length(q);
          out = normalized(q);
        }
      } else if (body.name[0] == 'g') {
        // Pressed against both sides it rests where it touches both.
        const Vec3 back = Vec3{0, exact.y, r / c3} - exact;
        if (std::abs(back.x) < back.z * s3 / c3) {
          sd = r - length(back);
          out = normalized(back);
        }
      } else if (body.name[0] == 'c') {
        for (int i = 0; i < 20; ++i) {  // foot of the perpendicular
          Vec3 foot = exact - out * sd;
          foot = foot - test::duck_normal(foot) * test::duck(foot);
          out = normalized(exact - foot);
          sd = length(exact - foot);
        }
      }
      poses.back().clearance = sd;
      poses.back().out = out;
    }
    for (const double h : {0.25, 0.5, 1.0}) {
      const BrickGrid bone = voxels_of(body, h);
      for (const ContactMethod method : kMethods) {
        ContactParams params;
        params.method = method;
        params.max_force_n = 100;
        Spread error, direction, force, us;
        for (int round = 0; round < 5; ++round) {
          for (const Pose& p : poses) {
            auto model = method == ContactMethod::proxy && round == 0 ? make_contact_model(params, h) : nullptr;
            static std::unique_ptr<ContactModel> kept;
            if (round == 0 && &p == &poses.front() && method != ContactMethod::proxy)
              kept = make_contact_model(params, h);
            if (method == ContactMethod::proxy && model == nullptr) break;
            ContactModel& m = model ? *model : *kept;
            DeviceSample s;
            s.tool = 3;
            s.axis = {0.6F, 0, 0.8F};
            if (method == ContactMethod::proxy) {
              // It comes along the way it is pressed, as a hand would.
              for (int i = 20; i > 0; --i) {
                const Vec3 q = p.x + p.along * (0.1 * i);
                s.position_mm = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)};
                static_cast<void>(m.contact(bone, s));
              }
            }
            s.position_mm = {static_cast<float>(p.x.x), static_cast<float>(p.x.y), static_cast<float>(p.x.z)};
            const auto begin = std::chrono::steady_clock::now();
            const ContactResult c = m.contact(bone, s);
            us.add(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() * 1e6);
            if (round > 0) continue;
            const Vec3 truth = method == ContactMethod::proxy
                                   ? p.out * params.force_n(std::max(0.0, r - p.clearance))
                                   : p.truth.normal * params.force_n(cap_depth_mm(p.truth.volume, r));
            error.add(length(c.force_n - truth));
            force.add(length(truth));
            if (length(c.force_n) > 0.05)
              direction.add(std::acos(std::clamp(dot(normalized(c.force_n), normalized(truth)), -1.0, 1.0)) * 180 /
                            M_PI);
          }
        }
        std::printf("| %s | %g | %s | %.2f | %.3f | %.3f | %.2f | %.1f | %.1f |\n", body.name, h, name_of(method),
                    force.mean(), error.mean(), error.at(0.99), direction.mean(), us.at(0.5), us.at(0.99));
        std::fflush(stdout);
      }
    }
  }
}

void bench_god_object() {
  std::printf(
      "\n### God-object on a closed smooth shape\n\nA recorded probe (20 s, normal force 1.2 +- 0.8 N, 0.5 N/mm) "
      "played through the "
      "renderer: mean of |true - "
      "rendered| force. Published for CHAI3D 3.3 on the same shape, flat or shaded, from 168 to 140,624 triangles: "
      "0.011 to 0.52 N at 0.7 "
      "to 4 us, up to 22.6 N "
      "worst with friction, all contacts lost in metres.\n\n| field | MB | friction | mean N | p95 N | worst N | lost "
      "| us p50 | us p99.9 "
      "|\n|---|---|---|---|---|---|---|---|---|\n");
  for (const int n : {32, 64, 128}) {
    const CubicField field = test::duck_field(n);
    const std::string what = "cubic grid " + std::to_string(n) + "^3";
    for (const double friction : {0.0, 0.3})
      duck_row(what.c_str(), field, static_cast<double>(field.memory_bytes()) / 1e6, friction);
  }
  for (const auto& [rings, sectors] : {std::pair{22, 22}, {54, 54}, {180, 180}}) {
    for (const bool shading : {false, true}) {
      const MeshField field(test::duck_mesh(rings, sectors), shading);
      const std::string what =
          std::to_string(2 * (rings - 1) * sectors) + " triangles" + (shading ? ", shaded" : ", flat");
      for (const double friction : {0.0, 0.3})
        duck_row(what.c_str(), field, 2 * (rings - 1) * sectors * 240e-6, friction);
    }
  }
  for (const double scale : {1e-3, 1e3}) {
    const MeshField field(test::duck_mesh(180, 180, scale), true);
    duck_row(scale < 1 ? "64440 triangles in metres" : "64440 triangles in micrometres", field, 64440 * 240e-6, 0.3,
             scale);
  }
}

}  // namespace osteo::haptics_tables
