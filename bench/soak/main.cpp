// Runs a day of frames with faults sprinkled in, from the simulator and a recording in turn, as
// fast as the machine allows: through ring, framer, estimators and publisher to a real subscriber.
// Beside them there are an operator who reloads the configuration, a subscriber that never reads,
// and a stranger who sends garbage to the publisher's port. Prints the memory at start and end, and
// where each tag went.
//
//   soak                  1,728,000 frames of 50 ms: 24 hours of the instrument's time
//   soak --frames 3000    some seconds
//
// Exit code 1 where a promise is broken.

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <thread>
#include <vector>
#include <zmq.hpp>

#include "bench/soak/faulty_source.hpp"
#include "daemon/base/text.hpp"
#include "daemon/service/memory.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/sockets/subscriber.hpp"
#include "drivers/wake.hpp"
#include "protocol/error.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/measured_stream.hpp"
#include "tests/support/process_memory.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::soak {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr std::uint64_t day_frames = 1'728'000;
constexpr double frame_s = 0.05;
constexpr double allowed_growth_mib = 1;
// The number of messages that are queued for the subscriber that never reads. Once they are, the
// memory for them is taken.
constexpr int queue_messages = 1000;

// A frame has some 90 photons, two thirds of them signal.
simulator::Options scene() {
  simulator::Options options;
  options.detection.signal_per_pulse = 1.2e-4;
  options.ambient_per_s = 100;
  return options;
}

Config configuration(double max_speed_mps) {
  Config config = scene_config(0, 2);
  config.estimator.effort = Effort::fast;
  config.scene.max_speed_mps = max_speed_mps;
  return config;
}

// Reads what comes to the subscriber, on a thread of its own.
class Reader {
 public:
  explicit Reader(const std::string& endpoint)
      : subscriber_(endpoint, {topic_frame}),
        thread_([this](const std::stop_token& stop) { run(stop); }) {}

  // To be called at the end; returns once nothing has come for a second.
  void finish() {
    thread_.request_stop();
    thread_.join();
  }

  std::uint64_t frames = 0;
  std::uint64_t out_of_turn = 0;  // frames whose number does not follow that of the frame before
  std::uint64_t photons = 0;
  std::uint64_t lost_tags = 0;

 private:
  void run(const std::stop_token& stop) {
    while (true) {
      const auto message = subscriber_.receive(milliseconds{1000});
      if (!message && stop.stop_requested()) return;
      if (!message) continue;
      const FrameMessage frame = frame_from_json(message->json);
      out_of_turn += frame.sequence == frames ? 0 : 1;
      ++frames;
      photons += frame.photons.value_or(0);
      lost_tags += frame.lost_tags.value_or(0);
    }
  }

  sockets::Subscriber subscriber_;
  std::jthread thread_;
};

// Every 250 frames reloads the configuration, and lets a stranger knock at the port.
class Operator {
 public:
  Operator(test::MeasuredStream& stream, const std::string& endpoint)
      : stream_(stream),
        port_(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))),
        thread_([this](const std::stop_token& stop) { run(stop); }) {}

  void frame(std::uint64_t number) {
    if (number % 250 != 249) return;
    ++turns_;
    wake_.notify();
  }

  std::atomic<std::uint64_t> reloads{0};
  std::atomic<std::uint64_t> garbage_bytes{0};

 private:
  void run(const std::stop_token& stop) {
    std::mt19937 random(3);
    std::string noise(4096, '\0');
    while (!stop.stop_requested()) {
      wake_.wait_for(milliseconds{50});
      if (reloads == turns_) continue;
      stream_.reload(configuration(reloads % 2 == 0 ? 100 : 150));
      ++reloads;
      for (char& byte : noise) byte = static_cast<char>(random());
      test::LocalConnection(port_).send(noise);
      garbage_bytes += noise.size();
    }
  }

  test::MeasuredStream& stream_;
  int port_;
  std::atomic<std::uint64_t> turns_{0};
  Wake wake_;
  std::jthread thread_;
};

// The memory of the process, every 50 frames. It goes up and down by some 5 MiB with the reloads,
// during which there are two sets of estimators, so that means of many values are compared: that of
// the first quarter of the frames with that of the last. The first 10,000 frames are left out, in
// which the heaps, the buffers and the queue of the subscriber that never reads are touched for the
// first time.
class Memory {
 public:
  explicit Memory(std::uint64_t frames) { samples_mib_.reserve(2 * frames / every); }

  void frame(std::uint64_t number) {
    if (number < settled || number % every != 0) return;
    samples_mib_.push_back(test::memory_mib("VmRSS"));
  }
  // 40,000 frames in all.
  [[nodiscard]] bool is_enough() const { return samples_mib_.size() >= 600; }
  [[nodiscard]] double start_mib() const { return mean(samples_mib_.begin()); }
  [[nodiscard]] double end_mib() const { return mean(samples_mib_.end() - quarter()); }

 private:
  using Sample = std::vector<double>::const_iterator;
  [[nodiscard]] std::ptrdiff_t quarter() const {
    return static_cast<std::ptrdiff_t>(samples_mib_.size() / 4);
  }
  [[nodiscard]] double mean(Sample from) const {
    return std::accumulate(from, from + quarter(), 0.0) / static_cast<double>(quarter());
  }

  static constexpr std::uint64_t every = 50;
  static constexpr std::uint64_t settled = 10'000;
  std::vector<double> samples_mib_;
};

class Verdict {
 public:
  void expect(bool holds, const std::string& promise) {
    std::printf("%-4s %s\n", holds ? "ok" : "NOT", promise.c_str());
    all_hold = all_hold && holds;
  }
  // Both are printed.
  void expect_equal(std::uint64_t counted, std::uint64_t expected, const std::string& promise) {
    expect(counted == expected, promise + ": " + grouped(counted) + " and " + grouped(expected));
  }
  bool all_hold = true;
};

void show_progress(std::uint64_t frame, std::uint64_t of, steady_clock::time_point began) {
  if (frame % 2000 != 0) return;
  const std::chrono::duration<double> took = steady_clock::now() - began;
  std::fprintf(stderr, "\r%s of %s frames, %.0f s, %.1f MiB  ", grouped(frame).c_str(),
               grouped(of).c_str(), took.count(), test::memory_mib("VmRSS"));
}

std::uint64_t count(const Injected& injected, StreamFault fault) {
  return injected.faults.at(static_cast<std::size_t>(fault));
}

void print_faults(const Injected& injected) {
  std::printf("faults injected\n");
  for (std::size_t i = 1; i < fault_count; ++i) {
    std::printf("  %-26s %s\n", to_string(static_cast<StreamFault>(i)),
                grouped(injected.faults.at(i)).c_str());
  }
}

void print_statuses(const StreamSummary& summary) {
  std::printf("frames by status\n");
  for (std::size_t i = 0; i < summary.frames_by_status.size(); ++i) {
    if (summary.frames_by_status.at(i) == 0) continue;
    std::printf("  %-26s %s\n", to_string(static_cast<FrameStatus>(i)),
                grouped(summary.frames_by_status.at(i)).c_str());
  }
}

// Checks that every tag that came is in a frame that was received, or in a counted loss.
void judge_sums(Verdict& verdict, const StreamSummary& summary, const Reader& reader) {
  const FramerTotals& tags = summary.tags;
  const std::uint64_t placed = tags.photons + tags.syncs + tags.markers - tags.shared;
  verdict.expect_equal(reader.frames, summary.frames, "frames received and cut");
  verdict.expect_equal(reader.out_of_turn, 0, "frames out of turn or missing");
  verdict.expect_equal(placed + tags.ignored + tags.late + tags.surplus, tags.events,
                       "tags in frames, on other channels, late or too many, and tags that came");
  verdict.expect_equal(reader.lost_tags + tags.unplaced, tags.late + tags.surplus + tags.reported,
                       "tags lost in the frames received and tags counted as lost");
  verdict.expect_equal(reader.photons, tags.photons,
                       "photons in the frames received and in those cut");
}

// Checks that the faults which were injected are those which were counted, to the tag.
void judge_faults(Verdict& verdict, const FramerTotals& tags, const Injected& injected) {
  verdict.expect_equal(tags.events, injected.events, "tags that came and tags sent");
  verdict.expect_equal(tags.reported, injected.reported, "tags reported missing and left out");
  verdict.expect_equal(tags.late, injected.late,
                       "tags late, and strays and those sent before a step back was believed");
  verdict.expect_equal(tags.ignored, 1000 * count(injected, StreamFault::other_channel),
                       "tags on other channels and such injected");
  verdict.expect_equal(tags.jumps, count(injected, StreamFault::clock_forward),
                       "steps of the clock ahead and such injected");
  verdict.expect_equal(
      tags.resets,
      count(injected, StreamFault::clock_back) + count(injected, StreamFault::clock_break),
      "steps of the clock back and such injected");
}

void judge_memory(Verdict& verdict, const Memory& memory) {
  if (!memory.is_enough()) {
    std::printf("     too few frames to judge memory: %.1f MiB\n", test::memory_mib("VmRSS"));
    return;
  }
  const double growth_mib = memory.end_mib() - memory.start_mib();
  verdict.expect(growth_mib <= allowed_growth_mib,
                 fmt::format("memory at the start {:.2f} MiB, at the end {:.2f}: {:+.2f}",
                             memory.start_mib(), memory.end_mib(), growth_mib));
}

int report(const StreamSummary& summary, const Injected& injected, const Reader& reader,
           const Operator& beside, const Memory& memory, bool is_whole) {
  std::printf("%s reloads, %s bytes of garbage at the publisher's port\n",
              grouped(beside.reloads).c_str(), grouped(beside.garbage_bytes).c_str());
  print_faults(injected);
  print_statuses(summary);
  Verdict verdict;
  judge_sums(verdict, summary, reader);
  if (is_whole) {
    judge_faults(verdict, summary.tags, injected);
  } else {
    std::printf("     stopped early: what was injected is not compared\n");
  }
  judge_memory(verdict, memory);
  return verdict.all_hold ? 0 : 1;
}

int soak(std::uint64_t frames) {
  return_large_blocks();
  StopSignals signals;
  const test::TempFolder folder;
  const Config config = configuration(150);
  Publisher publisher(config.publish.endpoint, queue_messages);
  zmq::context_t context;
  zmq::socket_t idle(context, zmq::socket_type::sub);
  idle.set(zmq::sockopt::rcvhwm, 1);
  idle.set(zmq::sockopt::linger, 0);
  idle.set(zmq::sockopt::subscribe, "");
  idle.connect(publisher.endpoint());
  if (!publisher.wait_for_subscriber(milliseconds{5000})) return 1;
  Reader reader(publisher.endpoint());
  std::this_thread::sleep_for(milliseconds{500});  // its subscription is on its way

  auto owned = std::make_unique<FaultySource>(config.pattern, scene(), folder.path("leg.ptu"),
                                              static_cast<double>(frames) * frame_s);
  FaultySource& source = *owned;
  test::MeasuredStream stream(config, std::move(owned), publisher, host_clock());
  Operator beside(stream, publisher.endpoint());
  Memory memory(frames);
  const auto began = steady_clock::now();
  stream.observe([&](const FrameMessage& frame, const std::string&) {
    memory.frame(frame.sequence);
    beside.frame(frame.sequence);
    show_progress(frame.sequence, frames, began);
    return true;
  });
  const StreamSummary summary = stream.run(signals.token());
  const std::chrono::duration<double> took = steady_clock::now() - began;
  reader.finish();
  std::fprintf(stderr, "\n");
  const Injected& injected = source.injected();
  std::printf("%s frames, from %s legs simulated and %s replayed: %.4f h of the scene in %.0f s\n",
              grouped(summary.frames).c_str(), grouped(injected.simulated_legs).c_str(),
              grouped(injected.replayed_legs).c_str(), injected.device_s / 3600, took.count());
  return report(summary, injected, reader, beside, memory, !signals.token().stop_requested());
}

}  // namespace
}  // namespace splid::soak

int main(int argc, char** argv) {
  CLI::App app{"A day of frames with faults sprinkled in", "soak"};
  std::uint64_t frames = splid::soak::day_frames;
  app.add_option("--frames", frames, "of 50 ms; rounded up to whole legs of 10 s")
      ->capture_default_str()
      ->check(CLI::Range(std::uint64_t{400}, std::uint64_t{100'000'000}));
  CLI11_PARSE(app, argc, argv);
  try {
    return splid::soak::soak(frames);
  } catch (const splid::Error& error) {
    std::fprintf(stderr, "soak: %s\n", error.what());
    return error.exit_code();
  }
}
