#include "osteo/app/vtk/vtkOsteoReader.h"

#include <vtkDataObject.h>
#include <vtkDemandDrivenPipeline.h>
#include <vtkErrorCode.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>

#include "failure.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/pipeline/formats.h"
#include "values.h"

using osteo::DataKind;

vtkStandardNewMacro(vtkOsteoReader);

vtkOsteoReader::vtkOsteoReader()
    : Kinds{DataKind::image,   DataKind::labels,   DataKind::grid, DataKind::surface,
            DataKind::picture, DataKind::document, DataKind::tets} {
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(1);
}
vtkOsteoReader::~vtkOsteoReader() = default;

void vtkOsteoReader::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << this->FileName << '\n';
}

void vtkOsteoReader::SetFileName(const std::string& path) {
  if (path == this->FileName) return;
  this->FileName = path;
  this->Modified();
}

void vtkOsteoReader::SetKinds(std::vector<DataKind> kinds) {
  if (kinds == this->Kinds) return;
  this->Kinds = std::move(kinds);
  this->Modified();
}

// As of vtkOsteoStage: what failed stays newer than its output.
vtkMTimeType vtkOsteoReader::GetMTime() {
  if (this->Failed) this->MTime.Modified();
  return this->Superclass::GetMTime();
}

int vtkOsteoReader::FillOutputPortInformation(int, vtkInformation* info) {
  info->Set(vtkDataObject::DATA_TYPE_NAME(), "vtkDataObject");
  return 1;
}

vtkTypeBool vtkOsteoReader::ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                                           vtkInformationVector* outputs) {
  using Request = vtkDemandDrivenPipeline;
  const bool object = request->Has(Request::REQUEST_DATA_OBJECT()) != 0,
             information = request->Has(Request::REQUEST_INFORMATION()) != 0,
             data = request->Has(Request::REQUEST_DATA()) != 0;
  if (!object && !information && !data) return this->Superclass::ProcessRequest(request, inputs, outputs);
  if (!this->Load()) return 0;
  vtkInformation* const info = outputs->GetInformationObject(0);
  if (object) osteo::make_object(info, osteo::kind_of(this->Value));
  if (information && osteo::is_image(osteo::kind_of(this->Value))) osteo::inform(info, this->Value);
  if (data) {
    osteo::fill(info->Get(vtkDataObject::DATA_OBJECT()), this->Value);
    this->Value = {};  // the object has it now
  }
  return 1;
}

bool vtkOsteoReader::Load() {
  if (!std::holds_alternative<std::monostate>(this->Value) && this->ValueTime >= this->Superclass::GetMTime())
    return true;
  this->Failed = false;
  this->Failure = nullptr;
  this->LastError.clear();
  try {
    if (this->FileName.empty()) throw osteo::Error(osteo::ExitCode::usage, "no file was named", "SetFileName");
    this->Value = osteo::load_data(this->FileName, this->Kinds,
                                   this->Surroundings != nullptr ? *this->Surroundings : osteo::Context());
    this->ValueTime = this->Superclass::GetMTime();
    this->SetErrorCode(vtkErrorCode::NoError);
    return true;
  } catch (const std::exception&) {
    this->Failed = true;
    this->Failure = std::current_exception();
    this->Value = {};
    const osteo::VtkFailure failure = osteo::vtk_failure(this->Failure);
    this->LastError = failure.text;
    this->SetErrorCode(failure.code);
    vtkErrorMacro(<< failure.text);
    return false;
  }
}
