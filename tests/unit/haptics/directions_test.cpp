// Contact from each side alike: no method may prefer a direction of the voxels.
#include <gtest/gtest.h>

#include "osteo/simulation/haptics/contact.h"
#include "solid.h"

namespace osteo {
namespace {

TEST(Contact, SixFacesGiveTheSameDepth) {
  for (std::size_t a = 0; a < 3; ++a) {
    for (const double side : {-1.0, 1.0}) {
      // Bone where side * x <= 0.1 along this axis, off the voxels' borders.
      const BrickGrid bone = test::solid(0.5, 8, [&](Vec3 p) { return side * p[a] <= 0.1; });
      for (std::size_t m = 0; m < EnumNames<ContactMethod>::values.size(); ++m) {
        ContactParams params;
        params.method = static_cast<ContactMethod>(m);
        const auto model = make_contact_model(params, 0.5);
        DeviceSample pose;
        pose.tool = 3;
        pose.axis = {0.36F, 0.48F, 0.8F};
        const auto at = [&](double depth) {
          Vec3 p{0.13, -0.21, 0.07};
          p[a] = side * (0.1 + burr_library()[3].diameter_mm / 2 - depth);
          pose.position_mm = to_floats(p);
          return model->contact(bone, pose);
        };
        static_cast<void>(at(-1));  // the proxy comes from outside
        const ContactResult r = at(0.8);
        SCOPED_TRACE(std::string(EnumNames<ContactMethod>::values[m]) + " axis " + std::to_string(a) + " side " +
                     std::to_string(side));
        EXPECT_NEAR(r.depth_mm, 0.8, params.method == ContactMethod::rays ? 0.15 : 0.06);
        EXPECT_GT(side * r.normal[a], 0.99);
      }
    }
  }
}

}  // namespace
}  // namespace osteo
