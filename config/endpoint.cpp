#include "config/endpoint.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>

namespace splid {
namespace {

constexpr std::string_view tcp = "tcp://";
constexpr std::string_view ipc = "ipc://";

bool is_port(std::string_view text) {
  if (text == "*") return true;  // the system's choice
  unsigned port = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, port);
  return error == std::errc{} && stop == end && port >= 1 && port <= 65535;
}

bool is_ipv4(std::string_view host) {
  int parts = 0;
  while (parts < 4) {
    unsigned part = 0;
    const char* end = host.data() + host.size();
    const auto [stop, error] = std::from_chars(host.data(), end, part);
    if (error != std::errc{} || part > 255) return false;
    host.remove_prefix(static_cast<std::size_t>(stop - host.data()));
    if (++parts == 4) return host.empty();
    if (!host.starts_with('.')) return false;
    host.remove_prefix(1);
  }
  return false;
}

bool is_loopback(std::string_view host) {
  return host == "[::1]" || host == "lo" || is_ipv4_loopback(host);
}

// Linux' own bounds of an interface's name.
bool is_interface_name(std::string_view host) {
  constexpr std::size_t most_letters = 15;
  const auto is_letter = [](unsigned char c) { return std::isgraph(c) != 0 && c != '/'; };
  return !host.empty() && host.size() <= most_letters &&
         std::all_of(host.begin(), host.end(), is_letter);
}

bool is_bindable_host(std::string_view host) {
  if (host == "*" || host == "localhost" || is_ipv4(host)) return true;
  if (host.starts_with('[')) return host.ends_with(']') && host.size() > 2;
  const bool is_number = host.find_first_not_of("0123456789.") == std::string_view::npos;
  return !is_number && is_interface_name(host);
}

std::string_view host_of(std::string_view address) { return address.substr(0, address.rfind(':')); }

std::optional<std::string> address_fault(std::string_view address, const char* example) {
  const std::size_t colon = address.rfind(':');
  if (colon == std::string_view::npos || colon == 0) {
    return std::string("has no port; write it as in ") + example;
  }
  if (!is_port(address.substr(colon + 1))) return "must end in a port from 1 to 65535, or *";
  return std::nullopt;
}

}  // namespace

// Design note: 127.0.0.0/8 as a whole is loopback, but "127.evil.example" is a name like any other.
bool is_ipv4_loopback(std::string_view host) {
  return host == "localhost" || (host.starts_with("127.") && is_ipv4(host));
}

std::optional<std::string> endpoint_fault(std::string_view endpoint) {
  // Linux holds a socket's path in 108 bytes, the NUL included.
  constexpr std::size_t max_ipc_bytes = 107;
  if (endpoint.starts_with(tcp)) {
    const std::string_view address = endpoint.substr(tcp.size());
    if (auto fault = address_fault(address, "tcp://127.0.0.1:9872")) return fault;
    if (is_bindable_host(host_of(address))) return std::nullopt;
    return "has \"" + std::string(host_of(address)) +
           "\" where an address in numbers, the name of an interface or * must stand; names of "
           "hosts are not looked up";
  }
  if (!endpoint.starts_with(ipc)) return "must begin with tcp:// or ipc://";
  const std::size_t bytes = endpoint.size() - ipc.size();
  if (bytes == 0) return "names no file; write ipc:///run/splid/frames";
  if (bytes > max_ipc_bytes) {
    return "has a path of " + std::to_string(bytes) + " bytes; a socket's may have 107";
  }
  return std::nullopt;
}

std::string numeric_endpoint(const std::string& endpoint) {
  constexpr std::string_view local = "tcp://localhost:";
  if (!endpoint.starts_with(local)) return endpoint;
  return "tcp://127.0.0.1:" + endpoint.substr(local.size());
}

bool is_on_this_machine(std::string_view endpoint) {
  return endpoint.starts_with(ipc) || is_loopback(host_of(endpoint.substr(tcp.size())));
}

std::string with_host(const std::string& address) {
  const bool is_port = !address.empty() && address.find_first_not_of("0123456789") == address.npos;
  return is_port ? "127.0.0.1:" + address : address;
}

std::optional<std::string> http_address_fault(std::string_view address, const char* example) {
  if (address.find("://") != std::string_view::npos) {
    return std::string("is a URL; write the address and the port alone, as in ") + example;
  }
  return address_fault(address, example);
}

std::optional<std::string> local_address_fault(std::string_view address, const char* example) {
  if (auto fault = http_address_fault(address, example)) return fault;
  if (is_loopback(host_of(address))) return std::nullopt;
  return std::string(
             "would offer the results to anyone on the network, without encryption; write it as "
             "in ") +
         example + ", and forward it by SSH";
}

}  // namespace splid
