#pragma once

#include <string>

namespace splid::control {

// A listening Unix socket whose file only its owner can use (mode 0600) from the moment it exists.
// The socket file of a dead daemon is replaced; that of a living daemon never is. To tell them
// apart, a daemon holds a lock on PATH.lock for as long as this object lives; the kernel releases
// the lock however the process ends. The file PATH.lock itself stays.
//
// Threads: one. Errors: the constructor throws Error(Fault::device), which names the file, where
// another daemon listens there, where something other than a socket is there, and where the socket
// cannot be made.
//
// Design note: where libzmq binds a socket itself, it removes any socket file that is there, even a
// living daemon's, and makes its own with the mode that the umask leaves. So libzmq is given a
// socket made here (ZMQ_USE_FD), and then it does not remove the file at the end either.
class UnixListener {
 public:
  explicit UnixListener(std::string file);
  ~UnixListener();
  UnixListener(const UnixListener&) = delete;
  UnixListener& operator=(const UnixListener&) = delete;

  // Gives the socket to the caller, who has to close it. To be called once.
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

}  // namespace splid::control
