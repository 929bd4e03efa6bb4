// What flows between stages: one of a few kinds of value.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "osteo/core/data/sparse_grid.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/core/data/tri_mesh.h"
#include "osteo/core/data/volume.h"

namespace osteo {

/// A file or folder that a stage reads itself.
struct Source {
  std::filesystem::path path;
};

/// RGB, 8 bits, top row first.
struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Findings in JSON, for programs as well as people.
struct Document {
  std::string json;
};

/// std::monostate stands for an optional input that was not given.
using Data = std::variant<std::monostate, Source, Image, Labels, SparseGrid, Surface, Picture, Document, Tets>;

/// In the order of the alternatives of Data.
enum class DataKind : int { none, source, image, labels, grid, surface, picture, document, tets };

[[nodiscard]] inline DataKind kind_of(const Data& data) {
  return static_cast<DataKind>(data.index());
}
[[nodiscard]] constexpr std::string_view kind_name(DataKind kind) {
  constexpr std::string_view names[] = {"none",    "source",  "image",    "labels", "grid",
                                        "surface", "picture", "document", "tets"};
  return names[static_cast<int>(kind)];
}

}  // namespace osteo
