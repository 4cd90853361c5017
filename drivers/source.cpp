#include "drivers/source.hpp"

#include <map>
#include <utility>

namespace splid {
namespace {

// A function's static, so that it exists before the first registration of any file.
std::map<std::string, MakeSourceOptions>& drivers() {
  static std::map<std::string, MakeSourceOptions> table;
  return table;
}

}  // namespace

bool register_source(const std::string& name, MakeSourceOptions make) {
  drivers()[name] = std::move(make);
  return true;
}

std::unique_ptr<SourceOptions> make_source_options(const std::string& name) {
  const auto found = drivers().find(name);
  return found == drivers().end() ? nullptr : found->second();
}

std::vector<std::string> source_names() {
  std::vector<std::string> names;
  for (const auto& [name, make] : drivers()) names.push_back(name);
  return names;
}

}  // namespace splid
