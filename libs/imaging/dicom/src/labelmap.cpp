#include "labelmap.h"

#include <vtkDICOMItem.h>
#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMSequence.h>
#include <vtkDICOMValue.h>
#include <vtkNew.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>

#include "decode.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/dicom/detail/header.h"
#include "pixels.h"
#include "seg_layers.h"

namespace osteo::inline imaging::dicom {
namespace {

const vtkDICOMTag kSegments(0x0062, 0x0002), kNumber(0x0062, 0x0004), kLabel(0x0062, 0x0005),
    kDescription(0x0062, 0x0006), kAlgorithmType(0x0062, 0x0008), kAlgorithmName(0x0062, 0x0009),
    kAlgorithm(0x0062, 0x0007), kAlgorithmVersion(0x0066, 0x0031);

struct Head {
  std::map<int, Structure> segments;  // by number, background left out; values are given later
  double spacing_mm = 0, thickness_mm = 0;
};

Head read_head(const fs::path& file, int background) {
  vtkNew<vtkDICOMParser> parser;
  vtkNew<vtkDICOMMetaData> meta;
  parser->SetMetaData(meta);
  parser->SetFileName(file.c_str());
  parser->Update();
  Head head;
  const vtkDICOMSequence list(meta->Get(kSegments));
  for (std::size_t i = 0; i < list.GetNumberOfItems(); ++i) {
    const vtkDICOMItem& item = list.GetItem(i);
    const auto text = [](const vtkDICOMValue& value) {
      std::string t = value.AsUTF8String();
      while (!t.empty() && t.back() == ' ') t.pop_back();
      return t;
    };
    const int number = item.Get(kNumber).AsInt();
    const std::string name = text(item.Get(kLabel));
    const vtkDICOMSequence algorithm(item.Get(kAlgorithm));
    const std::string version =
        algorithm.GetNumberOfItems() > 0 ? text(algorithm.GetItem(0).Get(kAlgorithmVersion)) : std::string();
    if (number != background)
      head.segments[number] = {1,
                               name.empty() ? "Segment " + std::to_string(number) : name,
                               {},
                               origin_from(text(item.Get(kAlgorithmType)), text(item.Get(kAlgorithmName)), version)};
    if (number != background) read_certainty(text(item.Get(kDescription)), head.segments[number]);
  }
  const auto number_of = [&](vtkDICOMTag tag) {
    const vtkDICOMValue& v = meta->Get(0, 0, tag);
    return v.GetNumberOfValues() > 0 ? v.AsDouble() : 0.0;
  };
  head.spacing_mm = number_of(DC::SpacingBetweenSlices);
  head.thickness_mm = number_of(DC::SliceThickness);
  return head;
}

// Numbers of segments of one picture.
std::vector<std::uint16_t> numbers_of(const DicomHeader& h, const CompressedFrames* compressed, int frame) {
  if (compressed != nullptr) return compressed->decode(frame);
  const std::size_t n = h.pixels_per_frame();
  std::vector<std::uint16_t> values(n);
  const std::uint64_t at = h.pixel_offset + static_cast<std::uint64_t>(frame) * h.bytes_per_frame();
  if (h.bits_allocated == 16) {
    read_bytes(h, at, values.data(), 2 * n);
    if (h.big_endian)
      for (std::uint16_t& v : values) v = __builtin_bswap16(v);
  } else {
    std::vector<std::uint8_t> bytes(n);
    read_bytes(h, at, bytes.data(), n);
    std::copy(bytes.begin(), bytes.end(), values.begin());
  }
  return values;
}

}  // namespace

Labels load_labelmap(const fs::path& path, const Context& context) {
  const auto fail = [&](const std::string& why) { return Error(ExitCode::corrupt, "'" + path.string() + "': " + why); };
  const TemporaryFolder scratch;
  const DicomHeader h = read_dicom_header(path, scratch.path());
  if (h.frames.empty() || h.columns <= 0 || h.rows <= 0) throw fail("the segmentation is empty");
  if (h.bits_allocated != 8 && h.bits_allocated != 16)
    throw fail(std::to_string(h.bits_allocated) + " bits a pixel are no label map's");
  const int background = h.padding.value_or(0);
  const Head head = read_head(h.file, background);
  if (head.segments.empty()) throw fail("the segmentation is empty");
  if (head.segments.size() > 255)
    throw fail("it holds " + std::to_string(head.segments.size()) + " segments; up to 255 are supported");

  const DicomFrame& first = h.frames.front();
  std::vector<Vec3> at;
  for (std::size_t i = 0; i < h.frames.size(); ++i) {
    const DicomFrame& f = h.frames[i];
    const std::string which = "frame " + std::to_string(i + 1);
    if (!f.has_position) throw fail(which + " states no position");
    constexpr double kSame = 1e-3;
    if (!f.has_orientation || !(f.column_spacing_mm > 0) || !(f.row_spacing_mm > 0))
      throw fail("it does not say where its frames lie in the patient");
    if (length(f.along_row - first.along_row) > kSame || length(f.along_column - first.along_column) > kSame ||
        std::abs(f.column_spacing_mm - first.column_spacing_mm) > kSame * first.column_spacing_mm ||
        std::abs(f.row_spacing_mm - first.row_spacing_mm) > kSame * first.row_spacing_mm)
      throw fail(which + " is turned against the first, or has other pixels: the frames make no one volume");
    at.push_back(f.position_mm);
  }
  Frame plane;
  plane.direction.column[0] = first.along_row;
  plane.direction.column[1] = first.along_column;
  plane.spacing_mm = {first.column_spacing_mm, first.row_spacing_mm, 1};
  plane.dims = {h.columns, h.rows, 1};
  const auto [frame, layers] = stack_seg_frames(plane, at, head.spacing_mm, head.thickness_mm);
  if (!layers.problem.empty()) throw fail(layers.problem);
  if (!layers.warning.empty()) context.warn("'" + path.string() + "': " + layers.warning);
  require_valid(frame);

  Labels labels{{frame, {}}, {}};
  const bool same_numbers = head.segments.begin()->first > 0 && head.segments.rbegin()->first <= 255;
  std::vector<int> value_of(65536, -1);
  for (const auto& [number, segment] : head.segments) {
    if (number < 0 || number > 65535) throw fail("segment " + std::to_string(number) + " has no number of 16 bits");
    const int value = same_numbers ? number : static_cast<int>(labels.structures.size()) + 1;
    value_of[static_cast<std::size_t>(number)] = value;
    labels.structures.push_back(segment);
    labels.structures.back().value = static_cast<std::uint8_t>(value);
  }
  if (background >= 0 && background < 65536) value_of[static_cast<std::size_t>(background)] = 0;
  if (value_of[0] < 0) value_of[0] = 0;
  if (!same_numbers)
    context.warn("'" + path.string() + "': its segments have numbers above 255; they are numbered from 1 here");
  const auto voxels = make_voxels<std::uint8_t>(frame.voxel_count());
  std::fill_n(voxels.get(), frame.voxel_count(), std::uint8_t{0});
  try {
    std::unique_ptr<CompressedFrames> compressed;
    if (h.compressed) compressed = std::make_unique<CompressedFrames>(h);
    for (std::size_t i = 0; i < h.frames.size(); ++i) {
      const std::vector<std::uint16_t> numbers = numbers_of(h, compressed.get(), static_cast<int>(i));
      std::uint8_t* const out = voxels.get() + static_cast<std::size_t>(layers.layer[i]) * h.pixels_per_frame();
      for (std::size_t p = 0; p < numbers.size(); ++p) {
        const int value = value_of[numbers[p]];
        if (value < 0)
          throw PixelError("frame " + std::to_string(i + 1) + " holds the number " + std::to_string(numbers[p]) +
                           ", which no segment has");
        if (value > 0) out[p] = static_cast<std::uint8_t>(value);
      }
    }
  } catch (const PixelError& e) {
    throw fail(e.what());
  }
  labels.voxels = voxels;
  return labels;
}

}  // namespace osteo::inline imaging::dicom
