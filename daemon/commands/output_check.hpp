#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"
#include "config/path_list.hpp"

namespace splid {

// For a command that writes what somebody named: whether that would destroy what the command reads.
class OutputCheck {
 public:
  // Reads all that the configuration names.
  explicit OutputCheck(const Config& config) : inputs_(input_files(config)) {}

  // And this, which the command line names.
  void add_input(const std::string& name, const std::string& file) {
    inputs_.push_back({name, file});
  }
  // But not what this key names: the command's result takes its place.
  void may_replace(const std::string& pointer);

  // option: that names `output`. Nothing for an empty output or one that is not there.
  // Errors: Error(Fault::usage) where `output` is one of the inputs, by whatever path or link.
  void check(const std::string& option, const std::string& output) const;

 private:
  std::vector<NamedPath> inputs_;
};

// For commands that write patterns again and again from their own command line: anything but a
// pattern stays.
// Errors: Error(Fault::usage) where `file` is there and is neither a pattern nor empty nor a
// device.
void check_is_pattern_or_new(const std::string& file);

}  // namespace splid
