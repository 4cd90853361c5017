#include "daemon/service/control/unix_listener.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "protocol/error.hpp"

namespace splid::control {
namespace {

constexpr int backlog = 128;

[[noreturn]] void fail(const std::string& file, const std::string& what) {
  throw Error(Fault::device, "control.endpoint ipc://" + file + ": " + what);
}

[[noreturn]] void fail_by_errno(const std::string& file, const char* call) {
  fail(file, std::string(call) + ": " + std::generic_category().message(errno) +
                 "; give control.endpoint a folder that may be written to, or off");
}

[[noreturn]] void fail_in_use(const std::string& file) {
  fail(file,
       "another splid is controlled there; stop it, or give control.endpoint another file or off");
}

sockaddr_un address_of(const std::string& file) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, file.c_str(), sizeof(address.sun_path) - 1);
  return address;
}

bool somebody_listens(const std::string& file) {
  const sockaddr_un address = address_of(file);
  const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (probe == -1) return false;
  const int result = ::connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  // Where a process listens and its backlog is full, connect() says EAGAIN. It says ECONNREFUSED
  // only where no process has the socket open.
  const bool refused = result != 0 && errno == ECONNREFUSED;
  ::close(probe);
  return !refused;
}

}  // namespace

UnixListener::UnixListener(std::string file) : file_(std::move(file)) {
  lock();
  try {
    make_way();
    listen();
  } catch (...) {
    if (socket_ != -1) ::close(socket_);
    ::close(lock_);
    throw;
  }
}

UnixListener::~UnixListener() {
  if (listens_) ::unlink(file_.c_str());
  if (socket_ != -1) ::close(socket_);
  ::close(lock_);
}

int UnixListener::release() { return std::exchange(socket_, -1); }

void UnixListener::lock() {
  lock_ = ::open((file_ + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (lock_ == -1) fail_by_errno(file_ + ".lock", "open");
  if (::flock(lock_, LOCK_EX | LOCK_NB) == 0) return;
  const int why = errno;
  ::close(std::exchange(lock_, -1));
  errno = why;
  if (why == EWOULDBLOCK) fail_in_use(file_);
  fail_by_errno(file_ + ".lock", "flock");
}

void UnixListener::make_way() const {
  struct stat found {};
  if (::lstat(file_.c_str(), &found) != 0) return;
  if (!S_ISSOCK(found.st_mode))
    fail(file_, "exists and is no socket; give control.endpoint another path");
  if (somebody_listens(file_)) fail_in_use(file_);
  if (::unlink(file_.c_str()) != 0) fail_by_errno(file_, "unlink");
}

void UnixListener::listen() {
  socket_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket_ == -1) fail_by_errno(file_, "socket");
  // The file gets the socket's mode when it is made, so there is no moment at which others can use
  // it.
  if (::fchmod(socket_, 0600) != 0) fail_by_errno(file_, "fchmod");
  const sockaddr_un address = address_of(file_);
  if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    fail_by_errno(file_, "bind");
  }
  listens_ = true;
  if (::listen(socket_, backlog) != 0) fail_by_errno(file_, "listen");
}

}  // namespace splid::control
