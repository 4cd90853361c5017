#include "daemon/forward/backlog.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/forward/broker.hpp"
#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/temp_folder.hpp"

// What waits for a broker, where it goes, and what a message is called.

namespace splid::forward {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::chrono::milliseconds at_once{0};

Message message_of(const std::string& topic, std::uint64_t sequence) {
  return *make_message("s1", topic,
                       R"({"timestamp":)" + std::to_string(sequence) + R"(.5,"sequence":)" +
                           std::to_string(sequence) + "}");
}

std::vector<std::string> ids(const std::vector<Message>& batch) {
  std::vector<std::string> names;
  for (const Message& message : batch) names.push_back(message.id);
  return names;
}

void expect_closed(const Backlog::Counts& counts) {
  EXPECT_EQ(counts.added, counts.carried + counts.lost + counts.waiting);
}

TEST(ForwardMessage, IsNamedByDeviceTopicSequenceAndTime) {
  EXPECT_EQ(message_of("frame", 7).id, "s1/frame/7/7.500000");
  for (const char* json : {"", "[]", "{}", R"({"sequence":1})", R"({"sequence":-1,"timestamp":1})",
                           R"({"sequence":"1","timestamp":1})"}) {
    EXPECT_FALSE(make_message("s1", "frame", json)) << json;
  }
}

TEST(Backlog, GivesMessagesInOrderAndCountsThemUntilTheyAreDone) {
  Backlog backlog("s1", 1 << 20);
  EXPECT_THAT(backlog.take(at_once), ElementsAre());
  backlog.add(message_of("status", 0));
  backlog.add(message_of("frame", 0));
  backlog.add(message_of("frame", 1));
  const auto batch = backlog.take(at_once);
  EXPECT_THAT(ids(batch),
              ElementsAre("s1/status/0/0.500000", "s1/frame/0/0.500000", "s1/frame/1/1.500000"));
  EXPECT_EQ(backlog.counts().waiting, 3);
  backlog.done(batch[0], false);
  backlog.done(batch[1], false);
  backlog.done(batch[2], true);  // the broker never takes it
  const Backlog::Counts counts = backlog.counts();
  EXPECT_EQ(counts.carried, 2);
  EXPECT_EQ(counts.lost, 1);
  EXPECT_EQ(counts.waiting, 0);
  EXPECT_EQ(counts.bytes, 0);
  expect_closed(counts);
  EXPECT_THAT(ids(backlog.take(at_once)), ElementsAre("s1/gap/0/1.500000"));
}

TEST(Backlog, LosesTheOldestAndSaysWhichInTheirPlace) {
  Backlog backlog("s1", 1500);
  backlog.add(message_of("frame", 0));
  const auto first = backlog.take(at_once);  // on its way, and not dropped any more
  backlog.add(message_of("status", 5));
  for (std::uint64_t i = 1; i < 100; ++i) backlog.add(message_of("frame", i));
  backlog.done(first[0], false);
  const auto batch = backlog.take(at_once);
  ASSERT_GT(batch.size(), 2);
  const auto gap = nlohmann::json::parse(batch[0].json);
  const std::uint64_t lost = gap["lost"][0]["count"];
  EXPECT_EQ(batch[1].sequence, lost + 1);
  EXPECT_EQ(batch.back().sequence, 99);
  EXPECT_EQ(batch.size() - 1, 99 - lost);
  EXPECT_EQ(gap, nlohmann::json::parse(
                     R"({"schema":"splid.gap","v":[1,0],"sequence":0,"device":"s1","timestamp":)" +
                     std::to_string(lost) + R"(.5,"lost":[{"topic":"frame","count":)" +
                     std::to_string(lost) + R"(,"first_sequence":1,"last_sequence":)" +
                     std::to_string(lost) +
                     R"(},{"topic":"status","count":1,"first_sequence":5,"last_sequence":5}]})"));
  EXPECT_LE(backlog.counts().bytes, 1500 + batch[0].json.size() + batch[0].id.size() + 200);
  for (const Message& message : batch) backlog.done(message, false);
  expect_closed(backlog.counts());
  EXPECT_EQ(backlog.counts().bytes, 0);
  EXPECT_EQ(backlog.counts().lost, lost + 1);
}

// What was on its way when newer ones were dropped, and is refused after them.
TEST(Backlog, AGapGoesFromTheFirstLostToTheLastInWhateverOrderTheyWereLost) {
  Backlog backlog("s1", 1500);
  backlog.add(message_of("frame", 0));
  const auto first = backlog.take(at_once);
  for (std::uint64_t i = 1; i < 100; ++i) backlog.add(message_of("frame", i));
  const std::uint64_t dropped = backlog.counts().lost;
  ASSERT_GT(dropped, 0);
  backlog.done(first[0], true);
  const auto gap = nlohmann::json::parse(backlog.take(at_once)[0].json);
  EXPECT_EQ(gap["lost"][0]["count"], dropped + 1);
  EXPECT_EQ(gap["lost"][0]["first_sequence"], 0);
  EXPECT_EQ(gap["lost"][0]["last_sequence"], dropped);
  EXPECT_EQ(gap["timestamp"], static_cast<double>(dropped) + 0.5);
}

TEST(Backlog, ABatchHasItsMostMessagesAndItsMostBytes) {
  Backlog backlog("s1", 64 << 20);
  for (std::uint64_t i = 0; i < 130; ++i) backlog.add(message_of("frame", i));
  EXPECT_EQ(backlog.take(at_once).size(), Backlog::most_messages);
  EXPECT_EQ(backlog.take(at_once).size(), 2);
  Message large = message_of("scene", 1);
  large.json.resize(Backlog::most_batch_bytes + 1, ' ');
  for (int i = 0; i < 2; ++i) backlog.add(large);
  EXPECT_EQ(backlog.take(at_once).size(), 1);  // alone, although it has more
}

TEST(ForwardDestination, IsABrokerAndAPort) {
  const auto place = [](const std::string& to, bool has_tls = false) {
    const Destination destination = parse_destination(to, has_tls);
    return std::string(destination.is_nats ? "nats " : "mqtt ") + destination.host + " " +
           std::to_string(destination.port);
  };
  EXPECT_EQ(place("mqtt://site"), "mqtt site 1883");
  EXPECT_EQ(place("mqtt://site", true), "mqtt site 8883");
  EXPECT_EQ(place("nats://10.0.0.1"), "nats 10.0.0.1 4222");
  EXPECT_EQ(place("nats://[::1]:99"), "nats [::1] 99");
  for (const char* bad : {"", "site", "http://site", "mqtt://", "mqtt://:1", "mqtt://a:0",
                          "mqtt://a:65536", "mqtt://a:1x", "nats://u:p@a", "nats://[::1"}) {
    const std::string text = test::error_text([&] { (void)parse_destination(bad, false); });
    EXPECT_THAT(text, HasSubstr("give a broker as mqtt://HOST:PORT or nats://HOST:PORT")) << bad;
  }
}

TEST(ForwardDestination, CredentialsAreAFileThatNobodyElseReads) {
  const test::TempFolder folder;
  const auto secret = [&](const std::string& name, const std::string& text) {
    const std::string file = folder.write(name, text);
    std::filesystem::permissions(file, std::filesystem::perms::owner_read);
    return file;
  };
  Destination mqtt;
  read_credentials(secret("one", "ann:a:b\n"), mqtt);
  EXPECT_EQ(mqtt.user, "ann");
  EXPECT_EQ(mqtt.password, "a:b");
  const std::string creds = secret("creds", "-----BEGIN NATS USER JWT-----\n");
  Destination nats;
  nats.is_nats = true;
  read_credentials(creds, nats);
  EXPECT_EQ(nats.nats_creds, creds);
  EXPECT_THAT(test::error_text([&] { read_credentials(creds, mqtt); }), HasSubstr("is for NATS"));
  EXPECT_THAT(test::error_text([&] { read_credentials(secret("two", "ann\n"), mqtt); }),
              HasSubstr("its first line must be USER:PASSWORD"));
  const std::string open = folder.write("open", "ann:b\n");
  std::filesystem::permissions(open, std::filesystem::perms{0644});
  EXPECT_THAT(test::error_text([&] { read_credentials(open, mqtt); }), HasSubstr(open));
}

}  // namespace
}  // namespace splid::forward
