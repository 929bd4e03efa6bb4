// convert: any value from one file format to another. bench: speed against error, beside the peers.
#include <unistd.h>

#include <array>
#include <ostream>

#include "bench_subjects.h"
#include "commands/bench.h"
#include "commands/convert.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/imaging/dicom/objects.h"
#include "osteo/imaging/pipeline/formats.h"
#include "osteo/imaging/pipeline/pipeline.h"

namespace osteo {

cli::CommandInfo ConvertCommand::info() {
  return {"convert",
          "one file format to another",
          "Volumes, label maps, surfaces, sparse grids and pictures, by suffix. A label map as .dcm becomes a DICOM "
          "segmentation, a "
          "surface as .dcm an encapsulated STL: with --source they belong to that patient and study, without they name "
          "nobody. "
          "A label map as .seg.nrrd is read by 3D Slicer with its names.",
          {{"input", "file to read"}, {"output", "file to write"}},
          "osteo convert mask.nrrd mask.dcm --source DICOM_FOLDER"};
}

int ConvertCommand::run(const Params& p, cli::Invocation& io) {
  const fs::path from = io.arguments[0], to = io.arguments[1];
  static constexpr std::array kAny{DataKind::labels,  DataKind::image, DataKind::grid,
                                   DataKind::surface, DataKind::tets,  DataKind::picture};
  require_readable(from);
  if (output_exists(to) && !io.common.force) {
    throw Error(ExitCode::cannot_write, "'" + to.string() + "' exists already",
                "give another name, or --force to replace it");
  }
  Data data = load_data(from, kAny, io.context);
  // A mask may be stored wider than a byte; what is wanted says how to read it.
  if (kind_of(data) == DataKind::image && to.filename().string().ends_with(".seg.nrrd")) {
    data = load_data(from, std::array{DataKind::labels}, io.context);
  }
  require_savable(kind_of(data), to);
  const auto* const labels = std::get_if<Labels>(&data);
  if (io.given.contains("segmentation") && (labels == nullptr || to.extension() != ".dcm"))
    throw Error(ExitCode::usage, "--segmentation is for a label map that becomes a .dcm");
  DicomObjectOptions options{nullptr, p.description, p.segmentation};
  if (p.source.empty()) {
    if (p.onto_source) throw Error(ExitCode::usage, "--onto-source needs --source DICOM_FOLDER");
    if (labels != nullptr && to.extension() == ".dcm")
      save_segmentation(*labels, to, options, io.context);
    else
      save_data(data, to, io.context, [&](const fs::path& old) { require_replaceable(old, to); });
  } else {
    if (to.extension() != ".dcm") throw Error(ExitCode::usage, "--source is for outputs that end in .dcm");
    const DicomScan scan = scan_dicom(p.source, {}, io.context);
    options.source = &choose_series(scan, p.series, p.source);
    if (labels != nullptr) {
      p.onto_source ? save_segmentation_on_source(*labels, to, options, io.context)
                    : save_segmentation(*labels, to, options, io.context);
    } else if (const auto* surface = std::get_if<Surface>(&data)) {
      save_encapsulated_stl(**surface, to, options, io.context);
    } else {
      throw Error(ExitCode::usage,
                  "a " + std::string(kind_name(kind_of(data))) + " cannot be written as one DICOM file");
    }
  }
  io.end_progress();
  if (io.common.json) io.out << Json{{"kind", kind_name(kind_of(data))}, {"output", to.string()}}.dump(2) << '\n';
  if (!io.common.quiet) io.err << kind_name(kind_of(data)) << " -> " << to.string() << '\n';
  return 0;
}

cli::CommandInfo BenchCommand::info() {
  return {"bench",
          "speed against error, beside the peers, in one run",
          "Prints the tables of docs/validation/accuracy.md. Runs osteo_bench, which is built by 'cmake --build "
          "build/release "
          "--target osteo_bench'.",
          {{"subject", bench_subject_names(), true}},
          "osteo bench import"};
}

int BenchCommand::run(const Params&, cli::Invocation& io) {
  std::error_code ec;
  const fs::path program = fs::read_symlink("/proc/self/exe", ec).parent_path() / "osteo_bench";
  if (ec || !fs::exists(program)) {
    throw Error(ExitCode::no_input, "osteo_bench is not built", "cmake --build build/release --target osteo_bench");
  }
  const std::string subject = io.arguments.empty() ? "all" : io.arguments[0],
                    threads = std::to_string(io.context.threads);
  io.end_progress();
  ::execl(program.c_str(), "osteo_bench", subject.c_str(), threads.c_str(), static_cast<char*>(nullptr));
  throw Error(ExitCode::failed, "osteo_bench cannot be started");
}

}  // namespace osteo
