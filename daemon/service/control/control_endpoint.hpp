#pragma once

#include <string>

#include "config/daemon_options.hpp"

namespace splid::control {

// The endpoint at which the daemon listens for control requests; empty: none. It is the configured
// endpoint or, for "auto", ipc:// with the first of these files whose variable is set:
// $RUNTIME_DIRECTORY/control.sock (for a service), $XDG_RUNTIME_DIR/splid-control.sock (for a
// user), or /run/splid-control.sock (for root without these variables).
std::string endpoint_of(const ControlOptions& options);

// The endpoint that `splid ctl` asks when its command line names none: the first of
// $XDG_RUNTIME_DIR/splid-control.sock, /run/splid/control.sock (the service's) and
// /run/splid-control.sock that exists; where none exists, the service's.
std::string default_endpoint();

// The file of an ipc:// endpoint.
std::string socket_file_of(const std::string& endpoint);

}  // namespace splid::control
