// Faults of pixels that no tag tells: planted into a series of the phantom, and looked for in real series that have
// none.
#include <algorithm>
#include <fstream>
#include <functional>
#include <random>

#include "edit.h"
#include "folders.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/dicom/detail/verdict_codes.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/dicom/volume.h"
#include "osteo/imaging/io/volume_io.h"

namespace osteo {
namespace {

using test::put;
using test::scratch;
using test::Series;

using Slices = std::vector<std::vector<std::int16_t>>;

constexpr std::array kJudged{
    code::slice_blank, code::slice_part_missing, code::slice_values_step, code::slice_mirrored,
    code::slice_order, code::slice_foreign,      code::slice_repeated,    code::concatenation_incomplete};

std::vector<std::string> judged(const Verdict& v) {
  std::vector<std::string> found;
  for (const Finding& f : v.findings) {
    if (std::find(kJudged.begin(), kJudged.end(), f.code) != kJudged.end()) found.push_back(f.code);
  }
  return found;
}
const Finding& finding(const Verdict& v, std::string_view code) {
  static const Finding none;
  const auto it = std::find_if(v.findings.begin(), v.findings.end(), [&](const Finding& f) { return f.code == code; });
  EXPECT_NE(it, v.findings.end()) << code;
  return it == v.findings.end() ? none : *it;
}

Image phantom(PhantomRegion region, double spacing_mm) {
  PhantomParams p;
  p.region = region;
  p.spacing_mm = spacing_mm;
  p.noise_hu = 0;
  return make_phantom(p).ct;
}
Image with(const Image& image, const std::function<void(Slices&)>& fault) {
  const std::size_t area =
      static_cast<std::size_t>(image.frame.dims[0]) * static_cast<std::size_t>(image.frame.dims[1]);
  Slices slices;
  for (int k = 0; k < image.frame.dims[2]; ++k) {
    const std::int16_t* const p = image.voxels.get() + static_cast<std::size_t>(k) * area;
    slices.emplace_back(p, p + area);
  }
  fault(slices);
  const auto v = make_voxels<std::int16_t>(image.frame.voxel_count());
  for (std::size_t k = 0; k < slices.size(); ++k) std::copy(slices[k].begin(), slices[k].end(), v.get() + k * area);
  return {image.frame, v};
}
Image noisy(const Image& image, double hu) {
  return with(image, [&](Slices& slices) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal(0, hu);
    for (auto& s : slices)
      for (auto& v : s) v = static_cast<std::int16_t>(std::lround(v + normal(random)));
  });
}

// The phantom is costly to make: once, without noise.
const Image& clean_ear() {
  static const Image image = phantom(PhantomRegion::temporal, 1.25);
  return image;
}
const Image& ear() {
  static const Image image = noisy(clean_ear(), 20);
  return image;
}

void turn_over(std::vector<std::int16_t>& slice, bool up_and_down) {
  const int nx = ear().frame.dims[0], ny = ear().frame.dims[1];
  for (int j = 0; j < ny; ++j) {
    if (!up_and_down) std::reverse(slice.begin() + j * nx, slice.begin() + (j + 1) * nx);
    if (up_and_down && j < ny / 2)
      std::swap_ranges(slice.begin() + j * nx, slice.begin() + (j + 1) * nx, slice.begin() + (ny - 1 - j) * nx);
  }
}

Verdict verdict_of(const Image& image) {
  const fs::path folder = scratch("judged") / "ct";
  save_dicom_series(image, folder);
  return import_ct(folder, {}).verdict;
}

struct Fault {
  const char* name;
  std::string_view code;
  std::function<void(Slices&)> plant;
};

const std::size_t kAt = 27;
std::vector<Fault> faults() {
  const auto last = static_cast<std::size_t>(ear().frame.dims[2] - 1);
  const auto each = [](std::size_t begin, std::size_t end,
                       const std::function<void(std::vector<std::int16_t>&)>& change) {
    return [=](Slices& s) {
      std::for_each(s.begin() + static_cast<std::ptrdiff_t>(begin), s.begin() + static_cast<std::ptrdiff_t>(end),
                    change);
    };
  };
  const auto blank = [](auto& s) { std::fill(s.begin(), s.end(), std::int16_t{-1024}); };
  const auto add = [](int hu) {
    return [=](auto& s) {
      for (auto& v : s) v = static_cast<std::int16_t>(v + hu);
    };
  };
  const auto slope = [](auto& s) {
    for (auto& v : s) v = static_cast<std::int16_t>((v + 1024) * 1.1 - 1024);
  };
  const auto half = [](auto& s) {
    std::fill(s.begin() + static_cast<std::ptrdiff_t>(s.size() / 2), s.end(), std::int16_t{-1024});
  };
  const auto upper_rows = [](auto& s) {
    std::fill(s.begin(), s.begin() + static_cast<std::ptrdiff_t>(s.size() / 3), std::int16_t{-1024});
  };
  const auto left_columns = [](auto& s) {
    const int nx = ear().frame.dims[0];
    for (std::size_t i = 0; i < s.size(); ++i)
      if (static_cast<int>(i) % nx < nx / 2) s[i] = -1024;
  };
  const auto sideways = [](auto& s) { std::rotate(s.begin(), s.begin() + 6, s.end()); };
  const auto swap = [](std::size_t a, std::size_t b) { return [=](Slices& s) { std::swap(s[a], s[b]); }; };
  return {{"one blank", code::slice_blank, each(kAt, kAt + 1, blank)},
          {"three blank", code::slice_blank, each(kAt, kAt + 3, blank)},
          {"blank at the end", code::slice_blank, each(0, 2, blank)},
          {"half", code::slice_part_missing, each(kAt, kAt + 1, half)},
          {"half of two", code::slice_part_missing, each(kAt, kAt + 2, half)},
          {"upper third", code::slice_part_missing, each(kAt, kAt + 1, upper_rows)},
          {"left half", code::slice_part_missing, each(kAt, kAt + 1, left_columns)},
          {"intercept of seven", code::slice_values_step, each(kAt, kAt + 7, add(100))},
          {"intercept of one", code::slice_values_step, each(kAt, kAt + 1, add(-60))},
          {"no intercept", code::slice_values_step, each(kAt, kAt + 7, add(1024))},
          {"intercept to the end", code::slice_values_step, each(kAt, last + 1, add(80))},
          {"slope of seven", code::slice_values_step, each(kAt, kAt + 7, slope)},
          {"neighbours exchanged", code::slice_order, swap(kAt, kAt + 1)},
          {"others exchanged", code::slice_order, swap(kAt, kAt + 8)},
          {"ends exchanged", code::slice_order, swap(0, last)},
          {"ten in reverse order", code::slice_order,
           [](Slices& s) { std::reverse(s.begin() + kAt - 8, s.begin() + kAt + 2); }},
          {"of another place", code::slice_foreign, [](Slices& s) { s[kAt] = s[kAt - 15]; }},
          {"two of another place", code::slice_foreign,
           [](Slices& s) {
             s[kAt] = s[kAt - 15];
             s[kAt + 1] = s[kAt - 14];
           }},
          {"moved sideways", code::slice_foreign, each(kAt, kAt + 1, sideways)},
          {"the same twice", code::slice_repeated, [](Slices& s) { s[kAt] = s[kAt - 1]; }},
          {"one mirrored", code::slice_mirrored, each(kAt, kAt + 1, [](auto& s) { turn_over(s, false); })},
          {"ten mirrored", code::slice_mirrored, each(kAt, kAt + 10, [](auto& s) { turn_over(s, false); })},
          {"the rest mirrored", code::slice_mirrored, each(kAt, last + 1, [](auto& s) { turn_over(s, false); })},
          {"upside down", code::slice_mirrored, each(kAt, kAt + 10, [](auto& s) { turn_over(s, true); })}};
}

TEST(SliceJudge, EachPlantedFaultIsToldAndNothingElse) {
  for (const Fault& f : faults()) {
    SCOPED_TRACE(f.name);
    const Verdict v = verdict_of(with(ear(), f.plant));
    EXPECT_EQ(judged(v), std::vector<std::string>{std::string(f.code)});
    EXPECT_NE(v.status(), "good");
  }
}

TEST(SliceJudge, APhantomHasNoFault) {
  EXPECT_EQ(judged(verdict_of(clean_ear())), std::vector<std::string>{});
  EXPECT_EQ(judged(verdict_of(noisy(clean_ear(), 60))), std::vector<std::string>{});
  const Image head = phantom(PhantomRegion::head, 4);
  EXPECT_EQ(judged(verdict_of(head)), std::vector<std::string>{});
  // Air that the scanner cuts off at one value.
  const Image clipped = with(head, [](Slices& s) {
    for (auto& slice : s)
      for (auto& v : slice) v = v < -900 ? std::int16_t{-1024} : v;
  });
  EXPECT_EQ(judged(verdict_of(clipped)), std::vector<std::string>{});
}

// A volume file has no slices with names, but its layers may have the same faults.
TEST(SliceJudge, LayersOfAVolumeFile) {
  const fs::path file = scratch("judged-file") / "ct.nrrd";
  save_image(with(ear(), [](Slices& s) { std::fill(s[20].begin(), s[20].end(), std::int16_t{-1024}); }), file);
  EXPECT_EQ(finding(import_ct(file, {}).verdict, code::slice_blank).files, std::vector<std::string>{"layer 20"});
}

// What a volume file leaves open is in the verdict, not in the log alone; axes that are given need not be stated.
TEST(VolumeFileVerdict, SaysWhatTheFileLeavesOpen) {
  const fs::path file = scratch("open") / "ct.nrrd";
  save_image(phantom(PhantomRegion::temporal, 4), file);
  EXPECT_EQ(import_ct(file, {}).verdict.status(), "good");
  std::string bytes(read_text(file));
  const std::string space = "space: left-posterior-superior\n";
  bytes.replace(bytes.find(space), space.size(), "space dimension: 3\n");
  write_file(file, bytes);
  const Verdict open = import_ct(file, {}).verdict;
  EXPECT_TRUE(open.has(code::axes_not_stated));
  EXPECT_EQ(open.status(), "repaired");
  ImportParams given;
  given.axes = "LPS";
  EXPECT_FALSE(import_ct(file, given).verdict.has(code::axes_not_stated));
}

// Of a head in centimetres, or in metres, that says millimetres; the other way round; and what only looks so.
TEST(VolumeFileVerdict, LengthsOfNoPatientAreTold) {
  const fs::path file = scratch("size") / "ct.nrrd";
  const Image ct = phantom(PhantomRegion::temporal, 4);
  for (const auto& [scale, told] :
       std::vector<std::pair<double, bool>>{{0.1, true}, {0.001, true}, {1, false}, {0.3, false}, {100, true}}) {
    Image other = ct;
    other.frame.spacing_mm = ct.frame.spacing_mm * scale * (scale == 0.1 ? 0.15 : 1);
    save_image(other, file);
    const Verdict v = import_ct(file, {}).verdict;
    EXPECT_EQ(v.has(code::size_implausible), told) << scale;
    if (!told) continue;
    EXPECT_EQ(v.status(), "repaired");
    EXPECT_EQ(finding(v, code::size_implausible).message.find("micro-CT") != std::string::npos, scale < 1) << scale;
  }
}

TEST(VolumeFileVerdict, APairOfHeaderAndVoxelsIsRefusedForWhatItIs) {
  const fs::path folder = scratch("pair");
  write_file(folder / "a.hdr", std::string("\x5c\x01\0\0", 4) + std::string(344, '\0'));
  write_file(folder / "a.img", std::string(100, '\0'));
  for (const char* const name : {"a.hdr", "a.img"}) {
    try {
      static_cast<void>(import_ct(folder / name, {}));
      ADD_FAILURE() << name;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("pair of files"), std::string::npos) << e.what();
    }
  }
}

// In a series it is the files that are named, whichever way they are read.
TEST(SliceJudge, NamesTheFiles) {
  const fs::path folder = scratch("judged-series") / "ct";
  save_dicom_series(with(ear(),
                         [](Slices& s) {
                           std::fill(s[20].begin(), s[20].end(), std::int16_t{-1024});
                           std::swap(s[30], s[31]);
                         }),
                    folder);
  const Verdict v = import_ct(folder, {}).verdict;
  const auto files = test::files_in(folder);
  EXPECT_EQ(finding(v, code::slice_blank).files, std::vector<std::string>{files[20].filename().string()});
  EXPECT_EQ(finding(v, code::slice_order).files,
            (std::vector<std::string>{files[30].filename().string(), files[31].filename().string()}));
  EXPECT_EQ(v.status(), "repaired");
  const DicomScan scan = scan_dicom(folder);
  DicomSlabs slabs(scan.series.at(0), {}, 2);
  slabs.run(8, {}, [](int, int, const std::int16_t*) {});
  EXPECT_EQ(judged(slabs.verdict()), judged(v));
}

// The part of a scan over several multi-frame files that is not there.
TEST(SliceJudge, AMissingPartOfAConcatenationIsTold) {
  for (const int parts : {1, 2, 3}) {
    Series s("concatenation", {test::straight_series().begin(), test::straight_series().begin() + 12});
    s.edit_all([&](DcmDataset& d, int i) {
      put(d, DCM_ConcatenationUID, "1.2.3");
      d.putAndInsertUint16(DCM_InConcatenationNumber, static_cast<Uint16>(i < 6 || parts == 1 ? 1 : 2));
      d.putAndInsertUint16(DCM_InConcatenationTotalNumber, static_cast<Uint16>(parts));
    });
    EXPECT_EQ(import_ct(s.folder, {}).verdict.has(code::concatenation_incomplete), parts == 3) << parts;
  }
}

// Tag and numbers both say that every second slice was left out.
TEST(SliceJudge, EverySecondSliceLeftOut) {
  for (const bool numbers_skip : {false, true}) {
    Series s("every-second", {test::straight_series().begin(), test::straight_series().begin() + 24});
    s.edit_all([&](DcmDataset& d, int i) {
      put(d, DCM_SpacingBetweenSlices, "1");
      put(d, DCM_InstanceNumber, std::to_string(numbers_skip ? i + 1 : i / 2 + 1));
    });
    int i = 0;
    for (const auto& f : test::files_in(s.folder))
      if (i++ % 2 == 1) s.drop(f.filename().string());
    const Verdict v = import_ct(s.folder, {}).verdict;
    EXPECT_EQ(finding(v, code::spacing_tag_wrong).severity, numbers_skip ? Severity::warning : Severity::info);
  }
}

TEST(SliceJudge, RealSeriesHaveNoFault) {
  const fs::path head = test::data("dicom_ct_head_tilt_gaps"), skull = test::data("dicom_ct_skull_phantom");
  if (!fs::exists(head) || !fs::exists(skull)) GTEST_SKIP() << "no real data at hand";
  fs::path unc;
  for (const auto& f : fs::directory_iterator(test::data("ct_head_unc")))
    if (f.path().extension() == ".nrrd") unc = f.path();
  for (const fs::path& source : {head, skull / "S21570" / "S2030", skull / "S21610" / "S2010", unc}) {
    const Verdict v = import_ct(source, {}).verdict;
    EXPECT_EQ(judged(v), std::vector<std::string>{}) << source;
  }
}

// Every code has its row, and the page holds the same rows.
TEST(VerdictCodes, TableAndPageAgree) {
  std::vector<std::string> rows;
  std::ifstream page(source_folder() / "docs" / "formats" / "verdict.md");
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("| `") && line.find_first_of("abcdefghijklmnopqrstuvwxyz") > line.find('`', 3))
      rows.push_back(line);
  }
  std::vector<std::string> wanted;
  for (const VerdictCode& c : verdict_codes()) wanted.push_back(table_row(c));
  EXPECT_EQ(rows, wanted);
  std::string text;
  for (const auto& f : fs::recursive_directory_iterator(source_folder() / "libs")) {
    if (f.path().filename() != "verdict.h") continue;
    std::ifstream header(f.path());
    text.append(std::istreambuf_iterator<char>(header), {});
  }
  int codes = 0;
  for (std::size_t at = text.find(" = \""); at != std::string::npos; at = text.find(" = \"", at + 1)) {
    const std::string code = text.substr(at + 4, text.find('"', at + 4) - at - 4);
    if (code.empty() || code.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") != std::string::npos ||
        code == "DICOM")
      continue;
    EXPECT_NE(find_verdict_code(code), nullptr) << code;
    ++codes;
  }
  EXPECT_EQ(static_cast<std::size_t>(codes), verdict_codes().size());
}

}  // namespace
}  // namespace osteo
