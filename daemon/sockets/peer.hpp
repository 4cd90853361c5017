#pragma once

#include <string>

namespace splid {

// Who is at the other end of a connection, as the kernel says it.
struct Peer {
  std::string name;   // "192.0.2.7", "2001:db8::7", "user 1000"
  std::string group;  // what shares one allowance: that, of IPv6 the first 64 bits, which are one
                      // machine's to choose from
};

// socket: a connected one, of TCP or Unix. Errors: none; "somebody" where the kernel says nothing.
Peer peer_of(int socket);

}  // namespace splid
