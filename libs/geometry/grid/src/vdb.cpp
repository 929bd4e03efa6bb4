#include "osteo/geometry/grid/vdb.h"

#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <mutex>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/grid/grid_io.h"

namespace osteo::inline geometry {
namespace grid {

void initialize_vdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

SparseGrid wrap(openvdb::FloatGrid::Ptr vdb, const Frame& frame, std::string name) {
  openvdb::tools::prune(vdb->tree());  // solid bone becomes tiles of 8^3
  SparseGrid result;
  result.name = std::move(name);
  result.frame = frame;
  result.background = static_cast<double>(vdb->background());
  result.active_voxels = vdb->activeVoxelCount();
  result.memory_bytes = vdb->memUsage();
  vdb->setName(result.name);
  result.impl = std::make_shared<SparseGrid::Impl>(SparseGrid::Impl{vdb});
  return result;
}

}  // namespace grid

namespace {

openvdb::math::Transform::Ptr transform_of(const Frame& f) {
  // OpenVDB takes a voxel of less than this volume for none at all.
  const double volume_mm3 = f.spacing_mm[0] * f.spacing_mm[1] * f.spacing_mm[2];
  if (!(volume_mm3 > 3 * openvdb::math::Tolerance<double>::value()))
    throw Error(ExitCode::failed, "a .vdb file cannot hold voxels of " + format_number(f.spacing_mm[0]) + " mm",
                "write .nrrd or .vti, or scale the body: coordinates are in mm");
  // OpenVDB's matrices take row vectors: row a is where index axis a goes.
  openvdb::math::Mat4d m = openvdb::math::Mat4d::identity();
  for (int a = 0; a < 3; ++a) {
    const Vec3 v = f.direction.column[static_cast<std::size_t>(a)] * f.spacing_mm[static_cast<std::size_t>(a)];
    m(a, 0) = v.x;
    m(a, 1) = v.y;
    m(a, 2) = v.z;
  }
  m(3, 0) = f.origin_mm.x;
  m(3, 1) = f.origin_mm.y;
  m(3, 2) = f.origin_mm.z;
  return openvdb::math::Transform::createLinearTransform(m);
}

Frame frame_of(const openvdb::FloatGrid& grid) {
  Frame f;
  const auto m = grid.transform().baseMap()->getAffineMap()->getMat4();
  for (int a = 0; a < 3; ++a) {
    const Vec3 v{m(a, 0), m(a, 1), m(a, 2)};
    f.spacing_mm[static_cast<std::size_t>(a)] = length(v);
    f.direction.column[static_cast<std::size_t>(a)] = normalized(v);
  }
  f.origin_mm = {m(3, 0), m(3, 1), m(3, 2)};
  const auto box = grid.evalActiveVoxelBoundingBox();
  for (int a = 0; a < 3; ++a)
    f.dims[static_cast<std::size_t>(a)] = std::min(box.max()[a], std::numeric_limits<int>::max() - 1) + 1;
  if (const auto meta = grid.getMetadata<openvdb::Vec3IMetadata>("osteo_dims")) {
    for (int a = 0; a < 3; ++a) f.dims[static_cast<std::size_t>(a)] = meta->value()[a];
  }
  return f;
}

}  // namespace

BrickGrid to_bricks(const SparseGrid& sparse, bool all) {
  const openvdb::FloatTree& stored = sparse.impl->grid->tree();
  // Before a tile becomes voxels: one of 4096^3 takes a few bytes in a file.
  std::uint64_t tiles = 0;
  auto tile = stored.cbeginValueOn();
  tile.setMaxDepth(openvdb::FloatTree::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) tiles += tile.getVoxelCount() / BrickGrid::kVoxels;
  if (too_many_bricks(tiles))
    throw Error(ExitCode::corrupt,
                "the sparse grid is solid over " + std::to_string(tiles) + " bricks of 8^3 voxels; " +
                    std::to_string(BrickGrid::kMaxBricks) + " can be numbered",
                "make it with larger voxels, or of a smaller region");
  openvdb::FloatTree tree(stored);
  tree.voxelizeActiveTiles();
  std::vector<Ijk> bricks;
  const auto holds_value = [all](const auto& leaf) {
    if (all) return leaf.cbeginValueOn().test();
    for (auto v = leaf.cbeginValueOn(); v; ++v) {
      if (*v > 0) return true;
    }
    return false;
  };
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    const auto o = leaf->origin();
    if (holds_value(*leaf)) bricks.push_back({o.x() >> 3, o.y() >> 3, o.z() >> 3});
  }
  BrickGrid result(sparse.frame, std::move(bricks));
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    const auto o = leaf->origin();
    const std::uint32_t b = result.find_brick(o.x() >> 3, o.y() >> 3, o.z() >> 3);
    if (b == BrickGrid::kNone) continue;
    for (auto v = leaf->cbeginValueOn(); v; ++v) {
      const auto c = v.getCoord();
      result.set(b * BrickGrid::kVoxels + BrickGrid::offset_in_brick(c.x(), c.y(), c.z()), *v);
    }
  }
  return result;
}

SparseGrid to_sparse(const BrickGrid& bricks, const std::string& name) {
  grid::initialize_vdb();
  auto vdb = openvdb::FloatGrid::create(0.0F);
  for (std::uint32_t b = 0; b < bricks.brick_count(); ++b) {
    const Ijk o = bricks.brick_coordinate(b);
    openvdb::FloatTree::LeafNodeType* leaf = nullptr;
    for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v) {
      const float value = bricks.value(b * BrickGrid::kVoxels + v);
      if (value == 0) continue;
      const openvdb::Coord c(o.i * 8 + static_cast<int>(v & 7), o.j * 8 + static_cast<int>(v >> 3 & 7),
                             o.k * 8 + static_cast<int>(v >> 6));
      if (leaf == nullptr) leaf = vdb->tree().touchLeaf(c);
      leaf->setValueOn(c, value);
    }
  }
  return grid::wrap(vdb, bricks.frame(), name);
}

namespace {

// OpenVDB gives each file a random UUID; ours follows from the content, so that the same grid is the same bytes.
void make_uuid_of_content(const fs::path& path) {
  constexpr std::size_t kAt = 21, kLength = 36;  // after magic, versions and the offsets flag; 8-4-4-4-12 hex digits
  std::string bytes = read_text(path);
  if (bytes.size() < kAt + kLength || bytes[kAt + 8] != '-' || bytes[kAt + 23] != '-') return;
  bytes.replace(kAt, kLength, kLength, '0');
  std::string uuid = hash_text(bytes);
  for (const std::size_t dash : {8, 13, 18, 23}) uuid.insert(dash, "-");
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(kAt));
  file.write(uuid.data(), static_cast<std::streamsize>(kLength));
}

// OpenVDB does not report a short write. Its last act is to go back and write where the grid ends: a file that is not
// as long as that, or has nothing there, was cut. (Reading it back would tell as well, for as much memory as the grid
// takes.)
bool is_complete(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  const auto skip_text = [&] {
    std::int32_t length = -1;
    file.read(reinterpret_cast<char*>(&length), sizeof length);
    file.seekg(length, std::ios::cur);
    return file.good() && length >= 0;
  };
  file.seekg(21 + 36 + 4 + 4);  // magic, versions, flag; UUID; no metadata of the file; number of grids
  // Names of the grid, its type, its instance parent; then where the grid begins, its blocks, its end.
  if (!skip_text() || !skip_text() || !skip_text()) return false;
  std::array<std::int64_t, 3> at{};
  file.read(reinterpret_cast<char*>(at.data()), sizeof at);
  std::error_code ec;
  return file.good() && at[2] > 0 && static_cast<std::uintmax_t>(at[2]) == fs::file_size(path, ec) && !ec;
}

}  // namespace

void save_grid(const SparseGrid& sparse, const fs::path& path) {
  if (path.extension() != ".vdb")
    throw Error(ExitCode::usage, "cannot write a sparse grid as '" + path.filename().string() + "'", "name it .vdb");
  grid::initialize_vdb();
  const auto copy = std::const_pointer_cast<openvdb::FloatGrid>(sparse.impl->grid)->copy();  // shares the tree
  copy->setTransform(transform_of(sparse.frame));
  copy->setName(sparse.name);
  const auto& d = sparse.frame.dims;
  copy->insertMeta("osteo_dims", openvdb::Vec3IMetadata(openvdb::Vec3I(d[0], d[1], d[2])));
  copy->insertMeta("space", openvdb::StringMetadata("LPS mm"));
  write_atomically(path, [&](const fs::path& temporary) {
    try {
      openvdb::io::File file(temporary.string());
      // OpenVDB packs each block twice, once to know how long it gets. Blosc takes an eighth of zip's time for a fifth
      // more bytes of bone.
      const bool blosc = openvdb::io::Archive::hasBloscCompression();
      file.setCompression((blosc ? openvdb::io::COMPRESS_BLOSC : openvdb::io::COMPRESS_ZIP) |
                          openvdb::io::COMPRESS_ACTIVE_MASK);
      file.write({copy}, openvdb::MetaMap());
      file.close();
    } catch (const openvdb::Exception& e) {
      throw Error(ExitCode::cannot_write, "cannot write '" + path.string() + "': " + e.what(),
                  "see that the disk has room");
    }
    make_uuid_of_content(temporary);
    if (!is_complete(temporary)) {
      throw Error(ExitCode::cannot_write, "cannot write '" + path.string() + "': the file is incomplete",
                  "free some space, or write to another disk");
    }
  });
}

SparseGrid load_grid(const fs::path& path) {
  require_readable(path);
  grid::initialize_vdb();
  try {
    openvdb::io::File file(path.string());
    file.open(false);
    for (auto name = file.beginName(); name != file.endName(); ++name) {
      const auto base = file.readGrid(name.gridName());
      const auto floats = openvdb::gridPtrCast<openvdb::FloatGrid>(base);
      if (!floats) continue;
      Frame frame = frame_of(*floats);
      require_valid(frame);
      return grid::wrap(floats, frame, floats->getName());
    }
    throw Error(ExitCode::corrupt, "'" + path.string() + "' holds no grid of floats");
  } catch (const openvdb::Exception& e) {
    throw Error(ExitCode::corrupt, "'" + path.string() + "' cannot be read as OpenVDB: " + e.what(),
                "the file may be cut short; make it again");
  } catch (const std::bad_alloc&) {
    // OpenVDB takes lengths from a cut file as they come.
    throw Error(ExitCode::corrupt,
                "'" + path.string() + "' cannot be read as OpenVDB: it asks for more memory than there is",
                "the file may be cut short; make it again");
  }
}

}  // namespace osteo::inline geometry
