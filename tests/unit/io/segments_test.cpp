// Segments of 3D Slicer, one by one. Files as Slicer writes them: tests/readers/check_slicer.py.
#include "osteo/imaging/io/segments.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/io/volume_io.h"

namespace osteo {
namespace {

Labels two_boxes() {
  Labels labels;
  labels.frame.dims = {9, 8, 7};
  labels.frame.spacing_mm = {0.5, 0.6, 0.7};
  labels.frame.origin_mm = {10, -20, 30};
  auto voxels = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  std::fill_n(voxels.get(), labels.frame.voxel_count(), std::uint8_t{0});
  labels.voxels = voxels;
  for (int k = 2; k < 5; ++k) voxels[labels.offset(1, 6, k)] = 3;
  voxels[labels.offset(8, 7, 6)] = 200;
  labels.structures = {{3, "facial nerve", {244, 214, 49}}, {200, "a|b: c", {1, 2, 3}}, {9, "nowhere", {5, 5, 5}}};
  return labels;
}

TEST(Segments, ComeBackInTheirBoxesWithTheirTags) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "s.seg.nrrd";
  const Labels labels = two_boxes();
  save_segments(labels, file, {{"Osteotome.Scan", "0123"}});
  const std::vector<Segment> s = load_segments(file);
  ASSERT_EQ(s.size(), 3u);
  EXPECT_EQ(s[0].name, "facial nerve");
  EXPECT_EQ(s[0].tags.at("Osteotome.Scan"), "0123");
  EXPECT_EQ(s[0].tags.at(std::string(kStructureTag)), "facial nerve");
  ASSERT_TRUE(s[0].mask);
  EXPECT_EQ(s[0].mask->frame.dims, (std::array<int, 3>{1, 1, 3}));
  EXPECT_LT(length(s[0].mask->frame.origin_mm - labels.frame.world_from_index({1, 6, 2})), 1e-9);
  EXPECT_EQ(s[0].rgb, (std::array<std::uint8_t, 3>{244, 214, 49}));
  EXPECT_EQ(s[1].tags.at(std::string(kStructureTag)), "a/b: c");
  ASSERT_TRUE(s[1].mask);
  EXPECT_EQ(s[1].mask->frame.voxel_count(), 1u);
  EXPECT_FALSE(s[2].mask);
  EXPECT_THROW(save_segments(labels, folder.path() / "s.nrrd", {}), Error);
}

TEST(Segments, WhatIsKnownOfTheirBoundariesComesBack) {
  const TemporaryFolder folder;
  Labels labels = two_boxes();
  labels.structures[0].within_mm = 0.6;
  labels.structures[0].doubt = "60 mm3, less than 83";
  labels.structures[1].within_mm = std::numeric_limits<double>::infinity();
  save_labels(labels, folder.path() / "s.seg.nrrd");
  const Labels back = load_labels(folder.path() / "s.seg.nrrd");
  ASSERT_EQ(back.structures.size(), 3U);
  for (const Structure& s : back.structures) {
    EXPECT_EQ(s.within_mm, s.value == 3 ? 0.6 : s.value == 200 ? std::numeric_limits<double>::infinity() : 0) << s.name;
    EXPECT_EQ(s.doubt, s.value == 3 ? "60 mm3, less than 83" : "") << s.name;
  }
  // What is no distance is nothing known.
  for (const char* const text : {"", "-1", "nan", "x", "0"}) {
    Structure s;
    read_certainty({{std::string(kWithinTag), text}}, s);
    EXPECT_EQ(s.within_mm, 0) << text;
  }
}

TEST(Segments, OriginsComeBack) {
  const TemporaryFolder folder;
  Labels labels = two_boxes();
  labels.structures[0].origin = "tube, version 2, corrected by hand";
  save_labels(labels, folder.path() / "s.seg.nrrd");
  const Labels back = load_labels(folder.path() / "s.seg.nrrd");
  ASSERT_EQ(back.structures.size(), labels.structures.size());
  for (const Structure& s : back.structures)
    EXPECT_EQ(s.origin, s.value == 3 ? labels.structures[0].origin : "") << s.name;
}

// Slicer up to 4.11 at least never returns from a list of tags that holds one without a colon.
TEST(Segments, EveryTagHasAColon) {
  const TemporaryFolder folder;
  Labels labels = two_boxes();
  for (const bool named : {true, false}) {
    if (!named) labels.structures.clear();
    save_labels(labels, folder.path() / "s.seg.nrrd");
    const std::string text = read_text(folder.path() / "s.seg.nrrd");
    int seen = 0;
    for (std::size_t at = 0; (at = text.find("_Tags:=", at)) != std::string::npos; ++seen) {
      at += 7;
      const std::string tags = text.substr(at, text.find('\n', at) - at);
      ASSERT_TRUE(tags.ends_with('|'));
      for (std::size_t begin = 0; begin < tags.size(); begin = tags.find('|', begin) + 1)
        EXPECT_LT(tags.find(':', begin), tags.find('|', begin)) << tags;
    }
    EXPECT_EQ(seen, named ? 3 : 2);
  }
}

TEST(Segments, OverlapInLayersAndOldFilesWithoutLayers) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "s.seg.nrrd";
  const auto write = [&](const std::string& keys) {
    std::string text =
        "NRRD0004\ntype: uint8\ndimension: 4\nspace: left-posterior-superior\nsizes: 2 2 2 1\n"
        "space directions: none (1,0,0) (0,1,0) (0,0,1)\nkinds: list domain domain domain\nencoding: raw\nspace "
        "origin: (0,0,0)\n" +
        keys + "\n";
    const char voxels[] = {1, 1, 0, 1, 1, 0, 0, 0};
    text.append(voxels, sizeof voxels);
    write_file(file, text);
  };
  const std::string names = "Segment0_Name:=a\nSegment1_Name:=b\n";
  for (const std::string& layers :
       {std::string(), std::string("Segment0_Layer:=0\nSegment1_Layer:=1\nSegment0_LabelValue:=1\n")}) {
    write(names + layers);
    const auto s = load_segments(file);
    ASSERT_EQ(s.size(), 2u);
    ASSERT_TRUE(s[0].mask && s[1].mask);
    EXPECT_EQ(std::count(s[0].mask->span().begin(), s[0].mask->span().end(), 1), 2);
    EXPECT_EQ(s[0].mask->frame.dims, (std::array<int, 3>{1, 2, 1}));
    EXPECT_EQ(s[1].mask->frame.dims, (std::array<int, 3>{2, 1, 1}));
  }
  write(names + "Segment1_Layer:=7\n");
  EXPECT_THROW(static_cast<void>(load_segments(file)), Error);
  write("");
  EXPECT_THROW(static_cast<void>(load_segments(file)), Error);
}

// Slicer writes one voxel where there is nothing to write.
TEST(Segments, OneVoxelIsNothing) {
  const TemporaryFolder folder;
  write_file(
      folder.path() / "s.seg.nrrd",
      std::string(
          "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 1 1 1\n"
          "space directions: (1,0,0) (0,1,0) (0,0,1)\nencoding: raw\nspace origin: (0,0,0)\nSegment0_Name:=a\n\n\1"));
  const auto s = load_segments(folder.path() / "s.seg.nrrd");
  ASSERT_EQ(s.size(), 1u);
  EXPECT_FALSE(s[0].mask);
}

}  // namespace
}  // namespace osteo
