#include "head_model.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline imaging {
using namespace anatomy;

// The cranium's outside: four ellipsoids, egg-shaped from above, widest behind the ears.
double HeadAnatomy::Model::outer_vault(Vec3 p) const {
  const Vec3 q{p.x / build.vault.x, p.y / build.vault.y, p.z > 0 ? p.z / build.vault.z : p.z};
  double d = ellipsoid(q, {0, 8, 22}, {68, 82, 74});
  d = smin(d, ellipsoid(q, {0, -33, 26}, {54, 57, 58}), 14);
  d = smin(d, ellipsoid(q, {0, 36, 4}, {61, 52, 49}), 14);
  return smin(d, ellipsoid(q, {0, 6, -8}, {61.5, 58, 34}), 10);
}

double HeadAnatomy::Model::orbit(Vec3 p) const {
  return smin(cone(p, {30, -82, 2}, {14, -44, 3}, 17.5, 4), ellipsoid(p, {31, -80, 2}, {19, 14, 17}), 3);
}

double HeadAnatomy::Model::nasal(Vec3 p) const {
  const double wide = mix(12.5, 4.5, ramp(p.z, -30, 2));
  return smax(smax(std::abs(p.x) - wide, std::abs(p.z + 20.5) - 21.5, 4), std::abs(p.y + 68) - 26, 4);
}

double HeadAnatomy::Model::brain(Vec3 p, double vault, double sinus_d, const Ear& e, double orbit_d, double air) const {
  // Thin squama above the ear, thick elsewhere.
  const double dy = (p.y + 2) / 34, dz = (p.z - 4) / 26, r2 = dy * dy + dz * dz;
  const double thick = 6.5 - 3.4 * ramp(r2, 1.3, 0.1) * ramp(p.x, 30, 45);
  const double inner = vault + thick;
  // Floors of the anterior and the middle fossa; the tegmen rises to the petrous ridge.
  const double across = (p.x - 54) * -0.69 + (p.y - 31) * 0.72;  // behind the ridge above 0
  double middle = mix(-3, -13, ramp(p.x, 9, 22));
  middle = mix(middle, -6.5 + build.tegmen_up, ramp(across, -27, -10));
  const double ax = p.x - 35.7, ay = p.y - 4.3, bulge = std::max(0.0, 1 - (ax * ax + ay * ay) / 49);
  middle += 1.9 * bulge * bulge + 1.2 * ramp(across, -7, -1);
  const double floor = mix(4, middle, ramp(p.y, -60, -40));
  const double above = (floor - p.z) * 0.75;
  // Posterior fossa: behind the petrous bone and the clivus.
  const Vec3 back = normalized({-0.69, 0.72, 0.17}), clivus = normalized({0, 0.85, 0.53});
  const double behind = smax(-dot(p - Vec3{54, 31, -4.5}, back), -dot(p - Vec3{0, -21, -5}, clivus), 6);
  double d = smax(inner, smin(above, behind, 2.5), 4);
  // The sinus lies in a groove of the bone, open to the inside.
  d = smin(d, sinus_d, 3);
  if (p.z < -30) d = smax(d, (-44.5 - p.z), 3);
  // Walls to what is hollow on the other side: at least the tegmen's 0.8 mm.
  d = smax(d, 0.8 - e.cavity, 0.6);
  d = smax(d, 1.2 - e.labyrinth, 0.6);
  d = smax(d, 1.5 - orbit_d, 1.5);
  return smax(d, 1.2 - air, 1.5);
}

double HeadAnatomy::Model::skin(Vec3 p, double vault) const {
  double d = vault - 6;
  d = smin(d, ellipsoid(p, {0, -48, -40}, {58, 50, 66}), 14);
  d = smin(d, ellipsoid(p, {0, -80, -86}, {33, 27, 35}), 12);
  d = smin(d, cone(p, {46, -24, -82}, {14, -80, -95}, 16, 16), 10);
  d = smin(d, ellipsoid(p, {45, -70, -16}, {17, 16, 22}), 8);
  d = smin(d, cone(p, {58, -56, -19}, {64, -14, -16}, 11, 10), 6);
  d = smin(d, cone(p, {0, -86, 14}, {44, -70, 16}, 13, 11), 8);
  d = smin(d, cone(p, {55, 17, -18}, {57, 14, -44}, 15, 10), 8);
  d = smin(d, cone(p, {0, 12, -40}, {0, 22, -160}, 56, 58), 22);
  d = smin(d, cone(p, {0, -97, -2}, {0, -113, -26}, 6, 8), 9);
  d = smin(d, cone(p, {46, -18, -30}, {45, -26, -82}, 18, 17), 12);
  // The auricle.
  d = smin(d, ellipsoid(p, {73, 12, -14}, {4, 17, 30}), 5);
  return d;
}

double HeadAnatomy::Model::tooth(Vec3 p) const {
  if (p.y > -38 || p.z > -34 || p.z < -100 || p.x > 42) {
    return std::max({p.y + 40, -36 - p.z < 0 ? p.z + 36 : -1e9, -98 - p.z, p.x - 38, 2.0});
  }
  double best = 1e9;
  for (const Tooth& t : teeth) {
    const Vec3 d = p - t.centre;
    const double away = length(d);
    if (away > 24 || away - 22 > best) {
      best = std::min(best, std::max(away - 22, 1.0));
      continue;
    }
    const Vec3 across{t.along.y, -t.along.x, 0};
    const Vec3 q{dot(d, t.along), dot(d, across), d.z * t.up};
    // The crown narrows to the neck and, in front teeth, to the edge.
    const bool molar = t.half.x > 4 && t.half.y > 4.5;
    const double blade = molar || t.half.y > 4 ? 1 : mix(0.45, 1, ramp(q.z, -t.half.z, t.half.z));
    const double neck = mix(1, 0.78, ramp(q.z, 0, t.half.z));
    double crown = box({q.x / neck, q.y / (blade * neck), q.z}, {}, {t.half.x, t.half.y, t.half.z},
                       std::min(t.half.x, t.half.y) * 0.62) *
                   0.7;
    double root = 1e9;
    if (molar) {
      for (const double side : {-1.0, 1.0}) {
        root = std::min(root, cone(q, {side * t.half.x * 0.4, 0, t.half.z * 0.6},
                                   {side * t.half.x * 0.55, 0, t.half.z + t.root}, t.half.x * 0.45, 1.0));
      }
    } else {
      root = cone(q, {0, 0, t.half.z * 0.6}, {0, 0, t.half.z + t.root}, std::min(t.half.x, t.half.y) * 0.72, 0.9);
    }
    best = std::min(best, smin(crown, root, 1));
  }
  return best;
}

double HeadAnatomy::Model::mandible(Vec3 p) const {
  if (p.y > 8 || p.z > -10) return std::max(p.y, p.z + 16);
  const double g = build.gonion_out;
  // Body: an upright plate along the arch, its upper part leaning inward to the teeth.
  const double low = -107 - build.jaw_height + 21 * std::clamp((p.y + 88) / 70, 0.0, 1.0);
  const double high = -77.5 + 0.1 * (p.y + 90) * 1.1;
  const double lean = 4.5 * ramp(p.y, -88, -62) * ramp(p.z, low + 6, high + 2);
  const double x = p.x + lean;
  double way = 1e9;
  for (std::size_t i = 0; i + 1 < jaw_line.size(); ++i) {
    way = std::min(way, segment2(x, p.y, jaw_line[i].at_mm.x, jaw_line[i].at_mm.y, jaw_line[i + 1].at_mm.x,
                                 jaw_line[i + 1].at_mm.y));
  }
  const double thick = mix(5.2, 5.8, ramp(p.z, -86, -98)) + 0.8 * ramp(p.y, -80, -90);
  double body = smax(way - thick, std::abs(p.z - 0.5 * (low + high)) - 0.5 * (high - low), 6) * 0.85;
  // What holds the teeth.
  double holder = smax(arch(p, 26.5, -45, 41) - 5, std::abs(p.z - 0.5 * (high - 95)) - 0.5 * (high + 95), 4);
  body = smin(body, smax(holder, p.y + 44, 6) * 0.8, 7);
  body = smin(body, ellipsoid(p, {0, -92, -103 - build.jaw_height}, {15, 5, 6}), 5);
  // Ramus: posterior border with the condyle's neck, anterior border with the coronoid process, a notch between.
  double sheet = segment2(p.y, p.z, -23, -76, -15.5, -40) - 7;
  sheet = smin(sheet, segment2(p.y, p.z, -48, -70, -43.5, -37) - 4.5, 9);
  sheet = smin(sheet, segment2(p.y, p.z, -35, -74, -31, -55) - 12, 6);
  const double at = mix(45 + g, 48.5, ramp(p.z, -80, -30));
  const double ramus = smax(sheet, std::abs(p.x - at) - mix(4.4, 3.2, ramp(p.z, -80, -40)), 4) * 0.95;
  double condyle = ellipsoid(p, {50.5, -13.5, -23.7}, {9.5, 4.4, 5});
  condyle = smin(condyle, cone(p, {50, -14, -25}, {48.5, -15, -42}, 4.2, 4.6), 5);
  return smin(smin(body, ramus, 8), condyle, 4);
}

double HeadAnatomy::Model::face(Vec3 p, double orbit_d, double nasal_d) const {
  // Brow, root of the nose, nasal bones.
  double d = ellipsoid(p, {0, -84, 13}, {19, 8.5, 10});
  d = smin(d, cone(p, {8, -87, 17}, {44, -74, 17}, 4.5, 4.5), 6);
  d = smin(d, cone(p, {0, -90, 8}, {0, -97, -9}, 4.4, 3.6), 5);
  d = smin(d, cone(p, {7, -89, 6}, {16, -85, -28}, 3.4, 4.2), 7);
  // Shells of orbit, nose and the maxilla's sinus; the rim of the orbit.
  const double rim_y = -81 + 0.42 * (p.x - 30);
  d = smin(d, smax(orbit_d - 1.9, (rim_y - p.y) * 0.9, 2), 2);
  const double ring = portable::hypot(p.x - 31, (p.z - 2) * 1.1) - 20.2;
  d = smin(d, portable::hypot(ring, (p.y - rim_y) * 0.9) * 0.95 - 3.0, 3);
  d = smin(d, smax(nasal_d - 1.8, -85.5 - p.y, 2), 2);
  d = smin(d, ellipsoid(p, {27, -64, -30}, {14.5, 18, 15.5}), 3);
  // Zygoma with its frontal process and the arch.
  d = smin(d, cone(p, {49.5, -71, 13}, {49, -71, -12}, 3.8, 4.5), 4);
  d = smin(d, ellipsoid(p, {44, -72, -20}, {10, 6.5, 9}), 5);
  const Vec3 flat{64 + (p.x - 64) * 1.0, p.y, p.z};
  d = smin(d, arch_tube.distance(flat, 9), 3);
  // Upper jaw: the arch that holds the teeth, the palate.
  const double low = -60 + 0.1 * (p.y + 90);
  double jaw = smax(arch(p, 28, -46, 43.5) - 5.6, std::abs(p.z - 0.5 * (low - 32)) - 0.5 * (-32 - low), 8);
  jaw = smax(jaw, p.y + 42, 4);
  d = smin(d, jaw * 0.8, 10);
  d = smin(d, cone(p, {15, -84, -28}, {13, -86, -46}, 4.5, 5), 8);
  const double fy = (p.y + 46) / 44, fx = p.x / 28, within = (std::sqrt(fx * fx + fy * fy) - 1) * 26;
  d = smin(d, smax(smax(within, std::abs(p.z + 43.5) - 1.6, 1), p.y + 42, 2) * 0.9, 4);
  // Sphenoid body and pterygoid plates.
  d = smin(d, box(p, {0, -38, -13}, {15, 16, 11}, 7), 4);
  d = smin(d, cone(p, {14, -40, -20}, {15, -44, -46}, 4, 2.2), 4);
  d = smin(d, cone(p, {14, -40, -20}, {20, -36, -44}, 4, 1.8), 3);
  // Lateral wall of the orbit to the temporal fossa: greater wing.
  return smin(d, cone(p, {46, -66, 4}, {36, -46, -4}, 3, 4), 6);
}

double HeadAnatomy::Model::skull(Vec3 p, double vault, double brain_d, double orbit_d, double nasal_d, double air,
                                 double sinus_d, const Ear& e) const {
  // Underside of the base.
  double under = mix(-24 - 0.42 * (p.y + 40), -17.5, ramp(p.x, 14, 26));
  under = mix(under, -32.2, ramp(p.y, -14, -2));
  const double behind = (p.x - 54) * -0.69 + (p.y - 31) * 0.72 - 5.7;  // the posterior fossa at the base
  under = mix(under, -50, ramp(behind, -12, 1) * ramp(p.y, -32, -10));
  under = mix(1, under, ramp(p.y, -56, -44));
  double d = smax(vault, (under - p.z) * 0.55, 4);
  // Temporal bone: mastoid with its tip, ring of the ear canal, styloid process, eminence before the joint.
  const double o = build.mastoid_out;
  d = smin(d, ellipsoid(p, {52.8 + 0.5 * o, 20.5, -16}, {11.2, 17, 17}), 6);
  d = smin(d, cone(p, {54 + o, 16.5, -24}, {56.8 + o, 12, -42 - build.tip_down}, 11.2, 5.2), 5);
  const Vec3 tall{p.x, p.y, -20 + (p.z + 20) * 0.86};
  d = smin(d, smax(canal.distance(tall, 8) - 2.4, smax(p.x - 60 - 0.3 * (p.z + 20), 43 - p.x, 1.5), 1.5), 3);
  d = smin(d, cone(p, {44, 4, -31}, {37.5, -6, -59}, 2.8, 1.2), 2);
  d = smin(d, ellipsoid(p, {53, -25, -17.5}, {9, 5, 5}), 4);
  d = smin(d, face(p, orbit_d, nasal_d), 4);
  d = smin(d, ellipsoid(p, {0, 84 * build.vault.y, -10}, {9, 5, 6}), 6);
  // The plate under the sigmoid sinus, to where it leaves for the jugular foramen.
  d = smin(d, smax(sinus_d - 1.4, 20 - p.y, 1), 2);
  // Occipital condyles.
  d = smin(d, ellipsoid(p, {17, 4, -40}, {6, 11, 6}), 3);
  // What is hollow.
  d = smax(d, -brain_d, 1);
  d = smax(d, -orbit_d, 1);
  d = smax(d, -nasal_d, 1);
  d = smax(d, -ellipsoid(p, {50.5, -13, -24.2}, {13, 7.8, 8.6}), 3);           // joint
  d = smax(d, -cone(p, {48.5, 28, -46.5}, {46.8, 14.5, -38.8}, 3.4, 3.0), 2);  // digastric groove
  const double mx = p.x / 15, my = (p.y - 17) / 18;
  d = smax(d, -smax((std::sqrt(mx * mx + my * my) - 1) * 14, p.z + 26, 4), 3);  // foramen magnum
  return std::max({d, -sinus_d, -e.carotid, -air});
}

}  // namespace osteo::inline imaging
