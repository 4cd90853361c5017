#include "daemon/sockets/full_file_table.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <mutex>
#include <thread>

#include "daemon/base/log.hpp"

namespace splid::sockets {
namespace {

using Time = std::chrono::steady_clock;

constexpr std::chrono::seconds between_lines{10};
// How long nobody is accepted where even the reserved descriptor is gone.
constexpr std::chrono::milliseconds pause{10};

int open_spare() { return ::open("/dev/null", O_RDONLY | O_CLOEXEC); }

int system_accept(int listener, sockaddr* peer, socklen_t* bytes, int flags) {
  return static_cast<int>(::syscall(SYS_accept4, listener, peer, bytes, flags));
}

// Threads: any; locks.
class Door {
 public:
  void prepare() {
    const std::scoped_lock lock(mutex_);
    if (spare_ == -1) spare_ = open_spare();
  }

  // Accepts the next connection and closes it.
  void turn_away(int listener) {
    if (close_next(listener)) {
      say();
    } else {
      std::this_thread::sleep_for(pause);
    }
  }

  [[nodiscard]] std::uint64_t count() const { return count_; }

 private:
  bool close_next(int listener) {
    const std::scoped_lock lock(mutex_);
    if (spare_ != -1) ::close(spare_);
    pollfd waiting{listener, POLLIN, 0};
    const int connection =
        ::poll(&waiting, 1, 0) > 0 ? system_accept(listener, nullptr, nullptr, SOCK_CLOEXEC) : -1;
    if (connection != -1) ::close(connection);
    spare_ = open_spare();
    if (connection == -1) return false;
    ++count_;
    return true;
  }

  void say() {
    {
      const std::scoped_lock lock(mutex_);
      const auto now = Time::now();
      if (said_ != Time::time_point{} && now - said_ < between_lines) return;
      said_ = now;
    }
    rlimit limit{};
    ::getrlimit(RLIMIT_NOFILE, &limit);
    log_warning(
        "no file can be opened any more (this process may have {}): {} connections were closed "
        "without an answer so far; see who connects, or raise LimitNOFILE",
        limit.rlim_cur, count_.load());
  }

  std::mutex mutex_;
  int spare_ = -1;
  Time::time_point said_;
  std::atomic<std::uint64_t> count_{0};
};

Door& door() {
  static Door only;
  return only;
}

int accept_or_turn_away(int listener, sockaddr* peer, socklen_t* bytes, int flags) {
  const int connection = system_accept(listener, peer, bytes, flags);
  if (connection != -1 || (errno != EMFILE && errno != ENFILE)) return connection;
  door().turn_away(listener);
  errno = EAGAIN;
  return -1;
}

}  // namespace

void keep_spare_file() { door().prepare(); }

std::uint64_t turned_away_connections() { return door().count(); }

}  // namespace splid::sockets

// Declared as in the C library: the libraries linked to this program call these functions.
extern "C" {

// NOLINTBEGIN(readability-inconsistent-declaration-parameter-name): the library's are reserved
// names.
[[gnu::visibility("default")]] int accept4(int listener, sockaddr* peer, socklen_t* bytes,
                                           int flags) {
  return splid::sockets::accept_or_turn_away(listener, peer, bytes, flags);
}

[[gnu::visibility("default")]] int accept(int listener, sockaddr* peer, socklen_t* bytes) {
  return splid::sockets::accept_or_turn_away(listener, peer, bytes, 0);
}
// NOLINTEND(readability-inconsistent-declaration-parameter-name)
}
