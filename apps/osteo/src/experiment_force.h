// Force-skill training, as 'osteo experiment' has it.
#pragma once
#include "commands/experiment.h"

namespace osteo {

[[nodiscard]] bool is_force_experiment(const std::string& which);
int run_force_experiment(const ExperimentCommand::Params& params, cli::Invocation& io);

}  // namespace osteo
