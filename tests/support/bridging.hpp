#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/support/bridged_run.hpp"
#include "tests/support/light_scene.hpp"
#include "tests/support/picoquant_instrument.hpp"
#include "tests/support/program.hpp"

namespace splid::test {

// `splid bridge picoquant` with the double of a library in it, and configurations of a `splid run`
// at the other end of its socket.
class Bridging : public BridgedRun {
 public:
  explicit Bridging(const PicoQuantKind& kind) : instrument(kind) {}

  // more: further members of the bridge's configuration.
  std::unique_ptr<Program> start_bridge(const std::string& more = "") {
    (void)folder.write("bridge.json", bridge_json(more));
    return std::make_unique<Program>(
        std::vector<std::string>{"bridge", "picoquant", "--config", folder.path("bridge.json")});
  }
  [[nodiscard]] std::string bridge_json(const std::string& more) const {
    return R"({"schema":"splid.bridge.picoquant","v":[1,0],"listen":"unix:)" + socket() +
           R"(","instrument":")" + instrument.kind().instrument + R"(","library":")" +
           instrument.kind().library + "\"" + more + "}";
  }
  // Of the instrument's endless scene.
  std::string write_scene_config() const {
    return write_config(source(), "1", instrument.scene_period_ps(), with_light_scene(small_ring));
  }

  PicoQuantInstrument instrument;
};

}  // namespace splid::test
