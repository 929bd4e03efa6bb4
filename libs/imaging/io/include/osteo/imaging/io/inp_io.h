// Input files of Abaqus and CalculiX (.inp), as far as bodies of tetrahedra need them.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "osteo/core/data/tet_mesh.h"

namespace osteo::inline imaging {

/// A line that begins with '*', and the lines of data under it. Names and options are upper case, without blanks at
/// their ends.
struct InpCard {
  std::string name;                            ///< like "SOLID SECTION"
  std::map<std::string, std::string> options;  ///< like MATERIAL -> M1; without a value: empty
  std::vector<std::vector<std::string>> rows;  ///< fields between commas
  std::size_t line = 0;                        ///< of the file, from 1
};

/// C3D4 and C3D10 elements; of the latter the corners make the mesh. Points keep the order of *NODE, those that no
/// element has are left out.
struct InpFile {
  TetMesh mesh;
  bool quadratic = false;
  std::unordered_map<long, std::uint32_t> point_of;  ///< number of a node -> corner
  std::unordered_map<long, std::array<std::uint32_t, 2>>
      middle_of;                                   ///< number of a node -> the corners it lies between
  std::unordered_map<long, std::uint32_t> tet_of;  ///< number of an element -> tetrahedron
  std::unordered_map<long, std::array<std::uint32_t, 4>>
      corners_of;  ///< number of an element -> its corners in the file's order
  std::map<std::string, std::vector<long>> node_sets,
      element_sets;            ///< *NSET, *ELSET (GENERATE too), and those named at *NODE, *ELEMENT
  std::vector<InpCard> cards;  ///< all others, in their order
};

/// A field as a finite number; nothing when it is none.
[[nodiscard]] std::optional<double> inp_number(std::string_view field);

/// Errors: corrupt, with `name` and line: what is no number, elements of other kinds, nodes that are not there;
/// *INCLUDE and parts with instances are rejected.
[[nodiscard]] InpFile parse_inp(std::string_view text, const std::string& name);

}  // namespace osteo::inline imaging
