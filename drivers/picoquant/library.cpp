#include "drivers/picoquant/library.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace splid::picoquant {
namespace {

using std::chrono::milliseconds;

// All that is called by whoever closes an instrument: it must not fail there for want of a name.
constexpr std::array<const char*, 3> closing_calls = {"GetErrorString", "StopMeas", "CloseDevice"};

// The library loads the instrument's firmware, or waits for it.
constexpr std::array<std::string_view, 4> slow_calls = {"OpenDevice", "Initialize", "Calibrate",
                                                        "CloseDevice"};
constexpr milliseconds slow_patience{30'000};
constexpr milliseconds patience{3000};

std::string last_dl_error() {
  const char* text = ::dlerror();  // NOLINT(concurrency-mt-unsafe): of this thread, in glibc
  return text == nullptr ? "cannot be opened" : text;
}

}  // namespace

Library::Library(Family family, const std::string& file, CallWatch& watch)
    : traits_(traits_of(family)), watch_(watch) {
  open(file);
  try {
    check_version();
  } catch (const LibraryError&) {
    ::dlclose(handle_);
    throw;
  }
}

Library::~Library() { ::dlclose(handle_); }

void Library::open(const std::string& file) {
  std::string faults;
  for (const char* name : traits_.files) {
    file_ = file.empty() ? name : file;
    handle_ = ::dlopen(file_.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle_ != nullptr) return;
    faults += (faults.empty() ? "" : "; ") + last_dl_error();
    if (!file.empty()) break;
  }
  throw LibraryError(faults + ": install PicoQuant's library for the " + traits_.product +
                     ", or name its file as /library");
}

void Library::check_version() {
  for (const char* name : closing_calls) find(name);
  std::array<char, 64> version{};
  call("GetLibraryVersion", version.data());
  for (const std::string_view beginning : traits_.version_beginnings) {
    if (std::string_view(version.data()).starts_with(beginning)) return;
  }
  throw LibraryError(file_ + " is version " + version.data() + "; splid knows version " +
                     traits_.versions + ": install such a version of PicoQuant's library");
}

void* Library::find(const char* name) {
  const std::string symbol = std::string(traits_.prefix) + name;
  void* found = ::dlsym(handle_, symbol.c_str());
  if (found == nullptr) {
    throw LibraryError(file_ + " has no " + symbol + ": install version " + traits_.versions +
                       " of PicoQuant's library for the " + traits_.product);
  }
  return found;
}

LibraryError Library::error(const char* name, int code) {
  std::array<char, 256> words{};
  const bool is_known = try_call("GetErrorString", words.data(), code) >= 0 && words[0] != '\0';
  words.back() = '\0';
  return LibraryError{std::string(traits_.prefix) + name + ": " +
                          (is_known ? std::string(words.data()) + " (" + std::to_string(code) + ")"
                                    : "error " + std::to_string(code)),
                      code};
}

milliseconds Library::patience_of(const char* name) {
  const bool is_slow = std::find(slow_calls.begin(), slow_calls.end(), name) != slow_calls.end();
  return is_slow ? slow_patience : patience;
}

}  // namespace splid::picoquant
