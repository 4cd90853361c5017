// Measures how many records a second come from the double of PicoQuant's MHLib, which hands out the
// records of a scene as the instrument's clock goes on, through `splid bridge picoquant`, a Unix
// socket and `splid run` to frames. The double is inside the bridge, and its time in the figures.
//
//   bridge_rate [SECONDS [PHOTONS_PER_PERIOD...]]
//
// A period has 5.24 us. Prints a line of a table for each number of photons. The time of the
// processors tells what a machine would take whose cores no other program had.

#include <sys/types.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/bridging.hpp"
#include "tests/support/watched_daemon.hpp"

namespace splid {
namespace {

using std::chrono::duration;
using std::chrono::steady_clock;

// Processor time that each thread of a process took so far.
std::map<std::string, double> thread_ns(pid_t process) {
  std::map<std::string, double> times;
  for (const auto& thread :
       std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
    std::istringstream(test::file_text(thread.path() / "schedstat")) >> times[thread.path()];
  }
  return times;
}

// Of a process since then, for each record: all its threads, and the busiest of them.
std::string cost(pid_t process, std::map<std::string, double> before, double records) {
  double all_ns = 0, most_ns = 0;
  for (const auto& [thread, now_ns] : thread_ns(process)) {
    all_ns += now_ns - before[thread];
    most_ns = std::max(most_ns, now_ns - before[thread]);
  }
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.1f, %.1f", all_ns / records, most_ns / records);
  return text.data();
}

void measure(int photons, double seconds) {
  test::Bridging bridging(test::picoquant_kinds[0]);
  test::PicoQuantControl& control = bridging.instrument.control();
  control.fifo_records = 1 << 27;  // as a MultiHarp 150 has
  bridging.instrument.give_scene(photons);
  const auto bridge = bridging.start_bridge();
  test::WatchedDaemon daemon(
      bridging.write_config(bridging.source(), "1", bridging.instrument.scene_period_ps(),
                            R"(,"scene":{"motion":"static"})"),
      "tcp://127.0.0.1:*");
  (void)daemon.await_frame([](const FrameMessage&) { return true; });
  daemon.start_counting();
  const auto began = steady_clock::now();
  const std::uint64_t records = control.records;
  const auto bridge_ns = thread_ns(bridge->id());
  const auto daemon_ns = thread_ns(daemon.program->id());
  (void)daemon.await_frame([&](const FrameMessage&) {
    return duration<double>(steady_clock::now() - began).count() > seconds;
  });
  const double took_s = duration<double>(steady_clock::now() - began).count();
  const auto handed = static_cast<double>(control.records - records);
  const double offered = (photons + 1.5 + 1.0 / 32) / bridging.instrument.scene_period_ps() * 1e6;
  std::printf("| %.1f | %.1f | %llu of %.0f | %s | %llu | %s | %s |\n", offered,
              handed / took_s * 1e-6, static_cast<unsigned long long>(daemon.frames), took_s * 20,
              daemon.losses().c_str(), static_cast<unsigned long long>(control.was_full),
              cost(bridge->id(), bridge_ns, handed).c_str(),
              cost(daemon.program->id(), daemon_ns, handed).c_str());
  std::fflush(stdout);
  (void)daemon.stop();
}

}  // namespace
}  // namespace splid

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 5;
  std::vector<int> photons;
  for (int i = 2; i < argc; ++i) photons.push_back(std::atoi(argv[i]));
  if (photons.empty()) photons = {25, 51, 103, 156, 208, 313, 418};
  std::puts(
      "| M records/s of the clock | of the library | frames | lost: tags counted, time unseen, "
      "frames of no use | FIFO full | bridge, ns a record: all, busiest thread | splid run |\n"
      "|---|---|---|---|---|---|---|");
  for (const int each : photons) splid::measure(each, seconds);
}
