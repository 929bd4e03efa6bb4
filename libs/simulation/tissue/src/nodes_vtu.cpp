#include "osteo/simulation/tissue/fem.h"

#include "osteo/core/base/param.h"

namespace osteo::inline simulation {
namespace {

class Text {
 public:
  void line(const std::string& s) { text_ += s + "\n"; }
  // One line an item.
  template <class Item>
  void array(const std::string& type, const std::string& name, int components, std::size_t count, const Item& item) {
    line("<DataArray type=\"" + type + "\" Name=\"" + name + "\"" +
         (components > 1 ? " NumberOfComponents=\"" + std::to_string(components) + "\"" : "") + " format=\"ascii\">");
    for (std::size_t i = 0; i < count; ++i) line(item(i));
    line("</DataArray>");
  }
  std::string text_;
};

std::string three(Vec3 v) {
  return format_number(v.x) + " " + format_number(v.y) + " " + format_number(v.z);
}

}  // namespace

std::string nodes_vtu(const FemBody& body, std::span<const Vec3> x) {
  const std::size_t nodes = body.point_count(), cells = body.tet_count(), per = body.order() == TetOrder::t10 ? 10 : 4;
  Text t;
  t.line("<?xml version=\"1.0\"?>");
  t.line("<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><UnstructuredGrid>");
  t.line("<Piece NumberOfPoints=\"" + std::to_string(nodes) + "\" NumberOfCells=\"" + std::to_string(cells) + "\">");
  t.line("<PointData Vectors=\"displacement_mm\">");
  t.array("Float64", "displacement_mm", 3, nodes, [&](std::size_t p) { return three(x[p] - body.rest()[p]); });
  t.line("</PointData><CellData>");
  const auto material = [&](std::size_t e) -> const Material& {
    return body.materials()[body.materials().size() == 1 ? 0 : e];
  };
  t.array("Float64", "young_mpa", 1, cells, [&](std::size_t e) { return format_number(material(e).young_mpa); });
  t.array("Float64", "poisson", 1, cells, [&](std::size_t e) { return format_number(material(e).poisson); });
  t.line("</CellData><Points>");
  t.array("Float64", "Points", 3, nodes, [&](std::size_t p) { return three(x[p]); });
  t.line("</Points><Cells>");
  t.array("Int64", "connectivity", 1, cells, [&](std::size_t e) {
    std::string row;
    for (const std::uint32_t n : body.nodes(e)) row += std::to_string(n) + " ";
    return row;
  });
  t.array("Int64", "offsets", 1, cells, [&](std::size_t e) { return std::to_string((e + 1) * per); });
  t.array("UInt8", "types", 1, cells, [&](std::size_t) { return per == 4 ? "10" : "24"; });
  t.line("</Cells></Piece></UnstructuredGrid></VTKFile>");
  return std::move(t.text_);
}

}  // namespace osteo::inline simulation
