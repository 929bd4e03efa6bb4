// Flipped, cut and spliced copies of DICOM files through scan, placement and decoding: none may crash, hang or eat
// memory. usage: mutate_dicom COUNT [SEED] [FOLDER...]   exits 1 and names file and seed when one does
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <random>

#include "folders.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/dicom/objects.h"
#include "osteo/imaging/dicom/save_series.h"
#include "osteo/imaging/dicom/volume.h"
#include "osteo/imaging/image/phantom.h"
#include "pixels.h"

namespace osteo {
namespace {

constexpr double kSecondsEach = 2;
constexpr rlim_t kMemory = rlim_t{3} << 30;

std::vector<fs::path> inputs(const std::vector<std::string>& folders, const fs::path& scratch) {
  std::vector<fs::path> files;
  for (const auto& folder : folders) {
    if (!fs::exists(folder)) continue;
    int taken = 0;
    std::vector<fs::path> here;
    for (const auto& e : fs::recursive_directory_iterator(folder)) {
      if (e.is_regular_file()) here.push_back(e.path());
    }
    std::sort(here.begin(), here.end());
    // A long series says nothing new with every slice.
    for (const auto& f : here) {
      if (fs::file_size(f) > 0 && taken++ < 30) files.push_back(f);
    }
  }
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 4;
  const Phantom phantom = make_phantom(p);
  save_dicom_series(phantom.ct, scratch / "made");
  files.push_back(scratch / "made" / "0001.dcm");
  save_segmentation(phantom.labels, scratch / "seg.dcm");
  files.push_back(scratch / "seg.dcm");
  return files;
}

void mutate(std::vector<char>& bytes, std::mt19937_64& random) {
  const auto pick = [&](std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(random() % n); };
  // Headers are where the parsers are; half of the changes go there.
  const auto place = [&] {
    return random() % 2 == 0 ? pick(std::min<std::size_t>(bytes.size(), 4000)) : pick(bytes.size());
  };
  switch (random() % 5) {
    case 0:
      for (std::size_t n = 1 + pick(20); n > 0; --n) bytes[place()] ^= static_cast<char>(1 << pick(8));
      break;
    case 1:
      for (std::size_t n = 1 + pick(8); n > 0; --n) bytes[place()] = static_cast<char>(random());
      break;
    case 2:
      bytes.resize(1 + pick(bytes.size()));
      break;
    case 3: {  // a piece copied elsewhere
      const std::size_t from = place(), to = place(), n = std::min({pick(400), bytes.size() - from, bytes.size() - to});
      std::memmove(bytes.data() + to, bytes.data() + from, n);
      break;
    }
    default: {  // lengths and numbers at their limits
      static constexpr std::uint32_t kLimits[] = {0,          1,          0x7FFFFFFF, 0x80000000,
                                                  0xFFFFFFFE, 0xFFFFFFFF, 0xFFFF,     0x10000};
      for (std::size_t n = 1 + pick(4); n > 0; --n) {
        const std::size_t at = place();
        const std::uint32_t v = kLimits[pick(8)];
        std::memcpy(bytes.data() + at, &v, std::min<std::size_t>(sizeof v, bytes.size() - at));
      }
    }
  }
}

// All that an import does with one file.
void digest(const fs::path& file) {
  try {
    const DicomScan scan = scan_dicom(file);
    for (const DicomSeries& s : scan.series) {
      for (const DicomHeader& h : s.headers) {
        if (!h.usable() || h.pixels_per_frame() * h.frames.size() > (std::size_t{1} << 28)) continue;
        std::vector<std::int16_t> pixels(h.pixels_per_frame());
        const dicom::FrameTarget target{0, pixels.data()};
        dicom::ValueCount count;
        try {
          dicom::read_frames_hu(h, {&target, 1}, count);
        } catch (const dicom::PixelError&) {
        }
      }
    }
    static_cast<void>(import_ct(file, {}));
  } catch (const Error&) {
  }
  try {
    if (is_segmentation(file)) static_cast<void>(load_segmentation(file));
  } catch (const Error&) {
  }
}

/// Of this process, all threads.
double processor_seconds() {
  timespec t{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace
}  // namespace osteo

int main(int argc, char** argv) {
  using namespace osteo;
  const int count = argc > 1 ? std::atoi(argv[1]) : 1000;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  std::vector<std::string> folders(argv + std::min(argc, 3), argv + argc);
  if (folders.empty()) {
    for (const char* f : {"dicom_hard_files", "dicom_transfer_syntaxes", "dicom_hard_geometry",
                          "dicom_ct_skull_phantom/S21570/S4010", "dicom_ct_head_tilt_gaps"}) {
      folders.push_back(shared_data().string() + "/" + f);
    }
  }
  const TemporaryFolder scratch;
  const auto files = inputs(folders, scratch.path());
  const fs::path copy = scratch.path() / "copy";
  int bad = 0;
  for (int done = 0; done < count && bad < 20;) {
    // Many copies a process: the next one starts where the last one died.
    const fs::path mark = scratch.path() / "at";
    std::fflush(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
#ifndef __SANITIZE_ADDRESS__  // whose shadow takes all addresses
      rlimit memory{kMemory, kMemory};
      ::setrlimit(RLIMIT_AS, &memory);
#endif
      ::freopen("/dev/null", "w", stderr);
      for (int n = done; n < std::min(count, done + 500); ++n) {
        std::mt19937_64 random(seed * 1000003 + static_cast<std::uint64_t>(n));
        const fs::path& original = files[static_cast<std::size_t>(random() % files.size())];
        std::ifstream in(original, std::ios::binary);
        std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
        in.close();
        mutate(bytes, random);
        std::ofstream(copy, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        std::ofstream(mark) << n << ' ' << original.string();
        // Processor time, not the clock's: other programs may have the machine. The alarm is for a wait that never
        // ends.
        ::alarm(600);
        const double start = processor_seconds();
        try {
          digest(copy);
        } catch (const std::bad_alloc&) {
          std::_Exit(3);
        }
        if (processor_seconds() - start > kSecondsEach) std::_Exit(4);
      }
      std::_Exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
      done = std::min(count, done + 500);
      std::printf("%d of %d\n", done, count);
      std::fflush(stdout);
      continue;
    }
    std::ifstream at(mark);
    int n = 0;
    std::string original;
    at >> n;
    std::getline(at, original);
    std::printf("copy %d (seed %llu) of%s: %s\n", n, static_cast<unsigned long long>(seed), original.c_str(),
                WIFSIGNALED(status)        ? strsignal(WTERMSIG(status))
                : WEXITSTATUS(status) == 4 ? "took too long"
                                           : "ran out of memory");
    fs::copy_file(copy, "mutate-dicom-" + std::to_string(n), fs::copy_options::overwrite_existing);
    ++bad;
    done = n + 1;
  }
  std::printf("%d copies, %d bad\n", count, bad);
  return bad == 0 ? 0 : 1;
}
