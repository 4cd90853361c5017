#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "tests/support/generated.hpp"
#include "tests/support/program.hpp"

// The manual's table of commands is what the program's --help lists.

namespace splid {
namespace {

// What the --help of a command has: its usage and what it does, its options and its subcommands.
struct Help {
  std::string usage, doc, options;
  std::vector<std::string> subcommands;
};

Help help_of(const std::vector<std::string>& command) {
  std::vector<std::string> arguments = command;
  arguments.emplace_back("--help");
  std::istringstream lines(test::run_program(arguments).out);
  Help help;
  std::getline(lines, help.doc);
  std::string section;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("Usage: ")) help.usage = line.substr(7);
    if (line.ends_with(':')) section = line;
    if (line.size() < 4 || !line.starts_with("  ") || line[2] == ' ') continue;
    const std::string word = line.substr(2, line.find(' ', 2) - 2);
    if (section == "Subcommands:") help.subcommands.push_back(word);
    const std::string name =
        word.substr(word.find("--") == std::string::npos ? 0 : word.find("--"));
    if (section == "Options:" && name != "--help" && name != "--log-level" && name != "--verbose") {
      help.options += (help.options.empty() ? "`" : ", `") + name.substr(0, name.find('=')) + "`";
    }
  }
  return help;
}

// The usage without [OPTIONS], which have a column of their own.
std::string call(std::string usage) {
  const std::string options = " [OPTIONS]";
  if (const auto at = usage.find(options); at != std::string::npos) usage.erase(at, options.size());
  return usage;
}

void add_rows(const std::vector<std::string>& command, std::string& table) {
  const Help help = help_of(command);
  if (help.subcommands.empty()) {
    table += "| `" + call(help.usage) + "` | " + help.doc + " | " + help.options + " |\n";
  }
  for (const std::string& name : help.subcommands) {
    std::vector<std::string> sub = command;
    sub.push_back(name);
    add_rows(sub, table);
  }
}

TEST(CommandsManual, HasEveryCommandWithItsOptions) {
  std::string table = "\n| command | what it does | options |\n|---|---|---|\n";
  add_rows({}, table);
  test::expect_generated_part(
      "docs/reference/commands.md",
      "<!-- Generated: all commands; see tests/daemon/commands/commands_manual_test.cpp -->\n",
      "<!-- Generated up to here -->\n", table + "\n", "daemon.CommandsManual");
}

}  // namespace
}  // namespace splid
