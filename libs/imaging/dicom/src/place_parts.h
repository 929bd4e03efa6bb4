// What placing is made of: which slices make up the stack (stacks.cpp), and what is to be said of it (judge_stack.cpp).
// Private to libs/imaging/dicom.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "osteo/imaging/dicom/detail/place.h"

namespace osteo::inline imaging::dicom {

struct Candidate {
  std::size_t header = 0;
  int frame = 0;
  double along = 0;  ///< the normal, mm
};

/// The pictures of a series.
struct Pictures {
  const std::vector<DicomHeader>& headers;

  [[nodiscard]] const DicomHeader& header_of(const Candidate& c) const { return headers[c.header]; }
  [[nodiscard]] const DicomFrame& frame_of(const Candidate& c) const {
    return headers[c.header].frames[static_cast<std::size_t>(c.frame)];
  }
  /// To show: the file, and which picture of it where it holds several.
  [[nodiscard]] std::string name_of(std::size_t header, int frame) const;
  [[nodiscard]] std::string name_of(const Candidate& c) const { return name_of(c.header, c.frame); }
  /// How far apart the corners of two slices come to lie by their axes and spacing alone.
  [[nodiscard]] double corner_deviation(const Candidate& a, const Candidate& b) const;
};

/// "2.5 mm", to a thousandth.
[[nodiscard]] std::string mm(double v);

using SamePixels = std::function<bool(std::size_t, std::size_t)>;

/// The slices of the stack to take, sorted along the normal; none when the verdict rejects. What is left out and why
/// goes into the verdict.
[[nodiscard]] std::vector<Candidate> choose_stack(const Pictures& pictures, const PlaceOptions& options,
                                                  const std::vector<FileSetAside>& excluded,
                                                  const SamePixels& same_pixels, Verdict& verdict);

/// Gaps, tilt, sideways shifts, and whether the pictures are slices of Hounsfield units at all; into p.verdict and
/// p.even. p.slices are those of `stack`.
void judge_stack(const Pictures& pictures, const std::vector<Candidate>& stack, const PlaceOptions& options,
                 Placement& p);

}  // namespace osteo::inline imaging::dicom
