#include "pipes.h"

#include <algorithm>
#include <iterator>

#include "osteo/core/base/error.h"

namespace osteo::inline app::cli {

const fs::path& Pipes::folder() {
  if (!folder_) folder_.emplace();
  return folder_->path();
}

fs::path Pipes::input(const Port& port, std::istream& in) {
  const auto takes = [&](DataKind k) { return std::find(port.kinds.begin(), port.kinds.end(), k) != port.kinds.end(); };
  if (!takes(DataKind::source) && !takes(DataKind::document))
    throw Error(ExitCode::usage,
                "'" + port.name + "' cannot come through a pipe: " + kinds_text(port.kinds) +
                    " is read by the suffix of its file, in any order",
                "give a file");
  if (read_) throw Error(ExitCode::usage, "two inputs are '-', and there is one standard input", "give a file for one");
  read_ = true;
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (text.empty()) throw Error(ExitCode::no_input, "standard input is empty", "'" + port.name + "' is read from it");
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  const bool json = first != std::string::npos && (text[first] == '{' || text[first] == '[');
  const fs::path path = folder() / (json ? "standard-input.json" : "standard-input.csv");
  write_file(path, text);
  return path;
}

fs::path Pipes::output(const Port& port) {
  if (port.kinds.front() != DataKind::document)
    throw Error(ExitCode::usage,
                "'" + port.name + "' cannot go through a pipe: " + kinds_text(port.kinds) +
                    " is written whole, with its provenance in a file beside it",
                "give a file name; its suffix is the format");
  if (!output_.empty())
    throw Error(ExitCode::usage, "two outputs are '-', and there is one standard output", "give a file for one");
  output_ = folder() / "standard-output.json";
  return output_;
}

void Pipes::flush(std::ostream& out) const {
  if (!output_.empty()) out << read_text(output_);
}

}  // namespace osteo::inline app::cli
