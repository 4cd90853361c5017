#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/support/light_scene.hpp"
#include "tests/support/picoquant_instrument.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::test {

// `splid bridge picoquant` with the double of a library in it, and configurations of a `splid run`
// at the other end of its socket.
class Bridging {
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
  [[nodiscard]] std::string socket() const { return folder.path("bridge.sock"); }

  // A pattern of one pulse a period, and a configuration that measures with it.
  std::string write_config(const std::string& source, const std::string& photon, double period_ps,
                           const std::string& more) const {
    (void)folder.write("pattern.json", R"({"schema":"splid.pattern","v":[1,0],"mode":"baseline",)"
                                       R"("unambiguous_delay_ps":)" +
                                           std::to_string(period_ps) +
                                           R"(,"segments":[{"period_ps":)" +
                                           std::to_string(period_ps) +
                                           R"(,"pulse_times_ps":[0],"amplitudes":[1],)"
                                           R"("repeats":0}]})");
    return folder.write("run-" + photon + ".json",
                        R"({"schema":"splid.config","v":[1,0],"source":)" + source +
                            R"(,"channels":{"photon":[)" + photon +
                            R"(],"encoder":""},"control":{"endpoint":"off"},)"
                            R"("estimator":{"effort":"fast"},"pattern":{"file":"pattern.json"},)"
                            R"("publish":{"endpoint":"tcp://127.0.0.1:*"})" +
                            more + "}");
  }
  // Of the instrument's endless scene.
  std::string write_scene_config() const {
    return write_config(bridge_source(), "1", instrument.scene_period_ps(),
                        with_light_scene(small_ring));
  }
  [[nodiscard]] std::string bridge_source() const {
    return R"({"driver":"bridge","address":"unix:)" + socket() + "\"}";
  }

  PicoQuantInstrument instrument;
  TempFolder folder;
};

}  // namespace splid::test
