#include "daemon/security/zap.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace splid::security {
namespace {

using testing::ElementsAre;

std::vector<std::string> request_parts() {
  return {"1.0", "7", "publish", "192.0.2.7", "", "CURVE", std::string(32, '\0')};
}

TEST(Zap, ARequestHasItsPartsInOrder) {
  const auto request = parse_zap_request(request_parts());
  ASSERT_TRUE(request);
  EXPECT_EQ(request->request_id, "7");
  EXPECT_EQ(request->domain, "publish");
  EXPECT_EQ(request->address, "192.0.2.7");
  EXPECT_EQ(request->mechanism, "CURVE");
  EXPECT_THAT(request->credentials, ElementsAre(std::string(32, '\0')));
  EXPECT_EQ(curve_key_of(*request), std::string(40, '0'));
}

TEST(Zap, WhatIsNoRequestOfVersionOneIsNone) {
  auto parts = request_parts();
  parts[0] = "2.0";
  EXPECT_FALSE(parse_zap_request(parts));
  for (std::size_t count = 0; count < 6; ++count) {
    parts = request_parts();
    parts.resize(count);
    EXPECT_FALSE(parse_zap_request(parts)) << count;
  }
  parts = request_parts();
  parts.resize(6);
  EXPECT_TRUE(parse_zap_request(parts)) << "NULL has no credentials";
}

TEST(Zap, OnlyCurveGivesAKey) {
  const auto key_of = [](const char* mechanism, std::vector<std::string> credentials) {
    return curve_key_of({"1", "publish", "", mechanism, std::move(credentials)});
  };
  EXPECT_TRUE(key_of("CURVE", {std::string(32, 'x')}));
  EXPECT_FALSE(key_of("PLAIN", {std::string(32, 'x')}));
  EXPECT_FALSE(key_of("NULL", {}));
  EXPECT_FALSE(key_of("CURVE", {}));
  EXPECT_FALSE(key_of("CURVE", {std::string(31, 'x')}));
  EXPECT_FALSE(key_of("CURVE", {std::string(33, 'x')}));
  EXPECT_FALSE(key_of("CURVE", {std::string(32, 'x'), ""}));
}

TEST(Zap, AnAnswerHasSixParts) {
  using Status = ZapReply::Status;
  EXPECT_THAT(zap_parts("7", {Status::admitted, "", "viewer"}),
              ElementsAre("1.0", "7", "200", "", "viewer", ""));
  EXPECT_THAT(zap_parts("", {Status::refused, "no", ""}),
              ElementsAre("1.0", "", "400", "no", "", ""));
  EXPECT_THAT(zap_parts("", {Status::malformed, "", ""}),
              ElementsAre("1.0", "", "500", "", "", ""));
  EXPECT_EQ(ZapReply{}.status, Status::refused);
}

}  // namespace
}  // namespace splid::security
