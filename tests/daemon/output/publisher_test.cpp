#include "daemon/output/publisher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <vector>
#include <zmq.hpp>

#include "daemon/sockets/subscriber.hpp"
#include "protocol/error.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/scene_json.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr const char* any_port = "tcp://127.0.0.1:*";
constexpr milliseconds soon{2000};

TEST(Publisher, SendsTopicAndJsonAndNothingElse) {
  Publisher publisher(any_port, 10);
  zmq::context_t context;
  zmq::socket_t sub(context, zmq::socket_type::sub);
  sub.set(zmq::sockopt::subscribe, "frame");
  sub.set(zmq::sockopt::rcvtimeo, 2000);
  sub.connect(publisher.endpoint());
  ASSERT_TRUE(publisher.wait_for_subscriber(soon));
  publisher.publish_frame("{}");
  zmq::message_t part;
  ASSERT_TRUE(sub.recv(part));
  EXPECT_EQ(part.to_string(), "frame");
  ASSERT_TRUE(part.more());
  ASSERT_TRUE(sub.recv(part));
  EXPECT_EQ(part.to_string(), "{}");
  EXPECT_FALSE(part.more());
}

TEST(Publisher, GreetsEachNewSubscriberWithTheLastVersionAndStatus) {
  Publisher publisher(any_port, 10);
  publisher.publish_version("old");
  publisher.publish_version("version");
  publisher.publish_status("status");
  for (int i = 0; i < 2; ++i) {
    sockets::Subscriber subscriber(publisher.endpoint(), {"version", "status", "frame"});
    std::map<std::string, std::string> last;
    const auto is_greeted = [&] {
      return last["version"] == "version" && last["status"] == "status";
    };
    for (int round = 0; round < 1000 && !is_greeted(); ++round) {
      if (const auto message = subscriber.receive(milliseconds{20})) {
        last[message->topic] = message->json;
      }
    }
    EXPECT_TRUE(is_greeted()) << i;
  }
}

// More topics than a connection may send are one topic to the daemon, and are told apart here.
TEST(Publisher, SendsEachOfManyPixelsToASubscriberThatNamesThem) {
  Publisher publisher(any_port, 10'000);
  std::vector<std::string> topics = {"status"};
  for (int i = 0; i < 1024; ++i)
    topics.push_back(pixel_topic("row-with-a-long-name-" + std::to_string(i)));
  sockets::Subscriber subscriber(publisher.endpoint(), topics);
  std::optional<sockets::Subscriber::Message> message;
  for (int round = 0; round < 500 && !message; ++round) {
    publisher.publish_pixel("row-with-a-long-name-1023", "{}");
    message = subscriber.receive(milliseconds{10});
  }
  ASSERT_TRUE(message);
  EXPECT_EQ(message->topic, topics.back());
}

TEST(Publisher, WaitsInVainWithoutSubscriber) {
  Publisher publisher(any_port, 10);
  EXPECT_FALSE(publisher.wait_for_subscriber(milliseconds{20}));
  const sockets::Subscriber only_status(publisher.endpoint(), {"status"});
  EXPECT_FALSE(publisher.wait_for_subscriber(milliseconds{200}));
}

// The queue is a thousand long: libzmq learns what a subscriber has taken once in 3 million ticks
// of the processor's clock, some 100 ms where that is a slow virtual one, and a queue of 100 looks
// full to it by then, with or without the one that does not read.
TEST(Publisher, ASubscriberThatDoesNotReadCostsTheOthersNothing) {
  Publisher publisher(any_port, 1000);
  zmq::context_t context;
  zmq::socket_t idle(context, zmq::socket_type::sub);
  idle.set(zmq::sockopt::rcvhwm, 1);
  idle.set(zmq::sockopt::subscribe, "");
  idle.connect(publisher.endpoint());
  ASSERT_TRUE(publisher.wait_for_subscriber(soon));
  sockets::Subscriber good(publisher.endpoint(), {"status"});
  publisher.publish_status("0");
  while (!good.receive(milliseconds{10})) {
  }
  const std::string json(20'000, 'x');
  for (int i = 0; i < 2000; ++i) {
    publisher.publish_status(json);
    std::optional<sockets::Subscriber::Message> message;
    while (!(message = good.receive(soon)) || message->json == "0") ASSERT_TRUE(message) << i;
  }
}

TEST(Publisher, SurvivesGarbageFromSubscribers) {
  Publisher publisher(any_port, 10);
  zmq::context_t context;
  zmq::socket_t hostile(context, zmq::socket_type::xsub);
  hostile.set(zmq::sockopt::linger, 0);
  hostile.connect(publisher.endpoint());
  hostile.send(zmq::buffer(std::string(100'000, '\x01')), zmq::send_flags::none);
  hostile.send(zmq::buffer(std::string("\x07junk")), zmq::send_flags::none);
  const sockets::Subscriber good(publisher.endpoint(), {"frame"});
  EXPECT_TRUE(publisher.wait_for_subscriber(soon));
}

TEST(Publisher, APortInUseIsADeviceErrorThatNamesIt) {
  const Publisher first(any_port, 10);
  try {
    const Publisher second(first.endpoint(), 10);
    FAIL() << "bound twice";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::device);
    EXPECT_THAT(error.what(), HasSubstr("publish.endpoint " + first.endpoint()));
    EXPECT_THAT(error.what(), HasSubstr("Address already in use"));
  }
}

TEST(Publisher, AnEndpointThatIsNoneIsAUsageError) {
  for (const char* endpoint : {"nonsense", "carrier://pigeon", "tcp://127.0.0.1"}) {
    try {
      const Publisher publisher(endpoint, 10);
      FAIL() << endpoint;
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::usage) << error.what();
    }
  }
}

}  // namespace
}  // namespace splid
