// The page that a case is chosen on.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "osteo/app/window/person_settings.h"
#include "osteo/app/window/window_shell.h"

namespace osteo::inline app {

struct StartChoice {
  std::filesystem::path case_folder;
  std::filesystem::path resume;  ///< a session to go on from; empty: from the whole bone
  bool teach = false;            ///< others may join it
};

/// A procedure to choose: by its name for load_procedure(), and as people call it.
struct StartProcedure {
  std::string id, name;
};

struct StartOptions {
  std::string message;               ///< why one is here again, such as what is wrong with a case
  std::filesystem::path folder;      ///< that the browser begins in; empty: the current one
  std::filesystem::path state_file;  ///< as of the rehearsal's window
  std::function<bool()> stop;        ///< asked before each picture
  std::vector<StartProcedure> procedures;
  std::filesystem::path osteo;  ///< the program that makes cases; empty: none are made here
};

/// What a path that was dropped stands for: a case, a session or a file that one is known by; else nothing, and `why`
/// says what to do.
[[nodiscard]] std::optional<StartChoice> choice_of(const std::filesystem::path& path, std::string& why);
/// The same for several dropped at once: the first that is one counts; `why` is about the first.
[[nodiscard]] std::optional<StartChoice> choice_of(const std::vector<std::filesystem::path>& paths, std::string& why);

/// Runs until something is chosen; nothing: the person closes the window. Cases opened last come from `person`, whose
/// choices on the page are changed there.
[[nodiscard]] std::optional<StartChoice> run_start_page(WindowShell& shell, PersonSettings& person,
                                                        const StartOptions& options);

}  // namespace osteo::inline app
