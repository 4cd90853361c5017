#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace splid::view {

// What is read of the requests that browsers send to the live page: who they think the server is
// (Host), whose page asks (Origin), and how many seconds they want to see. All of it comes from
// strangers.

// The host of "HOST" or "HOST:PORT", with the brackets of an IPv6 address removed, in lower case;
// absent where that is malformed.
std::optional<std::string> host_of(std::string_view host_and_port);

// Whether a request may name the server so: by an address in numbers, as localhost, or by the
// machine's own name, alone or with ".local". Any other name could belong to a stranger who lets it
// lead here (DNS rebinding), so that the stranger's page would be of the same origin as this page.
// The port does not matter: a tunnel of ssh has another port.
bool is_own_host(std::string_view host_header, std::string_view machine_name);

// Whether a request that names the origin of the page that sends it comes from this server's own
// page: http:// or https:// and the same host and port as in Host.
bool is_own_origin(std::string_view origin, std::string_view host_header);

// A time in seconds since 1970 that a query gives; absent for everything but a decimal number,
// with or without decimals, of at most 20 characters.
std::optional<double> time_from(std::string_view text);

// The seconds that a query asks for; absent for everything but a decimal number without a sign, of
// at most 5 digits.
std::optional<std::int64_t> seconds_from(std::string_view text);

}  // namespace splid::view
