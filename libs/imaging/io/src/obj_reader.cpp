#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>

#include <charconv>
#include <string>
#include <string_view>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "surface_text.h"

namespace osteo::inline imaging::io {

// Points and faces only. VTK's reader doubles points that carry several normals, which opens a closed surface.
vtkSmartPointer<vtkPolyData> read_obj(const fs::path& path) {
  const std::vector<std::byte> bytes = read_file(path);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> faces;
  std::vector<vtkIdType> face;
  std::size_t line = 0;
  const auto fail = [&](const std::string& what) {
    return Error(ExitCode::corrupt, "'" + path.string() + "', line " + std::to_string(line) + ": " + what);
  };
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = text.find('\n', at);
    if (end == std::string_view::npos) end = text.size();
    const char* p = text.data() + at;
    const char* const last = text.data() + end;
    at = end + 1;
    ++line;
    const auto skip = [&] {
      while (p < last && (*p == ' ' || *p == '\t' || *p == '\r')) ++p;
    };
    skip();
    if (last - p < 2 || (p[1] != ' ' && p[1] != '\t')) continue;
    if (*p == 'v') {
      ++p;
      double x[3];
      for (double& v : x) {
        skip();
        const auto [next, problem] = std::from_chars(p, last, v);
        if (problem != std::errc()) throw fail("a point needs three numbers");
        p = next;
      }
      points->InsertNextPoint(x);
    } else if (*p == 'f') {
      ++p;
      face.clear();
      for (skip(); p < last; skip()) {
        long id = 0;
        const auto [next, problem] = std::from_chars(p, last, id);
        if (problem != std::errc()) throw fail("a face needs the numbers of its points");
        // From 1, or from the end when negative.
        const long place = id > 0 ? id - 1 : points->GetNumberOfPoints() + id;
        if (place < 0 || place >= points->GetNumberOfPoints())
          throw fail("there is no point " + std::to_string(id) + " yet");
        face.push_back(place);
        p = next;
        while (p < last && *p != ' ' && *p != '\t' && *p != '\r') ++p;  // texture and normal
      }
      if (face.size() < 3) throw fail("a face needs three points or more");
      faces->InsertNextCell(static_cast<vtkIdType>(face.size()), face.data());
    }
  }
  auto poly = vtkSmartPointer<vtkPolyData>::New();
  poly->SetPoints(points);
  poly->SetPolys(faces);
  return poly;
}

}  // namespace osteo::inline imaging::io
