#pragma once

#include "config/config.hpp"

namespace splid {

// Checks that no two of the sockets that `run` binds are at one place, where the second could never
// be bound: the same file, or the same port of the same address or of all addresses.
//
// Threads: any. Errors: Error(Fault::usage) naming the file, the JSON pointers and the place.
void check_socket_places(const Config& config);

}  // namespace splid
