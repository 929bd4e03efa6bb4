#include "outer_faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "tet_faces.h"

namespace osteo::inline simulation {

std::vector<OuterFace> outer_faces(const FemBody& body) {
  std::map<std::array<std::uint32_t, 3>, OuterFace> faces;  // those of two go
  for (std::size_t e = 0; e < body.tet_count(); ++e) {
    for (std::size_t f = 0; f < 4; ++f) {
      std::array<std::uint32_t, 3> corners{body.nodes(e)[kTetFaces[f][0]], body.nodes(e)[kTetFaces[f][1]],
                                           body.nodes(e)[kTetFaces[f][2]]};
      std::sort(corners.begin(), corners.end());
      if (!faces.try_emplace(corners, OuterFace{e, f}).second) faces.erase(corners);
    }
  }
  std::vector<OuterFace> found;
  for (const auto& [corners, face] : faces) found.push_back(face);
  return found;
}

std::vector<std::uint32_t> points_of(const FemBody& body, OuterFace face) {
  constexpr std::size_t kMiddle[4][4] = {{0, 4, 6, 7}, {4, 0, 5, 8}, {6, 5, 0, 9}, {7, 8, 9, 0}};  // of C3D10
  const auto nodes = body.nodes(face.element);
  const auto& own = kTetFaces[face.face];
  std::vector<std::uint32_t> points{nodes[own[0]], nodes[own[1]], nodes[own[2]]};
  for (std::size_t c = 0; c < 3 && body.order() == TetOrder::t10; ++c)
    points.push_back(nodes[kMiddle[own[c]][own[(c + 1) % 3]]]);
  return points;
}

double points_per_mm2(const FemBody& body, std::span<const OuterFace> faces, const RigidShape& thing) {
  for (const double least : {std::sqrt(0.5), -2.0}) {
    double area = 0;
    std::vector<std::uint32_t> points;
    for (const OuterFace face : faces) {
      const auto& own = kTetFaces[face.face];
      const auto at = [&](std::size_t corner) { return body.rest()[body.nodes(face.element)[corner]]; };
      const Vec3 a = at(own[0]), b = at(own[1]), c = at(own[2]);
      Vec3 out = cross(b - a, c - a) * 0.5;
      if (dot(out, a - at(6 - own[0] - own[1] - own[2])) < 0) out = out * -1;
      Vec3 away{};  // from the thing
      static_cast<void>(thing.distance_mm((a + b + c) / 3, away));
      if (-dot(out, away) < least * length(out)) continue;
      area += length(out);
      const auto all = points_of(body, face);
      points.insert(points.end(), all.begin(), all.end());
    }
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    if (area > 0) return static_cast<double>(points.size()) / area;
  }
  return 1.0;
}

}  // namespace osteo::inline simulation
