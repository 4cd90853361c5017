#pragma once

#include "drivers/message_socket.hpp"

namespace splid::sockets {

// Opens connections of ZeroMQ for a driver, which share a context of their own: REQ or PAIR over
// TCP. A connection that breaks is made anew ten times a second.
//
// Threads: any; each socket is for one. Errors: the function throws Error(Fault::usage) where the
// place is none.
OpenSocket message_clients();

}  // namespace splid::sockets
