// OpenVDB behind SparseGrid: for source files that make or read its trees themselves, never for a header.
#pragma once
#include <openvdb/openvdb.h>

#include "osteo/core/data/sparse_grid.h"

namespace osteo {

struct SparseGrid::Impl {
  openvdb::FloatGrid::ConstPtr grid;
};

inline namespace geometry {
namespace grid {
void initialize_vdb();
/// Prunes, and fills in the summary. The grid's tree index is the index of `frame`.
[[nodiscard]] SparseGrid wrap(openvdb::FloatGrid::Ptr vdb, const Frame& frame, std::string name);
}  // namespace grid
}  // namespace geometry

}  // namespace osteo
