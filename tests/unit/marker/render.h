// A camera that sees a pen or a plate at a known place: perspective, lens distortion, exposure with motion, blur,
// uneven light, noise.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "osteo/simulation/marker/detail/tracker.h"

namespace osteo::test {

/// A flat part of what is printed; white and black cells.
struct Face {
  Vec3 centre_mm, right, up;
  double width_mm, height_mm;
  bool hexagon;
  int across, down;
  std::vector<std::uint8_t> cells;  // row by row from the top, 1 is white
};

inline void draw_marker(Face& f, MarkerKind kind, int id, double left_cells, double top_cells, int cells_a_module) {
  const int n = marker_cells_across(kind);
  const auto m = marker_cells(kind, id);
  for (int y = 0; y < n * cells_a_module; ++y) {
    for (int x = 0; x < n * cells_a_module; ++x)
      f.cells[static_cast<std::size_t>((static_cast<int>(top_cells) + y) * f.across + static_cast<int>(left_cells) +
                                       x)] = m[static_cast<std::size_t>(y / cells_a_module * n + x / cells_a_module)];
  }
}

inline std::vector<Face> pen_faces(int pen = 1, double scale = 1) {
  std::vector<Face> faces;
  const auto markers = pen_markers(pen);
  for (int i = 0; i < 6; ++i) {
    const MarkerPatch& upper = markers[static_cast<std::size_t>(i)];
    const Vec3 out = upper.out();
    // Cells of half a millimetre.
    Face f{out * PenBody::kApothemMm, upper.right, upper.up, PenBody::kFaceMm, PenBody::kHeightMm, false, 56, 112, {}};
    f.cells.assign(56 * 112, 1);
    draw_marker(f, MarkerKind::pen, upper.id, 4, 4, 8);
    draw_marker(f, MarkerKind::pen, markers[static_cast<std::size_t>(i + 6)].id, 4, 60, 8);
    faces.push_back(f);
  }
  const MarkerPatch& cap = markers[12];
  const double wide = 2 * PenBody::kCapMarkerMm;
  Face lid{cap.centre_mm, cap.right, cap.up, wide, wide, true, 12, 12, std::vector<std::uint8_t>(144, 1)};
  draw_marker(lid, MarkerKind::pen, cap.id, 3, 3, 1);
  faces.push_back(lid);
  faces.push_back({{0, 0, -PenBody::kHeightMm / 2}, {0, 1, 0}, {1, 0, 0}, wide, wide, true, 1, 1, {1}});
  for (Face& f : faces) {
    f.centre_mm = f.centre_mm * scale;
    f.width_mm *= scale;
    f.height_mm *= scale;
  }
  return faces;
}

inline std::vector<Face> plate_face() {
  constexpr int kW = 390, kH = 530;  // half millimetres, with a border of 10 mm
  Face f{{87.5, 122.5, 0},
         {1, 0, 0},
         {0, -1, 0},
         kW / 2.0,
         kH / 2.0,
         false,
         kW,
         kH,
         std::vector<std::uint8_t>(kW * kH, 1)};
  for (int y = 0; y < PlateBody::kDown; ++y) {
    for (int x = 0; x < PlateBody::kAcross; ++x) {
      if (!plate_square_is_black(x, y)) continue;
      for (int v = 0; v < 70; ++v) {
        for (int u = 0; u < 70; ++u) f.cells[static_cast<std::size_t>((20 + 70 * y + v) * kW + 20 + 70 * x + u)] = 0;
      }
    }
  }
  for (const MarkerPatch& m : plate_markers()) {
    const Vec3 corner = m.corner_mm(0);
    draw_marker(f, MarkerKind::plate, m.id, 20 + 2 * corner.x, 20 + 2 * corner.y, 8);
  }
  return {f};
}

struct Look {
  double blur_px = 0.6;      ///< of lens and sensor, a standard deviation
  double noise = 3;          ///< grey values, a standard deviation
  double exposure = 1;       ///< 1: paper is at 225
  double side_light = 0.35;  ///< share of light that comes from one side
  double gradient = 0.3;     ///< less light at the picture's right border, as a share
  double black = 0.12;       ///< of the paper's brightness
  int samples = 3;           ///< a pixel, in each direction
  double shutter_s = 0;      ///< how long a picture is exposed
  cv::Rect hidden{};         ///< something in front
  bool clutter = true;
};

inline RigidTransform pen_pose(double distance_mm, double turn_deg, double lean_deg = 0, double nod_deg = 0,
                               Vec3 off_mm = {}) {
  constexpr double k = std::numbers::pi / 180;
  const RigidTransform upright{Mat3{{Vec3{1, 0, 0}, Vec3{0, 0, 1}, Vec3{0, -1, 0}}}, {}};
  RigidTransform pose = rotation_about({}, {1, 0, 0}, nod_deg * k) * rotation_about({}, {0, 0, 1}, lean_deg * k) *
                        upright * rotation_about({}, {0, 0, 1}, turn_deg * k);
  pose.shift_mm = Vec3{0, 0, distance_mm} + off_mm;
  return pose;
}

inline CameraModel webcam(int width, int height, double wide_deg = 60, double k1 = 0.08, double k2 = -0.16) {
  CameraModel c;
  c.width = width;
  c.height = height;
  c.fx = 0.5 * width / std::tan(wide_deg / 2 * std::numbers::pi / 180);
  c.fy = c.fx * 1.002;
  c.cx = 0.51 * width;
  c.cy = 0.488 * height;
  c.distortion = {k1, k2, 0.0008, -0.0006, 0};
  return c;
}

/// `pose` by time since the middle of the exposure, s. Same seed, same picture.
class Renderer {
 public:
  Renderer(const CameraModel& camera, std::vector<Face> faces, std::uint32_t seed = 1)
      : camera_(camera), faces_(std::move(faces)), random_(seed) {}

  GrayPicture picture(const std::function<RigidTransform(double)>& pose, const Look& look) {
    cv::Mat1f image(camera_.height, camera_.width);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const bool block = look.clutter && (x * 7 / image.cols + y * 5 / image.rows) % 3 == 0;
        image(y, x) = block ? 70.F : 110.F;
      }
    }
    const int times = look.shutter_s > 0 ? look.samples * look.samples : 1;
    std::vector<RigidTransform> at;
    double lo[2] = {1e9, 1e9}, hi[2] = {-1e9, -1e9};
    for (int t = 0; t < times; ++t) {
      at.push_back(pose(times > 1 ? look.shutter_s * ((t + 0.5) / times - 0.5) : 0));
      for (const Face& f : faces_) {
        for (int c = 0; c < 4; ++c) {
          const auto p = project(camera_, at.back()(f.centre_mm + f.right * ((c & 1) != 0 ? 0.5 : -0.5) * f.width_mm +
                                                    f.up * ((c & 2) != 0 ? 0.5 : -0.5) * f.height_mm));
          for (int a = 0; a < 2; ++a) {
            lo[a] = std::min(lo[a], p[static_cast<std::size_t>(a)]);
            hi[a] = std::max(hi[a], p[static_cast<std::size_t>(a)]);
          }
        }
      }
    }
    const int x0 = std::clamp(static_cast<int>(lo[0]) - 2, 0, image.cols),
              x1 = std::clamp(static_cast<int>(hi[0]) + 3, 0, image.cols);
    const int y0 = std::clamp(static_cast<int>(lo[1]) - 2, 0, image.rows),
              y1 = std::clamp(static_cast<int>(hi[1]) + 3, 0, image.rows);
    std::vector<std::vector<Seen>> seen;
    for (const RigidTransform& p : at) seen.push_back(faces_towards(p, look));
    const int n = look.samples;
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        double sum = 0;
        for (int s = 0; s < n * n; ++s) {
          // Another moment for each sample, and samples of all moments all over the pixel.
          const auto& faces = seen[times > 1 ? static_cast<std::size_t>((s * 5 + x * 3 + y * 7) % times) : 0];
          const double px = x - 0.5 + (s % n + 0.5) / n, py = y - 0.5 + (s / n + 0.5) / n;
          const double v = value(faces, ray(px, py));
          sum += v < 0 ? image(y, x) : v * look.exposure;
        }
        image(y, x) = static_cast<float>(sum / (n * n));
      }
    }
    if (look.hidden.area() > 0) image(look.hidden & cv::Rect(0, 0, image.cols, image.rows)) = 140.F;
    if (look.exposure < 0.5) image = cv::min(image, 225 * look.exposure);
    if (look.blur_px > 0) cv::GaussianBlur(image, image, {0, 0}, look.blur_px);
    GrayPicture result{camera_.width, camera_.height, {}};
    result.pixels.reserve(image.total());
    std::normal_distribution<float> noise(0, 1);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const double light = 1 - look.gradient * x / image.cols;
        result.pixels.push_back(
            static_cast<std::uint8_t>(std::clamp(image(y, x) * light + look.noise * noise(random_) + 0.5, 0.0, 255.0)));
      }
    }
    return result;
  }
  GrayPicture picture(const RigidTransform& pose, const Look& look) {
    return picture([&](double) { return pose; }, look);
  }

 private:
  struct Seen {
    const Face* face;
    Vec3 centre, right, up, out;
    double light;
  };
  std::vector<Seen> faces_towards(const RigidTransform& p, const Look& look) const {
    const Vec3 lamp = normalized({-0.6, -0.7, -0.4});
    std::vector<Seen> seen;
    for (const Face& f : faces_) {
      Seen s{&f, p(f.centre_mm), p.rotation * f.right, p.rotation * f.up, {}, 0};
      s.out = cross(s.right, s.up);
      if (dot(s.out, s.centre) >= 0) continue;
      s.light = 225 * (1 - look.side_light + look.side_light * std::max(0.0, dot(s.out, lamp)));
      black_ = look.black;
      seen.push_back(s);
    }
    return seen;
  }
  double value(const std::vector<Seen>& faces, Vec3 ray) const {
    for (const Seen& s : faces) {
      const double along = dot(s.centre, s.out) / dot(ray, s.out);
      if (!(along > 0)) continue;
      const Vec3 on = ray * along - s.centre;
      const double x = dot(on, s.right), y = dot(on, s.up);
      const Face& f = *s.face;
      if (std::abs(x) > f.width_mm / 2 || std::abs(y) > f.height_mm / 2) continue;
      if (f.hexagon) {
        const double apothem = f.width_mm / 4 * std::sqrt(3.0);
        if (std::abs(y) > apothem || std::abs(x) * 0.75 * 2 / std::sqrt(3.0) + std::abs(y) / 2 > apothem) continue;
      }
      const int cx = std::min(f.across - 1, static_cast<int>((x / f.width_mm + 0.5) * f.across));
      const int cy = std::min(f.down - 1, static_cast<int>((0.5 - y / f.height_mm) * f.down));
      return s.light * (f.cells[static_cast<std::size_t>(cy * f.across + cx)] != 0 ? 1 : black_);
    }
    return -1;
  }
  // Undistorted, by fixed-point steps.
  Vec3 ray(double px, double py) const {
    const double xd = (px - camera_.cx) / camera_.fx, yd = (py - camera_.cy) / camera_.fy;
    const auto& k = camera_.distortion;
    double x = xd, y = yd;
    for (int i = 0; i < 8; ++i) {
      const double r2 = x * x + y * y, radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
      const double dx = 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x), dy = k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
      x = (xd - dx) / radial;
      y = (yd - dy) / radial;
    }
    return {x, y, 1};
  }

  CameraModel camera_;
  std::vector<Face> faces_;
  std::mt19937 random_;
  mutable double black_ = 0.12;
};

inline double angle_deg(const Mat3& a, const Mat3& b) {
  double trace = 0;
  for (std::size_t c = 0; c < 3; ++c) trace += dot(a.column[c], b.column[c]);
  return std::acos(std::clamp((trace - 1) / 2, -1.0, 1.0)) * 180 / std::numbers::pi;
}

}  // namespace osteo::test
