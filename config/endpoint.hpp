#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace splid {

// Checks of the places where sockets are bound, as a configuration names them. Each returned fault
// is the rest of a sentence that begins with the endpoint.

// The fault of an endpoint; absent for tcp://HOST:PORT (HOST: an address in numbers, the name of an
// interface, localhost or
// *; PORT: 1 to 65535, or * for the system's choice) and ipc://PATH.
std::optional<std::string> endpoint_fault(std::string_view endpoint);

// The endpoint with 127.0.0.1 in the place of localhost, which ZeroMQ would take for an interface.
std::string numeric_endpoint(const std::string& endpoint);

// Whether this machine alone can reach the endpoint: 127.0.0.0/8, ::1, localhost, lo, ipc. The
// endpoint has no fault.
bool is_on_this_machine(std::string_view endpoint);

// "127.0.0.1:PORT" for a port alone; any other address as it is.
std::string with_host(const std::string& address);

// The fault of a page's address; absent for HOST:PORT. example: what to write instead.
std::optional<std::string> http_address_fault(std::string_view address, const char* example);

// The fault of an address; absent for HOST:PORT on this machine. example: what to write instead.
std::optional<std::string> local_address_fault(std::string_view address, const char* example);

// Whether the host, an IPv4 address or localhost, is this machine itself.
bool is_ipv4_loopback(std::string_view host);

}  // namespace splid
