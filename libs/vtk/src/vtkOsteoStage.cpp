#include "osteo/vtk/vtkOsteoStage.h"

#include <vtkAlgorithmOutput.h>
#include <vtkDemandDrivenPipeline.h>
#include <vtkErrorCode.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMatrix3x3.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "osteo/io/vtk_data.h"
#include "osteo/vtk/vtkOsteoDataObject.h"

using osteo::DataKind;
using Pipeline = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkOsteoStage);

namespace {

bool is_image(DataKind kind) {
  return kind == DataKind::image || kind == DataKind::labels;
}

const char* class_of(DataKind kind) {
  if (is_image(kind)) return "vtkImageData";
  if (kind == DataKind::surface) return "vtkPolyData";
  if (kind == DataKind::tets) return "vtkUnstructuredGrid";
  return "vtkOsteoDataObject";
}

void set_image_information(vtkInformation* info, vtkImageData* image) {
  int extent[6];
  image->GetExtent(extent);
  info->Set(Pipeline::WHOLE_EXTENT(), extent, 6);
  info->Set(vtkDataObject::SPACING(), image->GetSpacing(), 3);
  info->Set(vtkDataObject::ORIGIN(), image->GetOrigin(), 3);
  info->Set(vtkDataObject::DIRECTION(), image->GetDirectionMatrix()->GetData(), 9);
  if (image->GetPointData()->GetScalars() != nullptr) vtkDataObject::SetPointDataActiveScalarInfo(info, image->GetScalarType(), 1);
}

// The value of a VTK data object, as the first kind that the port accepts and the object can be.
osteo::Data from_vtk(vtkDataObject* object, const osteo::Port& port) {
  if (auto* const own = vtkOsteoDataObject::SafeDownCast(object)) return own->GetValue();
  for (const DataKind kind : port.kinds) {
    if (auto* const image = vtkImageData::SafeDownCast(object)) {
      const bool bytes = image->GetScalarType() == VTK_UNSIGNED_CHAR;
      const bool labels_too = std::find(port.kinds.begin(), port.kinds.end(), DataKind::labels) != port.kinds.end();
      if (kind == DataKind::image && !(bytes && labels_too)) return osteo::image_from_vtk(image);
      if (kind == DataKind::labels) return osteo::labels_from_vtk(image);
    }
    if (auto* const poly = vtkPolyData::SafeDownCast(object); poly != nullptr && kind == DataKind::surface) {
      return std::make_shared<const osteo::TriMesh>(osteo::mesh_from_vtk(poly));
    }
    if (auto* const cells = vtkUnstructuredGrid::SafeDownCast(object); cells != nullptr && kind == DataKind::tets) {
      return std::make_shared<const osteo::TetMesh>(osteo::tets_from_vtk(cells));
    }
  }
  throw osteo::Error(osteo::ExitCode::usage, "the input '" + port.name + "' cannot be a " + object->GetClassName());
}

}  // namespace

vtkOsteoStage::vtkOsteoStage() {
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(0);
}
vtkOsteoStage::~vtkOsteoStage() = default;

void vtkOsteoStage::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Stage: " << (this->Stage ? this->Stage->info().name : "(none)") << '\n';
  if (!this->Stage) return;
  for (const auto& f : this->Stage->fields()) os << indent << f.doc.name << ": " << f.to_text() << '\n';
}

bool vtkOsteoStage::SetStage(const osteo::Registry& registry, const std::string& name) {
  try {
    this->Stage = registry.make(name);
  } catch (const osteo::Error& e) {
    this->LastError = e.what();
    return false;
  }
  this->StageInputOfPort.clear();
  const auto& inputs = this->Stage->info().inputs;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    if (inputs[i].kinds.front() != DataKind::source) this->StageInputOfPort.push_back(static_cast<int>(i));
  }
  this->SetNumberOfInputPorts(static_cast<int>(this->StageInputOfPort.size()));
  this->SetNumberOfOutputPorts(static_cast<int>(this->Stage->info().outputs.size()));
  this->Results.clear();
  this->Modified();
  return true;
}

bool vtkOsteoStage::SetParameter(const std::string& name, const std::string& value) {
  this->LastError = "there is no parameter '" + name + "'";
  if (!this->Stage) return false;
  for (const auto& f : this->Stage->fields()) {
    if (f.doc.name != name) continue;
    const std::string before = f.to_text();
    try {
      f.from_text(value);
    } catch (const osteo::Error& e) {
      this->LastError = e.what();
      return false;
    }
    this->LastError.clear();
    if (f.to_text() != before) this->Modified();
    return true;
  }
  return false;
}

std::string vtkOsteoStage::GetParameter(const std::string& name) {
  if (this->Stage) {
    for (const auto& f : this->Stage->fields()) {
      if (f.doc.name == name) return f.to_text();
    }
  }
  return {};
}

void vtkOsteoStage::SetSourcePath(const std::string& path) {
  if (path == this->SourcePath) return;
  this->SourcePath = path;
  this->Modified();
}

void vtkOsteoStage::SetSourcePath(const std::string& input, const std::string& path) {
  auto& own = this->SourcePaths[input];
  if (path == own) return;
  own = path;
  this->Modified();
}

int vtkOsteoStage::GetInputPortIndex(const std::string& name) const {
  for (std::size_t p = 0; p < this->StageInputOfPort.size(); ++p) {
    if (this->Stage->info().inputs[static_cast<std::size_t>(this->StageInputOfPort[p])].name == name) return static_cast<int>(p);
  }
  return -1;
}

int vtkOsteoStage::GetOutputPortIndex(const std::string& name) const {
  const auto& outputs = this->Stage->info().outputs;
  for (std::size_t p = 0; p < outputs.size(); ++p) {
    if (outputs[p].name == name) return static_cast<int>(p);
  }
  return -1;
}

// VTK forgets a failure once data exist: a filter that failed stays newer than its output until it succeeds.
vtkMTimeType vtkOsteoStage::GetMTime() {
  if (this->Failed) this->MTime.Modified();
  return this->Superclass::GetMTime();
}

int vtkOsteoStage::FillInputPortInformation(int port, vtkInformation* info) {
  const osteo::Port& p = this->Stage->info().inputs[static_cast<std::size_t>(this->StageInputOfPort[static_cast<std::size_t>(port)])];
  std::vector<std::string> classes;
  for (const DataKind kind : p.kinds) {
    const std::string name = class_of(kind);
    if (std::find(classes.begin(), classes.end(), name) == classes.end()) classes.push_back(name);
  }
  info->Remove(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE());
  for (const auto& c : classes) info->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), c.c_str());
  if (p.optional) info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  return 1;
}

int vtkOsteoStage::FillOutputPortInformation(int port, vtkInformation* info) {
  info->Set(vtkDataObject::DATA_TYPE_NAME(), class_of(this->Stage->info().outputs[static_cast<std::size_t>(port)].kinds.front()));
  return 1;
}

vtkTypeBool vtkOsteoStage::ProcessRequest(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) {
  if (!this->Stage) {
    vtkErrorMacro("SetStage was not called");
    return 0;
  }
  if (request->Has(vtkDemandDrivenPipeline::REQUEST_DATA_OBJECT())) return this->CreateOutputs(outputs) ? 1 : 0;
  if (request->Has(vtkDemandDrivenPipeline::REQUEST_INFORMATION())) return this->Inform(inputs, outputs) ? 1 : 0;
  if (request->Has(Pipeline::REQUEST_UPDATE_EXTENT())) {
    // Every stage needs the whole of its inputs.
    for (int p = 0; p < this->GetNumberOfInputPorts(); ++p) {
      for (int c = 0; c < this->GetNumberOfInputConnections(p); ++c) {
        vtkInformation* const info = inputs[p]->GetInformationObject(c);
        if (!info->Has(Pipeline::WHOLE_EXTENT())) continue;
        int extent[6];
        info->Get(Pipeline::WHOLE_EXTENT(), extent);
        info->Set(Pipeline::UPDATE_EXTENT(), extent, 6);
      }
    }
    return 1;
  }
  if (request->Has(vtkDemandDrivenPipeline::REQUEST_DATA())) return this->Execute(inputs, outputs) ? 1 : 0;
  return this->Superclass::ProcessRequest(request, inputs, outputs);
}

bool vtkOsteoStage::CreateOutputs(vtkInformationVector* outputs) {
  const auto& ports = this->Stage->info().outputs;
  for (std::size_t p = 0; p < ports.size(); ++p) {
    vtkInformation* const info = outputs->GetInformationObject(static_cast<int>(p));
    const std::string wanted = class_of(ports[p].kinds.front());
    vtkDataObject* const present = info->Get(vtkDataObject::DATA_OBJECT());
    if (present != nullptr && present->IsA(wanted.c_str())) continue;
    vtkSmartPointer<vtkDataObject> fresh;
    if (wanted == "vtkImageData")
      fresh = vtkSmartPointer<vtkImageData>::New();
    else if (wanted == "vtkPolyData")
      fresh = vtkSmartPointer<vtkPolyData>::New();
    else if (wanted == "vtkUnstructuredGrid")
      fresh = vtkSmartPointer<vtkUnstructuredGrid>::New();
    else
      fresh = vtkSmartPointer<vtkOsteoDataObject>::New();
    info->Set(vtkDataObject::DATA_OBJECT(), fresh);
  }
  return true;
}

// Whoever reads an image wants to know its extent before it exists. Only the stage itself knows it (crop finds its box in the voxels), so
// a stage that makes an image is run here; Execute hands over what came out.
bool vtkOsteoStage::Inform(vtkInformationVector** inputs, vtkInformationVector* outputs) {
  const auto& ports = this->Stage->info().outputs;
  const bool makes_image = std::any_of(ports.begin(), ports.end(), [](const auto& p) { return is_image(p.kinds.front()); });
  if (!makes_image) return true;
  for (int p = 0; p < this->GetNumberOfInputPorts(); ++p) {
    for (int c = 0; c < this->GetNumberOfInputConnections(p); ++c) {
      vtkAlgorithmOutput* const from = this->GetInputConnection(p, c);
      from->GetProducer()->Update(from->GetIndex());
    }
    this->Results.clear();
  }
  if ((this->Results.empty() || this->ResultsTime < this->Superclass::GetMTime()) && !this->Run(inputs)) return false;
  for (std::size_t p = 0; p < ports.size(); ++p) {
    if (!is_image(ports[p].kinds.front())) continue;
    vtkSmartPointer<vtkImageData> image = vtkSmartPointer<vtkImageData>::New();  // empty, for an output that was not made
    if (const auto* i = std::get_if<osteo::Image>(&this->Results[p])) image = osteo::to_vtk(*i);
    if (const auto* l = std::get_if<osteo::Labels>(&this->Results[p])) image = osteo::to_vtk(*l);
    set_image_information(outputs->GetInformationObject(static_cast<int>(p)), image);
  }
  return true;
}

bool vtkOsteoStage::Run(vtkInformationVector** inputs) {
  const auto& info = this->Stage->info();
  this->Failed = false;
  this->LastError.clear();
  std::atomic<bool> cancel{false};
  osteo::Context context;
  context.set_cancel_flag(&cancel);
  // Observers of VTK expect to be called from the thread that updates the pipeline.
  const auto caller = std::this_thread::get_id();
  context.on_progress([&](double fraction, std::string_view) {
    if (std::this_thread::get_id() != caller) return;
    this->UpdateProgress(fraction);
    if (this->GetAbortExecute() != 0) cancel = true;
  });
  try {
    std::vector<osteo::Data> values(info.inputs.size());
    for (std::size_t i = 0; i < info.inputs.size(); ++i) {
      if (info.inputs[i].kinds.front() == DataKind::source) {
        const auto own = this->SourcePaths.find(info.inputs[i].name);
        const auto& path = own != this->SourcePaths.end() ? own->second : this->SourcePath;
        if (!path.empty()) values[i] = osteo::Source{path};
      }
    }
    for (std::size_t p = 0; p < this->StageInputOfPort.size(); ++p) {
      const auto i = static_cast<std::size_t>(this->StageInputOfPort[p]);
      if (this->GetNumberOfInputConnections(static_cast<int>(p)) == 0) continue;
      vtkDataObject* const object = inputs[p]->GetInformationObject(0)->Get(vtkDataObject::DATA_OBJECT());
      if (object != nullptr) values[i] = from_vtk(object, info.inputs[i]);
    }
    this->Results = this->Stage->run(values, context);
    this->LastReport = context.take_report();
    this->ResultsTime = this->Superclass::GetMTime();
    this->SetErrorCode(vtkErrorCode::NoError);
    return true;
  } catch (const osteo::Error& e) {
    this->Fail(&e, e.advice().empty() ? e.what() : std::string(e.what()) + ". " + e.advice());
  } catch (const std::exception& e) {
    this->Fail(nullptr, e.what());
  }
  return false;
}

bool vtkOsteoStage::Execute(vtkInformationVector** inputs, vtkInformationVector* outputs) {
  const bool ready = !this->Results.empty() && this->ResultsTime >= this->Superclass::GetMTime();
  if (!ready && !this->Run(inputs)) return false;
  for (std::size_t p = 0; p < this->Results.size(); ++p) {
    vtkInformation* const info = outputs->GetInformationObject(static_cast<int>(p));
    vtkDataObject* const object = info->Get(vtkDataObject::DATA_OBJECT());
    const osteo::Data& value = this->Results[p];
    if (std::holds_alternative<std::monostate>(value)) object->Initialize();  // an output that was not made, this time
    if (auto* const image = vtkImageData::SafeDownCast(object)) {
      if (const auto* i = std::get_if<osteo::Image>(&value)) image->ShallowCopy(osteo::to_vtk(*i));
      if (const auto* l = std::get_if<osteo::Labels>(&value)) image->ShallowCopy(osteo::to_vtk(*l));
    } else if (auto* const poly = vtkPolyData::SafeDownCast(object)) {
      if (const auto* s = std::get_if<osteo::Surface>(&value)) poly->ShallowCopy(osteo::to_vtk(**s));
    } else if (auto* const cells = vtkUnstructuredGrid::SafeDownCast(object)) {
      if (const auto* t = std::get_if<osteo::Tets>(&value)) cells->ShallowCopy(osteo::to_vtk(**t));
    } else if (auto* const own = vtkOsteoDataObject::SafeDownCast(object)) {
      own->SetValue(value);
    }
  }
  this->Results.clear();
  return true;
}

void vtkOsteoStage::Fail(const osteo::Error* error, const std::string& text) {
  this->Failed = true;
  this->Results.clear();
  this->LastError = text;
  const auto code = error != nullptr ? error->code() : osteo::ExitCode::unspecified;
  unsigned long vtk_code = vtkErrorCode::UserError + static_cast<unsigned long>(code);
  if (code == osteo::ExitCode::no_input) vtk_code = vtkErrorCode::FileNotFoundError;
  if (code == osteo::ExitCode::cannot_read) vtk_code = vtkErrorCode::CannotOpenFileError;
  if (code == osteo::ExitCode::corrupt) vtk_code = vtkErrorCode::FileFormatError;
  this->SetErrorCode(vtk_code);
  vtkErrorMacro(<< this->Stage->info().name << ": " << text);
}
