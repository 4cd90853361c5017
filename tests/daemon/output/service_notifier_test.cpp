#include "daemon/output/service_notifier.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "daemon/sockets/subscriber.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/held_clock.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/measured_stream.hpp"
#include "tests/support/notify_socket.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/program.hpp"
#include "tests/support/scripted_source.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using testing::IsEmpty;

StatusMessage status(DaemonState state, std::uint64_t frames, const std::string& reason = "") {
  StatusMessage message;
  message.state = state;
  message.frames = frames;
  message.reason = reason;
  return message;
}

TEST(ServiceNotifier, IsReadyWithTheFirstFrameOrADeclaredWait) {
  for (const StatusMessage& when :
       {status(DaemonState::streaming, 1), status(DaemonState::waiting_for_device, 0),
        status(DaemonState::degraded, 0, "the instrument's library is missing")}) {
    test::NotifySocket manager("2000000");
    HeldClock clock;
    ServiceNotifier notifier(clock);
    notifier.tick(status(DaemonState::starting, 0), false);
    EXPECT_THAT(manager.next(test::patience), HasSubstr("STATUS=starting"));
    notifier.tick(when, false);
    EXPECT_EQ(manager.next(test::patience), "READY=1");
    notifier.tick(when, false);
    EXPECT_THAT(manager.next(test::patience), HasSubstr("STATUS="));
    EXPECT_THAT(manager.next(milliseconds{50}), IsEmpty());
  }
}

TEST(ServiceNotifier, FeedsTheWatchdogFourTimesInItsTimeWhileAlive) {
  test::NotifySocket manager("2000000");
  HeldClock clock;
  ServiceNotifier notifier(clock);
  int fed = 0, fed_dead = 0;
  for (int ms = 0; ms < 4000; ms += 50) {
    notifier.tick(status(DaemonState::starting, 0), ms < 2000);
    for (std::string heard = manager.next(milliseconds{5}); !heard.empty();
         heard = manager.next(milliseconds{5})) {
      (ms < 2000 ? fed : fed_dead) += heard == "WATCHDOG=1" ? 1 : 0;
    }
    clock.advance_ms(50);
  }
  EXPECT_EQ(fed, 4);
  EXPECT_EQ(fed_dead, 0);
}

TEST(ServiceNotifier, SaysStopAndReasonOnce) {
  test::NotifySocket manager("0");
  HeldClock clock;
  ServiceNotifier notifier(clock);
  notifier.tick(status(DaemonState::stopping, 12, "the cable came off"), true);
  notifier.tick(status(DaemonState::stopping, 12, "the cable came off"), true);
  EXPECT_EQ(manager.next(test::patience), "READY=1");
  EXPECT_EQ(manager.next(test::patience), "STOPPING=1");
  EXPECT_THAT(manager.next(test::patience),
              testing::AllOf(HasSubstr("STATUS=stopping: 12 frames"), HasSubstr("cable")));
  EXPECT_THAT(manager.next(milliseconds{50}), IsEmpty());
}

// What comes of the stream and not that there is one, and at once where that turns.
TEST(ServiceNotifier, SaysHowTheMeasurementIs) {
  test::NotifySocket manager("0");
  HeldClock clock;
  ServiceNotifier notifier(clock);
  StatusMessage now = status(DaemonState::streaming, 1200);
  now.valid_frames = 1190;
  now.measurement = "ok";
  notifier.tick(now, true);
  EXPECT_EQ(manager.next(test::patience), "READY=1");
  EXPECT_EQ(manager.next(test::patience),
            "STATUS=ok: 1,200 frames, 1,190 with a target, 0 tags lost");
  now.measurement = "no_target";
  now.reason = "the last frames show no target";
  notifier.tick(now, true);
  EXPECT_THAT(manager.next(test::patience),
              testing::AllOf(HasSubstr("STATUS=no target: 1,200 frames"),
                             HasSubstr("; the last frames show no target")));
}

// A source that neither sends nor says that it is at work.
TEST(ServiceNotifier, AHangingSourceStarvesTheWatchdog) {
  test::NotifySocket manager("400000");
  const Config config = scene_config(0);
  std::stop_source stop;
  Publisher publisher(config.publish.endpoint, 100);
  test::MeasuredStream measured(
      config,
      std::make_unique<ScriptedSource>(std::vector<Tag>{}, SourceInfo{"scripted", true, {}},
                                       ScriptedSource::End::until_stopped),
      publisher, host_clock());
  std::jthread running([&] { (void)measured.run(stop.get_token()); });
  EXPECT_TRUE(manager.hears("WATCHDOG=1"));
  EXPECT_TRUE(manager.hears("STATUS=waiting for device"));
  const auto deadline = std::chrono::steady_clock::now() + test::patience;
  bool was_starved = false;
  while (!was_starved && std::chrono::steady_clock::now() < deadline) {
    was_starved = !manager.hears_within("WATCHDOG=1", milliseconds{1000});
  }
  EXPECT_TRUE(was_starved);
  stop.request_stop();
}

// The program itself, as the service manager starts it.
class Service : public ::testing::Test {
 protected:
  Service() {
    test::run_program({"pattern", "interleaved", "--subperiods-ns", "180", "189", "--output",
                       folder.path("pattern.json")});
  }

  std::string configure(const std::string& source, const std::string& more = "") const {
    return folder.write("config.json", R"({"schema":"splid.config","source":{)" + source +
                                           R"(},"pattern":{"file":"pattern.json"},)"
                                           R"("pipeline":{"ring_capacity_tags":131072},)"
                                           R"("publish":{"endpoint":"ipc://)" +
                                           folder.path("socket") + "\"}" +
                                           test::with_light_scene(more) + "}");
  }

  // Waits for a message of the topic that holds `text`.
  std::string await(sockets::Subscriber& subscriber, const std::string& topic,
                    const std::string& text) {
    const auto deadline = std::chrono::steady_clock::now() + test::patience;
    while (std::chrono::steady_clock::now() < deadline) {
      const auto message = subscriber.receive(milliseconds{100});
      if (message && message->topic == topic && message->json.find(text) != std::string::npos) {
        return message->json;
      }
    }
    return "";
  }

  // Waits for a message of the topic that does not hold `text`.
  bool await_without(sockets::Subscriber& subscriber, const std::string& topic,
                     const std::string& text) {
    const auto deadline = std::chrono::steady_clock::now() + test::patience;
    while (std::chrono::steady_clock::now() < deadline) {
      const auto message = subscriber.receive(milliseconds{100});
      if (message && message->topic == topic && message->json.find(text) == std::string::npos) {
        return true;
      }
    }
    return false;
  }

  // Waits for a frame that is as wanted.
  template <class Wanted>
  FrameMessage await_frame(sockets::Subscriber& subscriber, const Wanted& wanted) {
    const auto deadline = std::chrono::steady_clock::now() + test::patience;
    while (std::chrono::steady_clock::now() < deadline) {
      const auto message = subscriber.receive(milliseconds{100});
      if (!message || message->topic != topic_frame) continue;
      FrameMessage frame = frame_from_json(message->json);
      if (wanted(frame)) return frame;
    }
    ADD_FAILURE() << "no such frame came";
    return {};
  }

  test::TempFolder folder;
  test::NotifySocket manager{"4000000"};
};

TEST_F(Service, IsReadyFedReloadedAndStopped) {
  const std::string config = configure(test::light_source);
  test::Program daemon({"run", "--config", config});
  sockets::Subscriber subscriber("ipc://" + folder.path("socket"), {""});
  ASSERT_TRUE(manager.hears("READY=1"));
  EXPECT_TRUE(manager.hears("WATCHDOG=1"));
  EXPECT_THAT(await(subscriber, "frame", "\"ok\""), HasSubstr("\"effort\":"));

  configure(
      test::light_source,
      R"(,"estimator":{"effort":"fast"},"scene":{"max_speed_mps":20,"range_offset_m":100},"frame":{"length_ms":20})");
  daemon.signal(SIGHUP);
  EXPECT_THAT(await(subscriber, "status", "takes a restart"), HasSubstr("/frame/length_ms"));
  // The card goes to and fro by 4 m around 284.5 m.
  const FrameMessage frame = await_frame(subscriber, [](const FrameMessage& heard) {
    return heard.effort == "fast" && std::abs(heard.distance_m.value_or(0) - 184.5) < 5;
  });
  EXPECT_NEAR(frame.duration_ms, 50, 0.1);
  EXPECT_THAT(daemon.err(), HasSubstr("/estimator/effort, /scene/range_offset_m"));

  folder.write("config.json", "{\"schema\":garbage");
  daemon.signal(SIGHUP);
  EXPECT_THAT(await(subscriber, "status", "not reloaded"), HasSubstr("line 1"));
  // It stays in each status, until one is taken over.
  for (int i = 0; i < 3; ++i) {
    EXPECT_THAT(await(subscriber, "status", ""), HasSubstr("not reloaded"));
  }
  configure(test::light_source,
            R"(,"estimator":{"effort":"fast"},"scene":{"max_speed_mps":20,"range_offset_m":100})");
  daemon.signal(SIGHUP);
  EXPECT_TRUE(await_without(subscriber, "status", "not reloaded"));
  EXPECT_NEAR(frame_from_json(await(subscriber, "frame", "\"ok\"")).distance_m.value_or(0), 184.5,
              5);

  daemon.signal(SIGTERM);
  EXPECT_TRUE(manager.hears("STOPPING=1"));
  const test::ProgramResult result = daemon.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(Service, IsReadyWhileItWaitsForItsInstrument) {
  const std::string config =
      configure(R"("driver":"bridge","address":"unix:)" + folder.path("nobody") + '"');
  test::Program daemon({"run", "--config", config});
  EXPECT_TRUE(manager.hears("READY=1"));
  EXPECT_TRUE(manager.hears("STATUS=waiting for device"));
  // Longer than a stream without frames may be without a sign of work.
  const auto until = std::chrono::steady_clock::now() + milliseconds{3500};
  while (std::chrono::steady_clock::now() < until) (void)manager.next(milliseconds{50});
  EXPECT_TRUE(manager.hears("WATCHDOG=1"));
  daemon.signal(SIGTERM);
  const test::ProgramResult result = daemon.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

}  // namespace
}  // namespace splid
