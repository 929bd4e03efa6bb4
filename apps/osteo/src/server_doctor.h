// doctor --server.
#pragma once
#include <string>

#include "pacs_commands.h"

namespace osteo {

/// Exit code failed when something that the services need will not work.
int doctor_of_server(const DoctorCommand::Params& p, cli::Invocation& io);

/// What draws pictures on this machine; empty: nothing.
std::string opengl_here();

}  // namespace osteo
