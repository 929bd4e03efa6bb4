#include "osteo/imaging/dicom/detail/header.h"

#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMSequence.h>
#include <vtkDICOMValue.h>
#include <vtkNew.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cmath>
#include <cstring>
#include <fstream>

#include "encodings.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/dicom/verdict.h"
#include "rewrite.h"
#include "sound.h"

namespace osteo::inline imaging {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kDeflated = "1.2.840.10008.1.2.1.99", kBigEndian = "1.2.840.10008.1.2.2";
constexpr std::string_view kImplicit = "1.2.840.10008.1.2", kExplicit = "1.2.840.10008.1.2.1";

/// Without what values are padded with to an even length.
std::string unpadded(std::string_view text) {
  return std::string(trimmed(text, std::string_view(" \0", 2)));
}

std::string text_of(vtkDICOMMetaData* meta, vtkDICOMTag tag) {
  return unpadded(meta->Get(tag).AsString());
}

// Values of these name a person, a visit or a place. They are looked for in whatever could leave the program, and
// removed.
constexpr std::array kIdentifying{DC::PatientName,
                                  DC::PatientID,
                                  DC::OtherPatientIDs,
                                  DC::OtherPatientNames,
                                  DC::PatientBirthName,
                                  DC::PatientBirthDate,
                                  DC::PatientMotherBirthName,
                                  DC::PatientAddress,
                                  DC::PatientTelephoneNumbers,
                                  DC::MedicalRecordLocator,
                                  DC::AccessionNumber,
                                  DC::InstitutionName,
                                  DC::InstitutionAddress,
                                  DC::InstitutionalDepartmentName,
                                  DC::ReferringPhysicianName,
                                  DC::PhysiciansOfRecord,
                                  DC::PerformingPhysicianName,
                                  DC::NameOfPhysiciansReadingStudy,
                                  DC::OperatorsName,
                                  DC::RequestingPhysician,
                                  DC::StudyID,
                                  DC::StudyInstanceUID,
                                  DC::SeriesInstanceUID,
                                  DC::SOPInstanceUID,
                                  DC::FrameOfReferenceUID,
                                  DC::StationName,
                                  DC::DeviceSerialNumber,
                                  DC::PatientComments,
                                  DC::StudyDate,
                                  DC::IssuerOfPatientID};

std::vector<std::string> identifying_values(vtkDICOMMetaData* meta) {
  std::vector<std::string> values;
  const auto add = [&](const std::string& value) {
    // Shorter pieces are initials or codes that occur by chance.
    if (value.size() >= 4) values.push_back(lower_case(value));
  };
  for (const auto tag : kIdentifying) {
    const std::string text = text_of(meta, tag);
    add(text);
    if (tag == DC::PatientName || tag == DC::PatientBirthName || tag == DC::OtherPatientNames) {
      std::string part;
      for (const char c : text + "^") {
        if (c == '^' || c == ' ' || c == '=' || c == '\\' || c == ',') {
          add(part);
          part.clear();
        } else {
          part += c;
        }
      }
    }
  }
  return values;
}

// Spelling that means nothing: case, and the empty parts at a name's end.
std::string patient_of(vtkDICOMMetaData* meta) {
  std::string all;
  for (const auto tag : {DC::PatientID, DC::IssuerOfPatientID, DC::PatientName, DC::PatientBirthDate}) {
    std::string text = lower_case(text_of(meta, tag));
    while (!text.empty() && (text.back() == '^' || text.back() == ' ' || text.back() == '=')) text.pop_back();
    all += text + '\n';
  }
  return all;
}

// A word of its own that names a projection: "MIP", "MINIP", "MAX_IP", "Thin MIP 10mm"; no "MIPS".
bool is_projection(const std::string& text) {
  std::string word;
  for (const char c : lower_case(text) + ' ') {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      word += c;
      continue;
    }
    if (c == '_' && (word == "max" || word == "min")) continue;
    for (const char* const name : {"mip", "minip", "mipi", "maxip", "maxmip", "minmip"}) {
      if (word == name) return true;
    }
    word.clear();
  }
  return false;
}

bool read_vec(const vtkDICOMValue& value, std::size_t at, Vec3& out) {
  if (value.GetNumberOfValues() < at + 3) return false;
  out = {value.GetDouble(at), value.GetDouble(at + 1), value.GetDouble(at + 2)};
  return std::isfinite(out.x) && std::isfinite(out.y) && std::isfinite(out.z);
}

DicomFrame read_frame(vtkDICOMMetaData* meta, int frame) {
  DicomFrame f;
  const auto get = [&](vtkDICOMTag tag) -> const vtkDICOMValue& { return meta->Get(0, frame, tag); };
  f.has_position = read_vec(get(DC::ImagePositionPatient), 0, f.position_mm);
  const vtkDICOMValue& iop = get(DC::ImageOrientationPatient);
  f.has_orientation = read_vec(iop, 0, f.along_row) && read_vec(iop, 3, f.along_column);
  if (f.has_orientation) {
    const double lu = length(f.along_row), lv = length(f.along_column);
    f.has_orientation =
        std::abs(lu - 1) < 0.01 && std::abs(lv - 1) < 0.01 && std::abs(dot(f.along_row, f.along_column)) < 0.01;
    if (f.has_orientation) {
      f.along_row = normalized(f.along_row);
      f.along_column = normalized(f.along_column - f.along_row * dot(f.along_row, f.along_column));
    }
  }
  if (const vtkDICOMValue& s = get(DC::PixelSpacing); s.GetNumberOfValues() == 2) {
    f.row_spacing_mm = s.GetDouble(0);
    f.column_spacing_mm = s.GetDouble(1);
  }
  if (const vtkDICOMValue& s = get(DC::RescaleSlope); s.IsValid() && s.GetNumberOfValues() > 0) f.slope = s.AsDouble();
  if (const vtkDICOMValue& s = get(DC::RescaleIntercept); s.IsValid() && s.GetNumberOfValues() > 0)
    f.intercept = s.AsDouble();
  f.rescale_type = unpadded(get(DC::RescaleType).AsString());
  return f;
}

// The tag's VR follows the sign of the pixels, but not in all files.
std::optional<int> read_padding(const vtkDICOMValue& value, const DicomHeader& h) {
  if (!value.IsValid() || value.GetNumberOfValues() == 0) return {};
  int v = value.AsInt();
  if (h.bits_allocated == 16) v = h.is_signed ? static_cast<std::int16_t>(v) : static_cast<std::uint16_t>(v);
  // As the pixels may be, it may be a negative number whose sign is not extended.
  if (h.is_signed && h.bits_stored > 1 && h.bits_stored < 16 && v >= 1 << (h.bits_stored - 1) && v < 1 << h.bits_stored)
    v -= 1 << h.bits_stored;
  return v;
}

void set_problem(DicomHeader& h, std::string_view code, std::string why) {
  if (!h.problem.empty()) return;
  h.problem_code = code;
  h.problem = std::move(why);
}

/// A number of the tag as it stands in the file when it has a decimal comma, which DICOM has not.
std::string with_comma(vtkDICOMMetaData* meta, vtkDICOMTag tag) {
  const std::string text = unpadded(meta->Get(tag).AsString());
  return text.find(',') != std::string::npos ? text : std::string();
}

void judge(DicomHeader& h, bool has_pixels) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 10> kOthers{{
      {"1.2.840.10008.1.3.10", "a DICOMDIR, the index of a medium"},
      {"1.2.840.10008.5.1.4.1.1.66.4", "a segmentation, not a CT; taken as structures by 'structures'"},
      {"1.2.840.10008.5.1.4.1.1.66.7", "a segmentation, not a CT; taken as structures by 'structures'"},
      {"1.2.840.10008.5.1.4.1.1.481.3", "a radiotherapy structure set"},
      {"1.2.840.10008.5.1.4.1.1.481.5", "a radiotherapy plan"},
      {"1.2.840.10008.5.1.4.1.1.481.8", "a radiotherapy plan"},
      {"1.2.840.10008.5.1.4.1.1.481.2", "a radiotherapy dose"},
      {"1.2.840.10008.5.1.4.1.1.88.", "a report"},
      {"1.2.840.10008.5.1.4.1.1.11.", "a presentation state"},
      {"1.2.840.10008.5.1.4.1.1.104.", "an encapsulated document"},
  }};
  for (const auto& [uid, what] : kOthers) {
    if (h.sop_class == uid || (uid.back() == '.' && h.sop_class.starts_with(uid)))
      return set_problem(h, code::not_an_image, std::string(what));
  }
  if (!has_pixels) {
    return set_problem(h, h.modality == "SR" ? code::not_an_image : code::no_pixels,
                       h.modality == "SR" ? "a report" : "it holds no pixels");
  }
  if (h.columns <= 0 || h.rows <= 0 || h.columns > 65535 || h.rows > 65535)
    return set_problem(h, code::pixels_damaged, "it states no size");
  if (h.float_pixels)
    return set_problem(h, code::no_pixels, "its pixels are no whole numbers (Float Pixel Data), which are not read");
  if (h.palette)
    return set_problem(h, code::colour, "a picture in the colours of a palette: its numbers are places in a table");
  if (h.value_table)
    return set_problem(h, code::slope_invalid,
                       "its values go through a table (Modality LUT) and not a slope; Hounsfield units cannot be had");
  if (h.samples != 1) return set_problem(h, code::colour, "a colour picture, such as a screen shot or a dose sheet");
  if (h.bits_allocated != 8 && h.bits_allocated != 16 && h.bits_allocated != 32) {
    return set_problem(h, code::pixels_damaged, std::to_string(h.bits_allocated) + " bits a pixel are not supported");
  }
  if (h.image_type.find("LOCALIZER") != std::string::npos)
    return set_problem(h, code::localizer, "a localizer, not a slice");
  // A slice image whose SOP class says screen shot: its numbers are for the eye.
  if (h.sop_class.starts_with("1.2.840.10008.5.1.4.1.1.7"))
    return set_problem(h, code::not_an_image, "a secondary capture, not a scan");
  if (const std::string why = h.compressed ? dicom::why_unread(h.transfer_syntax) : ""; !why.empty())
    return set_problem(h, code::unsupported_encoding, "its pixels " + why);
  if (h.compressed && h.bits_allocated > 16)
    return set_problem(h, code::unsupported_encoding,
                       "its compressed pixels have " + std::to_string(h.bits_allocated) + " bits, which is not read");
  const std::uint64_t wanted = h.bytes_per_frame() * h.frames.size();
  if (!h.compressed && h.pixel_offset + wanted > h.file_bytes) {
    return set_problem(
        h, code::pixels_damaged,
        "the file is cut short: " + std::to_string(h.file_bytes > h.pixel_offset ? h.file_bytes - h.pixel_offset : 0) +
            " of " + std::to_string(wanted) + " bytes of pixels are there");
  }
  for (const DicomFrame& f : h.frames) {
    if (!f.has_position) return set_problem(h, code::position_missing, "it states no position (ImagePositionPatient)");
    if (!f.has_orientation)
      return set_problem(h, code::orientation_missing, "it states no valid orientation (ImageOrientationPatient)");
    if (!(f.column_spacing_mm > 0) || !(f.row_spacing_mm > 0) ||
        !std::isfinite(f.column_spacing_mm + f.row_spacing_mm)) {
      return set_problem(h, code::spacing_missing, "it states no pixel spacing");
    }
    if (!(f.slope > 0) || !std::isfinite(f.slope) || !std::isfinite(f.intercept)) {
      return set_problem(h, code::slope_invalid, "its rescale slope or intercept is not a positive number");
    }
  }
}

bool parse(const fs::path& file, DicomHeader& h) {
  if (!dicom::header_is_sound(file)) return false;
  vtkNew<vtkDICOMParser> parser;
  vtkNew<vtkDICOMMetaData> meta;
  parser->SetMetaData(meta);
  parser->SetFileName(file.c_str());
  parser->Update();
  h.transfer_syntax = text_of(meta, DC::TransferSyntaxUID);
  if (parser->GetErrorCode() != 0 || h.transfer_syntax == kDeflated || meta->GetNumberOfDataElements() == 0)
    return false;

  h.sop_class = text_of(meta, DC::SOPClassUID);
  if (h.sop_class.empty()) h.sop_class = text_of(meta, DC::MediaStorageSOPClassUID);
  h.sop_uid = text_of(meta, DC::SOPInstanceUID);
  h.series_uid = text_of(meta, DC::SeriesInstanceUID);
  h.study_uid = text_of(meta, DC::StudyInstanceUID);
  h.frame_of_reference_uid = text_of(meta, DC::FrameOfReferenceUID);
  h.patient = patient_of(meta);
  h.study_date = text_of(meta, DC::StudyDate);
  h.study_description = text_of(meta, DC::StudyDescription);
  h.identifying = identifying_values(meta);
  h.modality = text_of(meta, DC::Modality);
  h.image_type = unpadded(meta->Get(DC::ImageType).AsString());
  h.description = text_of(meta, DC::SeriesDescription);
  const std::string technique = text_of(meta, DC::VolumeBasedCalculationTechnique);
  h.projection = is_projection(h.image_type) || is_projection(h.description) || technique == "MAX_IP" ||
                 technique == "MIN_IP" || technique == "VOLUME_RENDER" || technique == "SURFACE_RENDER";
  h.kernel = text_of(meta, DC::ConvolutionKernel);
  h.manufacturer = text_of(meta, DC::Manufacturer);
  h.series_number = meta->Get(DC::SeriesNumber).AsInt();
  h.acquisition = meta->Get(DC::AcquisitionNumber).AsInt();
  h.instance = meta->Get(DC::InstanceNumber).AsInt();
  h.time_position = text_of(meta, DC::TemporalPositionIdentifier);
  h.kvp = text_of(meta, DC::KVP);
  h.temporal = h.time_position + "/" + text_of(meta, DC::TriggerTime) + "/" + h.kvp;
  h.concatenation_uid = text_of(meta, DC::ConcatenationUID);
  h.concatenation_part = meta->Get(DC::InConcatenationNumber).AsInt();
  h.concatenation_parts = meta->Get(DC::InConcatenationTotalNumber).AsInt();
  h.thickness_mm = meta->Get(DC::SliceThickness).AsDouble();
  h.spacing_tag_mm = meta->Get(DC::SpacingBetweenSlices).AsDouble();
  h.has_tilt_tag = meta->Get(DC::GantryDetectorTilt).GetNumberOfValues() > 0;
  h.tilt_tag_deg = h.has_tilt_tag ? meta->Get(DC::GantryDetectorTilt).AsDouble() : 0;
  h.columns = meta->Get(DC::Columns).AsInt();
  h.rows = meta->Get(DC::Rows).AsInt();
  h.samples = meta->Get(DC::SamplesPerPixel).GetNumberOfValues() > 0 ? meta->Get(DC::SamplesPerPixel).AsInt() : 1;
  h.bits_allocated = meta->Get(DC::BitsAllocated).AsInt();
  h.bits_stored = meta->Get(DC::BitsStored).AsInt();
  h.high_bit = meta->Get(DC::HighBit).GetNumberOfValues() > 0 ? meta->Get(DC::HighBit).AsInt() : h.bits_stored - 1;
  h.is_signed = meta->Get(DC::PixelRepresentation).AsInt() != 0;
  const std::string photometric = text_of(meta, DC::PhotometricInterpretation);
  h.inverted = photometric == "MONOCHROME1";
  h.palette = photometric == "PALETTE COLOR";
  h.value_table = meta->Get(DC::ModalityLUTSequence).IsValid() && !meta->Get(DC::RescaleSlope).IsValid();
  // Float Pixel Data (PS3.3 C.7.6.24) has neither of these.
  h.float_pixels = !meta->Get(DC::BitsStored).IsValid() && !meta->Get(DC::PixelRepresentation).IsValid();
  for (unsigned short group = 0x6000; group <= 0x601E; group = static_cast<unsigned short>(group + 2)) {
    const vtkDICOMValue &bit = meta->Get(vtkDICOMTag(group, 0x0102)), &bits = meta->Get(vtkDICOMTag(group, 0x0100));
    if (!bit.IsValid()) continue;
    const bool below = bits.AsInt() == h.bits_allocated && bit.AsInt() <= h.high_bit - h.bits_stored;
    if (bit.AsInt() > h.high_bit || below) h.overlay_in_pixels = true;
  }
  h.padding = read_padding(meta->Get(DC::PixelPaddingValue), h);
  h.padding_limit = read_padding(meta->Get(DC::PixelPaddingRangeLimit), h);
  h.big_endian = h.transfer_syntax == kBigEndian;
  h.compressed =
      !(h.big_endian || h.transfer_syntax.empty() || h.transfer_syntax == kImplicit || h.transfer_syntax == kExplicit);
  const dicom::Encoding* const encoding = dicom::find_encoding(h.transfer_syntax);
  h.lossy = text_of(meta, DC::LossyImageCompression) == "01" || (encoding != nullptr && encoding->always_lossy);
  h.pixel_offset = static_cast<std::uint64_t>(parser->GetFileOffset());
  const int count = std::clamp(meta->Get(DC::NumberOfFrames).AsInt(), 1, 100000);
  if (h.samples == 1 && parser->GetPixelDataFound()) {
    for (int i = 0; i < count; ++i) h.frames.push_back(read_frame(meta, i));
  }
  // Said before judge() would say that the tag is missing.
  for (const auto tag : {DC::ImagePositionPatient, DC::ImageOrientationPatient, DC::PixelSpacing, DC::RescaleSlope,
                         DC::RescaleIntercept}) {
    const std::string text = with_comma(meta, tag);
    if (text.empty() || !parser->GetPixelDataFound()) continue;
    const bool rescale = tag == DC::RescaleSlope || tag == DC::RescaleIntercept;
    const std::string_view code = tag == DC::PixelSpacing           ? code::spacing_missing
                                  : tag == DC::ImagePositionPatient ? code::position_missing
                                  : rescale                         ? code::slope_invalid
                                                                    : code::orientation_missing;
    set_problem(h, code, "its numbers have a decimal comma where DICOM has a point ('" + text + "')");
    break;
  }
  judge(h, parser->GetPixelDataFound());
  return true;
}

// Whether DCMTK should try: not every text file of a folder.
bool could_be_dicom(const fs::path& file) {
  std::array<char, 132> head{};
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), head.size());
  if (in.gcount() < 8) return false;
  if (in.gcount() == 132 && std::memcmp(head.data() + 128, "DICM", 4) == 0) return true;
  // A data set without preamble begins with an element of group 2 or 8, in either byte order.
  const bool little = (head[0] == 2 || head[0] == 8) && head[1] == 0,
             big = head[0] == 0 && (head[1] == 2 || head[1] == 8);
  return little || big;
}

}  // namespace

DicomHeader read_dicom_header(const fs::path& file, const fs::path& scratch) {
  DicomHeader h;
  h.file = file;
  h.name = file.filename().string();
  std::error_code ec;
  h.file_bytes = fs::file_size(file, ec);
  if (ec) {
    set_problem(h, code::cannot_read, "it cannot be read: " + ec.message());
    return h;
  }
  if (h.file_bytes == 0) {
    set_problem(h, code::not_dicom, "it is empty");
    return h;
  }
  try {
    if (parse(file, h)) return h;
    if (!could_be_dicom(file)) {
      set_problem(h, std::ifstream(file).good() ? code::not_dicom : code::cannot_read,
                  std::ifstream(file).good() ? "it is not a DICOM file" : "it may not be read");
      return h;
    }
    static std::atomic<unsigned> counter{0};
    const fs::path plain = scratch / ("plain-" + std::to_string(counter++) + ".dcm");
    if (const std::string why = dicom::rewrite_plainly(file, plain); !why.empty()) {
      fs::remove(plain, ec);
      set_problem(h, code::header_damaged, "its header is damaged: " + why);
      return h;
    }
    DicomHeader rewritten;
    rewritten.file = plain;
    rewritten.name = h.name;
    rewritten.file_bytes = fs::file_size(plain, ec);
    if (parse(plain, rewritten)) return rewritten;
    set_problem(h, code::header_damaged, "its header is damaged");
  } catch (const std::exception& e) {
    set_problem(h, code::header_damaged, std::string("its header is damaged: ") + e.what());
  }
  return h;
}

}  // namespace osteo::inline imaging
