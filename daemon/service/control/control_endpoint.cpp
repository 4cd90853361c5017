#include "daemon/service/control/control_endpoint.hpp"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

namespace splid::control {
namespace {

constexpr std::string_view ipc = "ipc://";
constexpr const char* of_service = "/run/splid/control.sock";
constexpr const char* of_root = "/run/splid-control.sock";

// The folder that an environment variable names; empty where the variable is not set or names no
// absolute path.
std::string in_folder(const char* variable, const std::string& name) {
  const char* folder = std::getenv(variable);
  if (folder == nullptr || folder[0] != '/') return {};
  return std::string(folder) + "/" + name;
}

std::string own_file() { return in_folder("XDG_RUNTIME_DIR", "splid-control.sock"); }

}  // namespace

std::string endpoint_of(const ControlOptions& options) {
  if (options.endpoint == "off") return {};
  if (options.endpoint != "auto") return options.endpoint;
  std::string file = in_folder("RUNTIME_DIRECTORY", "control.sock");
  if (file.empty()) file = own_file();
  if (file.empty() && ::geteuid() == 0) file = of_root;
  return file.empty() ? "" : std::string(ipc) + file;
}

std::string default_endpoint() {
  std::error_code ignored;
  for (const std::string& file : {own_file(), std::string(of_service), std::string(of_root)}) {
    if (!file.empty() && std::filesystem::exists(file, ignored)) return std::string(ipc) + file;
  }
  return std::string(ipc) + of_service;
}

std::string socket_file_of(const std::string& endpoint) { return endpoint.substr(ipc.size()); }

}  // namespace splid::control
