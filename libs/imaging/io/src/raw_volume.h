// A volume as a file holds it: any scalar type. Private to libs/imaging/io.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"
#include "osteo/imaging/io/segments.h"
#include "osteo/imaging/io/volume_io.h"

namespace osteo::inline imaging::io {

enum class Scalar { u8, i8, u16, i16, u32, i32, f32, f64 };
[[nodiscard]] std::size_t size_of(Scalar type);

struct RawVolume {
  Frame frame;
  Scalar type = Scalar::i16;
  std::shared_ptr<const void>
      data;        ///< frame.voxel_count() * layers scalars in machine byte order, layer fastest, then x
  int layers = 1;  ///< label maps of 3D Slicer may hold several that overlap
  std::map<std::string, std::string> notes;  ///< key:=value lines of NRRD
  std::vector<VolumeFinding> findings;       ///< what the file leaves open
};

/// Calls f with a pointer to the scalars as what they are.
template <class F>
void visit_scalars(const RawVolume& raw, F&& f) {
  const void* const p = raw.data.get();
  switch (raw.type) {
    case Scalar::u8:
      f(static_cast<const std::uint8_t*>(p));
      break;
    case Scalar::i8:
      f(static_cast<const std::int8_t*>(p));
      break;
    case Scalar::u16:
      f(static_cast<const std::uint16_t*>(p));
      break;
    case Scalar::i16:
      f(static_cast<const std::int16_t*>(p));
      break;
    case Scalar::u32:
      f(static_cast<const std::uint32_t*>(p));
      break;
    case Scalar::i32:
      f(static_cast<const std::int32_t*>(p));
      break;
    case Scalar::f32:
      f(static_cast<const float*>(p));
      break;
    case Scalar::f64:
      f(static_cast<const double*>(p));
      break;
  }
}

/// Values are rounded to whole HU. Error(corrupt) when they are not finite, or too small in range to be HU.
[[nodiscard]] Image image_from(const RawVolume& raw, const Context& context);
/// Error(corrupt) when a value is not a whole number from 0 to 255.
[[nodiscard]] Labels labels_from(const RawVolume& raw, const Context& context = {});

/// Error(corrupt) when it names no segment, or one in a layer that is not there.
[[nodiscard]] std::vector<Segment> segments_of(const RawVolume& raw);

[[nodiscard]] RawVolume read_nrrd(const std::filesystem::path& path);
[[nodiscard]] RawVolume read_nifti(const std::filesystem::path& path);
[[nodiscard]] RawVolume read_meta(const std::filesystem::path& path);
[[nodiscard]] RawVolume read_vti(const std::filesystem::path& path);

/// Spacing and origin times `mm`, the file's unit in millimetres, with a finding where that is not 1. `unit`: "metres
/// (xyzt_units)".
void convert_lengths(RawVolume& raw, double mm, const std::string& unit);

/// Writes a header and its voxels as one file, atomically and without a copy of both together.
void write_parts(const std::filesystem::path& path, std::string_view header, std::string_view voxels);

/// Error(corrupt) when `there` bytes of a file cannot hold the `voxels` its header states: checked before memory is
/// asked for. Packed bytes (deflate) grow at most 1032 times.
void require_room(const std::filesystem::path& path, double voxels, double bytes_each, double there, bool packed);

void write_nrrd(const RawVolume& raw, const std::filesystem::path& path);
void write_nifti(const RawVolume& raw, const std::filesystem::path& path);
void write_meta(const RawVolume& raw, const std::filesystem::path& path);
void write_vti(const RawVolume& raw, const std::filesystem::path& path);

}  // namespace osteo::inline imaging::io
