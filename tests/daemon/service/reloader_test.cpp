#include "daemon/service/reloader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <functional>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <thread>

#include "protocol/error.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/notify_socket.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/temp_folder.hpp"

// SIGHUP to this process, and what then was taken over, said, and kept in the status.

namespace splid {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

// What this thread blocks is afterwards as it was, so that programs of later tests hear SIGTERM.
class SignalMask {
 public:
  SignalMask() { pthread_sigmask(SIG_SETMASK, nullptr, &before_); }
  ~SignalMask() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalMask(const SignalMask&) = delete;
  SignalMask& operator=(const SignalMask&) = delete;

 private:
  sigset_t before_{};
};

class ReloaderTest : public ::testing::Test {
 protected:
  void configure(const std::string& more) const {
    (void)folder.write("config.json", R"({"schema":"splid.config","source":{"driver":"simulator"},)"
                                      R"("pattern":{"file":")" SPLID_SOURCE_DIR
                                      R"(/config/patterns/interleaved-180-189.json"})" +
                                          more + "}");
  }

  // Until the service manager has heard that the reload is over.
  void reload() {
    ::kill(::getpid(), SIGHUP);
    ASSERT_TRUE(manager.hears("RELOADING=1"));
    ASSERT_TRUE(manager.hears("READY=1"));
  }

  // The one notice since the last call.
  std::string notice() {
    const std::vector<std::string> notices = device.take_notices();
    EXPECT_EQ(notices.size(), 1U);
    return notices.empty() ? "" : notices.front();
  }

  SignalMask mask;
  StopSignals signals{true};  // before any other thread, which would take SIGHUP and end
  test::TempFolder folder;
  std::string file = (configure(""), folder.path("config.json"));
  Config original = load_config(file);
  test::NotifySocket manager{"0"};
  DeviceMonitor device;

  void answer_with(std::function<std::string()> next) {
    const std::scoped_lock lock(mutex);
    answer = std::move(next);
  }
  // What the apply function was given.
  struct Applied {
    int times = 0;
    bool is_new = false;
    std::shared_ptr<const Config> given;
  };
  Applied applied() {
    const std::scoped_lock lock(mutex);
    return last;
  }

  // The apply function runs on the reloader's thread.
  std::mutex mutex;
  Applied last;
  std::function<std::string()> answer = [] { return ""; };
  std::optional<Reloader> reloader{std::in_place, original, device, &signals,
                                   [this](const std::shared_ptr<const Config>& next, bool is_new) {
                                     const std::scoped_lock lock(mutex);
                                     last = {last.times + 1, is_new, next};
                                     return answer();
                                   }};
};

TEST_F(ReloaderTest, SaysWhatItTookOverAndThatNothingElseIsNew) {
  configure(R"(,"scene":{"max_speed_mps":15})");
  answer_with([] { return std::string("3 readers are listed"); });
  reload();
  EXPECT_TRUE(applied().is_new);
  EXPECT_EQ(applied().given->scene.max_speed_mps, 15);
  EXPECT_EQ(notice(), "reloaded " + file + ": /scene/max_speed_mps; 3 readers are listed");
  answer_with([] { return ""; });
  reload();
  EXPECT_EQ(applied().times, 2);
  EXPECT_FALSE(applied().is_new);
  EXPECT_EQ(notice(), "reloaded " + file + ": nothing new");
  EXPECT_EQ(device.configuration_fault(), "");
}

TEST_F(ReloaderTest, AValueThatIsNoMoreIsSaidInTheLog) {
  configure(R"(,"estimator":{"effort":"exhaustive"})");
  testing::internal::CaptureStdout();
  reload();
  EXPECT_THAT(testing::internal::GetCapturedStdout(),
              HasSubstr("[warning] " + file + ": /estimator/effort: \"exhaustive\" is no longer"));
  EXPECT_EQ(notice(), "reloaded " + file + ": nothing new");
}

TEST_F(ReloaderTest, WhatTakesARestartIsInTheStatusUntilTheFileSaysAgainWhatRuns) {
  configure(R"(,"frame":{"length_ms":20})");
  reload();
  reload();  // Compared with the start and not with the reload before.
  EXPECT_EQ(device.configuration_fault(), "takes a restart: /frame/length_ms");
  configure("");
  reload();
  EXPECT_EQ(device.configuration_fault(), "");
}

TEST_F(ReloaderTest, AListThatComesBackBeforeTheRestartIsNotNew) {
  const std::string listed = R"(,"security":{"server_key":"k","allow_list":"a"})";
  reloader.reset();
  configure(listed);
  original = load_config(file);
  reloader.emplace(original, device, &signals,
                   [](const std::shared_ptr<const Config>&, bool) { return std::string(); });
  configure("");
  reload();
  EXPECT_EQ(device.configuration_fault(),
            "takes a restart: /security/allow_list, /security/server_key");
  EXPECT_EQ(notice(), "reloaded " + file + ": nothing new");
  configure(listed);
  reload();
  EXPECT_EQ(device.configuration_fault(), "");
  EXPECT_EQ(notice(), "reloaded " + file + ": nothing new");
}

TEST_F(ReloaderTest, WhatIsRefusedChangesNothingAndIsInTheStatusUntilTheNextReload) {
  configure(R"(,"frame":{"min_seen_fraction":2})");
  reload();
  EXPECT_EQ(applied().times, 0);
  EXPECT_THAT(device.configuration_fault(),
              testing::AllOf(StartsWith("not reloaded, going on as before: "),
                             HasSubstr("/frame/min_seen_fraction")));
  configure(R"(,"scene":{"max_speed_mps":15})");
  answer_with([]() -> std::string { throw Error(Fault::usage, "the estimator refuses it"); });
  reload();
  EXPECT_EQ(device.configuration_fault(),
            "not reloaded, going on as before: the estimator refuses it");
  answer_with([]() -> std::string { throw std::bad_alloc(); });
  reload();
  EXPECT_THAT(device.configuration_fault(), HasSubstr("not enough memory"));
  EXPECT_TRUE(device.take_notices().empty());
  answer_with([] { return ""; });
  reload();
  EXPECT_TRUE(applied().is_new);  // what was refused is not in use
  EXPECT_EQ(device.configuration_fault(), "");
}

// A reload may take as long as the tables of its estimators take to make.
TEST_F(ReloaderTest, AStopIsHeardWhileAReloadIsUnderWay) {
  configure(R"(,"scene":{"max_speed_mps":15})");
  std::atomic<bool> heard{false};
  answer_with([&] {
    ::kill(::getpid(), SIGTERM);
    heard = test::eventually([&] { return signals.token().stop_requested(); });
    return "";
  });
  reload();
  EXPECT_TRUE(heard);
}

TEST_F(ReloaderTest, NothingIsReadOnceItIsGone) {
  reloader.reset();
  configure(R"(,"scene":{"max_speed_mps":15})");
  ::kill(::getpid(), SIGHUP);
  ::kill(::getpid(), SIGTERM);  // after it: of two that wait the lower number comes first
  const auto deadline = std::chrono::steady_clock::now() + test::patience;
  while (!signals.token().stop_requested() && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
  EXPECT_TRUE(signals.token().stop_requested());
  EXPECT_EQ(applied().times, 0);
}

}  // namespace
}  // namespace splid
