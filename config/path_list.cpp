#include "config/path_list.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include "config/sections.hpp"

namespace splid {
namespace {

constexpr std::array<std::string_view, 3> written_paths = {"/source/truth", "/metrics/file",
                                                           "/record/folder"};

// The paths of a configuration's keys, by what is done there.
struct Paths {
  std::vector<NamedPath> read;
  std::vector<NamedPath> written;
};

// A visitor that takes note of paths and passes over all other keys.
class PathLister final : public OptionVisitor {
 public:
  PathLister(std::string pointer, Paths& found) : pointer_(std::move(pointer)), found_(found) {}

  void path(const char* key, std::string& value, const char*) override {
    const std::string place = pointer_ + "/" + key;
    const bool is_written =
        std::find(written_paths.begin(), written_paths.end(), place) != written_paths.end();
    if (!value.empty()) (is_written ? found_.written : found_.read).push_back({place, value});
  }
  void object(const char* key, const std::function<void(OptionVisitor&)>& members,
              const char*) override {
    PathLister lister(pointer_ + "/" + key, found_);
    members(lister);
  }
  void objects(const char* key, const std::function<void(std::size_t)>&,
               const std::function<void(OptionVisitor&, std::size_t)>& member, std::size_t count,
               const char*) override {
    for (std::size_t i = 0; i < count; ++i) {
      PathLister lister(pointer_ + "/" + key + "/" + std::to_string(i), found_);
      member(lister, i);
    }
  }

  void number(const char*, double&, Bounds, const char*) override {}
  void number(const char*, std::optional<double>&, Bounds, const char*) override {}
  void integer(const char*, std::int64_t&, std::int64_t, std::int64_t, const char*) override {}
  void flag(const char*, bool&, const char*) override {}
  void text(const char*, std::string&, const char*) override {}
  void choice(const char*, std::size_t&, std::span<const char* const>, const char*) override {}
  void numbers(const char*, std::vector<double>&, Bounds, const char*) override {}
  void pairs(const char*, std::vector<NumberPair>&, const std::array<Bounds, 2>&,
             const char*) override {}
  void channels(const char*, std::vector<std::string>&, const char*) override {}
  void require(const char*) override {}

 private:
  std::string pointer_;
  Paths& found_;
};

Paths paths_of(const Config& config) {
  Paths found{{{"the configuration itself", config.file}}, {}};
  if (!config.pixels_file.empty()) found.read.push_back({"/pixels", config.pixels_file});
  PathLister lister("", found);
  // describe() takes options that may be changed, since readers change them. This visitor does not.
  describe_sections(const_cast<Config&>(config), lister);
  return found;
}

}  // namespace

std::vector<NamedPath> input_files(const Config& config) { return paths_of(config).read; }

std::optional<OptionFault> written_file_fault(const Config& config) {
  const Paths paths = paths_of(config);
  for (const NamedPath& output : paths.written) {
    for (const NamedPath& input : paths.read) {
      std::error_code absent;
      const bool is_same = std::filesystem::equivalent(output.path, input.path, absent) &&
                           std::filesystem::is_regular_file(output.path, absent);
      if (!is_same) continue;
      return OptionFault{output.pointer, output.path + " is what is read as " + input.pointer +
                                             ": to write there would destroy it; give another "
                                             "name"};
    }
  }
  return std::nullopt;
}

}  // namespace splid
