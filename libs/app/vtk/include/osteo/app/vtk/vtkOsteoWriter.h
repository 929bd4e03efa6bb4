/// @class vtkOsteoWriter
/// The end of a VTK pipeline: what comes in, from Osteotome or from VTK, is written to a file by its suffix, whole or
/// not at all, and again only when it changed. Something that is there already is replaced only after
/// SetOverwrite(true), except what this writer wrote itself and nobody changed since; of a folder with files that it
/// has no record of, nothing is replaced at all. A failure sets the error code, is reported by vtkErrorMacro and tried
/// again. No record (FILE.prov.json) is written: `osteo run --engine vtk` does that.
#ifndef vtkOsteoWriter_h
#define vtkOsteoWriter_h

#include <vtkAlgorithm.h>

#include <exception>
#include <string>
#include <utility>

#include "osteo/core/data/data.h"

class vtkOsteoWriter : public vtkAlgorithm {
 public:
  static vtkOsteoWriter* New();
  vtkTypeMacro(vtkOsteoWriter, vtkAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  void SetFileName(const std::string& path);
  const std::string& GetFileName() const { return this->FileName; }
  void SetOverwrite(bool overwrite);
  /// What an image of bytes, which could be a scan or a label map, is written as. Other objects say it themselves.
  void SetKind(osteo::DataKind kind);

  /// Brings what is before it up to date and writes; nothing when the file is as it should be. Returns whether all went
  /// well.
  bool Write();

  const std::string& GetLastError() const { return this->LastError; }
  /// What writing threw in the last run, once; null when it threw nothing or was asked before.
  std::exception_ptr TakeFailure() { return std::exchange(this->Failure, nullptr); }

  vtkMTimeType GetMTime() override;
  vtkTypeBool ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                             vtkInformationVector* outputs) override;

 protected:
  vtkOsteoWriter();
  ~vtkOsteoWriter() override;
  int FillInputPortInformation(int port, vtkInformation* info) override;

 private:
  vtkOsteoWriter(const vtkOsteoWriter&) = delete;
  void operator=(const vtkOsteoWriter&) = delete;

  bool Save(vtkDataObject* object);

  std::string FileName;
  bool Overwrite = false;
  osteo::DataKind Kind = osteo::DataKind::none;
  std::string Written, WrittenHash;  // what this writer wrote last, and its content
  bool Failed = false;
  std::exception_ptr Failure;
  std::string LastError;
};

#endif
