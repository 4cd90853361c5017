#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/control_scene.hpp"
#include "tests/support/full_table.hpp"

// The built program while it cannot open a file more, and others connect to it.

namespace splid::sockets {
namespace {

using test::eventually;
using ::testing::HasSubstr;

// The thread's processor time, s.
double own_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double cpu_s(pid_t process) {
  clockid_t clock{};
  timespec time{};
  if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &time) != 0) return -1;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

class Connection {
 public:
  // To a Unix socket.
  explicit Connection(const std::string& file)
      : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    file.copy(address.sun_path, sizeof(address.sun_path) - 1);
    connect(address);
  }
  // To a port of this machine.
  explicit Connection(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connect(address);
  }
  ~Connection() { ::close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  [[nodiscard]] bool is_made() const { return is_made_; }
  // The other side closes it without a word, within a minute.
  [[nodiscard]] bool is_closed() const {
    char byte = 0;
    const ssize_t got = ::recv(socket_, &byte, 1, 0);
    return got == 0 || (got == -1 && errno == ECONNRESET);
  }

 private:
  template <class Address>
  void connect(const Address& address) {
    is_made_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    const timeval patience{60, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }

  int socket_;
  bool is_made_ = false;
};

class FullFileTable : public test::ControlScene {
 protected:
  // Nothing comes of it, so that the daemon has nothing else to do.
  void SetUp() override {
    frames = "tcp://127.0.0.1:*";
    daemon = std::make_unique<test::Program>(std::vector<std::string>{
        "run", "--config",
        configure(R"("driver":"bridge","address":"unix:)" + folder.path("nobody") + '"')});
    ASSERT_TRUE(eventually([this] { return status().find("no_device") != std::string::npos; }))
        << daemon->err();
  }

  // Where frames are published.
  [[nodiscard]] int port() const {
    const std::string words = "publishing at tcp://127.0.0.1:";
    const std::string said = daemon->err();
    return std::stoi(said.substr(said.find(words) + words.size()));
  }
};

TEST_F(FullFileTable, WhoConnectsIsTurnedAwayAndItIsSaid) {
  std::optional<test::FullTable> full(daemon->id());
  for (int i = 0; i < 20; ++i) {
    const Connection control(socket);
    ASSERT_TRUE(control.is_made());
    EXPECT_TRUE(control.is_closed()) << i;
    const Connection subscriber(port());
    ASSERT_TRUE(subscriber.is_made());
    EXPECT_TRUE(subscriber.is_closed()) << i;
  }
  EXPECT_THAT(daemon->err(), HasSubstr("no file can be opened any more"));
  EXPECT_THAT(daemon->err(), HasSubstr("raise LimitNOFILE"));
  full.reset();
  EXPECT_TRUE(eventually([this] { return status().find("no_device") != std::string::npos; }));
}

// Beside a thread that does nothing but spin, which gets as much of a processor as there is.
TEST_F(FullFileTable, NobodySpins) {
  std::optional<test::FullTable> full(daemon->id());
  const Connection subscriber(port());
  const double daemon_before_s = cpu_s(daemon->id());
  const double own_before_s = own_cpu_s();
  std::uint64_t spun = 0;
  while (own_cpu_s() - own_before_s < 0.5) ++spun;
  const double daemon_s = cpu_s(daemon->id()) - daemon_before_s;
  EXPECT_LT(daemon_s, 0.25) << "of 0.5 s that one who spins has taken";
  full.reset();
  EXPECT_TRUE(eventually([this] { return status().find("no_device") != std::string::npos; }))
      << daemon->err();
  EXPECT_GT(spun, 0U);
}

}  // namespace
}  // namespace splid::sockets
