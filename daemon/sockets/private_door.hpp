#pragma once

#include "daemon/base/file_descriptor.hpp"

namespace zmq {
class socket_t;
}

namespace splid {

// A way to a ZeroMQ socket of this process that nobody else can take: a Unix socket whose name is
// removed, with the folder that only its owner could enter, before anybody is told of it. It is
// found by its open inode alone.
//
// Threads: the constructor on the socket's; connect() on any one.
class PrivateDoor {
 public:
  // Binds `socket`, with the options that it has now. Errors: Error(Fault::device).
  explicit PrivateDoor(zmq::socket_t& socket);

  // A new connection that does not block; not open where it cannot be had now, errno says why.
  [[nodiscard]] FileDescriptor connect() const;

 private:
  FileDescriptor inode_;
};

}  // namespace splid
