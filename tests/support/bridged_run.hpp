#pragma once

#include <string>

#include "tests/support/temp_folder.hpp"

namespace splid::test {

// A folder with a bridge's socket, and configurations of a `splid run` at the other end of it.
class BridgedRun {
 public:
  [[nodiscard]] std::string socket() const { return folder.path("bridge.sock"); }
  [[nodiscard]] std::string source() const {
    return R"({"driver":"bridge","address":"unix:)" + socket() + "\"}";
  }

  // A pattern of one pulse a period, and a configuration that measures with it.
  std::string write_config(const std::string& from, const std::string& photon, double period_ps,
                           const std::string& more, const std::string& sync = "sync") const {
    (void)folder.write("pattern.json", R"({"schema":"splid.pattern","v":[1,0],"mode":"baseline",)"
                                       R"("unambiguous_delay_ps":)" +
                                           std::to_string(period_ps) +
                                           R"(,"segments":[{"period_ps":)" +
                                           std::to_string(period_ps) +
                                           R"(,"pulse_times_ps":[0],"amplitudes":[1],)"
                                           R"("repeats":0}]})");
    return folder.write("run-" + photon + "-" + sync + ".json",
                        R"({"schema":"splid.config","v":[1,0],"source":)" + from +
                            R"(,"channels":{"photon":[)" + photon + R"(],"sync":")" + sync +
                            R"(","encoder":""},"control":{"endpoint":"off"},)"
                            R"("estimator":{"effort":"fast"},"pattern":{"file":"pattern.json"},)"
                            R"("publish":{"endpoint":"tcp://127.0.0.1:*"})" +
                            more + "}");
  }

  TempFolder folder;
};

}  // namespace splid::test
