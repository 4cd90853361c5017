#include "daemon/sockets/zmtp_framing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "tests/support/zmtp_peer.hpp"

namespace splid::sockets {
namespace {

using test::ZmtpPeer;
using testing::ElementsAre;

std::string greeting(const std::string& mechanism) {
  std::string bytes = std::string("\xff\0\0\0\0\0\0\0\1\x7f\3\0", 12) + mechanism;
  bytes.resize(ZmtpFraming::greeting_bytes);
  return bytes;
}

bool take(ZmtpFraming& framing, const std::string& bytes, std::vector<std::uint64_t>& bodies) {
  return framing.take(std::as_bytes(std::span(bytes)), bodies);
}

const std::string stream = greeting("NULL") + ZmtpPeer::frame("") + ZmtpPeer::frame("1") +
                           ZmtpPeer::frame(std::string(255, 'x'), ZmtpPeer::command) +
                           ZmtpPeer::frame(std::string(256, 'x'), ZmtpPeer::more);

TEST(ZmtpFraming, FindsEachFrameHoweverItComes) {
  for (const std::size_t piece : {1, 2, 7, 64, 1000}) {
    ZmtpFraming framing;
    std::vector<std::uint64_t> bodies;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
      EXPECT_TRUE(take(framing, stream.substr(at, piece), bodies));
    }
    EXPECT_THAT(bodies, ElementsAre(0, 1, 255, 256)) << piece;
    EXPECT_EQ(framing.mechanism(), "NULL");
  }
}

TEST(ZmtpFraming, KnowsALengthBeforeItsBytesCome) {
  ZmtpFraming framing;
  std::vector<std::uint64_t> bodies;
  EXPECT_TRUE(take(framing, greeting("CURVE") + '\2' + std::string(8, '\xff'), bodies));
  EXPECT_THAT(bodies, ElementsAre(std::numeric_limits<std::uint64_t>::max()));
  EXPECT_EQ(framing.mechanism(), "CURVE");
  EXPECT_TRUE(take(framing, std::string(10'000, '\xff'), bodies));
  EXPECT_EQ(bodies.size(), 1U);
}

TEST(ZmtpFraming, TellsWhatItIsNot) {
  std::string old = greeting("NULL");
  old[10] = 1;
  std::string unsigned_one = greeting("NULL");
  unsigned_one[9] = 0;
  for (const std::string& bytes :
       {std::string("GET /metrics HTTP/1.1"), old, unsigned_one, greeting("NULL") + "\x08"}) {
    ZmtpFraming framing;
    std::vector<std::uint64_t> bodies;
    EXPECT_FALSE(take(framing, bytes, bodies));
    EXPECT_FALSE(take(framing, ZmtpPeer::frame("x"), bodies));
    EXPECT_TRUE(bodies.empty());
  }
}

TEST(ZmtpFraming, AMechanismThatIsNoneIsNamedSo) {
  ZmtpFraming framing;
  std::vector<std::uint64_t> bodies;
  EXPECT_TRUE(take(framing, greeting("\n\x1b[2J"), bodies));
  EXPECT_EQ(framing.mechanism(), "nothing");
}

}  // namespace
}  // namespace splid::sockets
