#pragma once

#include <cstdint>

namespace splid {

// What becomes of connections while this process, or the system, has no file left to open (EMFILE,
// ENFILE): each is taken with a file that is kept for that, and closed at once.
//
// Design note: libzmq accepts connections on threads of its own and, where the table is full, tries
// again at once for as long as somebody waits to be let in, which takes a whole core; on a Unix
// socket it aborts the process. It cannot be told otherwise, so this program has an accept() of its
// own, which the libraries that it is linked to call too: to them nobody waits any more.

// At the program's start, while there is a file to keep.
void keep_spare_file();

// Connections closed so far. Threads: any.
std::uint64_t turned_away_connections();

}  // namespace splid
