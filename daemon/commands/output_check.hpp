#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"
#include "config/path_list.hpp"

namespace splid {

// Checks that the file a command is to write is none of the files that it reads.
class OutputCheck {
 public:
  // The inputs are all files that the configuration names.
  explicit OutputCheck(const Config& config) : inputs_(input_files(config)) {}

  // Adds an input that the command line names. name: what an error calls it.
  void add_input(const std::string& name, const std::string& file) {
    inputs_.push_back({name, file});
  }
  // Removes the input that this configuration key names, since the command's result may replace it.
  void may_replace(const std::string& pointer);

  // option: the command line's option that names `output`. Does nothing where `output` is empty or
  // does not exist. Errors: Error(Fault::usage) where `output` is one of the inputs, also by
  // another path or through a link.
  void check(const std::string& option, const std::string& output) const;

 private:
  std::vector<NamedPath> inputs_;
};

// Checks that a command may write a pattern to `file`. Such commands are run again and again, so
// they replace an existing pattern without --force, but nothing else. Errors: Error(Fault::usage)
// where `file` exists and is neither a pattern nor empty nor a device.
void check_is_pattern_or_new(const std::string& file);

}  // namespace splid
