#include "daemon/sockets/subscriber.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <string>
#include <thread>

#include "protocol/frame_json.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::sockets {
namespace {

using std::chrono::milliseconds;
using State = security::HandshakeWatch::State;

class StoppedPublisher : public testing::Test {
 protected:
  bool hears() {
    return test::eventually([&] { return subscriber.receive(milliseconds{100}).has_value(); });
  }
  bool is_in(State state) {
    return test::eventually([&] {
      while (subscriber.receive(milliseconds{0})) {
      }
      return subscriber.state() == state;
    });
  }

  test::TempFolder folder;
  std::string endpoint = "ipc://" + folder.path("socket");
  std::string config = folder.write(
      "config.json", R"({"schema":"splid.config","v":[1,0],"source":{)" +
                         std::string(test::light_source) +
                         R"(},"pattern":{"file":")" SPLID_SOURCE_DIR
                         R"(/config/patterns/interleaved-180-189.json"},"publish":{"endpoint":")" +
                         endpoint + "\"}" + test::with_light_scene(test::small_ring) + "}");
  test::Program daemon{{"run", "--config", config}};
  Subscriber subscriber{endpoint, {topic_frame}};
};

// A process that is stopped is silent as a machine without power is: its connections stay open.
TEST_F(StoppedPublisher, IsNoticedByItsSilenceAndFoundAgain) {
  ASSERT_TRUE(hears());
  ASSERT_TRUE(is_in(State::connected));
  daemon.signal(SIGSTOP);
  EXPECT_TRUE(is_in(State::unanswered));
  daemon.signal(SIGCONT);
  EXPECT_TRUE(is_in(State::connected));
  EXPECT_TRUE(hears());
}

}  // namespace
}  // namespace splid::sockets
