#include "daemon/service/start_check.hpp"

#include <arpa/inet.h>
#include <fmt/core.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string_view>
#include <system_error>

#include "daemon/recording/recording_facts.hpp"
#include "daemon/security/allow_list.hpp"
#include "daemon/security/key_file.hpp"
#include "daemon/service/memory.hpp"
#include "daemon/service/socket_places.hpp"
#include "daemon/stream/frame_message.hpp"
#include "daemon/stream/stream.hpp"
#include "drivers/encoder/encoder_source.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view tcp = "tcp://";
constexpr std::string_view ipc = "ipc://";
constexpr std::string_view systemd_credentials = "/run/credentials/";

[[noreturn]] void refuse(const Config& config, const std::string& pointer, const std::string& what,
                         Fault fault = Fault::usage) {
  throw Error(fault, config.file + ": " + pointer + ": " + what);
}

// Calls `look`, and throws what it throws as a mistake of the configuration.
template <class Look>
void refuse_errors(const Config& config, const std::string& pointer, const Look& look) {
  try {
    look();
  } catch (const Error& error) {
    refuse(config, pointer, error.what());
  }
}

void check_memory(const Config& config) {
  const double machine_mib = static_cast<double>(::sysconf(_SC_PHYS_PAGES)) *
                             static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
  const double needed_mib = memory_needed_mib(config);
  if (needed_mib < machine_mib) return;
  refuse(config, "/pipeline",
         fmt::format(
             "takes about {:.0f} MiB, and this machine has {:.0f}; lower ring_capacity_tags or "
             "estimation_threads, or make frames shorter",
             needed_mib, machine_mib));
}

// Looks for the files that every start reads.
void check_files(const Config& config) {
  if (const auto fault = config.source->start_fault()) {
    refuse(config, "/source" + fault->pointer, fault->what);
  }
  if (!config.encoder.file.empty()) {
    refuse_errors(config, "/encoder/file", [&] { open_encoder_file(config.encoder.file); });
  }
  if (!config.security.allow_list.empty()) {
    refuse_errors(config, "/security/allow_list",
                  [&] { security::AllowList::read(config.security.allow_list); });
  }
  if (!config.control.allow_list.empty()) {
    refuse_errors(config, "/control/allow_list",
                  [&] { security::AllowList::read(config.control.allow_list); });
  }
  const std::string& key = config.security.server_key;
  if (key.empty() || key.starts_with(systemd_credentials)) return;  // there while the service runs
  if (::access(key.c_str(), R_OK) != 0 && errno == EACCES) return;  // the service's user may
  refuse_errors(config, "/security/server_key", [&] { security::read_secret_key(key); });
}

void check_socket_file(const Config& config, const std::string& pointer, std::string_view file) {
  if (file.starts_with('@')) return;  // Linux' abstract names need no folder
  std::error_code absent;
  const fs::file_status there = fs::status(file, absent);
  if (fs::exists(there) && !fs::is_socket(there)) {
    refuse(config, pointer,
           "ipc://" + std::string(file) + " exists and is no socket; give it another path");
  }
  fs::path folder = fs::path(file).parent_path();
  if (folder.empty()) folder = ".";
  if (::access(folder.c_str(), W_OK | X_OK) == 0) return;
  refuse(config, pointer,
         "ipc://" + std::string(file) + ": " + std::strerror(errno) +
             "; its folder must be there and let splid write");
}

bool can_bind(const std::string& host) {
  sockaddr_in here{};
  here.sin_family = AF_INET;
  if (::inet_pton(AF_INET, host.c_str(), &here.sin_addr) != 1) return true;  // not of IPv4
  const int probe = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (probe < 0) return true;
  const bool bound = ::bind(probe, reinterpret_cast<const sockaddr*>(&here), sizeof here) == 0;
  const bool is_ours = bound || errno != EADDRNOTAVAIL;
  ::close(probe);
  return is_ours;
}

std::string interfaces() {
  std::string names;
  const std::unique_ptr<struct if_nameindex, decltype(&::if_freenameindex)> all(::if_nameindex(),
                                                                                ::if_freenameindex);
  for (const struct if_nameindex* each = all.get(); each != nullptr && each->if_index != 0;
       ++each) {
    names += (names.empty() ? "" : ", ") + std::string(each->if_name);
  }
  return names;
}

void check_host(const Config& config, const std::string& pointer, const std::string& host) {
  if (host == "*" || host.starts_with('[')) return;
  in_addr number{};
  if (::inet_pton(AF_INET, host.c_str(), &number) == 1) {
    if (can_bind(host)) return;
    refuse(config, pointer, host + " is no address of this machine now", Fault::device);
  }
  if (::if_nametoindex(host.c_str()) != 0) return;
  refuse(config, pointer,
         host + " is no interface of this machine now, which has " + interfaces() +
             "; names of hosts are not looked up: give an address in numbers",
         Fault::device);
}

void check_endpoint(const Config& config, const std::string& pointer, const std::string& endpoint) {
  if (endpoint.starts_with(ipc)) {
    check_socket_file(config, pointer, std::string_view(endpoint).substr(ipc.size()));
  } else if (endpoint.starts_with(tcp)) {
    check_host(config, pointer, endpoint.substr(tcp.size(), endpoint.rfind(':') - tcp.size()));
  }
}

fs::path folder_of(const fs::path& file) {
  const fs::path folder = file.parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

// The service's user may look where the user of a check may not.
std::string not_known(const fs::path& place, const std::error_code& failure) {
  return place.string() + " cannot be looked at: " + failure.message() +
         "; so whether splid can write there is not known";
}

// Empty: nothing is to be said.
std::string metrics_note(const std::string& file) {
  std::error_code failure;
  const fs::path folder = folder_of(file);
  const fs::file_status there = fs::status(folder, failure);
  if (!fs::status_known(there)) return not_known(folder, failure);
  if (!fs::is_directory(there)) {
    return "there is no folder " + folder.string() + "; until there is, no metrics are written";
  }
  if (!fs::is_directory(file, failure)) return "";
  return file + " is a folder; until it is not, no metrics are written";
}

// Empty: nothing is to be said.
std::string record_note(const std::string& wanted) {
  std::error_code failure;
  fs::path folder = wanted;
  fs::file_status there = fs::status(folder, failure);
  while (there.type() == fs::file_type::not_found) {
    folder = folder_of(folder);
    there = fs::status(folder, failure);
  }
  if (!fs::status_known(there)) return not_known(folder, failure);
  if (fs::is_directory(there) && ::access(folder.c_str(), W_OK | X_OK) == 0) return "";
  return wanted + " cannot be made: " + folder.string() +
         " is no folder that may be written to; nothing would be recorded";
}

}  // namespace

void check_start(const Config& config) {
  asked_by(config.file, [&] { check_stream(stream_options(config)); });
  check_memory(config);
  check_files(config);
  if (!config.record.folder.empty()) {
    refuse_errors(config, "/record/folder", [&] { recording::check_inputs(config); });
  }
  check_endpoint(config, "/publish/endpoint", config.publish.endpoint);
  check_endpoint(config, "/publish/local_endpoint", config.publish.local_endpoint);
  check_endpoint(config, "/control/endpoint", config.control.endpoint);
  check_socket_places(config);
}

std::vector<std::string> start_notes(const Config& config) {
  std::vector<std::string> notes;
  const auto note = [&](const std::string& pointer, const std::string& sentence) {
    if (!sentence.empty()) notes.push_back(pointer + ": " + sentence);
  };
  if (!config.metrics.file.empty()) note("/metrics/file", metrics_note(config.metrics.file));
  if (const std::string reason = unmodelled_by(config); !reason.empty()) {
    note("/detector/dead_time", "the dead time is not modelled with " + reason +
                                    "; frames in which it would bias the values are saturated");
  }
  if (!config.record.folder.empty()) note("/record/folder", record_note(config.record.folder));
  return notes;
}

}  // namespace splid
