#include "surface_text.h"

#include <archive.h>
#include <archive_entry.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <memory>

#include "osteo/core/base/error.h"
#include "osteo/imaging/io/surface_io.h"

namespace osteo::inline imaging {
namespace {

template <class T>
void append(std::string& text, const T& value) {
  text.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// Shortest text that reads back to the same float.
void append_number(std::string& text, float value) {
  char buffer[32];
  text.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}
void append_number(std::string& text, std::uint64_t value) {
  char buffer[32];
  text.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

}  // namespace

// 80 bytes of header, the number of triangles, 50 bytes each.
std::string stl_text(const TriMesh& mesh) {
  std::string text(io::kSurfaceNote);
  text.resize(80, ' ');
  append(text, static_cast<std::uint32_t>(mesh.triangles.size()));
  text.reserve(text.size() + mesh.triangles.size() * 50);
  for (const auto& t : mesh.triangles) {
    const auto at = [&](std::size_t c) {
      const auto& p = mesh.points_mm[t[c]];
      return Vec3{p[0], p[1], p[2]};
    };
    const Vec3 n = normalized(cross(at(1) - at(0), at(2) - at(0)));
    for (std::size_t a = 0; a < 3; ++a) append(text, static_cast<float>(n[a]));
    for (const std::uint32_t p : t) append(text, mesh.points_mm[p]);
    append(text, std::uint16_t{0});
  }
  return text;
}

namespace io {

std::string ply_text(const TriMesh& mesh) {
  const bool normals = mesh.normals.size() == mesh.points_mm.size();
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment " + std::string(kSurfaceNote) +
                     "\nelement vertex " + std::to_string(mesh.points_mm.size()) +
                     "\nproperty float x\nproperty float y\nproperty float z\n" +
                     (normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "") + "element face " +
                     std::to_string(mesh.triangles.size()) + "\nproperty list uchar uint vertex_indices\nend_header\n";
  text.reserve(text.size() + mesh.points_mm.size() * (normals ? 24 : 12) + mesh.triangles.size() * 13);
  for (std::size_t p = 0; p < mesh.points_mm.size(); ++p) {
    append(text, mesh.points_mm[p]);
    if (normals) append(text, mesh.normals[p]);
  }
  for (const auto& t : mesh.triangles) {
    append(text, std::uint8_t{3});
    append(text, t);
  }
  return text;
}

std::string obj_text(const TriMesh& mesh) {
  std::string text = "# " + std::string(kSurfaceNote) + "\n";
  const bool normals = mesh.normals.size() == mesh.points_mm.size();
  const auto add = [&](const char* tag, const std::array<float, 3>& v) {
    text += tag;
    for (const float c : v) {
      text += ' ';
      append_number(text, c);
    }
    text += '\n';
  };
  for (const auto& p : mesh.points_mm) add("v", p);
  if (normals) {
    for (const auto& n : mesh.normals) add("vn", n);
  }
  for (const auto& t : mesh.triangles) {
    text += 'f';
    for (const std::uint32_t p : t) {
      text += ' ';
      append_number(text, std::uint64_t{p} + 1);
      if (normals) {
        text += "//";
        append_number(text, std::uint64_t{p} + 1);
      }
    }
    text += '\n';
  }
  return text;
}

std::string glb_text(const TriMesh& mesh) {
  const bool normals = mesh.normals.size() == mesh.points_mm.size();
  std::array<float, 3> lo{}, hi{};
  if (!mesh.points_mm.empty()) lo = hi = mesh.points_mm.front();
  for (const auto& p : mesh.points_mm) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  const std::size_t points = mesh.points_mm.size() * 12, faces = mesh.triangles.size() * 12;
  const std::size_t total = points * (normals ? 2 : 1) + faces;
  if (total > 0xFFFF0000U) throw Error(ExitCode::failed, "the surface is too large for glTF (4 GB)");
  const auto number = [](auto v) {
    std::string t;
    append_number(t, v);
    return t;
  };
  const auto triple = [&](const std::array<float, 3>& v) {
    return "[" + number(v[0]) + "," + number(v[1]) + "," + number(v[2]) + "]";
  };
  const auto count = [&](std::size_t n) { return number(static_cast<std::uint64_t>(n)); };
  std::string json =
      R"({"asset":{"version":"2.0","generator":"Osteotome","extras":{"frame_of_points":"LPS mm","turned_by_node":"metres, x left, y head, z front"}},)";
  json +=
      R"("scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"name":"bone","matrix":[0.001,0,0,0,0,0,-0.001,0,0,0.001,0,0,0,0,0,1]}],)";
  json +=
      R"("materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.89,0.85,0.76,1],"metallicFactor":0,"roughnessFactor":0.8}}],)";
  json += R"("meshes":[{"primitives":[{"attributes":{"POSITION":0)" + std::string(normals ? R"(,"NORMAL":2)" : "") +
          R"(},"indices":1,"material":0}]}],)";
  json += R"("accessors":[{"bufferView":0,"componentType":5126,"count":)" + count(mesh.points_mm.size()) +
          R"(,"type":"VEC3","min":)" + triple(lo) + R"(,"max":)" + triple(hi) +
          R"(},{"bufferView":1,"componentType":5125,"count":)" + count(mesh.triangles.size() * 3) +
          R"(,"type":"SCALAR"})";
  if (normals)
    json += R"(,{"bufferView":2,"componentType":5126,"count":)" + count(mesh.normals.size()) + R"(,"type":"VEC3"})";
  json += R"(],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" + count(points) +
          R"(,"target":34962},{"buffer":0,"byteOffset":)" + count(points) + R"(,"byteLength":)" + count(faces) +
          R"(,"target":34963})";
  if (normals)
    json += R"(,{"buffer":0,"byteOffset":)" + count(points + faces) + R"(,"byteLength":)" + count(points) +
            R"(,"target":34962})";
  json += R"(],"buffers":[{"byteLength":)" + count(total) + "}]}";
  while (json.size() % 4 != 0) json += ' ';

  std::string text = "glTF";
  append(text, std::uint32_t{2});
  append(text, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + total));
  append(text, static_cast<std::uint32_t>(json.size()));
  text += "JSON";
  text += json;
  append(text, static_cast<std::uint32_t>(total));
  text.append("BIN\0", 4);
  text.reserve(text.size() + total);
  for (const auto& p : mesh.points_mm) append(text, p);
  for (const auto& t : mesh.triangles) append(text, t);
  if (normals) {
    for (const auto& n : mesh.normals) append(text, n);
  }
  return text;
}

void write_3mf(const TriMesh& mesh, const std::filesystem::path& to, const std::filesystem::path& shown) {
  std::string model =
      R"(<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<metadata name="Application">Osteotome</metadata><metadata name="Description">Bone; LPS; mm</metadata>
<resources><object id="1" type="model"><mesh><vertices>
)";
  model.reserve(model.size() + mesh.points_mm.size() * 60 + mesh.triangles.size() * 50);
  for (const auto& p : mesh.points_mm) {
    model += "<vertex x=\"";
    append_number(model, p[0]);
    model += "\" y=\"";
    append_number(model, p[1]);
    model += "\" z=\"";
    append_number(model, p[2]);
    model += "\"/>\n";
  }
  model += "</vertices><triangles>\n";
  for (const auto& t : mesh.triangles) {
    model += "<triangle v1=\"";
    append_number(model, std::uint64_t{t[0]});
    model += "\" v2=\"";
    append_number(model, std::uint64_t{t[1]});
    model += "\" v3=\"";
    append_number(model, std::uint64_t{t[2]});
    model += "\"/>\n";
  }
  model += "</triangles></mesh></object></resources><build><item objectid=\"1\"/></build></model>\n";

  const std::unique_ptr<archive, decltype(&archive_write_free)> out(archive_write_new(), &archive_write_free);
  const auto fail = [&] {
    const char* const why = archive_error_string(out.get());
    return Error(ExitCode::cannot_write,
                 "cannot write '" + shown.string() + "': " + (why != nullptr ? why : "the file is incomplete"),
                 "see that the disk has room");
  };
  archive_write_set_format_zip(out.get());
  if (archive_write_open_filename(out.get(), to.c_str()) != ARCHIVE_OK) throw fail();
  const auto add = [&](const char* name, const std::string& content) {
    const std::unique_ptr<archive_entry, decltype(&archive_entry_free)> entry(archive_entry_new(), &archive_entry_free);
    archive_entry_set_pathname(entry.get(), name);
    archive_entry_set_size(entry.get(), static_cast<la_int64_t>(content.size()));
    archive_entry_set_filetype(entry.get(), AE_IFREG);
    archive_entry_set_perm(entry.get(), 0644);
    archive_entry_set_mtime(entry.get(), 315532800, 0);  // the first day of zip: the same surface, the same bytes
    if (archive_write_header(out.get(), entry.get()) != ARCHIVE_OK) throw fail();
    if (archive_write_data(out.get(), content.data(), content.size()) != static_cast<la_ssize_t>(content.size()))
      throw fail();
  };
  add("[Content_Types].xml",
      R"(<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>
)");
  add("_rels/.rels",
      R"(<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>
)");
  add("3D/3dmodel.model", model);
  if (archive_write_close(out.get()) != ARCHIVE_OK) throw fail();
}

}  // namespace io
}  // namespace osteo::inline imaging
