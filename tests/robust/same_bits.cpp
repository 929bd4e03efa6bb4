// Prints hashes of what the servo computes and of what it starts from, in full precision. check_same_bits.py runs it as
// other machines would.
#include <cmath>
#include <cstdio>

#include "osteo/core/base/files.h"
#include "osteo/core/base/simd.h"
#include "osteo/geometry/distance/distance_map.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/geometry/mesh/soup.h"
#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/haptics/fields.h"
#include "osteo/simulation/haptics/servo.h"
#include "osteo/simulation/haptics/vibration.h"
#include "osteo/simulation/tissue/dynamics.h"
#include "slab.h"
#include "tissue/block.h"

namespace osteo {
namespace {

class Sum {
 public:
  template <class T>
  void add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    hasher_.add(&value, sizeof value);
  }
  template <class T>
  void add(const std::vector<T>& values) {
    hasher_.add(values.data(), values.size() * sizeof(T));
  }
  void print(const std::string& what) const { std::printf("%s %s\n", what.c_str(), hasher_.hex().c_str()); }

 private:
  Hasher hasher_;
};

// The library's own, which is known to differ: whether the machine was really made another.
void library_itself() {
  Sum sum;
  for (int n = 0; n < 100'000; ++n) {
    const volatile double x = 0.00317 * n;
    sum.add(std::cos(x));
  }
  sum.print("library");
}

void tools() {
  Sum sum;
  for (int t = 0; t < static_cast<int>(burr_library().size()); ++t) {
    const auto tool = static_cast<std::size_t>(t);
    const Burr& burr = burr_library()[tool];
    for (double share = 0.003; share < 1; share += 0.07) {
      for (double cosine = -1; cosine <= 1; cosine += 0.1) {
        sum.add(head_cut_depth(tool)(share * burr.head().volume_mm3(), cosine));
        sum.add(shaft_cut_depth(tool)(share * burr.shaft().volume_mm3(), cosine));
      }
    }
    const BurrSamples inside =
        sample_head(burr.head(), burr.falloff_mm3_per_s_per_n_per_rad / burr.rate_mm3_per_s_per_n);
    const BurrSurface surface =
        sample_head_surface(burr.head(), burr.falloff_mm3_per_s_per_n_per_rad / burr.rate_mm3_per_s_per_n, 500);
    sum.add(inside.offset_mm), sum.add(inside.inward), sum.add(inside.efficiency), sum.add(inside.sample_volume_mm3);
    sum.add(surface.offset_mm), sum.add(surface.inward), sum.add(surface.efficiency);
  }
  for (const PlateModel& p : plate_library())
    sum.add(p.mesh.points_mm), sum.add(p.mesh.normals), sum.add(p.moving.points_mm);
  sum.print("tools");
}

void vibration_and_turns() {
  Sum sum;
  Vibration vibration(default_vibration());
  for (int n = 0; n < 20'000; ++n)
    sum.add(vibration.step(n % 3 == 0 ? BurrKind::diamond : BurrKind::cutting, 0.001 * n, 1e-3));
  for (int n = -500; n < 500; ++n) sum.add(rotation_about({1, 2, 3}, normalized(Vec3{1, 0.1 * n, 2}), 0.013 * n));
  sum.print("vibration-and-turns");
}

void distances() {
  const auto bone = test::slab(1);
  const TriangleSoup soup = soup_of(surface_nets(bone).mesh);
  Sum sum;
  MeshField field(soup, true);
  field.set_radius_mm(1.3);
  for (int n = 0; n < 3000; ++n) {
    const Clearance c = field({30 * std::sqrt(n / 3000.0) - 15, 0.01 * n - 15, 0.003 * n - 4});
    sum.add(c.value_mm), sum.add(c.gradient), sum.add(c.normal);
  }
  Frame frame;
  frame.dims = {60, 60, 30};
  frame.spacing_mm = {0.7, 0.7, 0.7};
  frame.origin_mm = {-21, -21, -15};
  const DistanceMap map = DistanceMapper(soup, frame).map();
  for (const double d : map.distance_mm) sum.add(std::isnan(d) ? 1e9 : d);
  sum.add(map.triangle);
  sum.print("distances");
}

void tissue() {
  Sum sum;
  const auto b = test::block(6, 4, 4, 2.0);
  const Material m{0.1, 0.45};
  const TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  const auto shake = [&]<class Real>(TissueDynamics<Real> d) {
    for (std::uint32_t p = 0; p < d.point_count(); p += 7) d.set_position(p, model.rest()[p] + Vec3{0.1, -0.2, 0.05});
    d.step(400);
    sum.add(d.positions_mm());
  };
  shake(TissueDynamics<float>(model, {}));
  shake(TissueDynamics<double>(model, {}));
  sum.print("tissue");
}

void servo(ContactMethod method, int tool) {
  auto bone = test::slab(0.5);
  HapticSetup setup;
  setup.params.contact.method = method;
  setup.device = SpringHand::traits();
  setup.curve = {{-5, 0, 1}, {0, 3, 0}, {5, 0, 1}};
  HapticRenderer renderer(setup, bone, {}, 1e-3);
  Stream stream;
  auto& reader = stream.add_reader(1 << 14, 1 << 22);
  Strokes script;
  script.tool = tool;
  script.axis = {0.6, 0, 0.8};
  for (int i = 0; i <= 30; ++i)
    script.waypoints.push_back({0.1 * i, {0.3 * (i % 7) - 1, 0.4 * (i % 5) - 1, 4 - 0.2 * i}, i % 5 != 0});
  ScriptedDevice device(script, 1000);
  Servo loop(renderer, device, stream, 1000);
  while (loop.step(0)) {
  }
  Sum sum;
  TickRecord tick;
  VoxelChange change;
  std::size_t ticks = 0, changes = 0;
  while (reader.ticks.pop(std::span(&tick, 1)) > 0) {
    tick.work_us = tick.lateness_us = 0;
    sum.add(tick);
    ++ticks;
  }
  while (reader.changes.pop(std::span(&change, 1)) > 0) {
    sum.add(change.voxel);
    sum.add(change.density);
    ++changes;
  }
  sum.print("servo-" + std::string(EnumNames<ContactMethod>::values[static_cast<std::size_t>(method)]) + "-tool-" +
            std::to_string(tool) + "-" + std::to_string(ticks) + "-ticks-" + std::to_string(changes) + "-changes-" +
            bone.hash());
}

}  // namespace
}  // namespace osteo

int main() {
  using namespace osteo;
  std::printf("instructions %s\n", simd_name(simd()).data());
  library_itself();
  tools();
  vibration_and_turns();
  distances();
  tissue();
  for (const ContactMethod m :
       {ContactMethod::rays, ContactMethod::volume, ContactMethod::overlap, ContactMethod::proxy}) {
    servo(m, burr_index(BurrKind::cutting, 4));
    servo(m, burr_index(BurrKind::diamond, 3, BurrShape::taper));
  }
}
