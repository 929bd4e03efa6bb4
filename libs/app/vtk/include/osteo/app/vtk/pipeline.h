// A pipeline file as a pipeline of VTK: its steps are filters that are connected as the file says, with sources before
// and writers at the end. VTK's executive decides what runs: asking one step for its output runs what that needs and is
// not up to date, nothing else.
#pragma once
#include <vtkSmartPointer.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "osteo/app/vtk/vtkOsteoReader.h"
#include "osteo/app/vtk/vtkOsteoStage.h"
#include "osteo/app/vtk/vtkOsteoWriter.h"
#include "osteo/core/stage/stage.h"
#include "osteo/imaging/pipeline/engine.h"
#include "osteo/imaging/pipeline/pipeline.h"

class vtkAlgorithmOutput;

namespace osteo::inline app {

struct VtkPipelineOptions {
  int threads = 0;         ///< 0: all cores
  std::uint64_t seed = 1;  ///< of random choices
  bool overwrite = false;  ///< writers replace files that exist
};

/// The filters of a pipeline; they live as long as it or whoever else holds them. Used by one thread at a time, as
/// VTK's are.
class VtkPipeline {
 public:
  /// Checks the whole pipeline (validate) and connects it. Reads, runs and writes nothing.
  /// Errors: usage. `where` is told of a step: it goes before errors of that step, "'head.json' line 7"; may be empty.
  VtkPipeline(Pipeline pipeline, const Registry& registry, const VtkPipelineOptions& options = {},
              std::function<std::string(const std::string& id)> where = {});

  /// Of the steps, in an order in which they can run.
  [[nodiscard]] const std::vector<std::string>& ids() const { return ids_; }
  /// Error(usage), with the nearest right name, when there is no such step.
  [[nodiscard]] vtkOsteoStage* step(const std::string& id) const;
  /// To connect a filter or mapper of VTK to; `port` empty: the step's first. Error(usage) when there is none.
  [[nodiscard]] vtkAlgorithmOutput* output(const std::string& id, const std::string& port = {}) const;
  /// Of a step's inputs that are files: port -> reader. Files that a stage reads itself are its SetSourcePath().
  [[nodiscard]] const std::map<std::string, vtkSmartPointer<vtkOsteoReader>>& readers(const std::string& id) const;
  /// Of a step's outputs that the file names: port -> writer.
  [[nodiscard]] const std::map<std::string, vtkSmartPointer<vtkOsteoWriter>>& writers(const std::string& id) const;

  /// Brings a step up to date. Throws what went wrong, with the step in which it did: as the stage threw it, cancelled
  /// after vtkAlgorithm::AbortExecuteOn(). VTK's own messages are not shown.
  void update(const std::string& id);
  /// Brings all writers up to date, in the order of the steps. Errors: as of update(), and cannot_write; files finished
  /// before stay.
  void write();

 private:
  struct Step {
    vtkSmartPointer<vtkOsteoStage> filter;
    std::map<std::string, vtkSmartPointer<vtkOsteoReader>> readers;
    std::map<std::string, vtkSmartPointer<vtkOsteoWriter>> writers;
  };

  [[nodiscard]] const Step& at(const std::string& id) const;
  void bring_up_to_date(vtkAlgorithm* algorithm);
  [[noreturn]] void rethrow(const std::string& id, const std::exception_ptr& thrown) const;

  std::vector<std::string> ids_;
  std::map<std::string, Step> steps_;
  std::function<std::string(const std::string&)> where_;
};

/// A pipeline file so; errors begin with file and line. `settings` as of parse_pipeline().
[[nodiscard]] VtkPipeline load_vtk_pipeline(const std::filesystem::path& file,
                                            const std::map<std::string, std::string>& settings,
                                            const Registry& registry, const VtkPipelineOptions& options = {});

/// For run_pipeline(): VTK's executive runs the steps. What is written is the same to the byte. Meshes need about twice
/// their memory, since VTK's objects stand beside ours while a step that reads them is still to come. `registry` must
/// outlive what is returned.
[[nodiscard]] MakeEngine vtk_engine(const Registry& registry);

}  // namespace osteo::inline app
