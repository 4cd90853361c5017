#include "daemon/sockets/listening_socket.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "protocol/error.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::sockets {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::MatchesRegex;
using testing::StartsWith;

std::string error_of(const std::string& endpoint, Fault fault) {
  try {
    const ListeningSocket socket("publish.endpoint", endpoint);
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), fault) << error.what();
    return error.what();
  }
  ADD_FAILURE() << endpoint << " was bound";
  return "";
}

TEST(ListeningSocket, BindsWhatTheDocumentsName) {
  for (const char* endpoint : {"tcp://127.0.0.1:*", "tcp://localhost:*", "tcp://lo:*"}) {
    const ListeningSocket socket("key", endpoint);
    EXPECT_THAT(socket.endpoint(), MatchesRegex("tcp://127\\.0\\.0\\.1:[1-9][0-9]*"));
  }
  EXPECT_THAT(ListeningSocket("key", "tcp://*:*").endpoint(), StartsWith("tcp://0.0.0.0:"));
}

TEST(ListeningSocket, BindsIpv6WhereThereIsOne) {
  if (!std::filesystem::exists("/proc/net/if_inet6")) GTEST_SKIP() << "no IPv6 here";
  EXPECT_THAT(ListeningSocket("key", "tcp://[::1]:*").endpoint(), StartsWith("tcp://[::1]:"));
  EXPECT_THAT(ListeningSocket("key", "tcp://[::]:*").endpoint(), StartsWith("tcp://[::]:"));
}

TEST(ListeningSocket, SaysWhoHasThePort) {
  const ListeningSocket first("publish.endpoint", "tcp://127.0.0.1:*");
  EXPECT_THAT(error_of(first.endpoint(), Fault::device),
              AllOf(HasSubstr("publish.endpoint " + first.endpoint()),
                    HasSubstr("Address already in use; another program, maybe another splid")));
}

TEST(ListeningSocket, SaysWhatIsNoAddressOfThisMachine) {
  EXPECT_THAT(error_of("tcp://no-such-place:9", Fault::device), HasSubstr("No such device"));
  EXPECT_THAT(error_of("tcp://192.0.2.1:*", Fault::device),
              HasSubstr("Cannot assign requested address"));
  EXPECT_THAT(error_of("ipc:///no/such/folder/s", Fault::device), HasSubstr("No such file"));
  for (const char* endpoint : {"nonsense", "carrier://pigeon", "tcp://127.0.0.1", "ipc://"}) {
    EXPECT_THAT(error_of(endpoint, Fault::usage), HasSubstr("publish.endpoint"));
  }
}

TEST(ListeningSocket, TakesOverAFileThatNobodyListensAt) {
  const test::TempFolder folder;
  const std::string file = folder.path("frames");
  {
    ListeningSocket dead("key", "ipc://" + file);
    EXPECT_TRUE(std::filesystem::is_socket(file));
    EXPECT_THAT(error_of("ipc://" + file, Fault::device), HasSubstr("listens there"));
  }
  EXPECT_FALSE(std::filesystem::exists(file));
  (void)folder.write("frames", "no socket");
  EXPECT_THAT(error_of("ipc://" + file, Fault::device), HasSubstr("Address already in use"));
  EXPECT_TRUE(std::filesystem::is_regular_file(file));
}

TEST(ListeningSocket, AnAbstractNameHasNoFile) {
  const ListeningSocket socket("key", "ipc://@splid-test-of-a-name");
  EXPECT_FALSE(std::filesystem::exists("@splid-test-of-a-name"));
  EXPECT_THAT(error_of("ipc://@splid-test-of-a-name", Fault::device), HasSubstr("in use"));
}

}  // namespace
}  // namespace splid::sockets
