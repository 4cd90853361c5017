#include "daemon/commands/word_check.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/nearest_name.hpp"

namespace splid {
namespace {

std::string suggested(std::string_view word, const std::vector<std::string>& names) {
  std::vector<const char*> known;
  known.reserve(names.size());
  for (const std::string& name : names) known.push_back(name.c_str());
  return suggest_name(word, known);
}

// The command that the first words name. so_far: these words are appended to it.
const CLI::App* find_command(const CLI::App& app, int argc, char** argv, std::string& so_far) {
  const CLI::App* command = &app;
  for (int i = 1; i < argc && argv[i][0] != '-'; ++i) {
    const std::string word = argv[i];
    std::vector<std::string> names;
    const CLI::App* next = nullptr;
    for (const CLI::App* sub : command->get_subcommands(nullptr)) {
      names.push_back(sub->get_name());
      if (names.back() == word) next = sub;
    }
    if (names.empty()) break;
    if (next == nullptr) {
      std::string sentence = "no command '" + word + "'";
      sentence.append(suggested(word, names)).append(" (").append(so_far);
      throw Error(Fault::usage, sentence.append(" --help lists all)"));
    }
    command = next;
    so_far += " " + word;
  }
  return command;
}

// Adds the names of the options of a command and of all its subcommands.
void add_options(const CLI::App& command, std::vector<std::string>& names) {
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  for (const CLI::App* sub : command.get_subcommands(nullptr)) add_options(*sub, names);
}

// "--name" for "--name=value", "-n" for "-nvalue"; empty for a value such as -5.
std::string option_name(std::string_view word) {
  if (word.size() < 2 || word[0] != '-') return {};
  if (word[1] == '-') return std::string(word.substr(0, word.find('=')));
  return std::isalpha(static_cast<unsigned char>(word[1])) == 0 ? std::string{}
                                                                : std::string(word.substr(0, 2));
}

}  // namespace

void check_words(const CLI::App& app, int argc, char** argv) {
  std::string so_far = "splid";
  const CLI::App* command = find_command(app, argc, argv, so_far);
  std::vector<std::string> names;
  add_options(*command, names);
  for (const CLI::App* above = command->get_parent(); above != nullptr;
       above = above->get_parent()) {
    for (const CLI::Option* option : above->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  }
  for (int i = 1; i < argc; ++i) {
    const std::string name = option_name(argv[i]);
    if (name == "--") return;  // after "--" there are no options
    if (name.empty() || std::find(names.begin(), names.end(), name) != names.end()) continue;
    std::string sentence = "no option " + name;
    if (name.size() > 2) sentence.append(suggested(name, names));
    throw Error(Fault::usage, sentence.append(" (").append(so_far).append(" --help lists all)"));
  }
}

}  // namespace splid
