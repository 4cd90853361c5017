#pragma once

namespace CLI {
class App;
}

namespace splid {

// Looks at the words of a command line before CLI11 does, which would call a mistyped command
// "unexpected", and say of a mistyped option that another one is required.
//
// Errors: Error(Fault::usage) for a word that is no command where one must stand, and for an option
// that the command does not have; each with the nearest that there is.
void check_words(const CLI::App& app, int argc, char** argv);

}  // namespace splid
