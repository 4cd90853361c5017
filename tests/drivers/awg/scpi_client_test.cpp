#include "drivers/awg/scpi_client.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include "tests/support/awg_double.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/tcp_peer.hpp"

namespace splid::awg {
namespace {

using test::AwgDouble;
using test::AwgFaults;
using test::error_text;
using ::testing::HasSubstr;
using ::testing::StartsWith;

ScpiClient connected(const AwgDouble& awg, std::chrono::milliseconds longest = test::patience) {
  return {"tcp:" + awg.address(), longest, {}};
}

TEST(ScpiClient, AsksAndCommands) {
  AwgDouble awg;
  ScpiClient client = connected(awg);
  EXPECT_THAT(client.ask("*IDN?"), StartsWith("Keysight Technologies,M8195A"));
  EXPECT_EQ(client.ask_number("*OPC?"), 1);
  EXPECT_NO_THROW(client.command(":FREQ:RAST 6E10"));
  EXPECT_EQ(client.ask_number(":FREQ:RAST?"), 6e10);
}

TEST(ScpiClient, AllErrorsOfACommandAreTold) {
  AwgDouble awg;
  ScpiClient client = connected(awg);
  EXPECT_THAT(error_text([&] { client.command(":FREQ:RAST 1;:FOO"); }),
              HasSubstr(":FREQ:RAST 1;:FOO: -222, Data out of range; -113, Undefined header;:FOO"));
  EXPECT_NO_THROW(client.command("*CLS"));
}

TEST(ScpiClient, BlocksMayHoldAnyBytes) {
  AwgDouble awg(AwgDouble::Model::m8195a, {}, AwgDouble::ReadBack::block);
  ScpiClient client = connected(awg);
  client.command(":TRAC1:DEF 1,1280");
  std::string bytes;
  for (int i = 0; i < 2'560; ++i) bytes += static_cast<char>(i);  // line feeds too
  client.command(":TRAC1:DATA 1,0,", bytes);
  const ScpiClient::Data data = client.ask_data(":TRAC1:DATA? 1,0,1280", 2'560);
  EXPECT_TRUE(data.is_block);
  EXPECT_EQ(data.content, bytes);
  EXPECT_EQ(client.ask_number("*OPC?"), 1);  // nothing of the block is left
}

TEST(ScpiClient, AnswersThatAreTooLongOrNoneAreErrors) {
  AwgFaults faults;
  faults.garbage_at = ":TRAC1:DATA?";
  const auto error_of = [&](const std::string& garbage,
                            std::chrono::milliseconds longest = test::patience) {
    faults.garbage = garbage;
    AwgDouble awg(AwgDouble::Model::m8195a, faults);
    ScpiClient client = connected(awg, longest);
    return error_text([&] { client.ask_data(":TRAC1:DATA? 1,0,4", 40); });
  };
  EXPECT_THAT(error_of("#9999999999"),
              HasSubstr("answered a block of 999999999 bytes; at most 40 were asked for"));
  EXPECT_THAT(error_of("#0abc\n"), HasSubstr("answered a block that begins \"#0\""));
  EXPECT_THAT(error_of("#a\n"), HasSubstr("answered a block that begins \"#a\""));
  EXPECT_THAT(error_of("#3-12"), HasSubstr("answered a block that begins \"#3-12\""));
  EXPECT_THAT(error_of("#15abc", std::chrono::milliseconds(500)),
              HasSubstr("not done after 500 ms"));
  EXPECT_THAT(error_of("#15abcdefgh\n"), HasSubstr("answered more than 2 bytes"));
  EXPECT_THAT(error_of(std::string(10'000, '1')), HasSubstr("answered more than 40 bytes"));
}

TEST(ScpiClient, ALineHasAnEnd) {
  AwgFaults faults;
  faults.garbage_at = "*IDN?";
  faults.garbage = std::string(5'000, 'x');
  AwgDouble awg(AwgDouble::Model::m8195a, faults);
  ScpiClient client = connected(awg);
  EXPECT_THAT(error_text([&] { client.ask("*IDN?"); }),
              HasSubstr("*IDN?: answered more than 4096 bytes"));
}

// Each byte comes in time; the answer as a whole does not.
TEST(ScpiClient, AnAnswerThatDribblesIsGivenUp) {
  const test::TcpPeer instrument([](const test::TcpPeer& peer, int socket) {
    while (peer.alive() && send(socket, "1", 1, MSG_NOSIGNAL) == 1) {
      std::this_thread::sleep_for(std::chrono::milliseconds{5});
    }
  });
  ScpiClient client("tcp:" + instrument.address(), std::chrono::milliseconds{200}, {});
  EXPECT_THAT(error_text([&] { client.ask("*IDN?"); }),
              HasSubstr(": *IDN?: not done after 200 ms"));
}

TEST(ScpiClient, ABlockThatIsTakenByteByByteIsGivenUp) {
  const test::TcpPeer instrument([](const test::TcpPeer& peer, int socket) {
    char byte = 0;
    while (peer.readable(socket) && recv(socket, &byte, 1, 0) == 1) {
    }
  });
  ScpiClient client("tcp:" + instrument.address(), std::chrono::milliseconds{200}, {});
  const std::string block(64 << 20, 'x');
  EXPECT_THAT(error_text([&] { client.command(":TRAC1:DATA 1,0,", block); }),
              HasSubstr(": :TRAC1:DATA 1,0,: not done after 200 ms"));
}

}  // namespace
}  // namespace splid::awg
