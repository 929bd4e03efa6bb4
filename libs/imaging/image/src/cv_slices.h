// Slices of our volumes as OpenCV's matrices.
#pragma once
#include <opencv2/core.hpp>

#include "osteo/core/base/error.h"
#include "osteo/imaging/image/planes.h"

namespace osteo::inline imaging::image {

// OpenCV's own threads are not wanted: slices are spread over ours, whose number never changes a result.
inline void without_own_threads() {
  static const bool once = [] {
    cv::setNumThreads(0);
    return true;
  }();
  static_cast<void>(once);
}

// Where a slice's columns and rows lie among a volume's voxels.
struct SliceLayout {
  std::size_t begin = 0, step_u = 1, step_v = 1;
  int width = 0, height = 0;
  int u = 0, v = 1;  // index axes of columns and rows
  double mm_u = 1, mm_v = 1;
};
inline SliceLayout layout_of(const Frame& f, SliceAt slice) {
  if (slice.axis < 0 || slice.axis > 2 || slice.index < 0 ||
      slice.index >= f.dims[static_cast<std::size_t>(slice.axis)])
    throw Error(ExitCode::usage,
                "there is no slice " + std::to_string(slice.index) + " across axis " + std::to_string(slice.axis));
  const std::array<std::size_t, 3> step{1, static_cast<std::size_t>(f.dims[0]),
                                        static_cast<std::size_t>(f.dims[0]) * static_cast<std::size_t>(f.dims[1])};
  SliceLayout l;
  l.u = slice.axis == 0 ? 1 : 0;
  l.v = slice.axis == 2 ? 1 : 2;
  const auto u = static_cast<std::size_t>(l.u), v = static_cast<std::size_t>(l.v),
             a = static_cast<std::size_t>(slice.axis);
  l.begin = step[a] * static_cast<std::size_t>(slice.index);
  l.step_u = step[u];
  l.step_v = step[v];
  l.width = f.dims[u];
  l.height = f.dims[v];
  l.mm_u = f.spacing_mm[u];
  l.mm_v = f.spacing_mm[v];
  return l;
}

// Wrapped where columns lie side by side, else copied. Not to be written to.
template <class T>
cv::Mat slice_of(const Volume<T>& volume, SliceAt slice) {
  without_own_threads();
  const SliceLayout l = layout_of(volume.frame, slice);
  constexpr int type = cv::DataType<T>::type;
  auto* const data = const_cast<T*>(volume.voxels.get()) + l.begin;
  if (l.step_u == 1) return {l.height, l.width, type, data, l.step_v * sizeof(T)};
  cv::Mat copy(l.height, l.width, type);
  for (int j = 0; j < l.height; ++j)
    for (int i = 0; i < l.width; ++i)
      copy.at<T>(j, i) = data[static_cast<std::size_t>(i) * l.step_u + static_cast<std::size_t>(j) * l.step_v];
  return copy;
}

}  // namespace osteo::inline imaging::image
