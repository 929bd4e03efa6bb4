// A series as a volume: all at once, or slab by slab onto any upright lattice.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>

#include "osteo/core/base/context.h"
#include "osteo/core/base/error.h"
#include "osteo/core/data/volume.h"
#include "osteo/imaging/dicom/scan.h"

namespace osteo::inline imaging {

/// A series that is not taken, with the reasons. what() is the first error of the verdict; the code is that of an
/// input, corrupt.
class Refused : public Error {
 public:
  explicit Refused(const Verdict& verdict);
  [[nodiscard]] const Verdict& verdict() const { return *verdict_; }

 private:
  std::shared_ptr<const Verdict> verdict_;
};

struct DicomVolume {
  Image image;  ///< HU; padding and what lies outside the scan is -1024
  Verdict verdict;
};

/// The series as a volume in LPS mm. Slices are placed by their own position and orientation. Evenly spaced slices that
/// stand straight above each other come out voxel for voxel; a tilted gantry or uneven distances are resampled onto
/// upright, even slices: linear in the slice and between slices, at the finest distance (at most 0.5 mm, at least a
/// pixel; so that layers lie on the slices where these are as far apart as ever), without padding taking part. Where
/// slices are only missing, those that are there stay voxel for voxel. Slices are read and decoded in parallel; a file
/// whose pixels are damaged counts as missing. Memory: the volume (and, when resampled, the slices besides). Throws
/// Rejected for whatever cannot be placed rightly; see verdict.h for the codes.
[[nodiscard]] DicomVolume load_dicom_series(const DicomSeries& series, const PlaceOptions& options = {},
                                            const Context& context = {});

/// The same series straight onto a lattice of `spacing_mm`, upright above the slices, a few layers at a time.
class DicomSlabs {
 public:
  /// Reads no pixels yet. Throws Rejected.
  DicomSlabs(const DicomSeries& series, const PlaceOptions& options, double spacing_mm);
  ~DicomSlabs();
  DicomSlabs(const DicomSlabs&) = delete;
  DicomSlabs& operator=(const DicomSlabs&) = delete;

  [[nodiscard]] const Frame& frame() const;
  /// Value of a voxel that no slice covers.
  static constexpr std::int16_t kNoValue = -32768;
  /// Calls take(first layer, layers, voxels) from the first layer to the last, `layers_each` at a time (the last may
  /// have fewer). Memory: the slab and the slices it lies between. When a file turns out damaged it is left out and
  /// everything starts again: take() then sees the first layer once more. Throws Rejected.
  void run(int layers_each, const Context& context, const std::function<void(int, int, const std::int16_t*)>& take);
  /// Complete after run().
  [[nodiscard]] const Verdict& verdict() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline imaging
