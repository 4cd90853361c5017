#include "config/path_list.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "config/sections.hpp"

namespace splid {
namespace {

constexpr std::array<std::string_view, 3> written_paths = {"/source/truth", "/metrics/file",
                                                           "/record/folder"};

// A visitor that takes note of paths and passes over all other keys.
class PathLister final : public OptionVisitor {
 public:
  PathLister(std::string pointer, std::vector<NamedPath>& found)
      : pointer_(std::move(pointer)), found_(found) {}

  void path(const char* key, std::string& value, const char*) override {
    const std::string place = pointer_ + "/" + key;
    const bool is_written =
        std::find(written_paths.begin(), written_paths.end(), place) != written_paths.end();
    if (!value.empty() && !is_written) found_.push_back({place, value});
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
  void channels(const char*, std::vector<std::string>&, const char*) override {}
  void require(const char*) override {}

 private:
  std::string pointer_;
  std::vector<NamedPath>& found_;
};

}  // namespace

std::vector<NamedPath> input_files(const Config& config) {
  std::vector<NamedPath> found = {{"the configuration itself", config.file}};
  PathLister lister("", found);
  // describe() takes options that may be changed, since readers change them. This visitor does not.
  describe_sections(const_cast<Config&>(config), lister);
  return found;
}

}  // namespace splid
