// DICOM series to a volume: time, memory and where the voxels end up, beside the readers of the field. Every
// measurement is a process of its own, so that peak memory is its own.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <gdcmFileChangeTransferSyntax.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>
#include <gdcmTrace.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vtkDICOMCTRectifier.h>
#include <vtkDICOMReader.h>
#include <vtkDICOMSorter.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkObject.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>

#include <chrono>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "bench.h"
#include "folders.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/bone_import/import_bone.h"
#include "osteo/imaging/dicom/save_series.h"
#include "osteo/imaging/dicom/volume.h"
#include "osteo/imaging/image/phantom.h"

namespace osteo {
namespace {

struct Cost {
  double wall_s = 1e9, cpu_s = 1e9, peak_mb = 1e9;
  bool ok = true;
};

// The best of some runs, each in a process of its own.
Cost measure(int runs, const std::function<bool()>& work) {
  Cost best;
  for (int i = 0; i < runs; ++i) {
    std::fflush(nullptr);
    const auto start = std::chrono::steady_clock::now();
    const pid_t child = ::fork();
    if (child == 0) {
      bool ok = false;
      try {
        ok = work();
      } catch (const std::exception& e) {
        std::fprintf(stderr, "  %s\n", e.what());
      }
      std::_Exit(ok ? 0 : 1);
    }
    int status = 0;
    rusage use{};
    ::wait4(child, &status, 0, &use);
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    best.ok = best.ok && WIFEXITED(status) && WEXITSTATUS(status) == 0;
    best.wall_s = std::min(best.wall_s, wall);
    best.cpu_s = std::min(best.cpu_s, seconds(use.ru_utime) + seconds(use.ru_stime));
    best.peak_mb = std::min(best.peak_mb, static_cast<double>(use.ru_maxrss) / 1000);
  }
  return best;
}

void row(const std::string& what, const std::string& who, const Cost& c) {
  if (c.ok) {
    std::printf("| %s | %s | %.2f | %.2f | %.0f |\n", what.c_str(), who.c_str(), c.wall_s, c.cpu_s, c.peak_mb);
  } else {
    std::printf("| %s | %s | fails | | |\n", what.c_str(), who.c_str());
  }
  std::fflush(stdout);
}

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& e : fs::recursive_directory_iterator(folder)) {
    if (e.is_regular_file()) files.push_back(e.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// `count` slices of 512x512, 1 mm apart: real ones over and over where data is at hand, else a phantom.
void make_series(const fs::path& to, int count, const std::function<void(DcmDataset&, int)>& change = {}) {
  fs::create_directories(to);
  std::vector<fs::path> base;
  const fs::path real = shared_data() / "dicom_ct_skull_phantom" / "S21570" / "S2030";
  const fs::path made = to.parent_path() / "phantom";
  if (fs::exists(real)) {
    for (const auto& f : files_in(real)) {
      if (f.filename() != "DIRFILE") base.push_back(f);
    }
  } else {
    if (!fs::exists(made)) {
      PhantomParams p;
      p.spacing_mm = 1;
      save_dicom_series(make_phantom(p).ct, made);
    }
    base = files_in(made);
  }
  for (int i = 0; i < count; ++i) {
    DcmFileFormat file;
    file.loadFile(base[static_cast<std::size_t>(i) % base.size()].c_str());
    DcmDataset& d = *file.getDataset();
    const auto put = [&](const DcmTagKey& tag, const std::string& v) { d.putAndInsertString(DcmTag(tag), v.c_str()); };
    put(DCM_SeriesInstanceUID, "1.2.826.0.1.3680043.9.1000.1");
    put(DCM_SOPInstanceUID, "1.2.826.0.1.3680043.9.1000.1." + std::to_string(i + 1));
    put(DCM_InstanceNumber, std::to_string(i + 1));
    put(DCM_ImagePositionPatient, "-115.5\\-1.85\\" + std::to_string(i));
    if (change) change(d, i);
    char name[32];
    std::snprintf(name, sizeof name, "%05d.dcm", i);
    file.saveFile((to / name).c_str(), EXS_LittleEndianExplicit);
  }
}

void encode(const fs::path& from, const fs::path& to, gdcm::TransferSyntax::TSType syntax) {
  fs::create_directories(to);
  for (const auto& f : files_in(from)) {
    gdcm::ImageReader reader;
    reader.SetFileName(f.c_str());
    reader.Read();
    gdcm::ImageChangeTransferSyntax change;
    change.SetTransferSyntax(syntax);
    change.SetInput(reader.GetImage());
    change.Change();
    gdcm::ImageWriter writer;
    writer.SetFileName((to / f.filename()).c_str());
    writer.SetFile(reader.GetFile());
    writer.SetImage(change.GetOutput());
    writer.Write();
  }
}

vtkSmartPointer<vtkDICOMReader> read_with_vtk(const fs::path& folder) {
  vtkNew<vtkStringArray> names;
  for (const auto& f : files_in(folder)) names->InsertNextValue(f.c_str());
  vtkNew<vtkDICOMSorter> sorter;
  sorter->SetInputFileNames(names);
  sorter->Update();
  auto reader = vtkSmartPointer<vtkDICOMReader>::New();
  reader->SetFileNames(sorter->GetOutputFileNames());
  reader->SetMemoryRowOrderToFileNative();
  reader->Update();
  return reader;
}

bool read_with_gdcm(const fs::path& folder) {
  std::vector<char> volume;
  for (const auto& f : files_in(folder)) {
    gdcm::ImageReader reader;
    reader.SetFileName(f.c_str());
    if (!reader.Read()) return false;
    const std::size_t at = volume.size(), n = reader.GetImage().GetBufferLength();
    if (at == 0) volume.reserve(n * files_in(folder).size());
    volume.resize(at + n);
    reader.GetImage().GetBuffer(volume.data() + at);
  }
  return !volume.empty();
}

bool read_with_dcmtk(const fs::path& folder) {
  std::vector<Uint16> volume;
  for (const auto& f : files_in(folder)) {
    DcmFileFormat file;
    if (file.loadFile(f.c_str()).bad()) return false;
    const Uint16* p = nullptr;
    unsigned long n = 0;
    if (file.getDataset()->findAndGetUint16Array(DCM_PixelData, p, &n).bad() || n == 0) return false;
    if (volume.empty()) volume.reserve(n * files_in(folder).size());
    volume.insert(volume.end(), p, p + n);
  }
  return !volume.empty();
}

bool read_with_python(const fs::path& folder) {
  const std::string script = "import SimpleITK as s; n=s.ImageSeriesReader.GetGDCMSeriesFileNames('" + folder.string() +
                             "'); r=s.ImageSeriesReader(); r.SetFileNames(n); r.Execute()";
  ::execlp("python3", "python3", "-c", script.c_str(), static_cast<char*>(nullptr));
  return false;
}

bool python_has(const char* module) {
  return std::system(("python3 -c 'import " + std::string(module) + "' 2>/dev/null").c_str()) == 0;
}

// In a process of measure(), which it becomes.
bool become(std::vector<std::string> words) {
  std::vector<char*> argv;
  for (std::string& w : words) argv.push_back(w.data());
  argv.push_back(nullptr);
  static_cast<void>(std::freopen("/dev/null", "w", stdout));
  static_cast<void>(std::freopen("/dev/null", "w", stderr));
  ::execvp(argv.front(), argv.data());
  return false;
}

bool is_program(const std::string& name) {
  return std::system(("command -v " + name + " >/dev/null 2>&1").c_str()) == 0;
}

// Whole programs, from files to files. What a program takes to start is a row of its own: it grows with the libraries
// that it is linked with, not with the series.
void programs(const fs::path& series, const fs::path& out) {
  std::error_code ec;
  const fs::path osteo = fs::read_symlink("/proc/self/exe", ec).parent_path() / "osteo";
  fs::create_directories(out);
  constexpr int kRuns = 5;
  std::printf(
      "\n300 uncompressed slices of 512x512 from files to a file, by whole programs, all cores.\n\n| to | program | "
      "wall s "
      "| CPU s | peak MB |\n|---|---|---|---|---|\n");
  if (fs::exists(osteo)) {
    row("nothing", "osteo --version", measure(kRuns, [&] { return become({osteo, "--version"}); }));
    for (const char* const name : {"ct.nii", "ct.nii.gz", "ct.nrrd"})
      row(fs::path(name).extension(), "osteo import", measure(kRuns, [&] {
            return become({osteo, "import", series, out / name, "--force"});
          }));
  }
  if (is_program("dcm2niix")) {
    row(".nii", "dcm2niix", measure(kRuns, [&] {
          return become({"dcm2niix", "-b", "n", "-z", "n", "-w", "1", "-o", out, series});
        }));
    row(".gz", "dcm2niix", measure(kRuns, [&] {
          return become({"dcm2niix", "-b", "n", "-z", "y", "-w", "1", "-o", out, series});
        }));
  }
  if (is_program("dicomtonifti"))
    row(".nii", "vtk-dicom (dicomtonifti)", measure(kRuns, [&] {
          return become({"dicomtonifti", "--no-qform", "--batch", "-r", "-o", out, series});
        }));
  fs::remove_all(out, ec);
}

bool read_with_osteo(const fs::path& folder) {
  const DicomScan scan = scan_dicom(folder);
  return load_dicom_series(choose_series(scan, "", "")).image.frame.voxel_count() > 0;
}

// Where the readers put the slices of a real, tilted, uneven head: farthest corner from what its file says.
void positions() {
  const fs::path folder = shared_data() / "dicom_ct_head_tilt_gaps";
  if (!fs::exists(folder)) {
    std::printf("\n(No %s: the table of positions is left out.)\n", folder.c_str());
    return;
  }
  const DicomScan scan = scan_dicom(folder);
  const DicomSeries& series = choose_series(scan, "", "");
  const Placement placed = place_slices(series.headers, {});
  const auto reader = read_with_vtk(folder);
  vtkMatrix4x4* const m = reader->GetPatientMatrix();
  double worst = 0, mean = 0;
  const double dz = reader->GetOutput()->GetSpacing()[2];
  for (std::size_t k = 0; k < placed.slices.size(); ++k) {
    const double in[4] = {0, 0, dz * static_cast<double>(k), 1};
    double out[4];
    m->MultiplyPoint(in, out);
    const double error = length(Vec3{out[0], out[1], out[2]} - placed.verdict.slices[k].position_mm);
    worst = std::max(worst, error);
    mean += error / static_cast<double>(placed.slices.size());
  }
  std::printf(
      "\n## Where the slices of a tilted, uneven head end up\n\n| reader | worst mm | mean mm | says "
      "|\n|---|---|---|---|\n");
  std::printf("| osteo import | %.4f | %.4f | TILTED, GAPS_UNEVEN, PADDING_TAG |\n", placed.verdict.position_error_mm,
              placed.verdict.position_error_mm);
  std::printf("| vtk-dicom | %.1f | %.1f | nothing (error code %lu) |\n", worst, mean, reader->GetErrorCode());
}

}  // namespace

void bench_import(const Context& context) {
  OFLog::configure(OFLogger::OFF_LOG_LEVEL);
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  vtkObject::GlobalWarningDisplayOff();
  static_cast<void>(context);
  const TemporaryFolder folder;
  const fs::path plain = folder.path() / "plain";
  const bool itk = python_has("SimpleITK");
  make_series(plain, 300);
  std::printf(
      "# DICOM import\n\n300 slices of 512x512 to a volume, headers, sorting and HU included (DCMTK and GDCM: pixels "
      "only).\n\n");
  std::printf("| encoding | reader | wall s | CPU s | peak MB |\n|---|---|---|---|---|\n");
  struct Encoding {
    const char* name;
    gdcm::TransferSyntax::TSType syntax;
    bool dcmtk;
  };
  for (const Encoding& e : {Encoding{"uncompressed", gdcm::TransferSyntax::ExplicitVRLittleEndian, true},
                            Encoding{"RLE", gdcm::TransferSyntax::RLELossless, false},
                            Encoding{"JPEG lossless", gdcm::TransferSyntax::JPEGLosslessProcess14_1, false},
                            Encoding{"JPEG-LS", gdcm::TransferSyntax::JPEGLSLossless, false},
                            Encoding{"JPEG 2000", gdcm::TransferSyntax::JPEG2000Lossless, false}}) {
    const bool raw = e.dcmtk;
    const fs::path at = raw ? plain : folder.path() / "coded";
    if (!raw) encode(plain, at, e.syntax);
    const int runs = raw ? 5 : 2;
    row(e.name, "osteo import", measure(runs, [&] { return read_with_osteo(at); }));
    row(e.name, "vtk-dicom", measure(runs, [&] { return read_with_vtk(at)->GetErrorCode() == 0; }));
    row(e.name, "GDCM", measure(runs, [&] { return read_with_gdcm(at); }));
    if (e.dcmtk) row(e.name, "DCMTK", measure(runs, [&] { return read_with_dcmtk(at); }));
    if (itk) row(e.name, "SimpleITK", measure(runs, [&] { return read_with_python(at); }));
    if (!raw) fs::remove_all(at);
  }

  programs(plain, folder.path() / "files");

  const fs::path lean = folder.path() / "lean";
  make_series(lean, 300, [](DcmDataset& d, int i) {
    const double z = 0.6 * i + (i % 7 == 0 ? 0.2 : 0);
    const std::string p = "-115.5\\" + std::to_string(0.3 * z) + "\\" + std::to_string(z);
    d.putAndInsertString(DCM_ImagePositionPatient, p.c_str());
  });
  std::printf("\n300 tilted (16.7 degrees), unevenly spaced slices of 512x512 to isotropic 0.5 mm.\n\n");
  std::printf("| what | who | wall s | CPU s | peak MB |\n|---|---|---|---|---|\n");
  row("HU and mask", "osteo, slab by slab", measure(3, [&] {
        const DicomScan scan = scan_dicom(lean);
        DicomSlabs slabs(choose_series(scan, "", ""), {}, 0.5);
        slabs.run(8, {}, [](int, int, const std::int16_t*) {});
        return slabs.verdict().tilt_deg > 10;
      }));
  row("sparse bone, HU, mask", "osteo import-bone", measure(3, [&] {
        ImportBoneParams p;
        return import_bone(lean, p).density.active_voxels > 0;
      }));
  row("upright only", "vtk-dicom's rectifier (slices taken as even)", measure(1, [&] {
        const auto reader = read_with_vtk(lean);
        vtkNew<vtkDICOMCTRectifier> rectify;
        rectify->SetInputConnection(reader->GetOutputPort());
        rectify->SetVolumeMatrix(reader->GetPatientMatrix());
        rectify->Update();
        return rectify->GetOutput()->GetNumberOfPoints() > 0;
      }));
  fs::remove_all(lean);

  const fs::path large = folder.path() / "large";
  make_series(large, 600, [](DcmDataset& d, int i) {
    const std::string p = "-115.5\\-1.85\\" + std::to_string(0.5 * i);
    d.putAndInsertString(DCM_ImagePositionPatient, p.c_str());
  });
  std::printf(
      "\n600 slices of 512x512, 0.5 mm apart (315 MB), to sparse bone of 0.5 mm.\n\n| what | who | wall s | CPU s | "
      "peak MB "
      "|\n|---|---|---|---|---|\n");
  row("sparse bone", "osteo import-bone", measure(2, [&] {
        ImportBoneParams p;
        return import_bone(large, p).density.active_voxels > 0;
      }));
  row("the volume alone", "osteo import", measure(2, [&] { return read_with_osteo(large); }));
  fs::remove_all(large);

  const fs::path many = folder.path() / "many";
  fs::create_directories(many);
  const auto some = files_in(plain);
  for (int i = 0; i < 10000; ++i) {
    const fs::path to = many / (std::to_string(i) + (i % 10 == 0 ? ".txt" : ".dcm"));
    if (i % 10 == 0) {
      write_file(to, "notes");
    } else {
      fs::create_hard_link(some[static_cast<std::size_t>(i) % some.size()], to);
    }
  }
  std::printf(
      "\n10,000 mixed files, headers read and grouped.\n\n| what | who | wall s | CPU s | peak MB "
      "|\n|---|---|---|---|---|\n");
  row("scan", "osteo import --list", measure(2, [&] { return scan_dicom(many).files == 10000; }));
  positions();
}

}  // namespace osteo
