#include "osteo/app/vtk/vtkOsteoStage.h"

#include <vtkAlgorithmOutput.h>
#include <vtkDataObject.h>
#include <vtkDemandDrivenPipeline.h>
#include <vtkErrorCode.h>
#include <vtkExecutive.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "failure.h"
#include "values.h"

using osteo::class_of;
using osteo::DataKind;
using osteo::is_image;
using Pipeline = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkOsteoStage);

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
  const auto fields = this->Stage->fields();
  const osteo::FieldRef* const field = osteo::find_field(fields, name);
  if (field == nullptr) return false;
  const std::string before = field->to_text();
  try {
    field->from_text(value);
  } catch (const osteo::Error& e) {
    this->LastError = e.what();
    return false;
  }
  this->LastError.clear();
  if (field->to_text() != before) this->Modified();
  return true;
}

std::string vtkOsteoStage::GetParameter(const std::string& name) {
  if (this->Stage) {
    const auto fields = this->Stage->fields();
    if (const osteo::FieldRef* const field = osteo::find_field(fields, name); field != nullptr) return field->to_text();
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

void vtkOsteoStage::SetThreads(int threads) {
  this->Threads = threads;
}

void vtkOsteoStage::SetSeed(std::uint64_t seed) {
  if (seed == this->Seed) return;
  this->Seed = seed;
  this->Modified();
}

int vtkOsteoStage::GetInputPortIndex(const std::string& name) const {
  for (std::size_t p = 0; p < this->StageInputOfPort.size(); ++p) {
    if (this->Stage->info().inputs[static_cast<std::size_t>(this->StageInputOfPort[p])].name == name)
      return static_cast<int>(p);
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
  const osteo::Port& p =
      this->Stage->info().inputs[static_cast<std::size_t>(this->StageInputOfPort[static_cast<std::size_t>(port)])];
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
  info->Set(vtkDataObject::DATA_TYPE_NAME(),
            class_of(this->Stage->info().outputs[static_cast<std::size_t>(port)].kinds.front()));
  return 1;
}

vtkTypeBool vtkOsteoStage::ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                                          vtkInformationVector* outputs) {
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
    osteo::make_object(outputs->GetInformationObject(static_cast<int>(p)), ports[p].kinds.front());
  }
  return true;
}

// Whoever reads an image wants to know its extent before it exists. Only the stage itself knows it (crop finds its box
// in the voxels), so a stage that makes an image is run here; Execute hands over what came out.
bool vtkOsteoStage::Inform(vtkInformationVector** inputs, vtkInformationVector* outputs) {
  const auto& ports = this->Stage->info().outputs;
  const bool makes_image =
      std::any_of(ports.begin(), ports.end(), [](const auto& p) { return is_image(p.kinds.front()); });
  if (!makes_image) return true;
  for (int p = 0; p < this->GetNumberOfInputPorts(); ++p) {
    for (int c = 0; c < this->GetNumberOfInputConnections(p); ++c) {
      vtkAlgorithmOutput* const from = this->GetInputConnection(p, c);
      if (from->GetProducer()->GetExecutive()->Update(from->GetIndex()) == 0) return false;  // it has said why
    }
    this->Results.clear();
  }
  if ((this->Results.empty() || this->ResultsTime < this->Superclass::GetMTime()) && !this->Run(inputs)) return false;
  for (std::size_t p = 0; p < ports.size(); ++p) {
    if (!is_image(ports[p].kinds.front())) continue;
    osteo::inform(outputs->GetInformationObject(static_cast<int>(p)), this->Results[p]);
  }
  return true;
}

bool vtkOsteoStage::Run(vtkInformationVector** inputs) {
  const auto& info = this->Stage->info();
  this->Failed = false;
  this->Failure = nullptr;
  this->LastError.clear();
  // VTK forgets an abort when it asks for data; a stage may be run before that.
  this->AbortExecute = 0;
  std::atomic<bool> cancel{false};
  osteo::Context alone;
  alone.threads = this->Threads;
  alone.seed = this->Seed;
  alone.set_cancel_flag(&cancel);
  // Observers of VTK expect to be called from the thread that updates the pipeline.
  const auto caller = std::this_thread::get_id();
  alone.on_progress([&](double fraction, std::string_view) {
    if (std::this_thread::get_id() != caller) return;
    this->UpdateProgress(fraction);
    if (this->GetAbortExecute() != 0) cancel = true;
  });
  const osteo::Context& context = this->Surroundings != nullptr ? *this->Surroundings : alone;
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
      if (object != nullptr) values[i] = osteo::value_of(object, info.inputs[i].kinds, info.inputs[i].name);
    }
    this->Results = this->Stage->run(values, context);
    if (this->Surroundings == nullptr) {
      context.check_cancelled();  // asked for in the last progress
      this->LastReport = context.take_report();
    }
    this->ResultsTime = this->Superclass::GetMTime();
    this->SetErrorCode(vtkErrorCode::NoError);
    return true;
  } catch (const std::exception&) {
    this->Fail();
  }
  return false;
}

bool vtkOsteoStage::Execute(vtkInformationVector** inputs, vtkInformationVector* outputs) {
  const bool ready = !this->Results.empty() && this->ResultsTime >= this->Superclass::GetMTime();
  if (!ready && !this->Run(inputs)) return false;
  for (std::size_t p = 0; p < this->Results.size(); ++p) {
    osteo::fill(outputs->GetInformationObject(static_cast<int>(p))->Get(vtkDataObject::DATA_OBJECT()),
                this->Results[p]);
  }
  this->Results.clear();
  return true;
}

void vtkOsteoStage::Fail() {
  this->Failed = true;
  this->Failure = std::current_exception();
  this->Results.clear();
  const osteo::VtkFailure failure = osteo::vtk_failure(this->Failure);
  this->LastError = failure.text;
  this->SetErrorCode(failure.code);
  vtkErrorMacro(<< this->Stage->info().name << ": " << failure.text);
}
