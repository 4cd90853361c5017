#include "config/security_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace splid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const SecurityOptions keys{.server_key = "s.key_secret", .allow_list = "allowed"};
const SecurityOptions in_words{
    .server_key = "", .allow_list = "", .unprotected = Unprotected::anyone_may_read};

std::string security_fault(const SecurityOptions& options) {
  const auto fault = options.validate();
  return fault ? fault->pointer + ": " + fault->what : "";
}

std::string security_fault(const SecurityOptions& options, const std::string& endpoint) {
  return options.endpoint_fault(endpoint).value_or("");
}

TEST(SecurityOptions, AKeyAndAListGoTogether) {
  EXPECT_EQ(security_fault(SecurityOptions{}), "");
  EXPECT_EQ(security_fault(keys), "");
  EXPECT_THAT(security_fault({.server_key = "s", .allow_list = ""}),
              HasSubstr("/allow_list: \"\" names no file"));
  EXPECT_THAT(security_fault({.server_key = "", .allow_list = "a"}),
              HasSubstr("/server_key: \"\" names no file"));
  EXPECT_EQ(security_fault(in_words), "");
  EXPECT_THAT(
      security_fault(
          {.server_key = "s", .allow_list = "a", .unprotected = Unprotected::anyone_may_read}),
      HasSubstr("/unprotected: contradicts"));
}

TEST(SecurityOptions, WithoutKeysThisMachineAloneIsReached) {
  for (const char* endpoint : {"tcp://127.0.0.1:9872", "tcp://127.3.2.1:*", "tcp://localhost:1",
                               "tcp://[::1]:9872", "tcp://lo:9872", "ipc:///run/x", "ipc://@x"}) {
    EXPECT_EQ(security_fault(SecurityOptions{}, endpoint), "") << endpoint;
  }
  for (const char* endpoint :
       {"tcp://*:9872", "tcp://0.0.0.0:9872", "tcp://192.168.1.2:9872", "tcp://eth0:9872",
        "tcp://[::]:9872", "tcp://127.example.org:9872", "tcp://127.0.0.1.example.org:9872",
        "tcp://127.0.0.256:9872", "tcp://127.0.0.:1"}) {
    EXPECT_THAT(security_fault(SecurityOptions{}, endpoint),
                AllOf(HasSubstr("without encryption"), HasSubstr("/security/server_key"),
                      HasSubstr("anyone on the network may read")))
        << endpoint;
    EXPECT_EQ(security_fault(keys, endpoint), "") << endpoint;
    EXPECT_EQ(security_fault(in_words, endpoint), "") << endpoint;
  }
}

}  // namespace
}  // namespace splid
