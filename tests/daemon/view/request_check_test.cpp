#include "daemon/view/request_check.hpp"

#include <gtest/gtest.h>

#include <string>

namespace splid::view {
namespace {

TEST(RequestCheck, FindsTheHostWithoutItsPort) {
  EXPECT_EQ(host_of("LocalHost:9874"), "localhost");
  EXPECT_EQ(host_of("127.0.0.1"), "127.0.0.1");
  EXPECT_EQ(host_of("[::1]:80"), "::1");
  EXPECT_EQ(host_of("lab-pc.example"), "lab-pc.example");
  for (const char* bad : {"", ":", ":80", "a:b", "a:", "a:123456", "[::1", "[::1]80", "[a]", "[]",
                          "a b", "a/b", "a@b", "http://a", "a\r\nb", "::1"}) {
    EXPECT_FALSE(host_of(bad)) << bad;
  }
  EXPECT_FALSE(host_of(std::string(300, 'a')));
  EXPECT_FALSE(host_of(std::string("[::\0evil]", 9)));
}

TEST(RequestCheck, AnswersToAddressesAndTheMachinesOwnName) {
  for (const char* own : {"localhost", "localhost:9874", "127.0.0.1:1", "192.168.1.20:9874",
                          "[fe80::1]:9874", "lab", "LAB:9874", "lab.local:80"}) {
    EXPECT_TRUE(is_own_host(own, "Lab")) << own;
  }
  // Names that a stranger can have in the DNS.
  for (const char* foreign : {"", "evil.example", "localhost.evil.example", "lab.evil.example",
                              "127.0.0.1.evil.example", "1.2.3", "other", "[::1].evil.example"}) {
    EXPECT_FALSE(is_own_host(foreign, "Lab")) << foreign;
  }
  EXPECT_FALSE(is_own_host("", ""));
  EXPECT_FALSE(is_own_host(".local", ""));
}

TEST(RequestCheck, OriginIsTheServersOwn) {
  EXPECT_TRUE(is_own_origin("http://127.0.0.1:9874", "127.0.0.1:9874"));
  EXPECT_TRUE(is_own_origin("https://LAB", "lab"));
  for (const char* foreign :
       {"", "null", "127.0.0.1:9874", "http://127.0.0.1:9875", "http://evil.example",
        "http://127.0.0.1:9874.evil.example", "file://127.0.0.1:9874", "http://"}) {
    EXPECT_FALSE(is_own_origin(foreign, "127.0.0.1:9874")) << foreign;
  }
}

TEST(RequestCheck, ReadsSeconds) {
  EXPECT_EQ(time_from("1764294000.25"), 1764294000.25);
  EXPECT_EQ(time_from("-1"), -1);
  for (const char* bad : {"", " 1", "1 ", "1e5", "nan", "inf", "0x10", "123456789012345678901"}) {
    EXPECT_FALSE(time_from(bad)) << bad;
  }
  EXPECT_EQ(seconds_from("60"), 60);
  EXPECT_EQ(seconds_from("0"), 0);
  EXPECT_EQ(seconds_from("99999"), 99'999);
  for (const char* bad : {"", "-1", "+1", "1.5", "1e3", "100000", " 1", "sixty"}) {
    EXPECT_FALSE(seconds_from(bad)) << bad;
  }
}

}  // namespace
}  // namespace splid::view
