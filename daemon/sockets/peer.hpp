#pragma once

#include <string>

namespace splid::sockets {

// Who is at the other end of a connection, as the kernel reports it.
struct Peer {
  std::string name;  // "192.0.2.7", "2001:db8::7", "user 1000"
  // Peers of one group share one allowance. It is the name; for IPv6 it is the first 64 bits of the
  // address, since one machine can choose freely among the addresses of such a network.
  std::string group;
};

// socket: a connected TCP or Unix socket. Errors: none; the peer is "somebody" where the kernel
// does not tell.
Peer peer_of(int socket);

}  // namespace splid::sockets
