#include "palette.h"

namespace osteo::inline app {

const NearnessLook& look_of(Nearness nearness) {
  static constexpr NearnessLook kLooks[] = {{palette::kFaint, "", 0},
                                            {palette::kSkyBlue, "clear", 0},
                                            {palette::kYellow, "NEAR", 3},
                                            {palette::kOrange, "CLOSE", 4},
                                            {palette::kVermillion, "TOUCHED", 8}};
  return kLooks[static_cast<int>(nearness)];
}

}  // namespace osteo::inline app
