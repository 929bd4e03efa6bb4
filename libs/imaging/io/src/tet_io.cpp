#include "osteo/imaging/io/tet_io.h"

#include <vtkCellArray.h>
#include <vtkCellType.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <charconv>
#include <cmath>
#include <string>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/imaging/io/inp_io.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline imaging {
namespace {

std::string suffix_of(const fs::path& path) {
  return lower_case(path.extension().string());
}

void turn_round(TetMesh& mesh) {
  for (auto& t : mesh.tets) {
    const auto p = [&](std::size_t i) {
      const auto& v = mesh.points_mm[t[i]];
      return Vec3{v[0], v[1], v[2]};
    };
    if (dot(cross(p(1) - p(0), p(2) - p(0)), p(3) - p(0)) < 0) std::swap(t[2], t[3]);
  }
}

std::string text_of(const fs::path& path) {
  const std::vector<std::byte> bytes = read_file(path);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// The numbers of TetGen's text files, line by line; what follows '#' is comment.
class Lines {
 public:
  explicit Lines(fs::path path) : path_(std::move(path)), text_(text_of(path_)) {}
  // The next line that holds numbers; at least `wanted` of them.
  std::vector<double> next(std::size_t wanted, const char* what) {
    std::vector<double> numbers;
    while (numbers.empty()) {
      if (at_ >= text_.size()) throw fail(std::string("ends before ") + what);
      ++line_;
      std::size_t end = text_.find('\n', at_);
      if (end == std::string::npos) end = text_.size();
      const std::size_t stop = std::min(end, text_.find('#', at_));
      const char* p = text_.data() + at_;
      const char* const last = text_.data() + stop;
      while (true) {
        while (p < last && (*p == ' ' || *p == '\t' || *p == '\r' || *p == ',')) ++p;
        if (p >= last) break;
        double value = 0;
        const auto [after, problem] = std::from_chars(p + (*p == '+' ? 1 : 0), last, value);
        if (problem != std::errc()) throw fail("'" + std::string(p, std::min(last, p + 20)) + "' is no number");
        numbers.push_back(value);
        p = after;
      }
      at_ = end + 1;
    }
    if (numbers.size() < wanted)
      throw fail("holds " + std::to_string(numbers.size()) + " numbers where " + what + " has " +
                 std::to_string(wanted));
    return numbers;
  }
  [[nodiscard]] Error fail(const std::string& what) const {
    return {ExitCode::corrupt, "'" + path_.string() + "', line " + std::to_string(line_) + ": " + what};
  }
  [[nodiscard]] std::size_t bytes() const { return text_.size(); }

 private:
  fs::path path_;
  std::string text_;
  std::size_t at_ = 0, line_ = 0;
};

std::size_t count_of(double value, const Lines& lines, const char* what) {
  // A line of at least two bytes for each, so a count beyond the file's size is damage, not a reason to reserve memory.
  if (!(value >= 0) || value != std::floor(value) || value > static_cast<double>(lines.bytes())) {
    throw lines.fail(std::string("'") + format_number(value) + "' cannot be the number of " + what);
  }
  return static_cast<std::size_t>(value);
}

TetMesh load_tetgen(const fs::path& path) {
  fs::path node = path, ele = path;
  node.replace_extension(".node");
  ele.replace_extension(".ele");
  require_readable(node);
  require_readable(ele);
  TetMesh mesh;
  Lines points(node);
  const auto head = points.next(2, "a header (number of points, dimension)");
  if (head[1] != 3) throw points.fail("the points have dimension " + format_number(head[1]) + ", not 3");
  const std::size_t n = count_of(head[0], points, "points");
  double first = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto v = points.next(4, "a point");
    if (i == 0) first = v[0];
    if (v[0] != first + static_cast<double>(i)) throw points.fail("point " + format_number(v[0]) + " is out of order");
    for (std::size_t a = 1; a < 4; ++a) {
      if (!std::isfinite(v[a]) || std::abs(v[a]) > 3e38) throw points.fail("a coordinate is no finite number");
    }
    mesh.points_mm.push_back({static_cast<float>(v[1]), static_cast<float>(v[2]), static_cast<float>(v[3])});
  }
  Lines cells(ele);
  const auto cell_head = cells.next(2, "a header (number of tetrahedra, points each)");
  const std::size_t m = count_of(cell_head[0], cells, "tetrahedra");
  for (std::size_t i = 0; i < m; ++i) {
    const auto v = cells.next(5, "a tetrahedron");
    std::array<std::uint32_t, 4> t{};
    for (std::size_t k = 0; k < 4; ++k) {
      const double id = v[k + 1] - first;
      if (!(id >= 0) || id >= static_cast<double>(n) || id != std::floor(id))
        throw cells.fail("there is no point " + format_number(v[k + 1]));
      t[k] = static_cast<std::uint32_t>(id);
    }
    mesh.tets.push_back(t);
  }
  return mesh;
}

TetMesh load_vtu(const fs::path& path) {
  const QuietVtk quiet;
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  if (reader->GetErrorCode() != 0 || !quiet.first_message().empty()) {
    throw Error(ExitCode::corrupt, "'" + path.string() + "' cannot be read: " + quiet.first_message());
  }
  try {
    return tets_from_vtk(reader->GetOutput());
  } catch (const Error& error) {
    throw error.in("'" + path.string() + "'");
  }
}

// Corners are what a mesh is made of here: points that are only in the middle of edges are left out.
void drop_middles(TetMesh& mesh, std::vector<bool> middle) {
  for (const auto& t : mesh.tets) {
    for (const std::uint32_t p : t) middle[p] = false;
  }
  std::vector<std::uint32_t> place(mesh.points_mm.size());
  std::uint32_t kept = 0;
  for (std::size_t p = 0; p < place.size(); ++p) {
    place[p] = kept;
    if (middle[p]) continue;
    mesh.points_mm[kept] = mesh.points_mm[p];
    if (!mesh.values.empty()) mesh.values[kept] = mesh.values[p];
    ++kept;
  }
  mesh.points_mm.resize(kept);
  if (!mesh.values.empty()) mesh.values.resize(kept);
  for (auto& t : mesh.tets) {
    for (std::uint32_t& p : t) p = place[p];
  }
}

void append_coordinate(std::string& text, float v) {
  char buffer[32];
  const auto [end, problem] = std::to_chars(buffer, buffer + sizeof buffer, v);
  (void)problem;
  text.append(buffer, end);
}

}  // namespace

bool is_tet_file(const fs::path& path) {
  const std::string s = suffix_of(path);
  return s == ".vtu" || s == ".node" || s == ".ele" || s == ".inp";
}

Tets load_tets(const fs::path& path) {
  require_readable(path);
  const std::string s = suffix_of(path);
  auto mesh = std::make_shared<TetMesh>(s == ".vtu"   ? load_vtu(path)
                                        : s == ".inp" ? parse_inp(text_of(path), path.string()).mesh
                                                      : load_tetgen(path));
  if (mesh->tets.empty()) throw Error(ExitCode::corrupt, "'" + path.string() + "' holds no tetrahedra");
  turn_round(*mesh);
  return mesh;
}

TetMesh tets_from_vtk(vtkUnstructuredGrid* grid) {
  TetMesh mesh;
  for (vtkIdType i = 0; i < grid->GetNumberOfPoints(); ++i) {
    double x[3];
    grid->GetPoint(i, x);
    for (const double v : x) {
      if (!std::isfinite(v))
        throw Error(ExitCode::corrupt, "point " + std::to_string(i) + " has a coordinate that is no finite number");
    }
    mesh.points_mm.push_back({static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2])});
  }
  vtkNew<vtkIdList> ids;
  std::vector<bool> middle(mesh.points_mm.size());
  bool quadratic = false;
  for (vtkIdType c = 0; c < grid->GetNumberOfCells(); ++c) {
    grid->GetCellPoints(c, ids);
    const bool ten = grid->GetCellType(c) == VTK_QUADRATIC_TETRA && ids->GetNumberOfIds() == 10;
    if (!ten && (grid->GetCellType(c) != VTK_TETRA || ids->GetNumberOfIds() != 4)) {
      throw Error(ExitCode::corrupt, "cell " + std::to_string(c) + " is no tetrahedron");
    }
    quadratic = quadratic || ten;
    for (vtkIdType k = 4; k < ids->GetNumberOfIds(); ++k) {
      const vtkIdType id = ids->GetId(k);
      if (id >= 0 && id < grid->GetNumberOfPoints()) middle[static_cast<std::size_t>(id)] = true;
    }
    std::array<std::uint32_t, 4> t{};
    for (int k = 0; k < 4; ++k) {
      const vtkIdType id = ids->GetId(k);
      if (id < 0 || id >= grid->GetNumberOfPoints()) {
        throw Error(ExitCode::corrupt,
                    "cell " + std::to_string(c) + " names point " + std::to_string(id) + ", which is not there");
      }
      t[static_cast<std::size_t>(k)] = static_cast<std::uint32_t>(id);
    }
    mesh.tets.push_back(t);
  }
  if (vtkDataArray* const values = grid->GetPointData()->GetScalars();
      values != nullptr && values->GetNumberOfComponents() == 1 && values->GetName() != nullptr) {
    mesh.values_name = values->GetName();
    for (vtkIdType i = 0; i < values->GetNumberOfTuples(); ++i)
      mesh.values.push_back(static_cast<float>(values->GetComponent(i, 0)));
  }
  if (quadratic) drop_middles(mesh, middle);
  turn_round(mesh);
  return mesh;
}

vtkSmartPointer<vtkUnstructuredGrid> to_vtk(const TetMesh& mesh) {
  vtkNew<vtkFloatArray> xyz;
  xyz->SetNumberOfComponents(3);
  xyz->SetNumberOfTuples(static_cast<vtkIdType>(mesh.points_mm.size()));
  std::copy_n(mesh.points_mm.data()->data(), mesh.points_mm.size() * 3, xyz->GetPointer(0));
  vtkNew<vtkPoints> points;
  points->SetData(xyz);
  vtkNew<vtkCellArray> cells;
  cells->AllocateExact(static_cast<vtkIdType>(mesh.tets.size()), static_cast<vtkIdType>(mesh.tets.size() * 4));
  for (const auto& t : mesh.tets) {
    const vtkIdType ids[4] = {t[0], t[1], t[2], t[3]};
    cells->InsertNextCell(4, ids);
  }
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  grid->SetPoints(points);
  grid->SetCells(VTK_TETRA, cells);
  if (!mesh.values.empty()) {
    vtkNew<vtkFloatArray> values;
    values->SetName(mesh.values_name.c_str());
    values->SetNumberOfTuples(static_cast<vtkIdType>(mesh.values.size()));
    std::copy(mesh.values.begin(), mesh.values.end(), values->GetPointer(0));
    grid->GetPointData()->SetScalars(values);
  }
  return grid;
}

void save_tets(const TetMesh& mesh, const fs::path& path) {
  require_sound(mesh);
  const std::string s = suffix_of(path);
  if (s == ".vtu") {
    write_atomically(path, [&](const fs::path& temporary) {
      const QuietVtk quiet;
      vtkNew<vtkXMLUnstructuredGridWriter> writer;
      writer->SetFileName(temporary.c_str());
      writer->SetInputData(to_vtk(mesh));
      if (writer->Write() == 0 || writer->GetErrorCode() != 0) throw vtk_write_error(path, writer->GetErrorCode());
    });
    return;
  }
  if (s != ".node" && s != ".ele") {
    throw Error(ExitCode::usage, "cannot write tetrahedra as '" + path.filename().string() + "'",
                "name it .vtu, .node or .ele; fem writes .inp with a problem in it (--inp-out)");
  }
  fs::path node = path, ele = path;
  node.replace_extension(".node");
  ele.replace_extension(".ele");
  std::string text = std::to_string(mesh.points_mm.size()) + " 3 0 0\n";
  for (std::size_t i = 0; i < mesh.points_mm.size(); ++i) {
    text += std::to_string(i);
    for (const float v : mesh.points_mm[i]) {
      text += ' ';
      append_coordinate(text, v);
    }
    text += '\n';
  }
  write_file(node, text);
  text = std::to_string(mesh.tets.size()) + " 4 0\n";
  for (std::size_t i = 0; i < mesh.tets.size(); ++i) {
    text += std::to_string(i);
    for (const auto v : mesh.tets[i]) text += ' ' + std::to_string(v);
    text += '\n';
  }
  write_file(ele, text);
}

}  // namespace osteo::inline imaging
