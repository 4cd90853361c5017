#include "daemon/service/stop_signals.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "tests/support/eventually.hpp"

namespace splid {
namespace {

void send_and_await_taken(int number) {
  ::kill(::getpid(), number);
  for (sigset_t waiting{}; ::sigpending(&waiting) == 0 && ::sigismember(&waiting, number) == 1;) {
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
}

constexpr int came_to_its_end = 7;

// `timeout` signals its child, and then the group that the child is in.
TEST(StopSignals, TwoAtOnceAreOneRequest) {
  EXPECT_EXIT(
      {
        {
          const StopSignals signals;
          for (const int number : {SIGTERM, SIGTERM, SIGINT}) send_and_await_taken(number);
        }  // what was taken has been acted upon
        ::_exit(came_to_its_end);
      },
      ::testing::ExitedWithCode(came_to_its_end), "");
}

// SIGUSR2 ends the thread that waits only where the object's end sends it.
TEST(StopSignals, AreHeardAfterASignalThatMeansNothing) {
  EXPECT_EXIT(
      {
        const StopSignals signals;
        send_and_await_taken(SIGUSR2);
        ::kill(::getpid(), SIGTERM);
        const bool heard = test::eventually([&] { return signals.token().stop_requested(); });
        ::_exit(heard ? came_to_its_end : 1);
      },
      ::testing::ExitedWithCode(came_to_its_end), "");
}

TEST(StopSignals, ALaterOneEndsTheProcessAtOnce) {
  EXPECT_EXIT(
      {
        const StopSignals signals;
        while (true) send_and_await_taken(SIGTERM);
      },
      ::testing::ExitedWithCode(128 + SIGTERM), "");
}

}  // namespace
}  // namespace splid
