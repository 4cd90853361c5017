#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/forward/message.hpp"
#include "daemon/output/publisher.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/status_json.hpp"
#include "tests/support/broker.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/program.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/small_disk.hpp"
#include "tests/support/temp_folder.hpp"

// `splid forward` with real brokers, which are killed, halted and run out of disk.

namespace splid {
namespace {

using ::testing::HasSubstr;

#define SPLID_NEEDS(program)                                                    \
  if (test::installed(program).empty()) {                                       \
    GTEST_SKIP() << program << " is not installed (scripts/setup installs it)"; \
  }

std::int64_t unix_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::size_t count_in(const std::string& text, const std::string& words) {
  std::size_t count = 0;
  for (auto at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++count;
  return count;
}

// How often the broker was reached.
std::size_t connections(const test::Program& forward) {
  return count_in(forward.err(), "connected to the broker");
}

// A daemon that does nothing but publish frames, and `splid forward` beside it.
class Sensor {
 public:
  // clock_error_s: how wrong this sensor's UTC is.
  Sensor(const test::Broker& broker, std::string device, double clock_error_s = 0,
         const std::string& buffer_mib = "64", const std::vector<std::string>& more = {})
      : device_(std::move(device)), clock_error_s_(clock_error_s) {
    begin_daemon();
    std::vector<std::string> arguments = {"forward",        "--endpoint", endpoint_,     "--to",
                                          broker.address(), "--device",   device_,       "--buffer",
                                          buffer_mib,       "--topics",   "frame,status"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    forward_ = std::make_unique<test::Program>(arguments);
    if (!publisher_->wait_for_subscriber(test::patience)) throw std::runtime_error("no subscriber");
  }

  // Of a daemon that starts anew, which counts from 0.
  void restart_daemon() {
    publisher_.reset();
    begin_daemon();
    next_ = 0;
    if (!publisher_->wait_for_subscriber(test::patience)) throw std::runtime_error("no subscriber");
  }

  void publish(int frames) {
    for (int i = 0; i < frames; ++i) {
      FrameMessage frame;
      frame.timestamp_s = static_cast<double>(unix_ns()) * 1e-9 + clock_error_s_;
      frame.sequence = next_++;
      frame.duration_ms = 50;
      sent_.push_back(to_json(frame));
      publisher_->publish_frame(sent_.back());
    }
  }
  void publish(const FrameMessage& frame) {
    publisher_->publish_frame(to_json(frame));
    next_ = frame.sequence + 1;
  }
  void publish_status(std::uint64_t sequence) {
    StatusMessage status;
    status.timestamp_s = static_cast<double>(unix_ns()) * 1e-9;
    status.sequence = sequence;
    publisher_->publish_status(to_json(status));
  }

  // In bursts, so that a broker that is killed has some of a batch.
  void keep_publishing() {
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        publish(20);
        std::this_thread::sleep_for(std::chrono::milliseconds{40});
      }
    });
  }
  void stop_publishing() { thread_ = {}; }

  void await_published(std::uint64_t more) {
    const std::uint64_t begin = next_;
    ASSERT_TRUE(test::eventually([&] { return next_ >= begin + more; }));
  }
  // The broker was reached for the n-th time.
  void await_connections(std::size_t count) {
    ASSERT_TRUE(test::eventually([&] { return connections(*forward_) >= count; }))
        << forward_->err();
  }
  void await_words(const std::string& words) {
    ASSERT_TRUE(test::eventually([&] { return count_in(forward_->err(), words) > 0; }))
        << forward_->err();
  }

  [[nodiscard]] std::uint64_t published() const { return next_; }
  // Of publish(int), while nothing is published.
  [[nodiscard]] const std::vector<std::string>& sent() const { return sent_; }
  test::Program& forward() { return *forward_; }

 private:
  void begin_daemon() {
    endpoint_ = "ipc://" + folder_.path("frames");
    publisher_ = std::make_unique<Publisher>(endpoint_, 1'000'000);
  }

  test::TempFolder folder_;
  std::string device_;
  double clock_error_s_;
  std::string endpoint_;
  std::unique_ptr<Publisher> publisher_;
  std::unique_ptr<test::Program> forward_;
  std::atomic<std::uint64_t> next_ = 0;
  std::vector<std::string> sent_;
  std::jthread thread_;
};

std::vector<std::uint64_t> first_numbers(std::uint64_t count) {
  std::vector<std::uint64_t> numbers(count);
  for (std::uint64_t i = 0; i < count; ++i) numbers[i] = i;
  return numbers;
}

std::vector<std::uint64_t> sequences(const std::vector<test::StoredMessage>& messages) {
  std::vector<std::uint64_t> numbers;
  for (const auto& message : messages) {
    numbers.push_back(nlohmann::json::parse(message.json)["sequence"]);
  }
  return numbers;
}

// Waits until the stream holds the frame, and returns the sequences of all.
std::vector<std::uint64_t> await_frame(const test::Broker& broker, const std::string& device,
                                       std::uint64_t last) {
  std::vector<std::uint64_t> numbers;
  const bool is_there = test::eventually([&] {
    numbers = sequences(test::stored_in(broker, "splid." + device + ".frame"));
    return !numbers.empty() && numbers.back() == last;
  });
  EXPECT_TRUE(is_there) << numbers.size() << " frames, the last "
                        << (numbers.empty() ? 0 : numbers.back());
  return numbers;
}

// A client of Mosquitto's own, which prints what it hears; a session that outlives connections.
class MqttListener {
 public:
  MqttListener(const test::Broker& broker, const std::string& topic)
      : program_({"-p", std::to_string(broker.port()), "-i", "listener", "-c", "-q", "0", "-v",
                  "-t", topic},
                 test::installed("mosquitto_sub")) {}

  // Sequences of the frames so far, in the order in which they came.
  [[nodiscard]] std::vector<std::uint64_t> frames() const {
    std::istringstream lines(program_.out());
    std::vector<std::uint64_t> numbers;
    for (std::string line; std::getline(lines, line) && !lines.eof();) {
      const auto json = nlohmann::json::parse(line.substr(line.find(' ')));
      if (json["schema"] == "splid.frame") numbers.push_back(json["sequence"]);
    }
    return numbers;
  }
  [[nodiscard]] std::string out() const { return program_.out(); }
  [[nodiscard]] std::size_t count() const {
    const std::string text = program_.out();
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }
  void await_more(std::size_t frames) const {
    const std::size_t begin = count();
    ASSERT_TRUE(test::eventually([&] { return count() >= begin + frames; }));
  }

 private:
  test::Program program_;
};

// Repeats left out: what is not above all before it.
std::vector<std::uint64_t> rising(const std::vector<std::uint64_t>& numbers) {
  std::vector<std::uint64_t> kept;
  for (const std::uint64_t number : numbers) {
    if (kept.empty() || number > kept.back()) kept.push_back(number);
  }
  return kept;
}

// A row of docs/evidence/data/fleet-faults.csv.
void tell(const std::string& fault, std::uint64_t sent, std::uint64_t twice = 0,
          std::uint64_t lost = 0) {
  std::cout << fmt::format("FLEET | {} | {} | {} | {} | {} |\n", fault, sent, sent - lost, twice,
                           lost);
}

// JetStream forgets the ids of messages after 100 ms, long before a killed one is there again.
TEST(Forward, JetStreamThatIsKilledHasEachFrameOnce) {
  SPLID_NEEDS("nats-server");
  const int times = test::times(20);
  test::Broker broker("nats-server");
  broker.start();
  test::make_stream(broker, 100'000'000);
  Sensor sensor(broker, "s1");
  sensor.keep_publishing();
  for (int i = 1; i <= times; ++i) {
    sensor.await_connections(static_cast<std::size_t>(i));
    sensor.await_published(100);
    broker.end(SIGKILL);
    sensor.await_published(100);
    broker.start();
  }
  sensor.await_connections(static_cast<std::size_t>(times) + 1);
  sensor.await_published(100);
  sensor.stop_publishing();
  const std::uint64_t count = sensor.published();
  EXPECT_EQ(await_frame(broker, "s1", count - 1), first_numbers(count));
  EXPECT_TRUE(test::stored_in(broker, "splid.s1.gap").empty());
  sensor.forward().signal(SIGTERM);
  const test::ProgramResult result = sensor.forward().wait();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr(fmt::format(" 0 lost; {} connections", times + 1)));
  tell(fmt::format("JetStream is killed (kill -9) {} times in mid-stream", times), count);
}

TEST(Forward, MqttBrokerThatIsKilledHasEachFrameAtLeastOnceInOrder) {
  SPLID_NEEDS("mosquitto");
  SPLID_NEEDS("mosquitto_sub");
  const int times = test::times(20);
  test::Broker broker("mosquitto");
  broker.start();
  const MqttListener listener(broker, "splid/s1/frame");
  Sensor sensor(broker, "s1");
  sensor.await_connections(1);
  sensor.publish(1);
  ASSERT_TRUE(test::eventually([&] { return listener.count() > 0; }));
  broker.end(SIGTERM);  // writes down who subscribes
  broker.start();
  sensor.keep_publishing();
  for (int i = 1; i <= times; ++i) {
    sensor.await_connections(static_cast<std::size_t>(i) + 1);
    listener.await_more(100);
    broker.end(SIGKILL);
    sensor.await_published(100);
    broker.start();
  }
  listener.await_more(100);
  sensor.stop_publishing();
  const std::uint64_t count = sensor.published();
  std::vector<std::uint64_t> heard;
  EXPECT_TRUE(test::eventually([&] {
    heard = listener.frames();
    return !heard.empty() && heard.back() == count - 1;
  }));
  EXPECT_EQ(rising(heard), first_numbers(count));
  const std::size_t repeats = heard.size() - count;
  EXPECT_LE(repeats, 128U * static_cast<unsigned>(times + 1));  // batches under way
  sensor.forward().signal(SIGTERM);
  EXPECT_THAT(sensor.forward().wait().err, HasSubstr(" 0 lost; "));
  tell(fmt::format("Mosquitto is killed (kill -9) {} times in mid-stream", times), count, repeats);
}

TEST(Forward, BeyondTheBufferThereIsACountedGap) {
  SPLID_NEEDS("nats-server");
  test::Broker broker("nats-server");
  Sensor sensor(broker, "s1", 0, "0.1");
  constexpr std::uint64_t count = 2000;
  sensor.publish(count);
  sensor.await_words("tried again until it answers");
  broker.start();
  (void)await_frame(broker, "s1", count - 1);
  std::vector<std::uint64_t> expected;
  std::uint64_t next = 0;
  std::uint64_t lost = 0;
  for (const auto& message : test::stored_in(broker, "splid.s1.*")) {
    const auto json = nlohmann::json::parse(message.json);
    if (message.subject == "splid.s1.frame") {
      EXPECT_EQ(json["sequence"], next++);
    } else if (message.subject == "splid.s1.gap") {
      const auto& gap = json["lost"][0];
      EXPECT_EQ(gap["topic"], "frame");
      EXPECT_EQ(gap["first_sequence"], next);
      lost += gap["count"].get<std::uint64_t>();
      next += gap["count"].get<std::uint64_t>();
      EXPECT_EQ(gap["last_sequence"], next - 1);
    }
  }
  EXPECT_EQ(next, count);
  EXPECT_GT(lost, 0);
  tell("JetStream is away for longer than a buffer of 0.1 MiB lasts; a gap counts the lost", count,
       0, lost);
}

TEST(Forward, AHaltedBrokerDelaysNoFrameAndLosesNone) {
  SPLID_NEEDS("nats-server");
  test::Broker broker("nats-server");
  broker.start();
  Sensor sensor(broker, "s1");
  sensor.await_connections(1);
  sensor.publish(10);
  (void)await_frame(broker, "s1", 9);
  broker.halt();
  const std::int64_t begin_ns = unix_ns();
  sensor.publish(1000);
  EXPECT_LT(unix_ns() - begin_ns, 10'000'000'000);  // nothing waits for the broker
  sensor.await_words("acknowledges nothing for 5 s");
  broker.go_on();
  EXPECT_EQ(await_frame(broker, "s1", 1009), first_numbers(1010));
  tell("JetStream is halted (SIGSTOP) for 5 s", 1010);
}

// The broker stored a message, but was killed before forward heard of it, and forgot its id.
TEST(Forward, WhatWasStoredButNotAcknowledgedIsNotStoredAgain) {
  SPLID_NEEDS("nats-server");
  test::Broker broker("nats-server");
  broker.start();
  constexpr std::int64_t ids_known_ns = 100'000'000;  // the least that JetStream takes
  test::make_stream(broker, ids_known_ns);
  FrameMessage frame;
  frame.timestamp_s = 1'000'000'000.25;
  const auto message = forward::make_message("s1", "frame", to_json(frame));
  ASSERT_TRUE(message);
  test::store(broker, "splid.s1.frame", message->id, message->json);
  std::this_thread::sleep_for(std::chrono::nanoseconds{2 * ids_known_ns});
  broker.end(SIGKILL);
  broker.start();
  Sensor sensor(broker, "s1");
  sensor.publish(frame);
  sensor.publish(3);
  EXPECT_EQ(await_frame(broker, "s1", 3), first_numbers(4));
}

// A daemon that starts anew counts from 0: its frames are not taken for repeats.
TEST(Forward, TheFramesOfASecondRunAreNoRepeats) {
  SPLID_NEEDS("nats-server");
  test::Broker broker("nats-server");
  broker.start();
  Sensor sensor(broker, "s1");
  sensor.publish(30);
  (void)await_frame(broker, "s1", 29);
  sensor.restart_daemon();
  sensor.publish(20);
  std::vector<std::uint64_t> expected = first_numbers(30);
  for (const std::uint64_t number : first_numbers(20)) expected.push_back(number);
  EXPECT_EQ(await_frame(broker, "s1", 19), expected);
}

// Who asks for a time asks the broker's clock, whatever a sensor takes the time to be. The first
// half of the frames came two hours ago.
TEST(Forward, AWrongClockAtOneSensorMovesNoFrameOfAnHourAgo) {
  SPLID_NEEDS("nats-server");
  test::Broker broker("nats-server");
  broker.start({SPLID_DOUBLES "/shifted_clock", "-7200"});
  Sensor right(broker, "right");
  constexpr double a_year_s = 365 * 86400.0;
  Sensor wrong(broker, "wrong", -a_year_s);
  for (Sensor* sensor : {&right, &wrong}) sensor->publish(50);
  (void)await_frame(broker, "right", 49);
  (void)await_frame(broker, "wrong", 49);
  broker.end(SIGKILL);
  broker.start();
  for (Sensor* sensor : {&right, &wrong}) sensor->publish(50);
  const std::vector<std::uint64_t> all = first_numbers(100);
  const std::vector<std::uint64_t> later(all.begin() + 50, all.end());
  constexpr std::int64_t an_hour_ns = 3'600'000'000'000;
  for (const char* device : {"right", "wrong"}) {
    EXPECT_EQ(await_frame(broker, device, 99), all);
    const std::string subject = std::string("splid.") + device + ".frame";
    EXPECT_EQ(sequences(test::stored_in(broker, subject, unix_ns() - an_hour_ns)), later);
    EXPECT_EQ(sequences(test::stored_in(broker, subject, unix_ns() - 3 * an_hour_ns)), all);
  }
  tell("the clock of one of two sensors is a year late; of two hours a subscriber asks for one",
       200);
}

TEST(Forward, AFullDiskAtTheBrokerIsWaitedFor) {
  SPLID_NEEDS("nats-server");
  test::SmallDisk disk(16);
  if (!disk.mounted()) GTEST_SKIP() << "no file system can be mounted: only root can";
  test::Broker broker("nats-server", disk.path("data"));
  broker.start();
  Sensor sensor(broker, "s1");
  sensor.publish(10);
  (void)await_frame(broker, "s1", 9);
  disk.fill_but(0);
  sensor.publish(2000);
  sensor.await_words("tried again until it answers");
  disk.clear();
  broker.end(SIGKILL);  // nats-server 2.9 ignores SIGTERM after its disk was full
  broker.start();
  EXPECT_EQ(await_frame(broker, "s1", 2009), first_numbers(2010));
  tell("the broker's disk is full; then there is room, and it is killed and started again", 2010);
}

// The last status and what became of forward itself are there for whoever comes later.
TEST(Forward, MqttKeepsTheLastStatusAndTheLastWill) {
  SPLID_NEEDS("mosquitto");
  SPLID_NEEDS("mosquitto_sub");
  test::Broker broker("mosquitto");
  broker.start();
  Sensor sensor(broker, "s1");
  sensor.await_connections(1);
  sensor.publish_status(3);
  sensor.publish(1);
  sensor.publish_status(4);
  const auto kept = [&](const std::string& topic) {
    const test::ProgramResult result =
        test::Program({"-p", std::to_string(broker.port()), "-t", topic, "-C", "1"},
                      test::installed("mosquitto_sub"))
            .wait();
    return nlohmann::json::parse(result.out);
  };
  EXPECT_TRUE(test::eventually([&] { return kept("splid/s1/status")["sequence"] == 4; }));
  EXPECT_TRUE(test::eventually([&] { return kept("splid/s1/forward")["state"] == "running"; }));
  sensor.forward().signal(SIGKILL);
  EXPECT_TRUE(test::eventually([&] { return kept("splid/s1/forward")["state"] == "gone"; }));
}

// A broker that asks for a password over TLS; without the right one nothing is carried.
TEST(Forward, ConnectsWithTlsAndAPassword) {
  SPLID_NEEDS("nats-server");
  SPLID_NEEDS("mosquitto");
  SPLID_NEEDS("openssl");
  const test::TempFolder folder;
  test::Broker::Security security{folder.path("cert.pem"), folder.path("key.pem"), "ann", "secret"};
  ASSERT_EQ(test::Program({"req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj",
                           "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout",
                           security.private_key, "-out", security.certificate},
                          test::installed("openssl"))
                .wait()
                .exit_code,
            0);
  const auto credentials = [&](const std::string& text) {
    const std::string file = folder.write(text, text + "\n");
    std::filesystem::permissions(file, std::filesystem::perms::owner_read);
    return std::vector<std::string>{"--ca", security.certificate, "--credentials", file};
  };
  for (const char* program : {"nats-server", "mosquitto"}) {
    test::Broker broker(program, "", security);
    broker.start();
    Sensor right(broker, "right", 0, "64", credentials("ann:secret"));
    right.await_connections(1);
    Sensor wrong(broker, "wrong", 0, "64", credentials("ann:none"));
    wrong.await_words("tried again until it answers");
    Sensor plain(broker, "plain");
    plain.await_words("tried again until it answers");
    right.publish(1);
    right.forward().signal(SIGTERM);
    EXPECT_THAT(right.forward().wait().err, HasSubstr(" 0 lost; 1 connections"));
  }
}

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line) && !stream.eof();) lines.push_back(line);
  return lines;
}

// `splid listen` hears a sensor by way of a broker as it hears it beside it.
TEST(ForwardBack, ListenHearsEachFrameOnceWhileTheBrokerIsKilled) {
  SPLID_NEEDS("nats-server");
  test::Broker broker("nats-server");
  broker.start();
  Sensor sensor(broker, "s1");
  Sensor other(broker, "s2");
  sensor.await_connections(1);  // the stream is there
  const test::TempFolder folder;
  const std::string endpoint = "ipc://" + folder.path("back");
  test::Program back(
      {"forward", "--back", "--to", broker.address(), "--device", "s1", "--endpoint", endpoint});
  const test::Program listen({"listen", "--endpoint", endpoint, "--json"});
  sensor.keep_publishing();
  ASSERT_TRUE(test::eventually([&] { return !lines_of(listen.out()).empty(); }))
      << back.err() << listen.err();
  for (std::size_t i = 2; i <= 4; ++i) {
    sensor.await_published(100);
    broker.end(SIGKILL);
    sensor.await_published(100);
    broker.start();
    sensor.await_connections(i);
    ASSERT_TRUE(test::eventually([&] { return connections(back) >= i; })) << back.err();
    other.publish(5);
  }
  sensor.stop_publishing();
  const std::string last = sensor.sent().back();
  std::vector<std::string> heard;
  EXPECT_TRUE(test::eventually([&] {
    heard = lines_of(listen.out());
    return heard.back() == last;
  })) << back.err();
  // From the first that it heard to the last that was sent.
  const auto& sent = sensor.sent();
  EXPECT_EQ(heard, std::vector<std::string>(std::find(sent.begin(), sent.end(), heard.front()),
                                            sent.end()));
  EXPECT_GT(heard.size(), 600);
  back.signal(SIGTERM);
  const test::ProgramResult result = back.wait();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr(" messages published; 4 connections to the broker"));
}

TEST(Forward, SaysInItsLastReportThatItStops) {
  SPLID_NEEDS("nats-server");
  test::Broker broker("nats-server");
  broker.start();
  Sensor sensor(broker, "s1");
  sensor.publish(5);
  (void)await_frame(broker, "s1", 4);
  sensor.forward().signal(SIGTERM);
  EXPECT_EQ(sensor.forward().wait().exit_code, 0);
  const auto reports = test::stored_in(broker, "splid.s1.forward");
  ASSERT_FALSE(reports.empty());
  const auto last = nlohmann::json::parse(reports.back().json);
  EXPECT_EQ(last["schema"], "splid.forward");
  EXPECT_EQ(last["state"], "stopped");
  EXPECT_EQ(last["lost"], 0);
  EXPECT_GE(last["carried"], 5);
}

TEST(Forward, RefusesWhatItCannotUse) {
  const auto said = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "forward");
    const test::ProgramResult result = test::run_program(arguments);
    EXPECT_EQ(result.exit_code, 2);
    return result.err;
  };
  EXPECT_THAT(said({}), HasSubstr("--to is required"));
  EXPECT_THAT(said({"--to", "http://a"}), HasSubstr("--to http://a: give a broker as mqtt://"));
  EXPECT_THAT(said({"--to", "nats://a", "--device", "a.b"}), HasSubstr("--device 'a.b': "));
  EXPECT_THAT(said({"--to", "nats://a", "--certificate", "c"}), HasSubstr("with --ca"));
  EXPECT_THAT(said({"--to", "nats://a", "--credentials", "/none"}),
              HasSubstr("--credentials: /none"));
  EXPECT_THAT(said({"--to", "nats://a", "--topics", "frame,none"}), HasSubstr("none"));
  EXPECT_THAT(said({"--to", "mqtt://a", "--back"}), HasSubstr("--back reads JetStream alone"));
}

}  // namespace
}  // namespace splid
