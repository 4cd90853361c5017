#include "daemon/service/socket_places.hpp"

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "daemon/service/control/control_endpoint.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr std::string_view tcp_mark = "tcp://";
constexpr std::string_view ipc_mark = "ipc://";

struct Socket {
  const char* pointer;
  std::string place;  // tcp://HOST:PORT or ipc://PATH; empty: there is none
};

// A place without what may be written in several ways.
std::string plain(const std::string& place) {
  if (place.starts_with(ipc_mark)) {
    const std::string file = place.substr(ipc_mark.size());
    if (file.starts_with('@')) return place;
    std::error_code error;
    const std::filesystem::path canonical = std::filesystem::weakly_canonical(file, error);
    return std::string(ipc_mark) + (error ? file : canonical.string());
  }
  const std::size_t colon = place.rfind(':');
  std::string host = place.substr(tcp_mark.size(), colon - tcp_mark.size());
  if (host == "localhost" || host == "lo") host = "127.0.0.1";
  if (host == "0.0.0.0") host = "*";
  return std::string(tcp_mark) + host + place.substr(colon);
}

// Whether two plain places are one. Port * is a port of its own each time.
bool are_one(const std::string& a, const std::string& b) {
  if (a.ends_with(":*") || a.starts_with(ipc_mark) != b.starts_with(ipc_mark)) return false;
  if (a == b) return true;
  if (a.starts_with(ipc_mark)) return false;
  const bool is_same_port = a.substr(a.rfind(':')) == b.substr(b.rfind(':'));
  const auto is_all = [](const std::string& place) { return place.starts_with("tcp://*:"); };
  const auto is_ipv6 = [](const std::string& place) { return place.starts_with("tcp://["); };
  return is_same_port && (is_all(a) || is_all(b)) && !is_ipv6(a) && !is_ipv6(b);
}

}  // namespace

void check_socket_places(const Config& config) {
  const std::string& http = config.metrics.http;
  const std::vector<Socket> sockets = {
      {"/publish/endpoint", config.publish.endpoint},
      {"/publish/local_endpoint", config.publish.local_endpoint},
      {"/control/endpoint", control::endpoint_of(config.control)},
      {"/metrics/http", http.empty() ? "" : std::string(tcp_mark) + http}};
  for (std::size_t i = 0; i < sockets.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (sockets[i].place.empty() || sockets[j].place.empty()) continue;
      if (!are_one(plain(sockets[i].place), plain(sockets[j].place))) continue;
      throw Error(Fault::usage, config.file + ": " + sockets[i].pointer + ": \"" +
                                    sockets[i].place + "\" is where " + sockets[j].pointer + " \"" +
                                    sockets[j].place +
                                    "\" listens too; give it another port or file");
    }
  }
}

}  // namespace splid
