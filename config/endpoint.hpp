#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace splid {

// Where a socket is bound, as a configuration names it. Each fault is the rest of a sentence that
// begins with the endpoint.

// Absent for tcp://HOST:PORT (HOST: an address in numbers, the name of an interface, localhost or
// *; PORT: 1 to 65535, or * for the system's choice) and ipc://PATH.
std::optional<std::string> endpoint_fault(std::string_view endpoint);

// The endpoint with 127.0.0.1 in the place of localhost, which ZeroMQ would take for an interface.
std::string numeric_endpoint(const std::string& endpoint);

// Whether this machine alone reaches it: 127.0.0.0/8, ::1, localhost, lo, ipc. For one without
// fault.
bool is_on_this_machine(std::string_view endpoint);

// Absent for HOST:PORT on this machine. example: what to write instead.
std::optional<std::string> local_address_fault(std::string_view address, const char* example);

// Whether an IPv4 address, or localhost, is this machine's own.
bool is_ipv4_loopback(std::string_view host);

}  // namespace splid
