#include "instrument_shapes.h"

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataNormals.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "osteo/display/view/instrument_view.h"

namespace osteo::inline display {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

struct Colour {
  double r, g, b;
};
constexpr Colour kSteel{0.66, 0.69, 0.74}, kDarkSteel{0.36, 0.38, 0.42}, kTouches{0.95, 0.45, 0.12},
    kHandpiece{0.45, 0.48, 0.53};

Colour mix(Colour a, Colour b, double t) {
  return {a.r + (b.r - a.r) * t, a.g + (b.g - a.g) * t, a.b + (b.b - a.b) * t};
}

// Rings of points along a line, joined to a skin.
class Rings {
 public:
  explicit Rings(int around) : around_(around) { colours_->SetNumberOfComponents(3); }
  // A ring begins again, not joined to the one before.
  void lift() { joined_ = false; }
  void ring(const std::function<Vec3(double)>& at, const std::function<Colour(double)>& colour) {
    for (int a = 0; a < around_; ++a) {
      const double angle = kTurn * a / around_;
      const Vec3 p = at(angle);
      const Colour c = colour(angle);
      points_->InsertNextPoint(p.x, p.y, p.z);
      const auto byte = [](double v) { return std::round(255 * std::clamp(v, 0.0, 1.0)); };
      colours_->InsertNextTuple3(byte(c.r), byte(c.g), byte(c.b));
    }
    const vtkIdType above = points_->GetNumberOfPoints() - around_, below = above - around_;
    for (int a = 0; joined_ && a < around_; ++a) {
      const vtkIdType next = (a + 1) % around_, quad[4] = {below + a, below + next, above + next, above + a};
      cells_->InsertNextCell(4, quad);
    }
    joined_ = true;
  }
  // Around the z axis.
  void circle(double z, double radius, Colour c) {
    ring(
        [&](double angle) {
          return Vec3{radius * std::cos(angle), radius * std::sin(angle), z};
        },
        [&](double) { return c; });
  }
  [[nodiscard]] vtkSmartPointer<vtkPolyData> done(double feature_deg) {
    vtkNew<vtkPolyData> raw;
    raw->SetPoints(points_);
    raw->SetPolys(cells_);
    raw->GetPointData()->SetScalars(colours_);
    vtkNew<vtkPolyDataNormals> normals;
    normals->SetInputData(raw);
    normals->SetFeatureAngle(feature_deg);
    normals->SplittingOn();
    normals->ConsistencyOff();
    normals->Update();
    auto out = vtkSmartPointer<vtkPolyData>::New();
    out->ShallowCopy(normals->GetOutput());
    return out;
  }

 private:
  int around_;
  bool joined_ = false;
  vtkNew<vtkPoints> points_;
  vtkNew<vtkCellArray> cells_;
  vtkNew<vtkUnsignedCharArray> colours_;
};

// Latitudes and heights of a round cone from pole to pole.
struct Place {
  double z, radius, along;  // along: 0 at the tip, 1 at the other end
};
std::vector<Place> profile(const RoundCone& shape, int rings) {
  std::vector<Place> all;
  const double waist = std::asin(shape.slope());
  constexpr double kPole = std::numbers::pi / 2;
  for (int r = 0; r <= rings; ++r) {
    const double latitude = -kPole + (waist + kPole) * r / rings;
    all.push_back(
        {shape.start_mm + shape.start_radius_mm * std::sin(latitude), shape.start_radius_mm * std::cos(latitude), 0});
  }
  const int side = shape.length_mm > 0 ? 8 : 0;
  const Place last = all.back();
  const double end = shape.start_mm + shape.length_mm;
  for (int r = 1; r < side; ++r) {
    const double t = static_cast<double>(r) / side, z = end + shape.end_radius_mm * std::sin(waist),
                 radius = shape.end_radius_mm * std::cos(waist);
    all.push_back({last.z + (z - last.z) * t, last.radius + (radius - last.radius) * t, 0});
  }
  for (int r = shape.length_mm > 0 ? 0 : 1; r <= rings; ++r) {  // a ball has no side: its equator is there
    const double latitude = waist + (kPole - waist) * r / rings;
    all.push_back({end + shape.end_radius_mm * std::sin(latitude), shape.end_radius_mm * std::cos(latitude), 0});
  }
  const double lo = all.front().z, hi = all.back().z;
  for (Place& p : all) p.along = (p.z - lo) / (hi - lo);
  return all;
}

// From 0 to 1, by a place alone: the grain of a diamond.
double grain(int a, int r) {
  auto x = static_cast<std::uint32_t>(a) * 2654435761U ^ static_cast<std::uint32_t>(r) * 2246822519U;
  x ^= x >> 15;
  x *= 2246822519U;
  x ^= x >> 13;
  return (x & 0xffffU) / 65535.0;
}

// A flat blade, toothed at one edge: as thick as what is felt; as wide as blades are, which is not felt. Its flat lies
// across x; which way it is turned about its own axis the hand does not tell.
void blade(Rings& rings, const RoundCone& head) {
  const double thick = head.start_radius_mm, end = head.length_mm + head.end_radius_mm;
  constexpr Colour kTooth{0.86, 0.87, 0.88};
  constexpr double kHalfWidthMm = 2.5, kToothMm = 1.2, kDeepMm = 0.6;
  const int steps = static_cast<int>(std::ceil((end + thick) / (kToothMm / 4)));
  rings.lift();
  for (int n = 0; n <= steps; ++n) {
    const double z = -thick + (end + thick) * n / steps, tip = std::clamp((z + thick) / 1.5, 0.05, 1.0);
    const double tooth = std::abs(2 * (z / kToothMm - std::floor(z / kToothMm)) - 1);  // 0 at the root, 1 at the point
    rings.ring(
        [&](double angle) {
          const double c = std::cos(angle), s = std::sin(angle);
          // The teeth are where the edge is felt: at the axis; the back lies behind it.
          const double edge = thick - kDeepMm * (1 - tooth), across = s > 0 ? s * edge : s * 2 * kHalfWidthMm * tip;
          return Vec3{0.8 * thick * c * std::min(1.0, tip + 0.2), across, z};
        },
        [&](double angle) { return std::sin(angle) > 0.3 ? mix(kTooth, kSteel, 0.5 * tooth) : kSteel; });
  }
}

}  // namespace

int flutes_of(const Burr& burr) {
  return row_of(burr.kind).flutes[burr.diameter_mm < 3 ? 0 : burr.diameter_mm < 5 ? 1 : 2];
}

vtkSmartPointer<vtkPolyData> burr_surface(const Burr& burr, double sharp) {
  const RoundCone head = burr.head();
  const int flutes = flutes_of(burr), around = flutes > 0 ? 12 * flutes : 72;
  constexpr double kDepth = 0.17, kTwist = 0.22;  // of the radius; turns from tip to end
  const auto colour = [](const std::array<double, 3>& c) { return Colour{c[0], c[1], c[2]}; };
  const BurrKindRow& kind = row_of(burr.kind);
  const Colour raised = colour(kind.raised), sunk = colour(kind.sunk), afar = colour(kind.colour);
  Rings rings(around);
  const std::vector<Place> places = profile(head, 12);
  for (std::size_t n = 0; n < places.size(); ++n) {
    const Place& p = places[n];
    const auto groove = [&](double angle) {  // 0 at an edge, growing behind it, steep before the next: a tooth
      const double x = angle / kTurn * flutes + p.along * kTwist * flutes, t = x - std::floor(x);
      return t < 0.7 ? t / 0.7 : (1 - t) / 0.3;
    };
    const auto speck = [&](double angle) {
      return grain(static_cast<int>(std::lround(angle / kTurn * around)), static_cast<int>(n));
    };
    rings.ring(
        [&](double angle) {
          const double cut = flutes > 0 ? kDepth * groove(angle) : 0.05 * speck(angle);
          const double r = p.radius * (1 - sharp * cut);
          return Vec3{r * std::cos(angle), r * std::sin(angle), p.z};
        },
        [&](double angle) { return mix(afar, mix(raised, sunk, flutes > 0 ? groove(angle) : speck(angle)), sharp); });
  }
  return rings.done(flutes > 0 ? 40 : 80);
}

vtkSmartPointer<vtkPolyData> tip_surface(const Instrument& i) {
  const RoundCone &head = i.head, &shaft = i.shaft;
  const double r = head.start_radius_mm, begin = shaft.start_mm - shaft.start_radius_mm;  // where the shaft takes over
  Rings rings(40);
  if (i.kind == InstrumentKind::sucker || i.kind == InstrumentKind::irrigator) {
    // Open at the tip: from the bottom of the bore out and over the rim, back along the outside.
    const double wall = i.kind == InstrumentKind::sucker ? 0.78 : 0.7;
    const Colour bore{0.05, 0.05, 0.06}, rim{0.80, 0.83, 0.88};
    rings.circle(2.5 * r, 0.01 * r, bore);
    rings.circle(2.5 * r, wall * r, bore);
    rings.circle(-0.9 * r, wall * r, mix(bore, kSteel, 0.4));
    rings.circle(-r, 0.5 * (wall + 1) * r, rim);
    rings.circle(-0.9 * r, r, rim);
    rings.circle(begin, r, kSteel);
  } else if (i.kind == InstrumentKind::saw) {
    blade(rings, head);
  } else if (i.name.starts_with("hook")) {
    // A rod that turns aside within the ball that is felt.
    const double rod = 0.3 * r;
    rings.lift();
    for (int n = 0; n <= 14; ++n) {
      const double t = static_cast<double>(n) / 14, bend = std::numbers::pi / 2 * std::max(0.0, 1 - t * 1.4),
                   b = r - rod;
      const Vec3 middle{b * std::sin(bend), 0, b - b * std::cos(bend) - (r - rod) + t * 0.9 * r};
      const Vec3 along = normalized({-std::cos(bend), 0, std::max(0.05, 1 - std::sin(bend))}), side{0, 1, 0},
                 up = cross(along, side);
      const double thick = n == 0 ? 0.02 : rod * std::min(1.0, 0.35 + 2 * t);
      rings.ring(
          [&](double angle) { return middle + up * (thick * std::cos(angle)) + side * (thick * std::sin(angle)); },
          [&](double) { return kSteel; });
    }
    rings.circle(begin, shaft.start_radius_mm, kSteel);
  } else {
    for (const Place& p : profile(head, 12)) {
      if (p.z > begin) break;
      rings.circle(p.z, p.z > 0 ? std::max(p.radius, shaft.start_radius_mm) : p.radius, kSteel);
    }
    rings.circle(begin, shaft.start_radius_mm, kSteel);
  }
  return rings.done(50);
}

ShaftSurface shaft_surface(const Instrument& i, const std::function<bool(Vec3)>& inside) {
  const RoundCone& shaft = i.shaft;
  const double r = shaft.start_radius_mm, begin = shaft.start_mm - r, end = shaft.start_mm + shaft.length_mm;
  constexpr double kStepMm = 0.5;
  const int steps = static_cast<int>(std::ceil((end - begin) / kStepMm));
  // A ring is in bone where half of its places are.
  std::vector<double> share(static_cast<std::size_t>(steps) + 1);
  for (int n = 0; inside && n <= steps; ++n) {
    const double z = begin + (end - begin) * n / steps;
    for (int a = 0; a < 16; ++a)
      share[static_cast<std::size_t>(n)] +=
          inside({0.98 * r * std::cos(kTurn * a / 16), 0.98 * r * std::sin(kTurn * a / 16), z}) ? 1.0 / 16 : 0.0;
  }
  ShaftSurface out;
  Rings rings(32);
  for (int n = 0; n <= steps; ++n) {
    double near = 0;
    for (int m = std::max(0, n - 2); m <= std::min(steps, n + 2); ++m)
      near = std::max(near, share[static_cast<std::size_t>(m)]);
    out.in_bone += share[static_cast<std::size_t>(n)] > 0 ? 1.0 / (steps + 1) : 0;
    if (share[static_cast<std::size_t>(n)] > 0.9) {
      rings.lift();
      continue;
    }
    const double z = begin + (end - begin) * n / steps;
    rings.circle(z, r,
                 near > 0                              ? kTouches
                 : i.kind == InstrumentKind::irrigator ? mix(kSteel, {0.45, 0.62, 0.85}, 0.5)
                                                       : kSteel);
  }
  if (i.cutter() != nullptr) {
    // The collet and the handpiece behind it: not felt.
    constexpr double kBackMm = 75;
    for (const auto& [z, radius, colour] : {std::array<double, 3>{0, 1.9, 0},
                                            {2, 2.4, 0},
                                            {8, 3.2, 1},
                                            {12, 5.2, 1},
                                            {20, 6.6, 1},
                                            {26, 6.4, 2},
                                            {kBackMm, 7.0, 1},
                                            {kBackMm, 0.1, 1}})
      rings.circle(end + z, radius,
                   colour == 0   ? kDarkSteel
                   : colour == 2 ? mix(kHandpiece, kDarkSteel, 0.5)
                                 : kHandpiece);
  } else if (i.kind == InstrumentKind::sucker || i.kind == InstrumentKind::irrigator) {
    // A finger's plate, the bend, and where the hose sits.
    for (const auto& [z, radius] : {std::pair{0.0, r},
                                    {1.0, 3.2},
                                    {9.0, 3.8},
                                    {10.0, r + 0.6},
                                    {32.0, r + 0.6},
                                    {33.0, r + 1.4},
                                    {42.0, r + 1.4},
                                    {42.0, 0.1}}) {
      rings.ring(
          [&](double angle) {
            const double flat = radius > 3 && z < 10 ? 0.35 : 1, bent = 0.35 * std::max(0.0, z - 10);
            return Vec3{radius * std::cos(angle), flat * radius * std::sin(angle) + bent, end + z};
          },
          [&](double) { return z > 32 ? kDarkSteel : kSteel; });
    }
  } else {
    for (const auto& [z, radius] : {std::pair{0.0, r}, {2.0, 2.2}, {70.0, 2.6}, {72.0, 1.8}, {72.0, 0.1}})
      rings.circle(end + z, radius, z > 2 ? kHandpiece : kSteel);
  }
  out.data = rings.done(40);
  return out;
}

}  // namespace osteo::inline display
