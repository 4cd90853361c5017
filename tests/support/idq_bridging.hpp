#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/bridged_run.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/program.hpp"
#include "tests/support/time_controller_double.hpp"

namespace splid::test {

// A target at rest, for ever: a sync each period on input 4, and a quarter of a period after every
// second sync a photon on input 1.
struct TimeControllerScene {
  static constexpr std::int64_t period_ps = 10'000'000;

  static std::vector<std::int64_t> times(int input, std::int64_t begin_ps, std::int64_t end_ps) {
    std::vector<std::int64_t> all;
    for (std::int64_t k = begin_ps / period_ps; k * period_ps < end_ps; ++k) {
      const auto chance = static_cast<std::uint32_t>(k) * 2'654'435'761U >> 16U;
      if (input != 4 && (input != 1 || chance % 2 != 0)) continue;
      const std::int64_t time_ps =
          k * period_ps + (input == 4 ? 0 : period_ps / 4 + chance / 2 % 80);
      if (time_ps >= begin_ps && time_ps < end_ps) all.push_back(time_ps);
    }
    return all;
  }
};

// `splid bridge idq` at the double of an instrument.
class IdqBridging : public BridgedRun {
 public:
  explicit IdqBridging(TimeControllerDouble::Events events = TimeControllerScene::times)
      : instrument(std::move(events)) {}

  std::unique_ptr<Program> start_bridge() {
    (void)folder.write("bridge.json", bridge_json(""));
    return std::make_unique<Program>(
        std::vector<std::string>{"bridge", "idq", "--config", folder.path("bridge.json")});
  }
  // more: further members.
  [[nodiscard]] std::string bridge_json(const std::string& more) const {
    return R"({"schema":"splid.bridge.idq","v":[1,0],"listen":"unix:)" + socket() +
           R"(","address":")" + instrument.address() + R"(","data_link":")" +
           instrument.data_link() + R"(","stream_port":)" +
           std::to_string(instrument.stream_port()) +
           R"(,"inputs":[{"input":1},{"input":2},{"input":4}])" + more + "}";
  }
  // Of the scene.
  std::string write_scene_config() const {
    return write_config(source(), "1", TimeControllerScene::period_ps, with_light_scene(small_ring),
                        "4");
  }

  TimeControllerDouble instrument;
};

}  // namespace splid::test
