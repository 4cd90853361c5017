#pragma once

namespace CLI {
class App;
}

namespace splid {

// Checks the words of a command line before CLI11 reads it. CLI11 would call a mistyped command
// "unexpected", and after a mistyped option would complain that another option is missing.
//
// Errors: Error(Fault::usage) for an unknown command and for an option that the command does not
// have, each with the nearest known name.
void check_words(const CLI::App& app, int argc, char** argv);

}  // namespace splid
