#include "config/pattern_file.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

#include "protocol/error.hpp"

namespace splid {
namespace {

// How far below the repository a program may be: build/release/tests/program is three folders.
constexpr int most_folders_up = 4;

std::string pattern_names_in(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code failure;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failure)) {
    if (entry.path().extension() == ".json") names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

std::string shipped_folder() {
  namespace fs = std::filesystem;
  std::error_code failure;
  fs::path folder = fs::read_symlink("/proc/self/exe", failure).parent_path();
  if (failure) return {};
  const fs::path installed = folder.parent_path() / "share/splid";
  if (fs::is_directory(installed / "patterns", failure)) return installed.string();
  for (int up = 0; up < most_folders_up; ++up, folder = folder.parent_path()) {
    const fs::path built = folder / "config";
    if (fs::is_directory(built / "patterns", failure)) return built.string();
  }
  return {};
}

std::string shipped_patterns_folder() {
  const std::string folder = shipped_folder();
  return folder.empty() ? "" : folder + "/patterns";
}

PatternFile find_pattern_file(const std::string& resolved, const std::string& written,
                              const std::string& shipped_folder, const std::string& asked_by) {
  namespace fs = std::filesystem;
  std::error_code absent;
  const bool may_be_shipped = fs::path(written).is_relative() && !shipped_folder.empty();
  if (!may_be_shipped || fs::exists(resolved, absent) || absent) return {resolved, ""};
  const fs::path shipped = fs::path(shipped_folder) / fs::path(written).filename();
  if (fs::is_regular_file(shipped, absent)) {
    return {shipped.string(), asked_by + resolved +
                                  " does not exist; taken instead is splid's own pattern " +
                                  shipped.string()};
  }
  throw Error(Fault::usage,
              asked_by + resolved +
                  ": cannot be read: No such file or directory; splid's own patterns, in " +
                  shipped_folder + ", are " + pattern_names_in(shipped_folder) +
                  "; choose a file, or make one with splid pattern");
}

}  // namespace splid
