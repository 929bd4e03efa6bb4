#include "osteo/app/vtk/vtkOsteoWriter.h"

#include <vtkDataObject.h>
#include <vtkDemandDrivenPipeline.h>
#include <vtkErrorCode.h>
#include <vtkExecutive.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <vector>

#include "failure.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/pipeline/formats.h"
#include "osteo/imaging/pipeline/pipeline.h"
#include "values.h"

using osteo::DataKind;

vtkStandardNewMacro(vtkOsteoWriter);

vtkOsteoWriter::vtkOsteoWriter() {
  this->SetNumberOfInputPorts(1);
  this->SetNumberOfOutputPorts(0);
}
vtkOsteoWriter::~vtkOsteoWriter() = default;

void vtkOsteoWriter::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << this->FileName << '\n'
     << indent << "Overwrite: " << (this->Overwrite ? "on" : "off") << '\n';
}

void vtkOsteoWriter::SetFileName(const std::string& path) {
  if (path == this->FileName) return;
  this->FileName = path;
  this->Modified();
}

void vtkOsteoWriter::SetOverwrite(bool overwrite) {
  if (overwrite == this->Overwrite) return;
  this->Overwrite = overwrite;
  this->Modified();
}

void vtkOsteoWriter::SetKind(DataKind kind) {
  if (kind == this->Kind) return;
  this->Kind = kind;
  this->Modified();
}

bool vtkOsteoWriter::Write() {
  return this->GetExecutive()->Update() != 0;
}

// As of vtkOsteoStage: what failed stays newer than its output.
vtkMTimeType vtkOsteoWriter::GetMTime() {
  if (this->Failed) this->MTime.Modified();
  return this->Superclass::GetMTime();
}

int vtkOsteoWriter::FillInputPortInformation(int, vtkInformation* info) {
  info->Remove(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE());
  for (const char* const c : {"vtkImageData", "vtkPolyData", "vtkUnstructuredGrid", "vtkOsteoDataObject"})
    info->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), c);
  return 1;
}

vtkTypeBool vtkOsteoWriter::ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                                           vtkInformationVector* outputs) {
  using Request = vtkStreamingDemandDrivenPipeline;
  if (request->Has(Request::REQUEST_UPDATE_EXTENT())) {
    vtkInformation* const info = inputs[0]->GetInformationObject(0);
    if (info != nullptr && info->Has(Request::WHOLE_EXTENT())) {
      int extent[6];
      info->Get(Request::WHOLE_EXTENT(), extent);
      info->Set(Request::UPDATE_EXTENT(), extent, 6);
    }
    return 1;
  }
  if (request->Has(vtkDemandDrivenPipeline::REQUEST_DATA())) {
    return this->Save(inputs[0]->GetInformationObject(0)->Get(vtkDataObject::DATA_OBJECT())) ? 1 : 0;
  }
  return this->Superclass::ProcessRequest(request, inputs, outputs);
}

bool vtkOsteoWriter::Save(vtkDataObject* object) {
  this->Failed = false;
  this->Failure = nullptr;
  this->LastError.clear();
  try {
    if (this->FileName.empty()) throw osteo::Error(osteo::ExitCode::usage, "no file was named", "SetFileName");
    std::vector<DataKind> kinds{DataKind::labels, DataKind::image, DataKind::surface, DataKind::tets};
    if (this->Kind != DataKind::none) kinds = {this->Kind};
    const osteo::Data value = osteo::value_of(object, kinds, this->FileName);
    if (osteo::kind_of(value) == DataKind::none)
      throw osteo::Error(osteo::ExitCode::failed, "there is nothing to write to '" + this->FileName + "'");
    const bool there = osteo::output_exists(this->FileName);
    const bool own = there && this->Written == this->FileName && osteo::hash_path(this->FileName) == this->WrittenHash;
    if (there && !own && !this->Overwrite)
      throw osteo::Error(osteo::ExitCode::cannot_write, "'" + this->FileName + "' exists already",
                         "give another name, or SetOverwrite(true)");
    osteo::save_data(value, this->FileName, {}, [&](const osteo::fs::path& old) {
      if (!own) osteo::require_replaceable(old, this->FileName);
    });
    this->Written = this->FileName;
    this->WrittenHash = osteo::hash_path(this->FileName);
    this->SetErrorCode(vtkErrorCode::NoError);
    return true;
  } catch (const std::exception&) {
    this->Failed = true;
    this->Failure = std::current_exception();
    const osteo::VtkFailure failure = osteo::vtk_failure(this->Failure);
    this->LastError = failure.text;
    this->SetErrorCode(failure.code);
    vtkErrorMacro(<< failure.text);
    return false;
  }
}
