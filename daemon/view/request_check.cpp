#include "daemon/view/request_check.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <system_error>

namespace splid::view {
namespace {

constexpr std::size_t longest_host = 253;  // of a name in the DNS

bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool is_port(std::string_view text) {
  return !text.empty() && text.size() <= 5 && std::all_of(text.begin(), text.end(), is_digit);
}

bool is_name(std::string_view text) {
  if (text.empty() || text.size() > longest_host) return false;
  return std::all_of(text.begin(), text.end(), [](char c) {
    return is_digit(c) || (c >= 'a' && c <= 'z') || c == '-' || c == '.' || c == '_';
  });
}

// A null character would end the host for the library alone.
bool is_address(const std::string& host) {
  if (host.find('\0') != std::string::npos) return false;
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  return ::inet_pton(AF_INET, host.c_str(), bytes.data()) == 1 ||
         ::inet_pton(AF_INET6, host.c_str(), bytes.data()) == 1;
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

}  // namespace

std::optional<std::string> host_of(std::string_view host_and_port) {
  if (host_and_port.starts_with('[')) {
    const std::size_t end = host_and_port.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view rest = host_and_port.substr(end + 1);
    if (!rest.empty() && (rest[0] != ':' || !is_port(rest.substr(1)))) return std::nullopt;
    std::string host = lower(host_and_port.substr(1, end - 1));
    if (host.find(':') == std::string::npos || !is_address(host)) return std::nullopt;
    return host;
  }
  const std::size_t colon = host_and_port.find(':');
  if (colon != std::string_view::npos && !is_port(host_and_port.substr(colon + 1))) {
    return std::nullopt;
  }
  std::string host = lower(host_and_port.substr(0, colon));
  if (!is_name(host)) return std::nullopt;
  return host;
}

bool is_own_host(std::string_view host_header, std::string_view machine_name) {
  const auto host = host_of(host_header);
  if (!host) return false;
  if (*host == "localhost" || is_address(*host)) return true;
  const std::string own = lower(machine_name);
  return !own.empty() && (*host == own || *host == own + ".local");
}

bool is_own_origin(std::string_view origin, std::string_view host_header) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme))
      return lower(origin.substr(scheme.size())) == lower(host_header);
  }
  return false;  // "null" too: a page without an origin of its own
}

std::optional<double> time_from(std::string_view text) {
  constexpr std::size_t most_characters = 20;
  if (text.empty() || text.size() > most_characters) return std::nullopt;
  double value = 0;
  const auto end =
      std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  if (end.ec != std::errc{} || end.ptr != text.data() + text.size()) return std::nullopt;
  if (!std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<std::int64_t> seconds_from(std::string_view text) {
  constexpr std::size_t most_digits = 5;
  if (text.empty() || text.size() > most_digits) return std::nullopt;
  if (!std::all_of(text.begin(), text.end(), is_digit)) return std::nullopt;
  std::int64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

}  // namespace splid::view
