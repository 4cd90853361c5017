#include "protocol/fold_json.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

#include "protocol/json_value.hpp"

namespace splid {
namespace {

// A message whose lists have one element, so that it can be read here.
FoldMessage message_of(std::uint64_t count, double value) {
  FoldMessage message{value, count, FrameStatus::ok, count, count, {}};
  message.fold.stack = {-value, value, {count}, {value}};
  message.fold.period = {value, true, {count}};
  message.fold.plane = {value, value, {value}};
  return message;
}

TEST(FoldJson, WithoutPicturesIsPinned) {
  EXPECT_EQ(to_json(FoldMessage{0, 0, FrameStatus::no_sync, 0, 0, {}}),
            R"({"schema":"splid.fold","v":[1,0],"timestamp":0,"sequence":0,"status":"no_sync",)"
            R"("photons":0,"folded":0})");
}

TEST(FoldJson, OfZeroIsPinned) {
  EXPECT_EQ(to_json(message_of(0, 0)),
            R"({"schema":"splid.fold","v":[1,0],"timestamp":0,"sequence":0,"status":"ok",)"
            R"("photons":0,"folded":0,)"
            R"("stack":{"first_ns":0,"bin_ns":0,"counts":[0],"expected":[0]},)"
            R"("period":{"bin_ns":0,"moved_back":true,"counts":[0]},)"
            R"("plane":{"delay_step_ns":0,"velocity_step_mps":0,"gain_nats":[0]}})");
}

TEST(FoldJson, OfOneIsPinned) {
  EXPECT_EQ(to_json(message_of(1, 1)),
            R"({"schema":"splid.fold","v":[1,0],"timestamp":1,"sequence":1,"status":"ok",)"
            R"("photons":1,"folded":1,)"
            R"("stack":{"first_ns":-1,"bin_ns":1,"counts":[1],"expected":[1]},)"
            R"("period":{"bin_ns":1,"moved_back":true,"counts":[1]},)"
            R"("plane":{"delay_step_ns":1,"velocity_step_mps":1,"gain_nats":[1]}})");
}

TEST(FoldJson, OfTheLargestNumbersIsPinned) {
  // 2^21 photons a frame, and a target that explains each by 40 nats.
  FoldMessage largest = message_of(2'097'152, 83'886'080.125);
  largest.sequence = std::numeric_limits<std::uint64_t>::max();
  largest.fold.period->moved_back = false;
  EXPECT_EQ(to_json(largest),
            R"({"schema":"splid.fold","v":[1,0],"timestamp":83886080.125,)"
            R"("sequence":18446744073709551615,"status":"ok","photons":2097152,"folded":2097152,)"
            R"("stack":{"first_ns":-83886080.125,"bin_ns":83886080.125,"counts":[2097152],)"
            R"("expected":[83890000]},)"
            R"("period":{"bin_ns":83886080.125,"moved_back":false,"counts":[2097152]},)"
            R"("plane":{"delay_step_ns":83886080.125,"velocity_step_mps":83886080.125,)"
            R"("gain_nats":[83886080.13]}})");
}

TEST(FoldJson, WholePicturesAreSmall) {
  FoldMessage message = message_of(12'345, 0.123456789);
  message.fold.stack->counts.assign(PhotonFold::stack_bins, 12'345);
  message.fold.stack->expected.assign(PhotonFold::stack_bins, 1.23456789e-5);
  message.fold.period->counts.assign(PhotonFold::period_bins, 12'345);
  message.fold.plane->gain_nats.assign(PhotonFold::plane_cells * PhotonFold::plane_cells,
                                       -12345.6789);
  const std::string json = to_json(message);
  EXPECT_LT(json.size(), 60'000u);
  const auto read = json_value(json);
  EXPECT_DOUBLE_EQ(read["stack"]["expected"][199].get<double>(), 1.235e-5);
  EXPECT_EQ(read["plane"]["gain_nats"][4095].get<double>(), -12345.68);
}

}  // namespace
}  // namespace splid
