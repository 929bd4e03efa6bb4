// Other ways to do the work of a pipeline's steps: who runs them is exchanged, what is written, kept and recorded is
// not.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/imaging/pipeline/pipeline.h"

namespace osteo::inline imaging {

/// Does the work of steps. Asked by one thread, for one step after the other, each after those that it reads.
class Engine {
 public:
  virtual ~Engine() = default;
  /// One value an output port of the step, in the order of its ports. Progress, cancellation, threads, seed and report
  /// are the context's. Throws what the stage throws, as it is.
  [[nodiscard]] virtual std::vector<Data> run(const std::string& id, const Context& context) = 0;
  /// No step that is still to come reads this one.
  virtual void release(const std::string& id) = 0;
};

/// Makes an engine for the steps that are to be run, in an order in which they can be. An input that comes from a step
/// which is not run, since its output is there and fresh, is that file.
using MakeEngine = std::function<std::unique_ptr<Engine>(const Pipeline& to_run)>;

/// As run_pipeline(), with the steps done by an engine: same checks, same files, same records, same errors.
std::vector<NodeResult> run_pipeline(Pipeline pipeline, const Registry& registry, const RunOptions& options,
                                     const Context& context, const MakeEngine& make_engine);

/// Where each step begins in a pipeline file: id -> line, from 1. Errors: usage, as of parse_pipeline().
[[nodiscard]] std::map<std::string, std::size_t> step_lines(std::string_view json);

}  // namespace osteo::inline imaging
