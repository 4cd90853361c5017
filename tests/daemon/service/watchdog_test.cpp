#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "daemon/output/liveness.hpp"
#include "daemon/output/publisher.hpp"
#include "daemon/stream/stream.hpp"
#include "drivers/client_socket.hpp"
#include "drivers/usb/tdc2_instrument.hpp"
#include "drivers/usb/usb_session.hpp"
#include "drivers/usb/usb_source.hpp"
#include "tests/support/matches.hpp"
#include "tests/support/program.hpp"

// The watchdog ends what hangs, and nothing that only tries again.

namespace splid {
namespace {

using std::chrono::milliseconds;

// Of the unit file, in seconds.
double unit_seconds(const std::string& key) {
  const std::string unit = test::file_text(SPLID_SOURCE_DIR "/systemd/splid.service");
  const auto found = test::first_match(unit, "(?:^|\n)" + key + "=([0-9.]+)(?:\n|$)");
  EXPECT_FALSE(found.empty()) << key;
  return found.empty() ? 0 : std::stod(found[1]);
}

double seconds(milliseconds time) { return std::chrono::duration<double>(time).count(); }

// All that may be spent on trying again, one after the other, while nothing feeds the watchdog: the
// longest connection to a bridge, a USB device that is silent until it is opened anew, does not
// answer a command, is tried again and drained, and a stop that drains the ring.
TEST(Watchdog, AllRetriesTogetherTakeLessThanHalfOfItsTime) {
  const double spent_s =
      seconds(ClientSocket::connect_patience) + seconds(usb::Session::silence_ended) +
      2 * seconds(usb::Tdc2Instrument::patience) + seconds(usb::Session::longest_drain) +
      seconds(usb::Source::between_tries) + Stream::stop_patience_ms / 1000.0;
  EXPECT_GT(spent_s, 3);
  EXPECT_LT(spent_s, unit_seconds("WatchdogSec") / 2);
}

// A pause that ends by itself never starves the watchdog. A longer pause does, in less than half of
// the watchdog's time.
TEST(Watchdog, WaitsForWhatEndsByItselfAndForNothingElse) {
  const double patience_s = Liveness::source_patience_ns * 1e-9;
  EXPECT_GT(patience_s, seconds(ClientSocket::connect_patience));
  EXPECT_GT(patience_s, seconds(usb::Source::between_tries) + seconds(usb::Session::longest_drain));
  EXPECT_LT(patience_s, unit_seconds("WatchdogSec") / 2);
  EXPECT_LT(Liveness::least_frame_patience_ms / 1000, unit_seconds("WatchdogSec") / 2);
}

TEST(Watchdog, AStopEndsLongBeforeItIsForced) {
  EXPECT_LT(Stream::stop_patience_ms / 1000.0 + seconds(Publisher::linger) + 0.1,
            unit_seconds("TimeoutStopSec") / 2);
}

}  // namespace
}  // namespace splid
