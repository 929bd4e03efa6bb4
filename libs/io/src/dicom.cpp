#include "osteo/io/dicom.h"

#include <vtkDICOMCTGenerator.h>
#include <vtkDICOMDirectory.h>
#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMReader.h>
#include <vtkDICOMValue.h>
#include <vtkDICOMWriter.h>
#include <vtkDataArray.h>
#include <vtkErrorCode.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkStringArray.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/base/parallel.h"
#include "osteo/base/param.h"
#include "osteo/io/vtk_data.h"
#include "vtk_volume.h"

namespace osteo {
namespace {

constexpr double kSamePlaceMm = 0.01;  // slices nearer than this lie at one place
constexpr double kStraightMm = 0.02;   // deviation from an even, straight stack that is still called even and straight
constexpr double kSameDirection = 1e-4;

std::string text_of(vtkDICOMMetaData* meta, vtkDICOMTag tag) {
  std::string text = meta->Get(tag).AsString();
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

vtkSmartPointer<vtkDICOMMetaData> read_header(const fs::path& file) {
  require_readable(file);
  const QuietVtk quiet;
  vtkNew<vtkDICOMParser> parser;
  auto meta = vtkSmartPointer<vtkDICOMMetaData>::New();
  parser->SetMetaData(meta);
  parser->SetFileName(file.c_str());
  parser->Update();
  if (parser->GetErrorCode() != 0) {
    throw Error(ExitCode::corrupt, "'" + file.string() + "': the DICOM header is damaged", "copy the file again from its source");
  }
  return meta;
}

std::string judge(DicomSeries& s, vtkDICOMMetaData* meta) {
  const std::string type = meta->Get(DC::ImageType).AsString();
  if (s.modality != "CT") return s.modality.empty() ? "no modality" : "not a CT (" + s.modality + ")";
  if (contains(type, "LOCALIZER")) return "localizer";
  if (meta->Get(DC::SamplesPerPixel).AsInt() > 1) return "colour picture";
  if (meta->Get(DC::NumberOfFrames).AsInt() > 1) return "multi-frame";
  if (meta->Get(DC::ImagePositionPatient).GetNumberOfValues() != 3 || meta->Get(DC::ImageOrientationPatient).GetNumberOfValues() != 6) {
    return "no image position";
  }
  if (s.images < 2) return "single image";
  s.usable = true;
  return "volume";
}

struct Slice {
  fs::path file;
  Vec3 position, u, v;
  double du = 1, dv = 1;
  int columns = 0, rows = 0;
  double slope = 1, intercept = 0;
  double along = 0;  // position along the common normal
};

Slice slice_of(const fs::path& file) {
  const auto meta = read_header(file);
  const vtkDICOMValue& ipp = meta->Get(DC::ImagePositionPatient);
  const vtkDICOMValue& iop = meta->Get(DC::ImageOrientationPatient);
  const vtkDICOMValue& spacing = meta->Get(DC::PixelSpacing);
  const std::string name = "'" + file.string() + "'";
  if (ipp.GetNumberOfValues() != 3 || iop.GetNumberOfValues() != 6) {
    throw Error(ExitCode::corrupt, name + " states no position or orientation",
                "remove this file from the series, or ask for the original export");
  }
  if (spacing.GetNumberOfValues() != 2) throw Error(ExitCode::corrupt, name + " states no pixel spacing");
  Slice s;
  s.file = file;
  s.position = {ipp.GetDouble(0), ipp.GetDouble(1), ipp.GetDouble(2)};
  s.u = {iop.GetDouble(0), iop.GetDouble(1), iop.GetDouble(2)};
  s.v = {iop.GetDouble(3), iop.GetDouble(4), iop.GetDouble(5)};
  s.dv = spacing.GetDouble(0);
  s.du = spacing.GetDouble(1);
  s.columns = meta->Get(DC::Columns).AsInt();
  s.rows = meta->Get(DC::Rows).AsInt();
  if (meta->Get(DC::RescaleSlope).IsValid()) {
    s.slope = meta->Get(DC::RescaleSlope).AsDouble();
    s.intercept = meta->Get(DC::RescaleIntercept).AsDouble();
  }
  if (!(s.slope > 0)) throw Error(ExitCode::corrupt, name + " has the rescale slope " + format_number(s.slope));
  return s;
}

void read_pixels(const Slice& s, std::int16_t* out) {
  const QuietVtk quiet;
  vtkNew<vtkDICOMReader> reader;
  reader->SetFileName(s.file.c_str());
  reader->SetMemoryRowOrderToFileNative();
  reader->AutoRescaleOff();
  reader->Update();
  const std::string name = "'" + s.file.string() + "'";
  if (reader->GetErrorCode() != vtkErrorCode::NoError) {
    throw Error(ExitCode::corrupt,
                name + ": the pixels cannot be read: " + std::string(vtkErrorCode::GetStringFromErrorCode(reader->GetErrorCode())),
                "the file may be cut short; copy it again from its source");
  }
  vtkDataArray* const scalars = reader->GetOutput()->GetPointData()->GetScalars();
  const std::size_t n = static_cast<std::size_t>(s.columns) * static_cast<std::size_t>(s.rows);
  if (scalars == nullptr || scalars->GetNumberOfComponents() != 1 || static_cast<std::size_t>(scalars->GetNumberOfTuples()) != n) {
    throw Error(ExitCode::corrupt, name + " does not hold one grey value a pixel");
  }
  const auto convert = [&](const auto* p) {
    for (std::size_t i = 0; i < n; ++i) {
      const double hu = std::floor(s.slope * static_cast<double>(p[i]) + s.intercept + 0.5);
      out[i] = static_cast<std::int16_t>(std::clamp(hu, -1024.0, 32767.0));
    }
  };
  switch (scalars->GetDataType()) {
    case VTK_SHORT:
      convert(static_cast<const short*>(scalars->GetVoidPointer(0)));
      break;
    case VTK_UNSIGNED_SHORT:
      convert(static_cast<const unsigned short*>(scalars->GetVoidPointer(0)));
      break;
    case VTK_UNSIGNED_CHAR:
      convert(static_cast<const unsigned char*>(scalars->GetVoidPointer(0)));
      break;
    case VTK_SIGNED_CHAR:
      convert(static_cast<const signed char*>(scalars->GetVoidPointer(0)));
      break;
    case VTK_INT:
      convert(static_cast<const int*>(scalars->GetVoidPointer(0)));
      break;
    default:
      throw Error(ExitCode::corrupt, name + " holds an unusual pixel type");
  }
}

// Sorted along the normal; checks that all slices are one family of parallel planes.
std::vector<Slice> sorted_slices(const DicomSeries& series, double max_gap_mm, const Context& context) {
  std::vector<Slice> slices;
  for (std::size_t i = 0; i < series.files.size(); ++i) {
    slices.push_back(slice_of(series.files[i]));
    context.progress(static_cast<double>(i + 1) / static_cast<double>(series.files.size()), "reading headers");
  }
  const Slice& first = slices.front();
  const Vec3 normal = normalized(cross(first.u, first.v));
  for (Slice& s : slices) {
    const std::string name = "'" + s.file.string() + "'";
    if (s.columns != first.columns || s.rows != first.rows) {
      throw Error(ExitCode::corrupt,
                  name + " has " + std::to_string(s.columns) + "x" + std::to_string(s.rows) + " pixels, others " +
                      std::to_string(first.columns) + "x" + std::to_string(first.rows),
                  "remove the file, or export the series again");
    }
    if (length(s.u - first.u) > kSameDirection || length(s.v - first.v) > kSameDirection) {
      throw Error(ExitCode::corrupt, name + " is oriented differently from the other slices",
                  "the series holds several stacks; export one");
    }
    if (std::abs(s.du - first.du) > 1e-4 || std::abs(s.dv - first.dv) > 1e-4) {
      throw Error(ExitCode::corrupt, name + " has another pixel spacing than the other slices");
    }
    s.along = dot(s.position, normal);
  }
  std::sort(slices.begin(), slices.end(), [](const Slice& a, const Slice& b) { return a.along < b.along; });
  for (std::size_t i = 1; i < slices.size(); ++i) {
    const double gap = slices[i].along - slices[i - 1].along;
    if (gap < kSamePlaceMm) {
      throw Error(ExitCode::corrupt, "'" + slices[i].file.string() + "' and '" + slices[i - 1].file.string() + "' lie at the same place",
                  "the series holds duplicates or several acquisitions; export one");
    }
    if (gap > max_gap_mm) {
      throw Error(ExitCode::failed,
                  "between '" + slices[i - 1].file.string() + "' and '" + slices[i].file.string() + "' there is a gap of " +
                      format_number(std::round(gap * 1000) / 1000) + " mm",
                  "look for missing slices; --max-gap-mm accepts wider gaps");
    }
  }
  return slices;
}

}  // namespace

std::vector<DicomSeries> scan_dicom(const fs::path& folder, const Context& context) {
  require_readable(folder);
  const QuietVtk quiet;
  vtkNew<vtkDICOMDirectory> directory;
  vtkNew<vtkStringArray> inputs;
  if (fs::is_directory(folder)) {
    directory->SetDirectoryName(folder.c_str());
    directory->SetScanDepth(8);
  } else {
    inputs->InsertNextValue(folder.string());
    directory->SetInputFileNames(inputs);
  }
  directory->SetIgnoreDicomdir(1);
  directory->SetRequirePixelData(1);
  directory->Update();
  context.progress(0.5, "scanning");

  std::vector<DicomSeries> result;
  for (int i = 0; i < directory->GetNumberOfSeries(); ++i) {
    vtkStringArray* const files = directory->GetFileNamesForSeries(i);
    DicomSeries s;
    for (vtkIdType f = 0; f < files->GetNumberOfValues(); ++f) s.files.emplace_back(std::string(files->GetValue(f)));
    if (s.files.empty()) continue;
    vtkSmartPointer<vtkDICOMMetaData> meta;
    try {
      meta = read_header(s.files.front());
    } catch (const Error& e) {
      context.warn(e.what());
      continue;
    }
    s.images = static_cast<int>(s.files.size());
    s.number = meta->Get(DC::SeriesNumber).AsInt();
    s.uid = text_of(meta, DC::SeriesInstanceUID);
    s.modality = text_of(meta, DC::Modality);
    s.description = text_of(meta, DC::SeriesDescription);
    s.kernel = text_of(meta, DC::ConvolutionKernel);
    s.columns = meta->Get(DC::Columns).AsInt();
    s.rows = meta->Get(DC::Rows).AsInt();
    if (meta->Get(DC::PixelSpacing).GetNumberOfValues() > 0) s.pixel_mm = meta->Get(DC::PixelSpacing).GetDouble(0);
    s.thickness_mm = meta->Get(DC::SliceThickness).AsDouble();
    s.what = judge(s, meta);
    result.push_back(std::move(s));
  }
  if (result.empty()) {
    throw Error(ExitCode::no_input, "'" + folder.string() + "' holds no DICOM image",
                "give the folder with the CT's slices, or a .nrrd, .nii.gz, .mha or .vti file");
  }
  // The most slices make the best volume of bone; among equals the thinnest.
  DicomSeries* best = nullptr;
  for (DicomSeries& s : result) {
    if (!s.usable) continue;
    if (best == nullptr || s.images > best->images || (s.images == best->images && s.thickness_mm < best->thickness_mm)) best = &s;
  }
  if (best != nullptr) best->recommended = true;
  return result;
}

Image load_dicom_series(const DicomSeries& series, double max_gap_mm, const Context& context) {
  if (!series.usable) throw Error(ExitCode::corrupt, "series " + std::to_string(series.number) + " cannot be used: " + series.what);
  const auto slices = sorted_slices(series, max_gap_mm, context.sub(0, 0.2));
  const Slice& first = slices.front();
  const Vec3 normal = normalized(cross(first.u, first.v));
  const std::size_t count = slices.size();
  const std::size_t area = static_cast<std::size_t>(first.columns) * static_cast<std::size_t>(first.rows);

  Frame frame;
  frame.direction = {{normalized(first.u), normalized(first.v), normal}};
  frame.dims = {first.columns, first.rows, static_cast<int>(count)};
  const double mean_gap = (slices.back().along - first.along) / static_cast<double>(count - 1);
  frame.spacing_mm = {first.du, first.dv, mean_gap};
  frame.origin_mm = first.position;

  double off = 0, gap_min = 1e30, gap_max = 0;
  for (std::size_t k = 0; k < count; ++k) {
    off = std::max(off, length(slices[k].position - (first.position + normal * (mean_gap * static_cast<double>(k)))));
    if (k == 0) continue;
    gap_min = std::min(gap_min, slices[k].along - slices[k - 1].along);
    gap_max = std::max(gap_max, slices[k].along - slices[k - 1].along);
  }
  const Vec3 lean = slices.back().position - first.position;
  const double tilt_deg = std::acos(std::clamp(dot(lean, normal) / length(lean), -1.0, 1.0)) * 180 / 3.14159265358979323846;
  context.report("slices", static_cast<std::int64_t>(count));
  context.report("slice_gap_min_mm", gap_min);
  context.report("slice_gap_max_mm", gap_max);
  context.report("gantry_tilt_deg", tilt_deg < 0.05 ? 0.0 : tilt_deg);

  const auto pixels = make_voxels<std::int16_t>(area * count);
  for (std::size_t k = 0; k < count; ++k) {
    read_pixels(slices[k], pixels.get() + k * area);
    context.progress(0.2 + 0.6 * static_cast<double>(k + 1) / static_cast<double>(count), "reading slices");
  }
  if (off <= kStraightMm) {
    context.report("resampled", false);
    return {frame, pixels};
  }

  // Tilted or uneven: straight slices at the finest gap (at most 1 mm, at least a pixel), wide enough for all of the lean.
  context.report("resampled", true);
  context.info("the slices are " + std::string(tilt_deg > 0.05 ? "tilted" : "unevenly spaced") +
               "; resampling them onto straight, even ones");
  double u_lo = 0, u_hi = 0, v_lo = 0, v_hi = 0;
  for (const Slice& s : slices) {
    const Vec3 d = s.position - first.position;
    u_lo = std::min(u_lo, dot(d, first.u));
    u_hi = std::max(u_hi, dot(d, first.u));
    v_lo = std::min(v_lo, dot(d, first.v));
    v_hi = std::max(v_hi, dot(d, first.v));
  }
  const double dz = std::max(std::min(gap_min, 1.0), std::min(first.du, first.dv));
  // Whole pixels of margin keep the pixel lattice of the first slice.
  const int before_u = static_cast<int>(std::ceil(-u_lo / first.du - 1e-6)), after_u = static_cast<int>(std::ceil(u_hi / first.du - 1e-6));
  const int before_v = static_cast<int>(std::ceil(-v_lo / first.dv - 1e-6)), after_v = static_cast<int>(std::ceil(v_hi / first.dv - 1e-6));
  frame.dims = {first.columns + before_u + after_u, first.rows + before_v + after_v,
                static_cast<int>(std::floor((slices.back().along - first.along) / dz + 1e-6)) + 1};
  frame.spacing_mm = {first.du, first.dv, dz};
  frame.origin_mm = first.position - first.u * (before_u * first.du) - first.v * (before_v * first.dv);

  const auto out = make_voxels<std::int16_t>(frame.voxel_count());
  const auto nx = static_cast<std::size_t>(frame.dims[0]), ny = static_cast<std::size_t>(frame.dims[1]);
  parallel_for(static_cast<std::size_t>(frame.dims[2]), 1, context.threads, [&](std::size_t z, std::size_t) {
    context.check_cancelled();
    const double along = first.along + static_cast<double>(z) * dz;
    std::size_t above = 1;
    while (above + 1 < count && slices[above].along < along) ++above;
    const double gap = slices[above].along - slices[above - 1].along;
    const double t = std::clamp((along - slices[above - 1].along) / gap, 0.0, 1.0);
    for (std::size_t y = 0; y < ny; ++y) {
      for (std::size_t x = 0; x < nx; ++x) {
        double sum = 0, weight = 0;
        for (int side = 0; side < 2; ++side) {
          const double share = side == 0 ? 1 - t : t;
          if (share < 1e-9) continue;
          const std::size_t k = above - 1 + static_cast<std::size_t>(side);
          const Vec3 d = slices[k].position - frame.origin_mm;
          const double i = static_cast<double>(x) - dot(d, first.u) / first.du, j = static_cast<double>(y) - dot(d, first.v) / first.dv;
          const int i0 = static_cast<int>(std::floor(i)), j0 = static_cast<int>(std::floor(j));
          for (int c = 0; c < 4; ++c) {
            const int ii = i0 + (c & 1), jj = j0 + (c >> 1);
            const double w = share * ((c & 1) != 0 ? i - i0 : 1 - (i - i0)) * ((c >> 1) != 0 ? j - j0 : 1 - (j - j0));
            if (w <= 0 || ii < 0 || jj < 0 || ii >= first.columns || jj >= first.rows) continue;
            sum += w *
                   pixels[k * area + static_cast<std::size_t>(jj) * static_cast<std::size_t>(first.columns) + static_cast<std::size_t>(ii)];
            weight += w;
          }
        }
        // Where only part of the neighbours exist the voxel lies outside the scan: air.
        const double hu = weight > 0.5 ? sum / weight : -1024;
        out[(z * ny + y) * nx + x] = static_cast<std::int16_t>(std::lround(hu));
      }
    }
  });
  return {frame, out};
}

void save_dicom_series(const Image& image, const fs::path& folder, const Context& context) {
  write_folder_atomically(folder, false, [&](const fs::path& temporary) {
    const QuietVtk quiet;
    vtkNew<vtkDICOMMetaData> meta;
    meta->Set(DC::PatientName, "OSTEOTOME^PHANTOM");
    meta->Set(DC::PatientID, "OSTEOTOME");
    meta->Set(DC::Modality, "CT");
    meta->Set(DC::SeriesNumber, 1);
    meta->Set(DC::SeriesDescription, "Osteotome volume");
    meta->Set(DC::RescaleSlope, 1.0);
    meta->Set(DC::RescaleIntercept, 0.0);
    meta->Set(DC::RescaleType, "HU");
    meta->Set(DC::SliceThickness, image.frame.spacing_mm.z);
    const auto volume = to_vtk(image);
    volume->SetOrigin(0, 0, 0);
    volume->SetDirectionMatrix(1, 0, 0, 0, 1, 0, 0, 0, 1);
    vtkNew<vtkMatrix4x4> matrix;
    for (int a = 0; a < 3; ++a) {
      for (int r = 0; r < 3; ++r) {
        matrix->SetElement(r, a, image.frame.direction.column[static_cast<std::size_t>(a)][static_cast<std::size_t>(r)]);
      }
      matrix->SetElement(a, 3, image.frame.origin_mm[static_cast<std::size_t>(a)]);
    }
    vtkNew<vtkDICOMCTGenerator> generator;
    vtkNew<vtkDICOMWriter> writer;
    writer->SetGenerator(generator);
    writer->SetMetaData(meta);
    writer->SetInputData(volume);
    writer->SetPatientMatrix(matrix);
    writer->SetMemoryRowOrderToFileNative();
    writer->SetFileSliceOrderToSame();
    writer->SetFilePrefix(temporary.c_str());
    writer->SetFilePattern("%s/%04d.dcm");
    writer->Write();
    if (writer->GetErrorCode() != 0) throw io::write_error(folder, writer->GetErrorCode());
    const std::size_t slice_bytes = image.frame.voxel_count() / static_cast<std::size_t>(image.frame.dims[2]) * sizeof(std::int16_t);
    for (const auto& entry : fs::directory_iterator(temporary)) {
      // vtk-dicom does not look whether its bytes arrived.
      if (entry.file_size() < slice_bytes) throw io::write_error(folder, vtkErrorCode::OutOfDiskSpaceError);
    }
    context.progress(1.0);
  });
}

}  // namespace osteo
