#pragma once

#include <string>

namespace splid {

// The folder of the patterns that come with splid: share/splid/patterns of the installation that
// the running program belongs to, or config/patterns of the repository that it was built in.
// Empty: neither is there.
std::string shipped_patterns_folder();

// Where a configuration's pattern is.
struct PatternFile {
  std::string path;
  std::string note;  // a sentence where it is not where the configuration says; empty: it is
};

// resolved: by the folder of the file that names it; taken where it is there, or `written`, as that
// file has it, is absolute. Else the pattern of the same name in `shipped_folder`.
// Errors: Error(Fault::usage) where neither is there, with what the folder has; asked_by: the
// beginning of its sentence.
PatternFile find_pattern_file(const std::string& resolved, const std::string& written,
                              const std::string& shipped_folder, const std::string& asked_by);

}  // namespace splid
