#include "osteo/core/data/volume.h"

#include <algorithm>

namespace osteo {

double sample_linear(const Image& image, Vec3 index) {
  int lo[3];
  double t[3];
  for (std::size_t a = 0; a < 3; ++a) {
    const double c = std::clamp(index[a], 0.0, image.frame.dims[a] - 1.0);
    lo[a] = std::min(static_cast<int>(c), std::max(0, image.frame.dims[a] - 2));
    t[a] = c - lo[a];
  }
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const double w =
        ((c & 1) != 0 ? t[0] : 1 - t[0]) * ((c & 2) != 0 ? t[1] : 1 - t[1]) * ((c & 4) != 0 ? t[2] : 1 - t[2]);
    if (w > 0) sum += w * image.at(lo[0] + (c & 1), lo[1] + (c >> 1 & 1), lo[2] + (c >> 2));
  }
  return sum;
}

}  // namespace osteo
