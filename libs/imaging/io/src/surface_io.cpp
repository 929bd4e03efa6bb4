#include "osteo/imaging/io/surface_io.h"

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPLYReader.h>
#include <vtkPNGReader.h>
#include <vtkPNGWriter.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkUnsignedCharArray.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <tuple>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/io/vtk_data.h"
#include "surface_text.h"

namespace osteo::inline imaging {
namespace {

template <class Reader>
vtkSmartPointer<vtkPolyData> read_with(const fs::path& path) {
  const QuietVtk quiet;
  vtkNew<Reader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  if (reader->GetErrorCode() != 0 || !quiet.first_message().empty()) {
    throw Error(ExitCode::corrupt, "'" + path.string() + "' cannot be read: " + quiet.first_message());
  }
  return reader->GetOutput();
}

template <class Writer>
void write_with(Writer* writer, vtkPolyData* data, const fs::path& path) {
  write_atomically(path, [&](const fs::path& temporary) {
    const QuietVtk quiet;
    writer->SetFileName(temporary.c_str());
    writer->SetInputData(data);
    if (writer->Write() == 0 || writer->GetErrorCode() != 0) throw vtk_write_error(path, writer->GetErrorCode());
  });
}

// An STL file in text without "facet", or in bytes that counts none.
bool holds_no_facet(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string head(1 << 16, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  if (head.size() == 84 && head.compare(80, 4, std::string(4, '\0')) == 0) return true;
  return head.starts_with("solid") && head.size() < (1 << 16) && head.find('\0') == std::string::npos &&
         head.find("facet") == std::string::npos && head.find("FACET") == std::string::npos;
}

vtkSmartPointer<vtkPolyData> read_poly(const fs::path& path) {
  require_readable(path);
  const auto e = path.extension();
  vtkSmartPointer<vtkPolyData> poly;
  if (e == ".ply") poly = read_with<vtkPLYReader>(path);
  if (e == ".stl") {
    // VTK's reader calls a file without a facet damaged in words of its own.
    if (fs::file_size(path) == 0) throw Error(ExitCode::corrupt, "'" + path.string() + "' is empty: no byte is in it");
    if (holds_no_facet(path)) throw Error(ExitCode::corrupt, "'" + path.string() + "': it holds no triangles");
    poly = read_with<vtkSTLReader>(path);
  }
  if (e == ".obj") poly = io::read_obj(path);
  if (e == ".vtp") poly = read_with<vtkXMLPolyDataReader>(path);
  if (!poly)
    throw Error(ExitCode::corrupt, "'" + path.string() + "' is not a surface file by its name",
                "surfaces are .ply .stl .obj .vtp");
  return poly;
}

// A .ply as io::ply_text() writes it, whose bytes are ours; anything else is nothing, and VTK's to judge.
std::shared_ptr<TriMesh> read_own_ply(const fs::path& path) {
  require_readable(path);
  std::ifstream file(path, std::ios::binary);
  std::string head(512, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  std::string_view rest = head;
  const auto take = [&](std::string_view text) {
    const bool there = rest.starts_with(text);
    if (there) rest.remove_prefix(text.size());
    return there;
  };
  const auto take_number = [&](std::size_t& n) {
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), n);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    return error == std::errc() && n < (std::size_t{1} << 32) && take("\n");
  };
  std::size_t points = 0, triangles = 0;
  if (!take("ply\nformat binary_little_endian 1.0\ncomment ") || rest.find('\n') == rest.npos) return nullptr;
  rest.remove_prefix(rest.find('\n'));
  if (!take("\nelement vertex ") || !take_number(points) ||
      !take("property float x\nproperty float y\nproperty float z\n"))
    return nullptr;
  const bool normals = take("property float nx\nproperty float ny\nproperty float nz\n");
  if (!take("element face ") || !take_number(triangles) ||
      !take("property list uchar uint vertex_indices\nend_header\n"))
    return nullptr;
  const std::size_t begin = head.size() - rest.size(), point_bytes = normals ? 24 : 12;
  constexpr std::size_t kTriangleBytes = 13;
  // VTK reads on where a file ends.
  const std::uintmax_t needed = begin + points * point_bytes + triangles * kTriangleBytes, there = fs::file_size(path);
  if (there < needed) {
    throw Error(ExitCode::corrupt,
                "'" + path.string() + "': " + std::to_string(points) + " points and " + std::to_string(triangles) +
                    " triangles take " + std::to_string(needed) + " bytes, but there are only " + std::to_string(there),
                "the file was cut short; copy it again from its source");
  }
  if (there > needed) return nullptr;
  auto mesh = std::make_shared<TriMesh>();
  mesh->points_mm.resize(points);
  mesh->triangles.resize(triangles);
  file.clear();
  file.seekg(static_cast<std::streamoff>(begin));
  constexpr std::size_t kAtOnce = 8192;
  std::vector<char> part(kAtOnce * point_bytes);
  const auto read = [&](std::size_t n, std::size_t each) {
    return static_cast<bool>(file.read(part.data(), static_cast<std::streamsize>(n * each)));
  };
  for (std::size_t p = 0; p < points; p += kAtOnce) {
    const std::size_t n = std::min(kAtOnce, points - p);
    if (!read(n, point_bytes)) return nullptr;
    for (std::size_t i = 0; i < n; ++i) std::memcpy(&mesh->points_mm[p + i], part.data() + i * point_bytes, 12);
  }
  part.resize(kAtOnce * kTriangleBytes);
  for (std::size_t t = 0; t < triangles; t += kAtOnce) {
    const std::size_t n = std::min(kAtOnce, triangles - t);
    if (!read(n, kTriangleBytes)) return nullptr;
    for (std::size_t i = 0; i < n; ++i) {
      auto& corners = mesh->triangles[t + i];
      std::memcpy(&corners, part.data() + i * kTriangleBytes + 1, 12);
      if (part[i * kTriangleBytes] != 3) return nullptr;
      if (const std::uint32_t most = std::max({corners[0], corners[1], corners[2]}); most >= points) {
        throw Error(ExitCode::corrupt, "'" + path.string() + "': polygon " + std::to_string(t + i) + " names point " +
                                           std::to_string(most) + ", but there are only " + std::to_string(points) +
                                           " points");
      }
    }
  }
  return mesh;
}

}  // namespace

bool is_surface_file(const fs::path& path) {
  const auto e = path.extension();
  return e == ".ply" || e == ".stl" || e == ".obj" || e == ".vtp";
}

Surface load_surface(const fs::path& path) {
  static_assert(std::endian::native == std::endian::little);
  if (path.extension() == ".ply") {
    if (auto mesh = read_own_ply(path); mesh && !mesh->triangles.empty()) return mesh;
  }
  const vtkSmartPointer<vtkPolyData> poly = read_poly(path);
  try {
    auto mesh = std::make_shared<TriMesh>(mesh_from_vtk(poly));
    if (mesh->triangles.empty()) throw Error(ExitCode::corrupt, "it holds no triangles");
    return mesh;
  } catch (const Error& error) {
    throw error.in("'" + path.string() + "'");
  }
}

std::vector<Vec3> load_surface_points(const fs::path& path) {
  const vtkSmartPointer<vtkPolyData> poly = read_poly(path);
  std::vector<Vec3> points(static_cast<std::size_t>(poly->GetNumberOfPoints()));
  for (std::size_t p = 0; p < points.size(); ++p) {
    double x[3];
    poly->GetPoint(static_cast<vtkIdType>(p), x);
    points[p] = {x[0], x[1], x[2]};
    if (!std::isfinite(dot(points[p], points[p])))
      throw Error(ExitCode::corrupt,
                  "'" + path.string() + "': point " + std::to_string(p) + " has a coordinate that is no finite number");
  }
  // Flat shading writes a point for each of its triangles.
  const auto before = [](Vec3 a, Vec3 b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); };
  std::sort(points.begin(), points.end(), before);
  points.erase(
      std::unique(points.begin(), points.end(), [&](Vec3 a, Vec3 b) { return !before(a, b) && !before(b, a); }),
      points.end());
  if (points.empty()) throw Error(ExitCode::corrupt, "'" + path.string() + "': it holds no points");
  return points;
}

void save_surface(const TriMesh& mesh, const fs::path& path) {
  for (std::size_t p = 0; p < mesh.points_mm.size(); ++p) {
    for (const float v : mesh.points_mm[p]) {
      if (!std::isfinite(v))
        throw Error(ExitCode::failed, "the surface is not written: point " + std::to_string(p) +
                                          " has a coordinate that is no finite number");
    }
  }
  const auto e = path.extension();
  if (e == ".ply") return write_file(path, io::ply_text(mesh));
  if (e == ".stl") return write_file(path, stl_text(mesh));
  if (e == ".glb") return write_file(path, io::glb_text(mesh));
  if (e == ".3mf")
    return write_atomically(path, [&](const fs::path& temporary) { io::write_3mf(mesh, temporary, path); });
  if (e == ".obj") return write_file(path, io::obj_text(mesh));
  if (e == ".vtp") {
    vtkNew<vtkXMLPolyDataWriter> writer;
    return write_with(writer.Get(), to_vtk(mesh), path);
  }
  throw Error(ExitCode::usage, "cannot write a surface as '" + path.filename().string() + "'",
              "name it .ply, .stl, .obj, .glb, .3mf or .vtp");
}

void save_picture(const Picture& picture, const fs::path& path) {
  if (path.extension() != ".png") {
    throw Error(ExitCode::usage, "cannot write a picture as '" + path.filename().string() + "'", "name it .png");
  }
  vtkNew<vtkImageData> image;
  image->SetDimensions(picture.width, picture.height, 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  const std::size_t row = static_cast<std::size_t>(picture.width) * 3;
  for (int y = 0; y < picture.height; ++y) {
    std::copy_n(picture.rgb.data() + static_cast<std::size_t>(picture.height - 1 - y) * row, row,
                static_cast<unsigned char*>(image->GetScalarPointer(0, y, 0)));
  }
  vtkNew<vtkPNGWriter> writer;
  writer->WriteToMemoryOn();
  writer->SetInputData(image);
  writer->Write();
  vtkUnsignedCharArray* const bytes = writer->GetResult();
  write_file(path, {reinterpret_cast<const char*>(bytes->GetPointer(0)),
                    static_cast<std::size_t>(bytes->GetNumberOfValues())});
}

Picture load_picture(const fs::path& path) {
  require_readable(path);
  const QuietVtk quiet;
  vtkNew<vtkPNGReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  vtkImageData* const image = reader->GetOutput();
  if (reader->GetErrorCode() != 0 || image->GetNumberOfScalarComponents() < 3) {
    throw Error(ExitCode::corrupt, "'" + path.string() + "' is not an RGB picture (.png)");
  }
  Picture picture{image->GetDimensions()[0], image->GetDimensions()[1], {}};
  for (int y = picture.height - 1; y >= 0; --y) {
    for (int x = 0; x < picture.width; ++x) {
      const auto* const p = static_cast<const unsigned char*>(image->GetScalarPointer(x, y, 0));
      picture.rgb.insert(picture.rgb.end(), p, p + 3);
    }
  }
  return picture;
}

}  // namespace osteo::inline imaging
