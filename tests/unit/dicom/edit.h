// Makes hard series out of easy ones. DCMTK does the editing: it is not what the reader reads with.
#pragma once
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/oflog/oflog.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "folders.h"
#include "osteo/core/base/files.h"
#include "osteo/core/data/vec.h"
#include "osteo/imaging/dicom/save_series.h"
#include "osteo/imaging/image/phantom.h"

namespace osteo::test {

inline fs::path data(const char* name) {
  return shared_data() / name;
}

inline fs::path scratch(const std::string& name) {
  static const TemporaryFolder folder;
  OFLog::configure(OFLogger::OFF_LOG_LEVEL);
  fs::remove_all(folder.path() / name);
  fs::create_directories(folder.path() / name);
  return folder.path() / name;
}

inline std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files(fs::directory_iterator(folder), {});
  std::sort(files.begin(), files.end());
  return files;
}

inline Vec3 position_of(DcmItem& item) {
  Vec3 v;
  for (unsigned a = 0; a < 3; ++a) item.findAndGetFloat64(DCM_ImagePositionPatient, v[a], a);
  return v;
}

/// A straight series of 60 slices 1 mm apart, names in order of position: real where data is at hand, else a phantom.
inline const std::vector<fs::path>& straight_series() {
  static const std::vector<fs::path> files = [] {
    const fs::path real = data("dicom_ct_skull_phantom") / "S21570" / "S2030", to = scratch("straight");
    std::vector<fs::path> source;
    if (fs::exists(real)) {
      std::vector<std::pair<double, fs::path>> sorted;
      for (const auto& f : files_in(real)) {
        DcmFileFormat file;
        if (file.loadFile(f.c_str(), EXS_Unknown, EGL_noChange, 64).bad() || !file.getDataset()->tagExists(DCM_Rows))
          continue;
        sorted.emplace_back(position_of(*file.getDataset()).z, f);
      }
      std::sort(sorted.begin(), sorted.end());
      for (std::size_t i = 40; i < 100; ++i) source.push_back(sorted[i].second);
    } else {
      PhantomParams p;
      p.region = PhantomRegion::temporal;
      p.spacing_mm = 1;
      save_dicom_series(make_phantom(p).ct, to / "all");
      source = files_in(to / "all");
      source.resize(60);
    }
    std::vector<fs::path> result;
    for (std::size_t i = 0; i < source.size(); ++i) {
      char name[16];
      std::snprintf(name, sizeof name, "%03d", static_cast<int>(i));
      fs::create_symlink(source[i], to / name);
      result.push_back(to / name);
    }
    return result;
  }();
  return files;
}

/// A folder of links to some files, under their own names; edit() replaces a link by a changed copy.
class Series {
 public:
  Series(const std::string& name, const std::vector<fs::path>& files) : folder(scratch(name)) {
    for (const auto& f : files) fs::create_symlink(fs::canonical(f), folder / f.filename());
  }
  void drop(const std::string& name) { fs::remove(folder / name); }
  void edit(const std::string& name, const std::function<void(DcmDataset&)>& change, const std::string& new_name = {},
            E_TransferSyntax syntax = EXS_Unknown, E_FileWriteMode mode = EWM_fileformat) {
    DcmFileFormat file;
    ASSERT_TRUE(file.loadFile((folder / name).c_str()).good());
    file.loadAllDataIntoMemory();
    change(*file.getDataset());
    if (syntax == EXS_Unknown) syntax = file.getDataset()->getOriginalXfer();
    ASSERT_TRUE(file.getDataset()->chooseRepresentation(syntax, nullptr).good());
    const fs::path to = folder / (new_name.empty() ? name : new_name);
    if (new_name.empty()) fs::remove(to);
    ASSERT_TRUE(file.saveFile(to.c_str(), syntax, EET_ExplicitLength, EGL_recalcGL, EPD_noChange, 0, 0, mode).good());
  }
  void edit_all(const std::function<void(DcmDataset&, int)>& change, E_TransferSyntax syntax = EXS_Unknown,
                E_FileWriteMode mode = EWM_fileformat) {
    int i = 0;
    for (const auto& f : files_in(folder))
      edit(
          f.filename().string(), [&](DcmDataset& d) { change(d, i); }, {}, syntax, mode),
          ++i;
  }
  const fs::path folder;
};

inline void put(DcmItem& d, const DcmTagKey& tag, const std::string& value) {
  ASSERT_TRUE(d.putAndInsertString(DcmTag(tag), value.c_str()).good());
}
inline std::string text(Vec3 v) {
  char t[64];
  std::snprintf(t, sizeof t, "%.6f\\%.6f\\%.6f", v.x, v.y, v.z);
  return t;
}

}  // namespace osteo::test
