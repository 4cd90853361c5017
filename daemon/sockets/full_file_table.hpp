#pragma once

#include <cstdint>

namespace splid::sockets {

// Deals with connections that come while this process, or the system, has no file descriptor left
// (EMFILE, ENFILE): each is accepted with a descriptor kept in reserve, and closed at once.
//
// Design note: libzmq accepts connections on threads of its own. With no descriptor left it tries
// again at once, for as long as a peer waits to be accepted, and that takes a whole core; on a Unix
// socket it aborts the process. libzmq has no option against this. So this program defines accept()
// itself, and the libraries linked to it call that function: to them no peer seems to wait any
// more.

// Reserves the descriptor. To be called at the program's start, while there are descriptors left.
void keep_spare_file();

// Connections closed so far. Threads: any.
std::uint64_t turned_away_connections();

}  // namespace splid::sockets
