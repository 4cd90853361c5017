#include "daemon/commands/output_check.hpp"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "config/read_file.hpp"
#include "protocol/error.hpp"
#include "protocol/json_value.hpp"

namespace splid {

void OutputCheck::may_replace(const std::string& pointer) {
  inputs_.erase(std::remove_if(inputs_.begin(), inputs_.end(),
                               [&](const NamedPath& input) { return input.pointer == pointer; }),
                inputs_.end());
}

void OutputCheck::check(const std::string& option, const std::string& output) const {
  if (output.empty()) return;
  for (const NamedPath& input : inputs_) {
    std::error_code absent;
    const bool is_same = std::filesystem::equivalent(output, input.path, absent) &&
                         std::filesystem::is_regular_file(output, absent);
    if (!is_same) continue;
    std::string sentence = option + " ";
    sentence.append(output).append(" is ");
    if (output != input.path) sentence.append(input.path).append(", ");
    sentence.append("what is read as ").append(input.pointer);
    throw Error(Fault::usage,
                sentence.append(": to write there would destroy it; give another name"));
  }
}

void check_is_pattern_or_new(const std::string& file) {
  std::error_code absent;
  if (!std::filesystem::is_regular_file(file, absent)) return;
  if (std::filesystem::file_size(file, absent) == 0) return;
  const auto json = json_value_if_any(read_start(file, largest_text_bytes));
  const bool is_pattern = json.is_object() && json.contains("schema") &&
                          json["schema"].is_string() && json["schema"] == "splid.pattern";
  if (is_pattern) return;
  throw Error(Fault::usage,
              "--output " + file +
                  ": the file exists and is not a pattern; give another name, or remove "
                  "it first");
}

}  // namespace splid
