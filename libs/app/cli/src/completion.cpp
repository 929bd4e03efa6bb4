// Completion for the shells, made from the declarations.
#include <sstream>

#include "describe.h"

namespace osteo::inline app::cli {
namespace {

// A word in single quotes, for a shell.
std::string shell_word(std::string_view text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

struct Flag {
  std::string flag, help;
  bool takes_value = true;
  std::vector<std::string> choices;
};

Flag flag_of(const FieldRef& f) {
  Flag flag{f.flag(), std::string(f.doc.help), f.kind() != "flag", {}};
  if (const auto* c = std::get_if<FieldRef::Choice>(&f.target)) flag.choices.assign(c->names.begin(), c->names.end());
  return flag;
}

// A stage or command with all its flags.
struct Word {
  std::string name, synopsis;
  std::vector<Flag> flags;
};

std::vector<Word> words_of(const Program& program) {
  std::vector<Word> words;
  const auto add_common = [](Word& w) {
    for (const FieldRef& f : common_fields()) w.flags.push_back(flag_of(f));
    w.flags.push_back({"--help", "all of it", false, {}});
  };
  for (const auto& name : program.registry.names()) {
    const auto stage = program.registry.make(name);
    Word w{name, stage->info().synopsis, {}};
    for (const FieldRef& f : stage->fields()) w.flags.push_back(flag_of(f));
    for (const Port& p : stage->info().inputs) {
      if (p.optional) w.flags.push_back({"--" + p.name, p.help, true, {}});
    }
    for (const Port& p : stage->info().outputs) {
      if (p.optional) w.flags.push_back({output_flag(p), p.help, true, {}});
    }
    add_common(w);
    words.push_back(std::move(w));
  }
  for (const auto& c : program.commands) {
    Word w{c->info().name, c->info().synopsis, {}};
    for (const FieldRef& f : c->fields()) w.flags.push_back(flag_of(f));
    if (c->info().takes_settings) w.flags.push_back({"--set", "NAME=VALUE", true, {}});
    add_common(w);
    words.push_back(std::move(w));
  }
  return words;
}

}  // namespace

std::string bash_completion(const Program& program) {
  std::ostringstream out;
  out << "# bash completion of osteo: source it, or put it into /etc/bash_completion.d\n_osteo() {\n  local "
         "cur=${COMP_WORDS[COMP_CWORD]} "
         "prev=${COMP_WORDS[COMP_CWORD-1]}\n"
      << "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n    COMPREPLY=($(compgen -W \"";
  for (const auto& name : program.registry.names()) out << name << ' ';
  for (const auto& c : program.commands) out << c->info().name << ' ';
  out << "help --version\" -- \"$cur\"))\n    return\n  fi\n  case \"${COMP_WORDS[1]} $prev\" in\n";
  const auto choices = [&](const std::string& name, const std::vector<FieldRef>& fields) {
    for (const FieldRef& f : fields) {
      const auto* c = std::get_if<FieldRef::Choice>(&f.target);
      if (c == nullptr) continue;
      out << "    \"" << name << ' ' << f.flag() << "\") COMPREPLY=($(compgen -W \"";
      for (const auto v : c->names) out << v << ' ';
      out << "\" -- \"$cur\")); return ;;\n";
    }
  };
  for (const auto& name : program.registry.names()) choices(name, program.registry.make(name)->fields());
  for (const auto& c : program.commands) choices(c->info().name, c->fields());
  out << "  esac\n  local flags=\"";
  for (const FieldRef& f : common_fields()) out << f.flag() << ' ';
  out << "--help\"\n  case \"${COMP_WORDS[1]}\" in\n";
  for (const auto& name : program.registry.names()) {
    const auto stage = program.registry.make(name);
    out << "    " << name << ") flags=\"$flags --xml --describe";
    for (const FieldRef& f : stage->fields()) out << ' ' << f.flag();
    for (const Port& p : stage->info().inputs) {
      if (p.optional) out << " --" << p.name;
    }
    for (const Port& p : stage->info().outputs) {
      if (p.optional) out << ' ' << output_flag(p);
    }
    out << "\" ;;\n";
  }
  for (const auto& c : program.commands) {
    out << "    " << c->info().name << ") flags=\"$flags";
    for (const FieldRef& f : c->fields()) out << ' ' << f.flag();
    out << "\" ;;\n";
  }
  out << "  esac\n  case \"$cur\" in\n    -*) COMPREPLY=($(compgen -W \"$flags\" -- \"$cur\")) ;;\n    *) "
         "COMPREPLY=($(compgen -f -- "
         "\"$cur\")) ;;\n  esac\n}\ncomplete -o filenames -F _osteo osteo ./osteo\n";
  return out.str();
}

std::string zsh_completion(const Program& program) {
  std::ostringstream out;
  out << "#compdef osteo\n# completion of zsh for osteo: a file _osteo in a folder of $fpath\n_osteo() {\n  local -a "
         "words_\n  if (( CURRENT == 2 )); then\n";
  const auto words = words_of(program);
  // A colon parts a word from its description.
  const auto plain = [](std::string text) {
    for (char& c : text) c = c == ':' || c == '[' || c == ']' ? ' ' : c;
    return text;
  };
  // The same groups as in the help, each with its title.
  int number = 0;
  for (const Group& g : program.grouped()) {
    out << "    words_=(\n";
    for (const std::string& name : g.members)
      out << "      " << shell_word(name + ":" + plain(program.synopsis_of(name))) << '\n';
    out << "    )\n    _describe -t group" << ++number << ' ' << shell_word(g.title) << " words_\n";
  }
  out << "    return\n  fi\n  case $words[2] in\n";
  for (const Word& w : words) {
    out << "    " << w.name << ")\n      _arguments '1: ' '*:file:_files'";
    for (const Flag& f : w.flags) {
      std::string spec = f.flag + "[" + plain(f.help) + "]";
      if (f.takes_value) {
        spec += ":value:";
        if (f.choices.empty()) {
          spec += "_files";
        } else {
          spec += "(";
          for (const auto& c : f.choices) spec += (spec.back() == '(' ? "" : " ") + c;
          spec += ")";
        }
      }
      out << " \\\n        " << shell_word(spec);
    }
    out << " ;;\n";
  }
  out << "  esac\n}\n_osteo \"$@\"\n";
  return out.str();
}

std::string fish_completion(const Program& program) {
  std::ostringstream out;
  out << "# completion of fish for osteo: a file osteo.fish in a folder of $fish_complete_path\n";
  for (const Word& w : words_of(program)) {
    out << "complete -c osteo -n __fish_use_subcommand -f -a " << w.name << " -d " << shell_word(w.synopsis) << '\n';
    for (const Flag& f : w.flags) {
      out << "complete -c osteo -n '__fish_seen_subcommand_from " << w.name << "' -l " << f.flag.substr(2);
      if (f.takes_value) out << " -r";
      if (!f.choices.empty()) {
        std::string all;
        for (const auto& c : f.choices) all += (all.empty() ? "" : " ") + c;
        out << " -f -a " << shell_word(all);
      }
      out << " -d " << shell_word(f.help) << '\n';
    }
  }
  return out.str();
}

}  // namespace osteo::inline app::cli
