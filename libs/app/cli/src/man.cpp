// Man pages, made from the help that is made from the declarations; and all that an installation shares.
#include <algorithm>
#include <sstream>

#include "describe.h"
#include "osteo/app/cli/report.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/pipeline/pipeline.h"

namespace osteo::inline app::cli {
namespace {

// roff's own characters lose their meaning: a backslash anywhere, a dot or an apostrophe at the beginning of a line,
// and hyphens stay.
std::string roff(std::string_view text) {
  std::string out;
  bool first = true;
  for (const char c : text) {
    if (first && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
    first = c == '\n';
  }
  return out;
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace

std::string man_page(const Program& program, const std::string& subject) {
  const std::string title = subject.empty() ? "osteo" : "osteo-" + subject;
  std::string synopsis, help;
  if (subject.empty()) {
    const std::size_t colon = program.about.find(": ");
    synopsis = colon == std::string::npos ? program.about : program.about.substr(colon + 2);
    help = program_help(program, true);
  } else if (Command* const command = program.find(subject); command != nullptr) {
    synopsis = command->info().synopsis;
    help = command_help(*command);
  } else {
    const auto stage = program.registry.make(subject);
    synopsis = stage->info().synopsis;
    help = stage_help(*stage);
  }
  std::ostringstream out;
  const std::string version(program_version());
  out << ".TH \"" << upper(title) << "\" 1 \"\" \"osteo " << version.substr(0, version.find(' '))
      << "\" \"Osteotome\"\n.SH NAME\n"
      << roff(title) << " \\- " << roff(synopsis) << "\n.SH SYNOPSIS\n";
  // A line "Usage: ..." is the synopsis; one that ends with a colon and is not indented heads a section.
  std::istringstream lines(help);
  std::string line, usage;
  std::vector<std::string> rest;
  std::getline(lines, line);  // the name again
  while (std::getline(lines, line)) {
    if (line.starts_with("Usage: "))
      usage = line.substr(7);
    else
      rest.push_back(line);
  }
  out << ".nf\n"
      << roff(usage.empty() ? "osteo STAGE|COMMAND [arguments] [flags]" : usage) << "\n.fi\n.SH DESCRIPTION\n.nf\n";
  for (const std::string& l : rest) {
    if (l.size() > 1 && l[0] != ' ' && l.back() == ':' && l.size() < 60)
      out << ".fi\n.SH \"" << roff(upper(l.substr(0, l.size() - 1))) << "\"\n.nf\n";
    else
      out << roff(l) << '\n';
  }
  out << ".fi\n.SH \"EXIT STATUS\"\n";
  for (const auto& d : exit_code_table)
    out << ".TP\n" << static_cast<int>(d.code) << '\n' << roff(std::string(d.meaning)) << '\n';
  out << ".SH NOTES\nNot a medical device: for rehearsal, teaching and research, not for treatment decisions.\n";
  return out.str();
}

std::map<std::string, std::string> shared_files(const Program& program) {
  std::map<std::string, std::string> files;
  files["man/man1/osteo.1"] = man_page(program, "");
  for (const auto& name : program.registry.names()) {
    files["man/man1/osteo-" + name + ".1"] = man_page(program, name);
    const std::string module = "osteo/slicer/" + slicer_module_name(name);
    files[module] = slicer_module_script(name);
    files[module + ".xml"] = stage_xml(*program.registry.make(name), group_of(program, name));
  }
  for (const auto& c : program.commands)
    files["man/man1/osteo-" + c->info().name + ".1"] = man_page(program, c->info().name);
  files["bash-completion/completions/osteo"] = bash_completion(program);
  files["zsh/site-functions/_osteo"] = zsh_completion(program);
  files["fish/vendor_completions.d/osteo.fish"] = fish_completion(program);
  return files;
}

}  // namespace osteo::inline app::cli
