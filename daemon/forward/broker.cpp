#include "daemon/forward/broker.hpp"

#include <charconv>

#include "daemon/security/guarded_file.hpp"
#include "protocol/error.hpp"
#include "protocol/shown_text.hpp"

namespace splid::forward {
namespace {

constexpr int mqtt_port = 1883;
constexpr int mqtt_tls_port = 8883;
constexpr int nats_port = 4222;
constexpr int most_port = 65535;

[[noreturn]] void refuse_destination(const std::string& to) {
  throw Error(Fault::usage, "--to " + shown_text(to, most_said) +
                                ": give a broker as mqtt://HOST:PORT or nats://HOST:PORT");
}

}  // namespace

Destination parse_destination(const std::string& to, bool has_tls) {
  Destination destination;
  destination.is_nats = to.starts_with("nats://");
  if (!destination.is_nats && !to.starts_with("mqtt://")) refuse_destination(to);
  const std::string address = to.substr(std::string("nats://").size());
  const std::size_t bracket = address.starts_with('[') ? address.find(']') : 0;
  if (bracket == std::string::npos) refuse_destination(to);
  const std::size_t colon = address.find(':', bracket);
  destination.host = address.substr(0, colon);
  destination.port = destination.is_nats ? nats_port : (has_tls ? mqtt_tls_port : mqtt_port);
  if (colon != std::string::npos) {
    const std::string port = address.substr(colon + 1);
    const char* end = port.data() + port.size();
    const auto [at, error] = std::from_chars(port.data(), end, destination.port);
    if (error != std::errc{} || at != end) refuse_destination(to);
  }
  const bool is_port = destination.port > 0 && destination.port <= most_port;
  if (!is_port || destination.host.empty() ||
      destination.host.find_first_of("/@ ,") != std::string::npos) {
    refuse_destination(to);
  }
  return destination;
}

void read_credentials(const std::string& file, Destination& destination) {
  const std::string text = security::read_secret_file(file);
  if (text.find("BEGIN NATS USER JWT") != std::string::npos) {
    if (!destination.is_nats) {
      throw Error(Fault::usage, file + ": is for NATS; for MQTT give a file with USER:PASSWORD");
    }
    destination.nats_creds = file;
    return;
  }
  const std::string line = text.substr(0, text.find_first_of("\r\n"));
  const std::size_t colon = line.find(':');
  if (colon == std::string::npos || colon == 0) {
    throw Error(Fault::usage, file + ": its first line must be USER:PASSWORD" +
                                  (destination.is_nats ? ", or the file NATS credentials" : ""));
  }
  destination.user = line.substr(0, colon);
  destination.password = line.substr(colon + 1);
}

}  // namespace splid::forward
