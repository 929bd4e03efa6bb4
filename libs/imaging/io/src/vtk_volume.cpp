// The formats that VTK and its MetaIO read and write for us.
#include "vtk_volume.h"

#include <libdeflate.h>
#include <vtkDataArray.h>
#include <vtkErrorCode.h>
#include <vtkImageData.h>
#include <vtkInformationVector.h>
#include <vtkMatrix3x3.h>
#include <vtkMatrix4x4.h>
#include <vtkNIFTIImageHeader.h>
#include <vtkNIFTIImageReader.h>
#include <vtkNIFTIImageWriter.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLImageDataWriter.h>
#include <vtkZLibDataCompressor.h>
#include <vtkmetaio/metaImage.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iostream>
#include <memory>
#include <sstream>
#include <system_error>

#include "gzip.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline imaging::io {
namespace {

int vtk_type(Scalar s) {
  switch (s) {
    case Scalar::u8:
      return VTK_UNSIGNED_CHAR;
    case Scalar::i8:
      return VTK_SIGNED_CHAR;
    case Scalar::u16:
      return VTK_UNSIGNED_SHORT;
    case Scalar::i16:
      return VTK_SHORT;
    case Scalar::u32:
      return VTK_UNSIGNED_INT;
    case Scalar::i32:
      return VTK_INT;
    case Scalar::f32:
      return VTK_FLOAT;
    case Scalar::f64:
      return VTK_DOUBLE;
  }
  return VTK_VOID;
}

Scalar scalar_from_vtk(int type) {
  for (const Scalar s :
       {Scalar::u8, Scalar::i8, Scalar::u16, Scalar::i16, Scalar::u32, Scalar::i32, Scalar::f32, Scalar::f64}) {
    if (vtk_type(s) == type) return s;
  }
  if (type == VTK_CHAR) return Scalar::i8;
  throw Error(ExitCode::corrupt, "the scalar type of this image is not supported");
}

[[noreturn]] void fail(const fs::path& path, const std::string& what, const std::string& advice = {}) {
  throw Error(ExitCode::corrupt, "'" + path.string() + "': " + what, advice);
}

// MetaIO tells its troubles to std::cerr: ours are enough.
class QuietCerr {
 public:
  QuietCerr() : before_(std::cerr.rdbuf(nullptr)) {}
  ~QuietCerr() {
    std::cerr.rdbuf(before_);
    std::cerr.clear();
  }
  QuietCerr(const QuietCerr&) = delete;
  QuietCerr& operator=(const QuietCerr&) = delete;

 private:
  std::streambuf* before_;
};

// LPS frame from a RAS matrix whose columns include the spacing.
void frame_from_ras(Frame& frame, const vtkMatrix4x4* m, Vec3 spacing) {
  for (std::size_t a = 0; a < 3; ++a) {
    const int c = static_cast<int>(a);
    const Vec3 v{-m->GetElement(0, c), -m->GetElement(1, c), m->GetElement(2, c)};
    const double scale = length(v);
    frame.direction.column[a] = normalized(v);
    frame.spacing_mm[a] = spacing[a] * scale;
  }
  frame.origin_mm = {-m->GetElement(0, 3), -m->GetElement(1, 3), m->GetElement(2, 3)};
}

}  // namespace

void set_frame(vtkImageData* image, const Frame& f) {
  image->SetDimensions(f.dims[0], f.dims[1], f.dims[2]);
  image->SetSpacing(f.spacing_mm.x, f.spacing_mm.y, f.spacing_mm.z);
  image->SetOrigin(f.origin_mm.x, f.origin_mm.y, f.origin_mm.z);
  const auto& c = f.direction.column;
  image->SetDirectionMatrix(c[0].x, c[1].x, c[2].x, c[0].y, c[1].y, c[2].y, c[0].z, c[1].z, c[2].z);
}

RawVolume raw_from_vtk(vtkImageData* image) {
  vtkDataArray* const scalars = image->GetPointData()->GetScalars();
  if (scalars == nullptr) throw Error(ExitCode::corrupt, "the image has no scalars");
  if (scalars->GetNumberOfComponents() != 1)
    throw Error(ExitCode::corrupt, "the image has several components; a CT has one");
  RawVolume raw;
  int extent[6];
  image->GetExtent(extent);
  const double* const spacing = image->GetSpacing();
  const double* const m = image->GetDirectionMatrix()->GetData();
  for (std::size_t a = 0; a < 3; ++a) {
    raw.frame.dims[a] = extent[2 * a + 1] - extent[2 * a] + 1;
    raw.frame.spacing_mm[a] = spacing[a];
    raw.frame.direction.column[a] = {m[a], m[3 + a], m[6 + a]};
  }
  double first[3];
  image->TransformIndexToPhysicalPoint(extent[0], extent[2], extent[4], first);
  raw.frame.origin_mm = {first[0], first[1], first[2]};
  raw.type = scalar_from_vtk(scalars->GetDataType());
  const vtkSmartPointer<vtkDataArray> keep = scalars;
  raw.data = std::shared_ptr<const void>(scalars->GetVoidPointer(0), [keep](const void*) {});
  return raw;
}

vtkSmartPointer<vtkImageData> vtk_view(const RawVolume& raw) {
  auto image = vtkSmartPointer<vtkImageData>::New();
  set_frame(image, raw.frame);
  const auto array = vtk::TakeSmartPointer(vtkDataArray::CreateDataArray(vtk_type(raw.type)));
  array->SetVoidArray(const_cast<void*>(raw.data.get()), static_cast<vtkIdType>(raw.frame.voxel_count()), 1);
  image->GetPointData()->SetScalars(array);
  return image;
}

RawVolume read_vti(const fs::path& path) {
  require_readable(path);
  const QuietVtk quiet;
  vtkNew<vtkXMLImageDataReader> reader;
  if (reader->CanReadFile(path.c_str()) == 0) fail(path, "this is not a VTK image file (.vti)");
  reader->SetFileName(path.c_str());
  reader->Update();
  if (reader->GetErrorCode() != 0 || !quiet.first_message().empty())
    fail(path, "cannot be read: " + quiet.first_message());
  return raw_from_vtk(reader->GetOutput());
}

namespace {

// VTK's blocks of zlib, by a faster library: the same format, and so the same name in the file.
class FastZlib : public vtkZLibDataCompressor {
 public:
  static FastZlib* New();
  size_t GetMaximumCompressionSpace(size_t size) override {
    return libdeflate_zlib_compress_bound(compressor_.get(), size);
  }

 protected:
  size_t CompressBuffer(const unsigned char* in, size_t size, unsigned char* out, size_t room) override {
    return libdeflate_zlib_compress(compressor_.get(), in, size, out, room);
  }

 private:
  std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor_{
      libdeflate_alloc_compressor(1), &libdeflate_free_compressor};
};
vtkStandardNewMacro(FastZlib)

}  // namespace

void write_vti(const RawVolume& raw, const fs::path& path) {
  write_atomically(path, [&](const fs::path& temporary) {
    const QuietVtk quiet;
    vtkNew<vtkXMLImageDataWriter> writer;
    const vtkNew<FastZlib> compressor;
    writer->SetCompressor(compressor);
    writer->SetFileName(temporary.c_str());
    writer->SetInputData(vtk_view(raw));
    if (writer->Write() == 0 || writer->GetErrorCode() != 0) throw vtk_write_error(path, writer->GetErrorCode());
  });
}

namespace {

// How the two forms of a NIfTI header differ, where it has both. Found before the reader, which calls a mirrored one an
// error of the file.
void require_like_handed(vtkNIFTIImageHeader& h, const fs::path& path) {
  if (h.GetSFormCode() <= 0 || h.GetQFormCode() <= 0) return;
  const double *const x = h.GetSRowX(), *const y = h.GetSRowY(), *const z = h.GetSRowZ();
  const double s = dot(cross(Vec3{x[0], x[1], x[2]}, Vec3{y[0], y[1], y[2]}), Vec3{z[0], z[1], z[2]});
  const double q = h.GetPixDim(0) < 0 ? -1 : 1;
  if (s * q < 0)
    fail(path, "its two forms (sform and qform) are mirror images of each other: which side is left is not known",
         "find out which is right and write both alike");
}

// How far apart two frames put the same voxel, at most.
double farthest_apart(const Frame& a, const Frame& b) {
  double most = 0;
  for (int c = 0; c < 8; ++c) {
    const Vec3 corner{(c & 1) != 0 ? a.dims[0] - 1.0 : 0.0, (c & 2) != 0 ? a.dims[1] - 1.0 : 0.0,
                      (c & 4) != 0 ? a.dims[2] - 1.0 : 0.0};
    most = std::max(most, length(a.world_from_index(corner) - b.world_from_index(corner)));
  }
  return most;
}

}  // namespace

RawVolume read_nifti(const fs::path& path) {
  require_readable(path);
  const QuietVtk quiet;
  vtkNew<vtkNIFTIImageReader> reader;
  if (reader->CanReadFile(path.c_str()) == 0) fail(path, "this is not a NIfTI file");
  reader->SetFileName(path.c_str());
  reader->UpdateInformation();
  vtkNIFTIImageHeader* const header = reader->GetNIFTIHeader();
  const bool readable = header != nullptr && quiet.first_message().empty();
  if (header != nullptr) {
    require_like_handed(*header, path);
    std::int64_t volumes = 1, voxels = 1;
    for (int a = 1; a <= 7 && a <= header->GetDim(0); ++a) {
      const auto n = std::max<std::int64_t>(1, header->GetDim(a));
      (a <= 3 ? voxels : volumes) *= n;
    }
    if (readable && volumes > 1)
      fail(path, "it holds " + std::to_string(volumes) + " volumes (a series over time, or of channels), not one",
           "save the one to be used as a file of its own");
    if (readable && (path.extension() == ".gz" || voxels > 1'000'000'000))
      require_room(path, static_cast<double>(voxels), header->GetBitPix() / 8.0,
                   static_cast<double>(fs::file_size(path)), path.extension() == ".gz");
  }
  reader->Update();
  if (reader->GetErrorCode() != 0 || !quiet.first_message().empty()) {
    fail(path, "cannot be read: " + quiet.first_message(), "the file may be cut short; copy it again from its source");
  }
  RawVolume raw = raw_from_vtk(reader->GetOutput());
  const Vec3 spacing = raw.frame.spacing_mm;
  vtkMatrix4x4* const sform = reader->GetSFormMatrix();
  vtkMatrix4x4* const qform = reader->GetQFormMatrix();
  if (sform != nullptr) {
    Frame other = raw.frame;
    frame_from_ras(raw.frame, sform, spacing);
    if (qform != nullptr) {
      frame_from_ras(other, qform, spacing);
      const double apart = farthest_apart(raw.frame, other), voxel = std::min({spacing.x, spacing.y, spacing.z});
      if (apart > voxel) {
        double trace = 0;
        for (std::size_t a = 0; a < 3; ++a) trace += dot(raw.frame.direction.column[a], other.direction.column[a]);
        const double degrees = std::acos(std::clamp((trace - 1) / 2, -1.0, 1.0)) * 180 / 3.14159265358979323846;
        raw.findings.push_back({VolumeFinding::What::places_disagree,
                                "the file states two places (sform and qform) that are turned against each other by " +
                                    format_number(std::round(degrees * 10) / 10) + " degrees and put a voxel up to " +
                                    format_number(std::round(apart / voxel * 10) / 10) +
                                    " voxels apart; the sform is taken"});
      }
    }
  } else if (qform != nullptr) {
    frame_from_ras(raw.frame, qform, spacing);
  } else {
    raw.findings.push_back(
        {VolumeFinding::What::axes_not_stated, "the NIfTI file states no orientation: left and right are not known"});
  }
  const int unit = header != nullptr ? header->GetXYZTUnits() & 7 : 0;
  if (unit == 1) convert_lengths(raw, 1000, "metres (xyzt_units)");
  if (unit == 3) convert_lengths(raw, 1e-3, "micrometres (xyzt_units)");
  if (unit > 3)
    fail(path, "its unit of length (xyzt_units " + std::to_string(unit) + ") is not known", "save it in millimetres");
  if (std::abs(reader->GetRescaleSlope()) > 0 &&
      (reader->GetRescaleSlope() != 1 || reader->GetRescaleIntercept() != 0)) {
    const double slope = reader->GetRescaleSlope(), intercept = reader->GetRescaleIntercept();
    const std::size_t n = raw.frame.voxel_count();
    const auto scaled = std::make_shared_for_overwrite<float[]>(n);
    vtkDataArray* const in = reader->GetOutput()->GetPointData()->GetScalars();
    for (std::size_t i = 0; i < n; ++i) {
      scaled[i] = static_cast<float>(slope * in->GetComponent(static_cast<vtkIdType>(i), 0) + intercept);
    }
    raw.type = Scalar::f32;
    raw.data = std::shared_ptr<const void>(scaled, scaled.get());
  }
  try {
    require_valid(raw.frame);
  } catch (const Error& e) {
    throw e.in("'" + path.string() + "'");
  }
  return raw;
}

// The same voxels at the same places with the slices counted from the other end.
RawVolume with_slices_reversed(const RawVolume& raw) {
  RawVolume out = raw;
  const auto nz = static_cast<std::size_t>(raw.frame.dims[2]);
  out.frame.origin_mm = raw.frame.world_from_index({0, 0, static_cast<double>(nz) - 1});
  out.frame.direction.column[2] = -raw.frame.direction.column[2];
  const std::size_t slice = raw.frame.voxel_count() / nz * size_of(raw.type);
  const auto bytes = std::make_shared_for_overwrite<std::byte[]>(slice * nz);
  for (std::size_t k = 0; k < nz; ++k)
    std::memcpy(bytes.get() + k * slice, static_cast<const std::byte*>(raw.data.get()) + (nz - 1 - k) * slice, slice);
  out.data = std::shared_ptr<const void>(bytes, bytes.get());
  return out;
}

namespace {

// VTK's header without its voxels, which it writes row by row.
class NiftiHeaderWriter : public vtkNIFTIImageWriter {
 public:
  static NiftiHeaderWriter* New();
  vtkTypeMacro(NiftiHeaderWriter, vtkNIFTIImageWriter);
  NiftiHeaderWriter(const NiftiHeaderWriter&) = delete;
  void operator=(const NiftiHeaderWriter&) = delete;
  std::string header;

 protected:
  NiftiHeaderWriter() = default;
  int RequestData(vtkInformation*, vtkInformationVector** input, vtkInformationVector*) override {
    const int ok = GenerateHeader(input[0]->GetInformationObject(0), true);
    // Sizes of nifti1.h and nifti2.h; four more bytes say that nothing comes in between. More than 32767 voxels a side
    // make VTK take the second.
    alignas(8) std::array<char, 540 + 4> bytes{};
    const bool second = std::string_view(OwnHeader->GetMagic()).starts_with("n+2");
    if (second) {
      OwnHeader->GetHeader(reinterpret_cast<nifti_2_header*>(bytes.data()));
    } else {
      OwnHeader->GetHeader(reinterpret_cast<nifti_1_header*>(bytes.data()));
    }
    header.assign(bytes.data(), second ? 540 + 4 : 348 + 4);
    return ok;
  }
};
vtkStandardNewMacro(NiftiHeaderWriter);

}  // namespace

void write_nifti(const RawVolume& given, const fs::path& path) {
  // A qform holds only rotations: a left-handed volume is written with its slices in reverse order.
  const RawVolume raw = determinant(given.frame.direction) < 0 ? with_slices_reversed(given) : given;
  const QuietVtk quiet;
  // The matrix carries the place; the VTK image itself stays at the origin with unit axes.
  const auto image = vtk_view(raw);
  image->SetOrigin(0, 0, 0);
  image->SetDirectionMatrix(1, 0, 0, 0, 1, 0, 0, 0, 1);
  vtkNew<vtkMatrix4x4> ras;
  const Frame& f = raw.frame;
  for (int a = 0; a < 3; ++a) {
    const Vec3 c = f.direction.column[static_cast<std::size_t>(a)];
    ras->SetElement(0, a, -c.x);
    ras->SetElement(1, a, -c.y);
    ras->SetElement(2, a, c.z);
  }
  ras->SetElement(0, 3, -f.origin_mm.x);
  ras->SetElement(1, 3, -f.origin_mm.y);
  ras->SetElement(2, 3, f.origin_mm.z);
  vtkNew<NiftiHeaderWriter> writer;
  writer->SetFileName(path.c_str());
  writer->SetInputData(image);
  writer->SetQFormMatrix(ras);
  writer->SetSFormMatrix(ras);
  writer->SetDescription("Osteotome");
  writer->Write();
  if (writer->GetErrorCode() != 0) throw vtk_write_error(path, writer->GetErrorCode());
  const std::string_view voxels(static_cast<const char*>(raw.data.get()), f.voxel_count() * size_of(raw.type));
  if (path.extension() == ".gz") {
    write_file(path, gzip(writer->header, voxels));
  } else {
    write_parts(path, writer->header, voxels);
  }
}

// The value of a line "KEY = value" of a MetaImage header; empty where there is none.
std::string meta_value(std::string_view all, std::string_view key) {
  const std::size_t limit = std::min<std::size_t>(all.size(), 1 << 16);
  for (std::size_t at = 0; at < limit;) {
    const std::size_t end = std::min(all.find('\n', at), limit);
    const std::string_view line = all.substr(at, end - at);
    const std::size_t equals = line.find('=');
    if (equals != std::string_view::npos && trimmed(line.substr(0, equals), " \r") == key)
      return std::string(trimmed(line.substr(equals + 1), " \r"));
    at = end + 1;
  }
  return {};
}

// MetaIO reads what there is of a cut file and says nothing: compare sizes with the header first.
void require_whole_meta(const fs::path& path) {
  const auto bytes = read_file(path);
  const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string data_file = meta_value(all, "ElementDataFile");
  if (data_file.empty())
    fail(path, "this is not a whole MetaImage header", "the file may be cut short; copy it again from its source");
  if (const std::string axes = meta_value(all, "NDims"); !axes.empty() && axes != "3") {
    fail(path, "it has " + axes + " axes; a volume has three",
         axes == "4" ? "a series over time or of channels: save one of its volumes as a file of its own" : "");
  }
  const bool packed = meta_value(all, "CompressedData") == "True";
  const bool many_files = data_file.starts_with("LIST") || data_file.find('%') < data_file.size();
  std::istringstream sizes(meta_value(all, "DimSize"));
  double voxels = 1;
  for (double n = 0; sizes >> n;) voxels *= n;
  const bool huge = voxels > 1e9 && meta_value(all, "BinaryData") != "False";
  if (many_files || (!packed && !huge)) return;  // MetaIO checks the size of plain data
  std::uint64_t there = 0;
  if (data_file == "LOCAL") {
    const std::size_t line = all.find("ElementDataFile");
    there = bytes.size() - std::min(bytes.size(), all.find('\n', line) + 1);
  } else {
    require_readable(path.parent_path() / data_file);
    there = fs::file_size(path.parent_path() / data_file);
  }
  require_room(path, voxels, 1, static_cast<double>(there), packed);
  if (!packed) return;
  const std::string size = meta_value(all, "CompressedDataSize");
  if (size.empty()) return;
  if (static_cast<double>(there) < parse_number(size, "CompressedDataSize")) {
    fail(path, "it holds " + std::to_string(there) + " bytes of packed voxels but needs " + size,
         "the file was cut short; copy it again from its source");
  }
}

RawVolume read_meta(const fs::path& path) {
  require_readable(path);
  require_whole_meta(path);
  vtkmetaio::MetaImage meta;
  const QuietCerr quiet;
  if (!meta.Read(path.c_str(), true))
    fail(path, "cannot be read as MetaImage", "the file may be cut short or its data file missing");
  // MetaIO leaves bytes in the file's order (BinaryDataByteOrderMSB); numbers written as text have none.
  if (meta.BinaryData()) meta.ElementByteOrderFix();
  if (meta.NDims() != 3) fail(path, "it has " + std::to_string(meta.NDims()) + " axes; a volume has three");
  if (meta.ElementNumberOfChannels() != 1) fail(path, "it has several channels; a CT has one");
  RawVolume raw;
  switch (meta.ElementType()) {
    case vtkmetaio::MET_UCHAR:
      raw.type = Scalar::u8;
      break;
    case vtkmetaio::MET_CHAR:
      raw.type = Scalar::i8;
      break;
    case vtkmetaio::MET_USHORT:
      raw.type = Scalar::u16;
      break;
    case vtkmetaio::MET_SHORT:
      raw.type = Scalar::i16;
      break;
    case vtkmetaio::MET_UINT:
      raw.type = Scalar::u32;
      break;
    case vtkmetaio::MET_INT:
      raw.type = Scalar::i32;
      break;
    case vtkmetaio::MET_FLOAT:
      raw.type = Scalar::f32;
      break;
    case vtkmetaio::MET_DOUBLE:
      raw.type = Scalar::f64;
      break;
    default:
      fail(path, "its element type is not supported");
  }
  for (int a = 0; a < 3; ++a) {
    const auto ua = static_cast<std::size_t>(a);
    raw.frame.dims[ua] = meta.DimSize(a);
    raw.frame.spacing_mm[ua] = meta.ElementSpacing(a);
    raw.frame.origin_mm[ua] = meta.Offset(a);
    raw.frame.direction.column[ua] = {meta.TransformMatrix(a, 0), meta.TransformMatrix(a, 1),
                                      meta.TransformMatrix(a, 2)};
  }
  if (meta.DistanceUnits() == vtkmetaio::MET_DISTANCE_UNITS_UM)
    convert_lengths(raw, 1e-3, "micrometres (DistanceUnits)");
  if (meta.DistanceUnits() == vtkmetaio::MET_DISTANCE_UNITS_CM) convert_lengths(raw, 10, "centimetres (DistanceUnits)");
  try {
    require_valid(raw.frame);
  } catch (const Error& e) {
    throw e.in("'" + path.string() + "'");
  }
  const std::size_t size = raw.frame.voxel_count() * size_of(raw.type);
  const auto bytes = std::make_shared_for_overwrite<std::byte[]>(size);
  std::memcpy(bytes.get(), meta.ElementData(), size);
  raw.data = std::shared_ptr<const void>(bytes, bytes.get());
  return raw;
}

void write_meta(const RawVolume& raw, const fs::path& path) {
  if (path.extension() == ".mhd") {
    throw Error(ExitCode::usage, "'" + path.string() + "': .mhd would be two files", "write .mha, which is one");
  }
  write_atomically(path, [&](const fs::path& temporary) {
    vtkmetaio::MET_ValueEnumType type = vtkmetaio::MET_SHORT;
    switch (raw.type) {
      case Scalar::u8:
        type = vtkmetaio::MET_UCHAR;
        break;
      case Scalar::i8:
        type = vtkmetaio::MET_CHAR;
        break;
      case Scalar::u16:
        type = vtkmetaio::MET_USHORT;
        break;
      case Scalar::i16:
        type = vtkmetaio::MET_SHORT;
        break;
      case Scalar::u32:
        type = vtkmetaio::MET_UINT;
        break;
      case Scalar::i32:
        type = vtkmetaio::MET_INT;
        break;
      case Scalar::f32:
        type = vtkmetaio::MET_FLOAT;
        break;
      case Scalar::f64:
        type = vtkmetaio::MET_DOUBLE;
        break;
    }
    const Frame& f = raw.frame;
    const int dims[3] = {f.dims[0], f.dims[1], f.dims[2]};
    const double spacing[3] = {f.spacing_mm.x, f.spacing_mm.y, f.spacing_mm.z};
    vtkmetaio::MetaImage meta(3, dims, spacing, type, 1, const_cast<void*>(raw.data.get()));
    const double offset[3] = {f.origin_mm.x, f.origin_mm.y, f.origin_mm.z};
    meta.Offset(offset);
    double matrix[9];
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) matrix[3 * a + b] = f.direction.column[a][b];
    }
    meta.TransformMatrix(matrix);
    meta.CompressedData(true);
    meta.BinaryData(true);
    meta.SetDoublePrecision(17);
    const QuietCerr quiet;
    if (!meta.Write(temporary.c_str(), "LOCAL")) throw vtk_write_error(path, 0);
    try {
      require_whole_meta(temporary);  // MetaIO does not look whether its bytes arrived
    } catch (const Error&) {
      throw vtk_write_error(path, vtkErrorCode::OutOfDiskSpaceError);
    }
  });
}

}  // namespace osteo::inline imaging::io
