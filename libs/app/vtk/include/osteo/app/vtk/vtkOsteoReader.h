/// @class vtkOsteoReader
/// A file of any kind that Osteotome reads (by its suffix) as a VTK source: vtkImageData, vtkPolyData,
/// vtkUnstructuredGrid or, for grids, pictures and documents, vtkOsteoDataObject. The file is read when its kind must
/// be known, so already in UpdateInformation(), and again only after Modified(), as by VTK's own readers. A failure
/// sets the error code, is reported by vtkErrorMacro and tried again.
#ifndef vtkOsteoReader_h
#define vtkOsteoReader_h

#include <vtkAlgorithm.h>

#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/data.h"

class vtkOsteoReader : public vtkAlgorithm {
 public:
  static vtkOsteoReader* New();
  vtkTypeMacro(vtkOsteoReader, vtkAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  void SetFileName(const std::string& path);
  const std::string& GetFileName() const { return this->FileName; }
  /// What the file may hold; anything but a file's mere name (source), unless it is set.
  void SetKinds(std::vector<osteo::DataKind> kinds);
  /// As of vtkOsteoStage.
  void SetContext(const osteo::Context* context) { this->Surroundings = context; }

  const std::string& GetLastError() const { return this->LastError; }
  /// What reading threw in the last run, once; null when it threw nothing or was asked before.
  std::exception_ptr TakeFailure() { return std::exchange(this->Failure, nullptr); }

  vtkMTimeType GetMTime() override;
  vtkTypeBool ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                             vtkInformationVector* outputs) override;

 protected:
  vtkOsteoReader();
  ~vtkOsteoReader() override;
  int FillOutputPortInformation(int port, vtkInformation* info) override;

 private:
  vtkOsteoReader(const vtkOsteoReader&) = delete;
  void operator=(const vtkOsteoReader&) = delete;

  bool Load();

  std::string FileName;
  std::vector<osteo::DataKind> Kinds;
  const osteo::Context* Surroundings = nullptr;
  osteo::Data Value;
  vtkMTimeType ValueTime = 0;
  bool Failed = false;
  std::exception_ptr Failure;
  std::string LastError;
};

#endif
