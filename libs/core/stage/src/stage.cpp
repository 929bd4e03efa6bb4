#include "osteo/core/stage/stage.h"

#include <algorithm>

#include "osteo/core/base/error.h"

namespace osteo {

std::string kinds_text(std::span<const DataKind> kinds) {
  std::string text;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (i > 0) text += i + 1 == kinds.size() ? " or " : ", ";
    text += kind_name(kinds[i]);
  }
  return text;
}

std::vector<Data> Stage::run(std::span<const Data> inputs, const Context& context) const {
  const auto& ports = info().inputs;
  if (inputs.size() != ports.size()) {
    throw Error(ExitCode::usage, "stage '" + info().name + "' takes " + std::to_string(ports.size()) + " inputs, not " +
                                     std::to_string(inputs.size()));
  }
  for (std::size_t i = 0; i < ports.size(); ++i) {
    const DataKind kind = kind_of(inputs[i]);
    if (kind == DataKind::none) {
      if (ports[i].optional) continue;
      throw Error(ExitCode::usage, "stage '" + info().name + "' needs its input '" + ports[i].name + "'");
    }
    if (std::find(ports[i].kinds.begin(), ports[i].kinds.end(), kind) == ports[i].kinds.end()) {
      throw Error(ExitCode::usage, "stage '" + info().name + "' takes " + kinds_text(ports[i].kinds) + " as '" +
                                       ports[i].name + "', not " + std::string(kind_name(kind)));
    }
  }
  return do_run(inputs, context);
}

std::unique_ptr<Stage> Registry::make(std::string_view name) const {
  const std::string_view wanted = current_command(name);
  for (const auto maker : makers_) {
    auto stage = maker();
    if (stage->info().name == wanted) return stage;
  }
  const std::string near = nearest_name(name, names());
  throw Error(ExitCode::usage, "there is no stage '" + std::string(name) + "'",
              near.empty() ? "'osteo list' shows the stages" : "did you mean '" + near + "'?");
}

bool Registry::has(std::string_view name) const {
  const auto all = names();
  return std::find(all.begin(), all.end(), current_command(name)) != all.end();
}

std::vector<std::string> Registry::names() const {
  std::vector<std::string> result;
  for (const auto maker : makers_) result.push_back(maker()->info().name);
  return result;
}

}  // namespace osteo
