/// @class vtkOsteoStage
/// Any Osteotome stage as a VTK filter. Images, masks and surfaces are VTK's own data sets, without copies of voxels;
/// sparse grids and pictures travel as vtkOsteoDataObject. Progress and abort are VTK's; a failure sets the error code,
/// is reported by vtkErrorMacro, and keeps the filter modified, so that the next Update() tries again. A stage that
/// makes an image does its work in UpdateInformation(), since only then its extent is known; Update() hands over the
/// same result.
///
/// @code
/// vtkNew<vtkOsteoStage> threshold;
/// threshold->SetStage(registry, "threshold");
/// threshold->SetParameter("lower", "250");
/// threshold->SetInputConnection(reader->GetOutputPort());
/// @endcode
#ifndef vtkOsteoStage_h
#define vtkOsteoStage_h

#include <vtkAlgorithm.h>

#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "osteo/core/base/error.h"
#include "osteo/core/stage/stage.h"

class vtkOsteoStage : public vtkAlgorithm {
 public:
  static vtkOsteoStage* New();
  vtkTypeMacro(vtkOsteoStage, vtkAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /// Chooses the stage and makes its ports. Returns false, with GetLastError(), when there is none of that name.
  bool SetStage(const osteo::Registry& registry, const std::string& name);
  /// Sets a parameter from text. Returns false, with GetLastError(), when name or value are wrong. A value equal to the
  /// present one does not modify the filter.
  bool SetParameter(const std::string& name, const std::string& value);
  std::string GetParameter(const std::string& name);
  /// For stages that read a file or folder themselves (import).
  void SetSourcePath(const std::string& path);
  /// For one input of a stage that reads several (curve).
  void SetSourcePath(const std::string& input, const std::string& path);

  /// Threads to work with; 0, all cores. Results do not depend on it.
  void SetThreads(int threads);
  /// Of random choices; 1 when it was not set.
  void SetSeed(std::uint64_t seed);
  /// A program's own surroundings in place of the above: threads, seed, progress, notes, report and cancellation are
  /// this context's, VTK's progress events and abort are not used. Borrowed until the next call; null: back to VTK's.
  void SetContext(const osteo::Context* context) { this->Surroundings = context; }

  /// Index of the VTK port of a stage's input or output; -1 when there is none.
  int GetInputPortIndex(const std::string& name) const;
  int GetOutputPortIndex(const std::string& name) const;

  const std::string& GetLastError() const { return this->LastError; }
  /// What the stage threw in the last run, once; null when it threw nothing or was asked before.
  std::exception_ptr TakeFailure() { return std::exchange(this->Failure, nullptr); }
  /// Facts measured in the last run, e.g. volume_after_mm3.
  const osteo::Report& GetReport() const { return this->LastReport; }

  vtkMTimeType GetMTime() override;
  vtkTypeBool ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                             vtkInformationVector* outputs) override;

 protected:
  vtkOsteoStage();
  ~vtkOsteoStage() override;
  int FillInputPortInformation(int port, vtkInformation* info) override;
  int FillOutputPortInformation(int port, vtkInformation* info) override;

 private:
  vtkOsteoStage(const vtkOsteoStage&) = delete;
  void operator=(const vtkOsteoStage&) = delete;

  bool CreateOutputs(vtkInformationVector* outputs);
  bool Inform(vtkInformationVector** inputs, vtkInformationVector* outputs);
  bool Execute(vtkInformationVector** inputs, vtkInformationVector* outputs);
  bool Run(vtkInformationVector** inputs);
  void Fail();  // with the exception that is being handled

  std::unique_ptr<osteo::Stage> Stage;
  std::vector<int> StageInputOfPort;  // VTK input port -> input of the stage (file inputs have no VTK port)
  std::string SourcePath;
  std::map<std::string, std::string> SourcePaths;
  std::vector<osteo::Data> Results;  // of a run done ahead, when its output's extent had to be known
  vtkMTimeType ResultsTime = 0;
  int Threads = 0;
  std::uint64_t Seed = 1;
  const osteo::Context* Surroundings = nullptr;
  bool Failed = false;
  std::exception_ptr Failure;
  std::string LastError;
  osteo::Report LastReport;
};

#endif
