// Slices of a placement, read in parallel; and lattices sampled between them. Private to libs/imaging/dicom.
#pragma once
#include <map>
#include <memory>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/frame.h"
#include "osteo/imaging/dicom/detail/place.h"
#include "pixels.h"
#include "slice_judge.h"

namespace osteo::inline imaging::dicom {

/// A file that could not be decoded.
struct DamagedFile {
  std::size_t header = 0;
  std::string why;
};

class SliceReader {
 public:
  SliceReader(const std::vector<DicomHeader>& headers, const Placement& placement)
      : headers_(headers), placement_(placement), figures_(placement.slices.size()) {}
  /// Reads slices [begin, end) into out[slice]; throws DamagedFile for the first that cannot be read.
  void read(std::size_t begin, std::size_t end, const std::vector<std::int16_t*>& out, const Context& context);
  [[nodiscard]] const ValueCount& count() const { return count_; }
  /// Of the slices read so far; those of others are empty.
  [[nodiscard]] const std::vector<SliceFigure>& figures() const { return figures_; }

 private:
  /// What one file is read for.
  struct Job {
    std::vector<FrameTarget> targets;
    std::vector<std::size_t> slices;  ///< of each target
  };
  const std::vector<DicomHeader>& headers_;
  const Placement& placement_;
  ValueCount count_;
  std::vector<SliceFigure> figures_;
  std::map<std::size_t, std::vector<std::int16_t>> decoded_;  // compressed multi-frame files, kept
};

/// An upright lattice above the slices of a placement: linear along rows, columns and the normal, each slice where it
/// lies.
class SliceSampler {
 public:
  SliceSampler(const Placement& placement, int columns, int rows, const Frame& frame);
  /// Slices [first, last] that layer z lies between.
  [[nodiscard]] std::pair<std::size_t, std::size_t> slices_of(int z) const;
  /// One row of the lattice. slice(k) gives the pixels of slice k. Voxels that no measured pixel reaches become
  /// kNoValue.
  struct Scratch {
    std::vector<float> value, weight, sum, sum_weight;
  };
  void row(int y, int z, const std::vector<const std::int16_t*>& slices, std::int16_t* out, Scratch& scratch) const;

 private:
  struct Tap {
    int index;
    float fraction;
  };
  struct AlongRow {
    std::vector<Tap> taps;  // one a column of the lattice; index -2 where no pixel is near
    int begin = 0, end = 0;
  };
  [[nodiscard]] double along(int z) const { return along_first_ + z * frame_.spacing_mm.z; }

  const Placement& placement_;
  int columns_, rows_;
  Frame frame_;
  double along_first_ = 0, side_first_[2] = {};
  std::vector<const AlongRow*> of_slice_;
  std::map<long long, AlongRow> tables_;  // by sideways shift: slices that stand above each other share one
};

}  // namespace osteo::inline imaging::dicom
