// The verbs of osteo beside its stages.
#pragma once
#include <string>

#include "osteo/cli/command.h"

namespace osteo {

struct ListCommand {
  struct Params {};
  static void describe(Params&, auto&) {}
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct InfoCommand {
  struct Params {};
  static void describe(Params&, auto&) {}
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct SeriesCommand {
  struct Params {};
  static void describe(Params&, auto&) {}
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct RunCommand {
  struct Params {
    bool validate = false;
    bool dry_run = false;
    bool reuse = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"validate", "check the whole pipeline without reading any data, answer in JSON, and stop"}, p.validate);
    visit({"dry_run", "show what would be run and written, and stop"}, p.dry_run);
    visit({"reuse", "keep outputs that exist and would come out the same"}, p.reuse);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

struct DocsCommand {
  struct Params {
    bool check = false;
  };
  static void describe(Params& p, auto& visit) { visit({"check", "compare instead of writing; fails when a page is stale"}, p.check); }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

/// All stages and commands of osteo.
[[nodiscard]] cli::Program& osteo_program();

}  // namespace osteo
