#pragma once

#include <string>

#include "config/daemon_options.hpp"

namespace splid {

// Where the daemon listens for control: the configured endpoint; for "auto" ipc:// and
// $RUNTIME_DIRECTORY/control.sock (a service), $XDG_RUNTIME_DIR/splid-control.sock (somebody's own)
// or, for root without either, /run/splid-control.sock. Empty: nowhere.
std::string control_endpoint(const ControlOptions& options);

// Where splid ctl asks when nobody says where: the first of $XDG_RUNTIME_DIR/splid-control.sock,
// /run/splid/control.sock (the service's) and /run/splid-control.sock that is there; the service's
// where none is.
std::string default_control_endpoint();

// The file of an ipc:// endpoint.
std::string socket_file_of(const std::string& endpoint);

}  // namespace splid
