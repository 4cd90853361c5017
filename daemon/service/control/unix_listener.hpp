#pragma once

#include <string>

namespace splid {

// A listening Unix socket whose file only its owner can use (0600), from the moment it is there.
// A file that a dead daemon left is taken over, that of a living one never: PATH.lock, which stays,
// is held for as long as this lives, and the kernel lets go of it however the process ends.
//
// Threads: one. Errors: the constructor throws Error(Fault::device) naming the file: where another
// listens there, what is there is no socket, or it cannot be made.
//
// Design note: libzmq, asked to bind, removes whatever socket is there, also a living daemon's, and
// makes its own with the mode of the process's umask. It takes one that was made elsewhere
// (ZMQ_USE_FD), and then removes nothing at the end either.
class UnixListener {
 public:
  explicit UnixListener(std::string file);
  ~UnixListener();
  UnixListener(const UnixListener&) = delete;
  UnixListener& operator=(const UnixListener&) = delete;

  // The socket, which is the caller's to close from now on. Once.
  int release();

 private:
  void lock();
  void make_way() const;
  void listen();

  std::string file_;
  int lock_ = -1;
  int socket_ = -1;
  bool listens_ = false;
};

}  // namespace splid
