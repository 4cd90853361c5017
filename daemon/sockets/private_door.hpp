#pragma once

#include "daemon/base/file_descriptor.hpp"

namespace zmq {
class socket_t;
}

namespace splid::sockets {

// An entrance to a ZeroMQ socket of this process that no other process can use. It is a Unix socket
// in a folder that only its owner could enter; its file and the folder are removed at once. From
// then on only this process can reach the socket, through the descriptor of its inode.
//
// Threads: the constructor on the socket's thread; connect() on any thread.
class PrivateDoor {
 public:
  // Binds `socket`, which has to have all its options by now. Errors: Error(Fault::device).
  explicit PrivateDoor(zmq::socket_t& socket);

  // A new non-blocking connection to the socket. Where none can be had at present, the descriptor
  // is not open and errno says why.
  [[nodiscard]] FileDescriptor connect() const;

 private:
  FileDescriptor inode_;
};

}  // namespace splid::sockets
