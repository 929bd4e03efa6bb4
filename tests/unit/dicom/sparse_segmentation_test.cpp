// Segmentations that leave out empty frames, as PS3.3 A.51 allows: where their frames lie, and what they hold together.
#include <dcmtk/dcmdata/dctk.h>

#include <numeric>
#include <random>

#include "edit.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/dicom/objects.h"

namespace osteo {
namespace {

using test::put;
using test::scratch;

constexpr int kColumns = 21, kRows = 19;  // frames of bits that end within a byte

Frame stack(double pitch_mm, bool oblique = false) {
  Frame f;
  f.dims = {kColumns, kRows, 24};
  f.spacing_mm = {0.4, 0.5, pitch_mm};
  f.origin_mm = {-12, 33.5, 101};
  if (oblique) {
    const Vec3 u = normalized({1, 0.2, -0.1}), w = normalized(cross(u, {0.05, 1, 0.3}));
    f.direction = {{u, cross(w, u), w}};
  }
  return f;
}

// A disc in some layers, its size by the layer, so that no two layers are alike.
Labels painted(const Frame& f, const std::vector<std::pair<int, std::uint8_t>>& layers) {
  const auto v = make_voxels<std::uint8_t>(f.voxel_count());
  std::fill_n(v.get(), f.voxel_count(), std::uint8_t{0});
  Labels labels{{f, v}, {}};
  for (const auto& [k, value] : layers) {
    for (int j = 0; j < kRows; ++j)
      for (int i = 0; i < kColumns; ++i)
        if (std::hypot(i - 9 - value, j - 8) < 3 + 0.2 * k) v[labels.offset(i, j, k)] = value;
  }
  return labels;
}

std::vector<std::size_t> voxels_by_value(const Labels& l) {
  std::vector<std::size_t> n(4);
  for (const auto v : l.span()) ++n.at(v);
  return n;
}

void expect_same_structures(const Labels& wanted, const Labels& got) {
  EXPECT_NEAR(got.frame.voxel_volume_mm3(), wanted.frame.voxel_volume_mm3(), 1e-6);
  const auto a = voxels_by_value(wanted), b = voxels_by_value(got);
  for (std::size_t v = 1; v < a.size(); ++v) EXPECT_EQ(a[v], b[v]) << v;
  for (int k = 0; k < got.frame.dims[2]; ++k)
    for (int j = 0; j < kRows; ++j)
      for (int i = 0; i < kColumns; ++i) {
        const Vec3 at = wanted.frame.index_from_world(got.frame.world_from_index({double(i), double(j), double(k)}));
        const Vec3 near{std::round(at.x), std::round(at.y), std::round(at.z)};
        ASSERT_LT(length(at - near), 1e-3) << k;
        ASSERT_EQ(wanted.at(int(near.x), int(near.y), int(near.z)), got.at(i, j, k)) << i << ' ' << j << ' ' << k;
      }
}

// The file with its frames in another order.
void shuffle_frames(const fs::path& path) {
  DcmFileFormat file;
  ASSERT_TRUE(file.loadFile(path.c_str()).good());
  file.loadAllDataIntoMemory();
  DcmDataset& d = *file.getDataset();
  DcmSequenceOfItems* groups = nullptr;
  ASSERT_TRUE(d.findAndGetSequence(DCM_PerFrameFunctionalGroupsSequence, groups).good());
  const auto n = static_cast<std::size_t>(groups->card());
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(4));
  std::vector<DcmItem*> items;
  while (groups->card() > 0) items.push_back(groups->remove(0UL));
  const Uint8* bits = nullptr;
  unsigned long bytes = 0;
  ASSERT_TRUE(d.findAndGetUint8Array(DCM_PixelData, bits, &bytes).good());
  std::vector<Uint8> moved(bytes, 0);
  constexpr std::size_t kArea = kColumns * kRows;
  for (std::size_t f = 0; f < n; ++f) {
    groups->insert(items[order[f]]);
    for (std::size_t p = 0; p < kArea; ++p) {
      const std::size_t from = order[f] * kArea + p, to = f * kArea + p;
      moved[to / 8] = static_cast<Uint8>(moved[to / 8] | (bits[from / 8] >> (from % 8) & 1) << (to % 8));
    }
  }
  ASSERT_TRUE(d.putAndInsertUint8Array(DCM_PixelData, moved.data(), bytes).good());
  ASSERT_TRUE(file.saveFile(path.c_str(), EXS_LittleEndianExplicit).good());
}

// What the shared pixel measures state; empty removes it.
void state(const fs::path& path, const std::string& spacing, const std::string& thickness) {
  DcmFileFormat file;
  ASSERT_TRUE(file.loadFile(path.c_str()).good());
  file.loadAllDataIntoMemory();
  DcmItem *shared = nullptr, *measures = nullptr;
  ASSERT_TRUE(file.getDataset()->findAndGetSequenceItem(DCM_SharedFunctionalGroupsSequence, shared).good());
  ASSERT_TRUE(shared->findAndGetSequenceItem(DCM_PixelMeasuresSequence, measures).good());
  if (spacing.empty()) {
    delete measures->remove(DCM_SpacingBetweenSlices);
  } else {
    put(*measures, DCM_SpacingBetweenSlices, spacing);
  }
  put(*measures, DCM_SliceThickness, thickness);
  ASSERT_TRUE(file.saveFile(path.c_str(), EXS_LittleEndianExplicit).good());
}

struct Loaded {
  Labels labels;
  std::string warned, refused;
};
Loaded load(const fs::path& file) {
  Loaded r;
  Context context;
  context.on_log([&](LogLevel level, std::string_view text) {
    if (level == LogLevel::warning) r.warned += text;
  });
  try {
    r.labels = load_segmentation(file, context);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::corrupt);
    r.refused = e.what();
  }
  return r;
}

// Painted on every n-th slice, as by hand: no two neighbouring slices hold anything.
TEST(SparseSegmentation, AbsentFramesAreEmptyLayers) {
  const fs::path out = scratch("sparse");
  using Layers = std::vector<std::pair<int, std::uint8_t>>;
  for (const bool oblique : {false, true}) {
    for (const double pitch : {0.5, 1.0 / 3}) {
      for (const Layers& layers :
           {Layers{{10, 1}, {13, 1}, {19, 1}},                     // distances with a common part
            Layers{{10, 1}, {12, 1}, {17, 1}},                     // and without
            Layers{{0, 1}, {23, 1}}, Layers{{7, 1}},               // the ends, one alone
            Layers{{3, 1}, {4, 1}, {5, 1}, {9, 1}},                // neighbours and a hole
            Layers{{2, 1}, {8, 2}, {14, 1}, {20, 3}, {22, 2}}}) {  // several segments, none in all
        for (const bool shuffled : {false, true}) {
          SCOPED_TRACE(std::to_string(layers.size()) + " of pitch " + std::to_string(pitch) +
                       (shuffled ? ", shuffled" : "") + (oblique ? ", oblique" : ""));
          const Labels truth = painted(stack(pitch, oblique), layers);
          save_segmentation(truth, out / "a.dcm");
          if (shuffled) shuffle_frames(out / "a.dcm");
          for (const auto form : {SegmentationForm::binary, SegmentationForm::labelmap, SegmentationForm::labelmap16}) {
            if (form != SegmentationForm::binary) save_segmentation(truth, out / "a.dcm", {nullptr, "Bone", form});
            const Loaded r = load(out / "a.dcm");
            ASSERT_EQ(r.refused, "");
            expect_same_structures(truth, r.labels);
          }
        }
      }
    }
  }
}

// Every subset of the slices of a stack of twelve is one of 4095: every 97th of them here, straight and leaning; all of
// them (a minute) with OSTEO_ALL_SUBSETS in the environment.
TEST(SparseSegmentation, EverySubsetOfTwelveSlicesComesBack) {
  const fs::path file = scratch("sparse-subsets") / "a.dcm";
  const int step = std::getenv("OSTEO_ALL_SUBSETS") != nullptr ? 1 : 97;
  for (const bool oblique : {false, true}) {
    for (int subset = 1 + (oblique ? step / 2 : 0); subset < 1 << 12; subset += step) {
      const auto form = static_cast<SegmentationForm>(subset % 3);
      SCOPED_TRACE(std::to_string(subset) + (oblique ? " oblique" : "") + " form " + std::to_string(subset % 3));
      std::vector<std::pair<int, std::uint8_t>> layers;
      for (int k = 0; k < 12; ++k)
        if ((subset >> k & 1) != 0)
          layers.emplace_back(k, static_cast<std::uint8_t>(1 + layers.size() % 2));  // 1 is always there
      const Labels truth = painted(stack(1.0 / 3, oblique), layers);
      save_segmentation(truth, file, {nullptr, "Bone", form});
      const Loaded r = load(file);
      ASSERT_EQ(r.refused, "");
      expect_same_structures(truth, r.labels);
    }
  }
}

TEST(SparseSegmentation, SaysWhatItsVolumeDependsOn) {
  const fs::path file = scratch("sparse-words") / "a.dcm";
  save_segmentation(painted(stack(0.5), {{10, 1}, {13, 1}, {19, 1}}), file);
  EXPECT_NE(load(file).warned.find("no two neighbouring slices"), std::string::npos);
  save_segmentation(painted(stack(0.5), {{10, 1}, {11, 1}, {19, 1}}), file);
  EXPECT_EQ(load(file).warned, "");
}

TEST(SparseSegmentation, WithoutAStatedDistanceThicknessDecides) {
  const fs::path file = scratch("sparse-unstated") / "a.dcm";
  const Labels close = painted(stack(0.5), {{10, 1}, {11, 1}, {14, 1}}),
               even = painted(stack(0.5), {{10, 1}, {13, 1}, {19, 1}}),
               odd = painted(stack(0.5), {{10, 1}, {12, 1}, {17, 1}});
  for (const Labels* const l : {&close, &odd}) {
    save_segmentation(*l, file);
    state(file, "", "0.5");
    const Loaded r = load(file);
    ASSERT_EQ(r.refused, "");
    expect_same_structures(*l, r.labels);
  }
  // Three times as far apart as thick: left out, or slices with space between them?
  save_segmentation(even, file);
  state(file, "", "0.5");
  EXPECT_NE(load(file).refused.find("cannot be known"), std::string::npos);
  // As thick as they lie apart: none is left out.
  const Labels wide = painted(stack(1.5), {{10, 1}, {11, 1}, {13, 1}});
  save_segmentation(wide, file);
  state(file, "", "1.5");
  expect_same_structures(wide, load(file).labels);
}

TEST(SparseSegmentation, AWrongStatedDistanceIsTold) {
  const fs::path file = scratch("sparse-wrong") / "a.dcm";
  const Labels truth = painted(stack(0.5), {{10, 1}, {11, 1}, {14, 1}});
  save_segmentation(truth, file);
  for (const char* const wrong : {"3", "0.35", "-0.5"}) {
    SCOPED_TRACE(wrong);
    state(file, wrong, "0.5");
    const Loaded r = load(file);
    ASSERT_EQ(r.refused, "");
    expect_same_structures(truth, r.labels);
    EXPECT_EQ(r.warned.find("positions count") != std::string::npos, std::string(wrong) != "-0.5") << r.warned;
  }
}

}  // namespace
}  // namespace osteo
