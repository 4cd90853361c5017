#include "daemon/service/control/unix_listener.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "config/daemon_options.hpp"
#include "daemon/service/control/control_endpoint.hpp"
#include "protocol/error.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::control {
namespace {

using ::testing::HasSubstr;

std::string listen_refusal(const std::string& file) {
  try {
    const UnixListener listener(file);
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::device);
    return error.what();
  }
  return "";
}

// A socket file as another program makes it; -1 where it cannot.
int bind_by_hand(const std::string& file) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, file.c_str(), sizeof(address.sun_path) - 1);
  const int made = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  return ::bind(made, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ? made : -1;
}

TEST(UnixListener, IsItsOwnersAloneWhateverTheUmask) {
  const test::TempFolder folder;
  const mode_t before = ::umask(0);
  const UnixListener listener(folder.path("s"));
  ::umask(before);
  struct stat found {};
  ASSERT_EQ(::stat(folder.path("s").c_str(), &found), 0);
  EXPECT_TRUE(S_ISSOCK(found.st_mode));
  EXPECT_EQ(found.st_mode & 0777U, 0600U);
}

TEST(UnixListener, IsGoneWithItsOwner) {
  const test::TempFolder folder;
  { const UnixListener listener(folder.path("s")); }
  EXPECT_FALSE(std::filesystem::exists(folder.path("s")));
  EXPECT_EQ(listen_refusal(folder.path("s")), "");
}

TEST(UnixListener, ALivingOneIsNeverTakenOver) {
  const test::TempFolder folder;
  const UnixListener listener(folder.path("s"));
  EXPECT_THAT(listen_refusal(folder.path("s")), HasSubstr("another splid is controlled there"));
  EXPECT_TRUE(std::filesystem::exists(folder.path("s")));
}

TEST(UnixListener, TakesADeadOnesPlaceAndNobodyElses) {
  const test::TempFolder folder;
  const int other = bind_by_hand(folder.path("s"));
  ASSERT_EQ(::listen(other, 1), 0);
  EXPECT_THAT(listen_refusal(folder.path("s")), HasSubstr("another splid is controlled there"));
  ::close(other);
  EXPECT_EQ(listen_refusal(folder.path("s")), "");

  const std::string file = folder.write("kept", "text");
  EXPECT_THAT(listen_refusal(file), HasSubstr("is no socket"));
  EXPECT_EQ(std::filesystem::file_size(file), 4u);
  EXPECT_THAT(listen_refusal(folder.path("absent/s")), HasSubstr("No such file or directory"));
}

// The tests' own variables are given back.
class ControlEndpoint : public ::testing::Test {
 protected:
  ControlEndpoint() {
    ::unsetenv("RUNTIME_DIRECTORY");
    ::unsetenv("XDG_RUNTIME_DIR");
  }
  ~ControlEndpoint() override {
    ::unsetenv("RUNTIME_DIRECTORY");
    if (xdg_.empty()) {
      ::unsetenv("XDG_RUNTIME_DIR");
    } else {
      ::setenv("XDG_RUNTIME_DIR", xdg_.c_str(), 1);
    }
  }

 private:
  std::string xdg_ =
      std::getenv("XDG_RUNTIME_DIR") == nullptr ? "" : std::getenv("XDG_RUNTIME_DIR");
};

TEST_F(ControlEndpoint, IsAsConfiguredOrTheServicesOrTheUsersOwn) {
  EXPECT_EQ(endpoint_of({.endpoint = "off", .allow_list = ""}), "");
  EXPECT_EQ(endpoint_of({.endpoint = "ipc:///a/b", .allow_list = ""}), "ipc:///a/b");
  EXPECT_EQ(endpoint_of({}), ::geteuid() == 0 ? "ipc:///run/splid-control.sock" : "");
  ::setenv("XDG_RUNTIME_DIR", "/run/user/7", 1);
  EXPECT_EQ(endpoint_of({}), "ipc:///run/user/7/splid-control.sock");
  ::setenv("RUNTIME_DIRECTORY", "/run/splid", 1);
  EXPECT_EQ(endpoint_of({}), "ipc:///run/splid/control.sock");
}

TEST_F(ControlEndpoint, TheCommandFindsTheOneThatIsThere) {
  const test::TempFolder folder;
  ::setenv("XDG_RUNTIME_DIR", std::filesystem::path(folder.path("x")).parent_path().c_str(), 1);
  EXPECT_THAT(default_endpoint(), HasSubstr("ipc:///run/splid"));
  folder.write("splid-control.sock", "");
  EXPECT_EQ(default_endpoint(), "ipc://" + folder.path("splid-control.sock"));
}

}  // namespace
}  // namespace splid::control
