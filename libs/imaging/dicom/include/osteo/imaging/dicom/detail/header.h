// What one DICOM file says about itself and about where its pixels lie.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo::inline imaging {

/// One picture of a file: a classic file has one, a multi-frame file several.
struct DicomFrame {
  bool has_position = false, has_orientation = false;
  Vec3 position_mm;  ///< centre of the first pixel, LPS
  Vec3 along_row, along_column;
  double column_spacing_mm = 0, row_spacing_mm = 0;  ///< between columns (along a row), between rows; 0 when not stated
  double slope = 1, intercept = 0;
  std::string rescale_type;  ///< what the values are: "HU", or empty where the file does not say
};

struct DicomHeader {
  std::filesystem::path file;  ///< where to read the pixels
  std::string name;            ///< to show: path below the scanned folder, without anything that identifies the patient
  std::uint64_t file_bytes = 0;
  std::string problem;       ///< why its pixels cannot be used; empty when they can be tried
  std::string problem_code;  ///< stable code of `problem`, see verdict.h

  // Of use for grouping only; never written anywhere.
  std::string series_uid, sop_uid, study_uid, frame_of_reference_uid;
  std::string patient;  ///< name, number and birth date as one text, the same for all files of a person
  std::string study_date, study_description;  ///< shown on request only
  std::vector<std::string> identifying;       ///< values that name the patient, the people or the place, lower case

  std::string sop_class, modality, image_type, description, kernel, manufacturer, transfer_syntax;
  int series_number = 0, acquisition = 0, instance = 0;
  std::string time_position, kvp;  ///< temporal position and tube voltage as the file gives them
  std::string temporal;  ///< temporal position, trigger time, tube voltage: what tells two pictures of one place apart
  std::string concatenation_uid;  ///< of a multi-frame scan over several files; empty for others
  int concatenation_part = 0,
      concatenation_parts = 0;  ///< which part this is, from 1, and of how many; 0 when not stated
  double thickness_mm = 0, tilt_tag_deg = 0, spacing_tag_mm = 0;
  bool has_tilt_tag = false, lossy = false;

  int columns = 0, rows = 0, samples = 1;
  int bits_allocated = 0, bits_stored = 0, high_bit = 0;
  bool projection = false;  ///< its pictures show the most (or least) of a slab, or a rendering, not a slice
  bool is_signed = false, inverted = false;    ///< inverted: MONOCHROME1
  bool palette = false, float_pixels = false;  ///< colours of a palette; floating-point pixels
  bool value_table = false;                    ///< a Modality LUT stands in place of slope and intercept
  bool overlay_in_pixels = false;              ///< bits around those of the pixel hold an overlay
  std::optional<int> padding, padding_limit;
  bool compressed = false, big_endian = false;
  std::uint64_t pixel_offset = 0;  ///< first byte of uncompressed pixels
  std::vector<DicomFrame> frames;

  [[nodiscard]] bool usable() const { return problem.empty(); }
  [[nodiscard]] std::size_t pixels_per_frame() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  [[nodiscard]] std::size_t bytes_per_frame() const {
    return pixels_per_frame() * static_cast<std::size_t>(bits_allocated / 8 * samples);
  }
};

/// Reads the header only; never throws for what is in the file: `problem` tells. Deflated files and files without
/// preamble and meta header are rewritten plainly (by DCMTK) into `scratch`, and `file` points there. Any thread.
[[nodiscard]] DicomHeader read_dicom_header(const std::filesystem::path& file, const std::filesystem::path& scratch);

/// The stored value that is HU by slope and intercept, as a Hounsfield unit is rounded here: to the nearest whole
/// number.
[[nodiscard]] inline double hounsfield(double stored, const DicomFrame& frame) {
  return stored * frame.slope + frame.intercept;
}

}  // namespace osteo::inline imaging
