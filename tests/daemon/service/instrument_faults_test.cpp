#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/fault_scene.hpp"

// Something goes wrong with the instrument, its clock, the light or the syncs. It is said or shown,
// what is lost is counted, and good frames come again: how soon is asserted on the instrument's
// clock, and where only the host's tells, beside the machine's slowness.

namespace splid {
namespace {

using test::FaultyBridge;
using test::Tags16Record;
using test::WatchedDaemon;

constexpr std::int64_t scene_second_ps = 1'000'000'000'000;
constexpr std::int64_t frame_ps = scene_second_ps / 20;
constexpr int sync_input = 8;

struct FaultyInstrument {
  const char* name;
  const char* words;  // what it is, for the table
  std::function<void(FaultyBridge&)> inject;
  const char* said;                // words of the status; empty: the frames show it
  WatchedDaemon::FrameTest shows;  // then a frame that shows it
  std::function<void(FaultyBridge&)> heal = nullptr;  // null: it is over by itself
  std::int64_t lost_tags = -1;                        // exactly; -1: as the moment has it
  double said_within_ms = 100;                        // the status that says it
  // A good frame begins so soon after the fault, or after its end, on the instrument's clock.
  std::int64_t good_within_ps = 2 * frame_ps;
};

void PrintTo(const FaultyInstrument& fault, std::ostream* out) { *out << fault.name; }

class InstrumentFault : public test::FaultScene,
                        public ::testing::WithParamInterface<FaultyInstrument> {};

TEST_P(InstrumentFault, IsToldAndCountedAndGoodFramesComeAgain) {
  const FaultyInstrument& fault = GetParam();
  start();
  daemon->start_counting();
  auto begin = WatchedDaemon::Clock::now();
  fault.inject(bridge);
  std::int64_t over_ps = bridge.sender.now_ps();
  const bool is_said = *fault.said != '\0';
  ASSERT_TRUE(is_said ? daemon->await_status(fault.said) : daemon->await_frame(fault.shows));
  const double said_ms = WatchedDaemon::ms_since(begin);
  EXPECT_TRUE(!is_said || yardstick.keeps(fault.said_within_ms, said_ms));
  const std::string shown =
      is_said ? daemon->said : "a frame: " + std::string(to_string(daemon->last_frame->status));
  if (fault.heal) {
    begin = WatchedDaemon::Clock::now();
    fault.heal(bridge);
    over_ps = bridge.sender.now_ps();
  }
  ASSERT_TRUE(daemon->await_good_frame());
  const double good_ms = WatchedDaemon::ms_since(begin);
  EXPECT_LE(daemon->last_frame->start_ps, over_ps + fault.good_within_ps);
  EXPECT_NEAR(daemon->last_frame->distance_m.value_or(0), 284.5, 0.5);
  if (fault.lost_tags >= 0) {
    EXPECT_EQ(daemon->lost_tags, static_cast<std::uint64_t>(fault.lost_tags));
  }
  test::record({fault.words, shown, said_ms, daemon->losses(), good_ms});
}

// Changes one block, and no other.
void once(FaultyBridge& bridge, FaultyBridge::Damage damage) {
  bridge.damage([damage = std::move(damage), done = false](auto& records) mutable {
    if (!std::exchange(done, true)) damage(records);
  });
}

void undo(FaultyBridge& bridge) { bridge.damage({}); }

// After the block's first record, in its place in time.
void put_second(std::vector<Tags16Record>& records, std::vector<Tags16Record> more) {
  const std::int64_t at_ps = records.front().time_ps;
  for (Tags16Record& record : more) record.time_ps = at_ps;
  records.insert(records.begin() + 1, more.begin(), more.end());
}

bool is_dark(const FrameMessage& frame) { return frame.status == FrameStatus::no_target; }
bool is_unseen(const FrameMessage& frame) { return frame.seen_fraction.value_or(1) < 1; }
WatchedDaemon::FrameTest lost(std::uint64_t tags) {
  return [tags](const FrameMessage& frame) { return frame.lost_tags.value_or(0) == tags; };
}

std::vector<FaultyInstrument> connection_faults() {
  return {{"hangsUp",
           "bridge closes the connection and takes the next",
           [](FaultyBridge& bridge) { bridge.hang_up(false); },
           "closed the connection",
           {}},
          {"goesAway",
           "bridge goes away",
           [](FaultyBridge& bridge) { bridge.hang_up(true); },
           "closed the connection",
           {},
           [](FaultyBridge& bridge) { bridge.come_back(); }},
          {"silent",
           "bridge sends nothing",
           [](FaultyBridge& bridge) { bridge.set_silent(true); },
           "sends nothing, not even a heartbeat",
           {},
           [](FaultyBridge& bridge) { bridge.set_silent(false); },
           -1,
           200},  // four frames
          {"silentForLong",
           "bridge sends nothing for 3 s, as after a power failure",
           [](FaultyBridge& bridge) { bridge.set_silent(true); },
           "silent for 3 s; connecting anew",
           {},
           [](FaultyBridge& bridge) { bridge.set_silent(false); },
           -1,
           3000,
           10 * frame_ps},  // what went to the connection that was given up is lost
          {"garbage", "5,003 bytes of garbage in place of 3 ms of blocks",
           [](FaultyBridge& bridge) {
             bridge.sender.skip(3);
             bridge.insert(test::noise(5003));
           },
           "", is_unseen},
          {"gap", "3 ms of blocks are missing", [](FaultyBridge& bridge) { bridge.sender.skip(3); },
           "", is_unseen},
          {"gapInNumbers",
           "two blocks' numbers are missing, and no time",
           [](FaultyBridge& bridge) { bridge.sender.skip_numbers(2); },
           "tags were lost: 2 blocks missing by their numbers",
           {}}};
}

std::vector<FaultyInstrument> told_losses() {
  return {{"missed", "instrument says that 500 tags were missed",
           [](FaultyBridge& bridge) {
             once(bridge, [](auto& records) { put_second(records, {{0, 1, 4, 500}}); });
           },
           "", lost(500), undo, 500},
          {"overflow", "instrument's memory overflows, 1,234 tags missed",
           [](FaultyBridge& bridge) {
             once(bridge, [](auto& records) {
               put_second(records, {{0, 0, 2, 0}, {0, 1, 4, 1234}, {0, 0, 3, 0}});
             });
           },
           "", lost(1234), undo, 1234},
          {"timeBase", "instrument says that its time base broke",
           [](FaultyBridge& bridge) {
             once(bridge, [](auto& records) { put_second(records, {{0, 0, 1, 0}}); });
           },
           "", is_unseen, undo}};
}

std::vector<FaultyInstrument> clock_faults() {
  return {{"clockAhead", "clock jumps 10 s forward, unsaid",
           [](FaultyBridge& bridge) { bridge.sender.step(10 * scene_second_ps); }, "",
           [](const FrameMessage& frame) { return frame.start_ps > 9 * scene_second_ps; }},
          {"clockBack", "clock jumps 10 s back, unsaid",
           [](FaultyBridge& bridge) { bridge.sender.step(-10 * scene_second_ps); }, "",
           [](const FrameMessage& frame) { return frame.start_ps < -5 * scene_second_ps; }},
          {"clockOfDays", "clock jumps to 3.4e17 ps, an epoch of 3.9 days",
           [](FaultyBridge& bridge) { bridge.sender.step(340'000 * scene_second_ps); }, "",
           [](const FrameMessage& frame) { return frame.start_ps > 339'000 * scene_second_ps; }},
          {"stray", "one time stamp is an hour ahead",
           [](FaultyBridge& bridge) {
             once(bridge, [](auto& records) {
               records.insert(records.begin() + 1,
                              {records.front().time_ps + 3600 * scene_second_ps, 1, 0, 0});
             });
           },
           "", [](const FrameMessage& frame) { return frame.lost_tags.value_or(0) > 0; }, undo}};
}

std::vector<FaultyInstrument> light_and_sync_faults() {
  return {
      {"noSync",
       "sync cable comes off",
       [](FaultyBridge& bridge) {
         bridge.damage([](auto& records) {
           std::erase_if(records, [](const auto& r) { return r.channel == sync_input; });
         });
       },
       "too few pattern syncs",
       {},
       undo},
      {"doubledSync", "every sync comes twice, 20 ns apart",
       [](FaultyBridge& bridge) {
         bridge.damage([](auto& records) {
           std::vector<Tags16Record> made;
           for (const Tags16Record& record : records) {
             made.push_back(record);
             if (record.channel != sync_input) continue;
             const std::int64_t again_ps = record.time_ps + 20'000;
             // Later ones may be past the block's end.
             if (again_ps < records.back().time_ps) made.push_back({again_ps, sync_input, 0, 0});
           }
           std::ranges::stable_sort(made, {}, &Tags16Record::time_ps);
           records = made;
         });
       },
       "", [](const FrameMessage& frame) { return frame.sync->spurious > 10'000; }, undo, 0},
      {"silence", "instrument says nothing in mid-frame, but its clock goes on",
       [](FaultyBridge& bridge) {
         bridge.damage([blocks = 0](auto& records) mutable {
           if (++blocks <= 20) records.clear();
         });
       },
       "", is_unseen, undo, 0},
      {"dark", "detector is covered",
       [](FaultyBridge& bridge) {
         bridge.damage([](auto& records) {
           std::erase_if(records, [](const auto& r) { return r.channel != sync_input; });
         });
       },
       "", is_dark, undo, 0},
      {"flood", "200,000 photons in one millisecond",
       [](FaultyBridge& bridge) {
         once(bridge, [](auto& records) {
           put_second(records, std::vector<Tags16Record>(200'000, {0, 1, 0, 0}));
         });
       },
       "", [](const FrameMessage& frame) { return frame.photons.value_or(0) > 200'000; }, undo, 0}};
}

std::string name_of(const ::testing::TestParamInfo<FaultyInstrument>& fault) {
  return fault.param.name;
}

INSTANTIATE_TEST_SUITE_P(Connection, InstrumentFault, ::testing::ValuesIn(connection_faults()),
                         name_of);
INSTANTIATE_TEST_SUITE_P(ToldLoss, InstrumentFault, ::testing::ValuesIn(told_losses()), name_of);
INSTANTIATE_TEST_SUITE_P(Clock, InstrumentFault, ::testing::ValuesIn(clock_faults()), name_of);
INSTANTIATE_TEST_SUITE_P(LightAndSyncs, InstrumentFault,
                         ::testing::ValuesIn(light_and_sync_faults()), name_of);

using LossesToTheEnd = test::FaultScene;

// An overflow begins, and the bridge comes back with a clock that begins anew.
TEST_F(LossesToTheEnd, AnOverflowIsOverWithItsClock) {
  start();
  once(bridge, [](auto& records) { put_second(records, {{0, 0, 2, 0}}); });
  ASSERT_TRUE(daemon->await_frame(
      [](const FrameMessage& frame) { return frame.seen_fraction.value_or(1) == 0; }));
  undo(bridge);
  bridge.hang_up(true);
  ASSERT_TRUE(daemon->await_status("closed the connection"));
  bridge.sender.restart();
  bridge.come_back();
  EXPECT_TRUE(daemon->await_good_frame());
}

TEST_F(LossesToTheEnd, AGapInTheNumbersIsInAFrameAndInTheLog) {
  start();
  bridge.sender.skip_numbers(2);
  ASSERT_TRUE(daemon->await_frame([](const FrameMessage& frame) {
    return frame.status == FrameStatus::ok && frame.uncounted_losses == 1;
  }));
  ASSERT_TRUE(daemon->await_good_frame());
  const test::ProgramResult result = daemon->stop();
  daemon.reset();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err,
              ::testing::ContainsRegex("warning: connected: .*2 blocks missing by their numbers"));
  EXPECT_THAT(result.err, ::testing::HasSubstr("0 lost, and nobody knows how many in 1 loss;"));
}

// The rates are those of the time that was seen, not of the frame's length.
TEST_F(LossesToTheEnd, SignalAndBackgroundOfAPartlySilentFrameAreRight) {
  start(R"(,"frame":{"min_seen_fraction":0.3})");
  ASSERT_TRUE(daemon->await_good_frame());
  const FrameMessage whole = *daemon->last_frame;
  bridge.damage([blocks = 0](auto& records) mutable {
    if (++blocks <= 20) records.clear();
  });
  ASSERT_TRUE(daemon->await_frame([](const FrameMessage& frame) {
    return frame.status == FrameStatus::ok && frame.seen_fraction.value_or(1) < 0.85;
  }));
  undo(bridge);
  const FrameMessage& partly = *daemon->last_frame;
  EXPECT_NEAR(*partly.background_per_s, *whole.background_per_s, 6 * *partly.std_background_per_s);
  EXPECT_NEAR(*partly.signal_per_pulse, *whole.signal_per_pulse, 6 * *partly.std_signal_per_pulse);
  EXPECT_LT(*partly.std_background_per_s, 0.05 * *whole.background_per_s);  // else it shows nothing
}

class UtcOfFrames : public test::FaultScene {
 protected:
  double utc_error_ms(const FrameMessage& frame) {
    const double middle_s = bridge.sender.unix_s(frame.start_ps) + frame.duration_ms / 2000;
    return 1000 * std::abs(frame.timestamp_s - middle_s);
  }
};

TEST_F(UtcOfFrames, IsRightAgainAfterTheClockJumpedByDays) {
  start();
  bridge.sender.step(340'000 * scene_second_ps);
  const std::int64_t stepped_ps = bridge.sender.now_ps();
  ASSERT_TRUE(daemon->await_frame([this](const FrameMessage& frame) {
    return frame.start_ps > 339'000 * scene_second_ps && yardstick.keeps(100, utc_error_ms(frame));
  }));
  EXPECT_LT(daemon->last_frame->start_ps, stepped_ps + 2 * scene_second_ps);
}

}  // namespace
}  // namespace splid
