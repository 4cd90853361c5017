#include "drivers/client_socket.hpp"

#include <gtest/gtest.h>
#include <netinet/tcp.h>

#include <string>

#include "tests/support/bridge_server.hpp"

namespace splid {
namespace {

int option_of(int descriptor, int level, int option) {
  int value = -1;
  socklen_t bytes = sizeof value;
  ::getsockopt(descriptor, level, option, &value, &bytes);
  return value;
}

// The descriptor of this process that is connected to a port of this machine; -1 for none.
int connected_to(const std::string& address) {
  const int port = std::stoi(address.substr(address.rfind(':') + 1));
  for (int descriptor = 3; descriptor < 1024; ++descriptor) {
    sockaddr_in peer{};
    socklen_t bytes = sizeof peer;
    if (::getpeername(descriptor, reinterpret_cast<sockaddr*>(&peer), &bytes) != 0) continue;
    if (peer.sin_family == AF_INET && ntohs(peer.sin_port) == port) return descriptor;
  }
  return -1;
}

// Otherwise a reader that never writes would wait for ever on a machine that lost its power.
TEST(ClientSocket, ATcpConnectionThatDiesSilentlyFails) {
  test::BridgeServer server;
  ClientSocket socket(server.address());
  ASSERT_TRUE(socket.connect({}));
  const int descriptor = connected_to(server.address());
  ASSERT_NE(descriptor, -1);
  EXPECT_EQ(option_of(descriptor, SOL_SOCKET, SO_KEEPALIVE), 1);
  EXPECT_EQ(option_of(descriptor, IPPROTO_TCP, TCP_KEEPIDLE), 3);
  EXPECT_EQ(option_of(descriptor, IPPROTO_TCP, TCP_KEEPINTVL), 1);
  EXPECT_EQ(option_of(descriptor, IPPROTO_TCP, TCP_KEEPCNT), 3);
}

}  // namespace
}  // namespace splid
