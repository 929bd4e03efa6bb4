#include "osteo/app/vtk/pipeline.h"

#include <vtkAlgorithmOutput.h>
#include <vtkDataObject.h>
#include <vtkExecutive.h>

#include "osteo/app/vtk/vtkOsteoDataObject.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/io/vtk_data.h"
#include "values.h"

namespace osteo::inline app {
namespace {

// Step, reader or writer, for as long as a program's surroundings are its own.
template <class Algorithm>
class Surrounded {
 public:
  Surrounded(Algorithm* algorithm, const Context& context) : algorithm_(algorithm) { algorithm_->SetContext(&context); }
  ~Surrounded() { algorithm_->SetContext(nullptr); }
  Surrounded(const Surrounded&) = delete;
  Surrounded& operator=(const Surrounded&) = delete;

 private:
  Algorithm* algorithm_;
};

class VtkEngine final : public Engine {
 public:
  VtkEngine(Pipeline pipeline, const Registry& registry) : filters_(without_outputs(std::move(pipeline)), registry) {}

  std::vector<Data> run(const std::string& id, const Context& context) override {
    vtkOsteoStage* const filter = filters_.step(id);
    const QuietVtk quiet;
    for (const auto& [port, reader] : filters_.readers(id)) {
      const Surrounded<vtkOsteoReader> here(reader, context);
      update(reader.GetPointer(), quiet);
    }
    static_cast<void>(context.take_report());  // what was read is no finding of the step
    const Surrounded<vtkOsteoStage> here(filter, context);
    update(filter, quiet);
    std::vector<Data> values;
    for (int p = 0; p < filter->GetNumberOfOutputPorts(); ++p) {
      vtkDataObject* const object = filter->GetOutputDataObject(p);
      if (const auto* const own = vtkOsteoDataObject::SafeDownCast(object)) {
        values.push_back(own->GetValue());
      } else {
        const Data* const value = vtkOsteoDataObject::GetAttached(object);
        values.push_back(value != nullptr ? *value : Data());
      }
    }
    for (const auto& [port, reader] : filters_.readers(id)) drop(reader->GetOutputDataObject(0));
    return values;
  }

  void release(const std::string& id) override {
    vtkOsteoStage* const filter = filters_.step(id);
    for (int p = 0; p < filter->GetNumberOfOutputPorts(); ++p) drop(filter->GetOutputDataObject(p));
  }

 private:
  static Pipeline without_outputs(Pipeline pipeline) {
    for (PipelineNode& node : pipeline.nodes) node.outputs.clear();
    return pipeline;
  }

  template <class Algorithm>
  static void update(Algorithm* algorithm, const QuietVtk& quiet) {
    if (algorithm->GetExecutive()->Update() != 0) return;
    if (const std::exception_ptr thrown = algorithm->TakeFailure()) std::rethrow_exception(thrown);
    throw Error(ExitCode::unspecified, "VTK did not run it: " + quiet.first_message());
  }

  static void drop(vtkDataObject* object) {
    vtkOsteoDataObject::Detach(object);
    object->ReleaseData();
  }

  VtkPipeline filters_;
};

}  // namespace

VtkPipeline::VtkPipeline(Pipeline pipeline, const Registry& registry, const VtkPipelineOptions& options,
                         std::function<std::string(const std::string&)> where)
    : where_(std::move(where)) {
  validate(pipeline, registry);
  for (const PipelineNode& node : pipeline.nodes) {
    ids_.push_back(node.id);
    Step& step = steps_[node.id];
    step.filter = vtkSmartPointer<vtkOsteoStage>::New();
    vtkOsteoStage* const filter = step.filter;
    bool done = filter->SetStage(registry, node.stage);
    filter->SetThreads(options.threads);
    filter->SetSeed(options.seed);
    for (const auto& [name, value] : node.params) done = done && filter->SetParameter(name, value);
    if (!done)
      throw Error(ExitCode::usage, "stage '" + node.id + "': " + filter->GetLastError());  // not after validate()
    const auto stage = registry.make(node.stage);
    for (const Port& port : stage->info().inputs) {
      const auto from = node.inputs.find(port.name);
      if (from == node.inputs.end()) continue;
      const int p = filter->GetInputPortIndex(port.name);
      if (p < 0) {
        filter->SetSourcePath(port.name, from->second.file.string());
      } else if (from->second.node.empty()) {
        const auto reader = vtkSmartPointer<vtkOsteoReader>::New();
        reader->SetFileName(from->second.file.string());
        reader->SetKinds(port.kinds);
        filter->SetInputConnection(p, reader->GetOutputPort());
        step.readers[port.name] = reader;
      } else {
        filter->SetInputConnection(p, output(from->second.node, from->second.port));
      }
    }
    for (const Port& port : stage->info().outputs) {
      const auto to = node.outputs.find(port.name);
      if (to == node.outputs.end()) continue;
      const auto writer = vtkSmartPointer<vtkOsteoWriter>::New();
      writer->SetFileName(to->second.string());
      writer->SetOverwrite(options.overwrite);
      if (is_image(port.kinds.front())) writer->SetKind(port.kinds.front());
      writer->SetInputConnection(output(node.id, port.name));
      step.writers[port.name] = writer;
    }
  }
}

const VtkPipeline::Step& VtkPipeline::at(const std::string& id) const {
  const auto it = steps_.find(id);
  if (it != steps_.end()) return it->second;
  const std::string near = nearest_name(id, ids_);
  throw Error(ExitCode::usage, "the pipeline has no stage '" + id + "'",
              near.empty() ? "" : "did you mean '" + near + "'?");
}

vtkOsteoStage* VtkPipeline::step(const std::string& id) const {
  return at(id).filter;
}

vtkAlgorithmOutput* VtkPipeline::output(const std::string& id, const std::string& port) const {
  vtkOsteoStage* const filter = at(id).filter;
  const int p = port.empty() ? 0 : filter->GetOutputPortIndex(port);
  if (p < 0 || p >= filter->GetNumberOfOutputPorts())
    throw Error(ExitCode::usage, "stage '" + id + "' has no output '" + port + "'");
  return filter->GetOutputPort(p);
}

const std::map<std::string, vtkSmartPointer<vtkOsteoReader>>& VtkPipeline::readers(const std::string& id) const {
  return at(id).readers;
}
const std::map<std::string, vtkSmartPointer<vtkOsteoWriter>>& VtkPipeline::writers(const std::string& id) const {
  return at(id).writers;
}

void VtkPipeline::update(const std::string& id) {
  bring_up_to_date(at(id).filter);
}

void VtkPipeline::write() {
  for (const std::string& id : ids_) {
    for (const auto& [port, writer] : at(id).writers) bring_up_to_date(writer);
  }
}

void VtkPipeline::bring_up_to_date(vtkAlgorithm* algorithm) {
  const QuietVtk quiet;
  // What went wrong earlier, and was not asked for, is not what goes wrong now.
  const auto take = [](Step& step) {
    std::exception_ptr first;
    const auto keep = [&](const std::exception_ptr& thrown) {
      if (!first) first = thrown;
    };
    for (const auto& [port, reader] : step.readers) keep(reader->TakeFailure());
    keep(step.filter->TakeFailure());
    for (const auto& [port, writer] : step.writers) keep(writer->TakeFailure());
    return first;
  };
  for (auto& [id, step] : steps_) static_cast<void>(take(step));
  if (algorithm->GetExecutive()->Update() != 0) return;
  for (const std::string& id : ids_) {
    if (const std::exception_ptr thrown = take(steps_.at(id))) rethrow(id, thrown);
  }
  throw Error(ExitCode::unspecified, "VTK did not run the pipeline: " + quiet.first_message());
}

void VtkPipeline::rethrow(const std::string& id, const std::exception_ptr& thrown) const {
  const std::string where = (where_ ? where_(id) + ": " : std::string()) + "stage '" + id + "'";
  try {
    std::rethrow_exception(thrown);
  } catch (const ErrorWithDocument& e) {
    throw ErrorWithDocument(e.in(where), e.port(), e.document(), e.picture());
  } catch (const Error& e) {
    throw e.in(where);
  } catch (const std::bad_alloc&) {
    throw Error(ExitCode::resources, where + " ran out of memory", "use larger voxels or a smaller region");
  }
}

VtkPipeline load_vtk_pipeline(const fs::path& file, const std::map<std::string, std::string>& settings,
                              const Registry& registry, const VtkPipelineOptions& options) {
  const std::string text = read_text(file), name = "'" + file.string() + "'";
  try {
    Pipeline pipeline = parse_pipeline(text, settings);
    const auto where = [name, lines = step_lines(text)](const std::string& id) {
      return name + " line " + std::to_string(lines.at(id));
    };
    // One step at a time knows of itself only; whose error it is stands in its text, so the line is looked up by that.
    try {
      return {std::move(pipeline), registry, options, where};
    } catch (const Error& e) {
      for (const auto& [id, line] : step_lines(text)) {
        if (std::string_view(e.what()).starts_with("stage '" + id + "'"))
          throw Error(e.code(), "line " + std::to_string(line) + ": " + e.what(), e.advice());
      }
      throw;
    }
  } catch (const Error& e) {
    throw e.in(name);
  }
}

MakeEngine vtk_engine(const Registry& registry) {
  return [&registry](const Pipeline& to_run) { return std::make_unique<VtkEngine>(to_run, registry); };
}

}  // namespace osteo::inline app
