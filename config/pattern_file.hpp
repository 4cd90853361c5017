#pragma once

#include <string>

namespace splid {

// The folder of the configurations and patterns that come with splid: share/splid of the
// installation that the running program belongs to, or config of the repository that it was built
// in. It has the folder `patterns` and the demonstration, demo.json. Empty where neither is there.
std::string shipped_folder();

// The folder `patterns` in shipped_folder(); empty where there is no such folder.
std::string shipped_patterns_folder();

// Where a configuration's pattern is.
struct PatternFile {
  std::string path;
  std::string note;  // a sentence where the file is elsewhere than the configuration says, or empty
};

// Finds the pattern file that a configuration names. written: the path as the configuration has it;
// resolved: the same path from that configuration's folder. If there is no file at `resolved`, and
// `written` is relative, the pattern of the same name in `shipped_folder` is taken.
// Errors: Error(Fault::usage) where that is not there either, with the names in the folder.
// asked_by: the beginning of the error's sentence.
PatternFile find_pattern_file(const std::string& resolved, const std::string& written,
                              const std::string& shipped_folder, const std::string& asked_by);

}  // namespace splid
