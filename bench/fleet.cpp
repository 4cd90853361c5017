// Many sensors into one JetStream of this machine: each is a publisher of frames with a `splid
// forward` of its own, beside one nats-server and one subscriber. Prints a row of
// docs/evidence/data/fleet.csv for each argument.
//
//   build/release/bench/fleet [SENSORS:FRAMES_PER_S:SECONDS...]
//
// By default 16, 32 and 64 sensors at 20 frames/s for 20 s, and 64 at 200 frames/s for 60 s: ten
// times as fast. Exit code 1 where a frame is missing, comes twice or out of order.

#include <fmt/core.h>
#include <nats/nats.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "daemon/base/clock.hpp"
#include "daemon/output/publisher.hpp"
#include "protocol/frame_json.hpp"
#include "tests/support/broker.hpp"

namespace splid {
namespace {

struct Load {
  int sensors = 0;
  int rate = 0;  // frames a second of each
  int seconds = 0;
};

// A frame with all that one of [P]'s set-up has.
FrameMessage frame_of(std::uint64_t sequence) {
  FrameMessage frame;
  frame.timestamp_s = host_clock().unix_s();
  frame.sequence = sequence;
  frame.status = FrameStatus::ok;
  frame.mode = Mode::interleaved;
  frame.start_ps = static_cast<std::int64_t>(sequence) * 50'000'000'000;
  frame.duration_ms = 49.99806;
  frame.distance_m = 123.456789, frame.std_distance_m = 0.00123456;
  frame.velocity_mps = 12.3456789, frame.std_velocity_mps = 0.0123456;
  frame.signal_per_pulse = 0.00134567, frame.std_signal_per_pulse = 2.34567e-5;
  frame.background_per_s = 174567.89, frame.std_background_per_s = 1876.54;
  frame.signal_per_period = 0.0538268, frame.background_per_period = 0.65986;
  frame.sbr = 0.0815, frame.delay_ns = 823.456789, frame.significance = 4321.987;
  frame.range_odds_nats = 2345.678;
  return frame;
}

// Hears all frames, and knows which should come next.
class Hearer {
 public:
  explicit Hearer(const test::Broker& broker) {
    jsSubOptions options;
    jsSubOptions_Init(&options);
    options.Ordered = true;
    // The first sensor that connects makes the stream.
    const bool is_there = test::eventually([&] {
      if (connection_ == nullptr) natsConnection_ConnectTo(&connection_, broker.address().c_str());
      if (connection_ != nullptr && context_ == nullptr) {
        natsConnection_JetStream(&context_, connection_, nullptr);
      }
      return context_ != nullptr && js_Subscribe(&subscription_, context_, "splid.*.frame", hear,
                                                 this, nullptr, &options, nullptr) == NATS_OK;
    });
    if (!is_there) throw std::runtime_error("no stream to hear");
    natsSubscription_SetPendingLimits(subscription_, -1, -1);
  }
  ~Hearer() {
    natsConnection_Close(connection_);  // ends its thread, which would use a destroyed subscription
    natsSubscription_Destroy(subscription_);
    jsCtx_Destroy(context_);
    natsConnection_Destroy(connection_);
  }
  Hearer(const Hearer&) = delete;
  Hearer& operator=(const Hearer&) = delete;

  std::atomic<std::uint64_t> frames = 0;
  std::uint64_t wrong = 0;  // not the one after the last one of its sensor
  std::vector<double> latencies_ms;

 private:
  static void hear(natsConnection* /*connection*/, natsSubscription* /*subscription*/,
                   natsMsg* message, void* self) {
    static_cast<Hearer*>(self)->take(message);
    natsMsg_Destroy(message);
  }
  void take(natsMsg* message) {
    const double now_s = host_clock().unix_s();
    const auto json = nlohmann::json::parse(natsMsg_GetData(message));
    latencies_ms.push_back((now_s - json["timestamp"].get<double>()) * 1e3);
    if (json["sequence"] != next_[natsMsg_GetSubject(message)]++) ++wrong;
    ++frames;
  }

  natsConnection* connection_ = nullptr;
  jsCtx* context_ = nullptr;
  natsSubscription* subscription_ = nullptr;
  std::map<std::string, std::uint64_t> next_;
};

// Processor time of a process that runs.
double processor_s(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  std::string word;
  std::getline(file, word, ')');
  double ticks = 0;
  for (int field = 3; field <= 15 && file >> word; ++field) {
    if (field >= 14) ticks += std::stod(word);
  }
  return ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

struct Fleet {
  Fleet(const test::Broker& broker, int sensors) {
    for (int i = 0; i < sensors; ++i) {
      const std::string endpoint = "ipc://" + folder.path(std::to_string(i));
      publishers.push_back(std::make_unique<Publisher>(endpoint, 100'000));
      forwards.push_back(std::make_unique<test::Program>(std::vector<std::string>{
          "forward", "--endpoint", endpoint, "--to", broker.address(), "--device",
          "sensor-" + std::to_string(i), "--topics", "frame"}));
    }
    for (const auto& publisher : publishers) publisher->wait_for_subscriber(test::patience);
  }

  // The sensors take turns, evenly in time. How many frames each sent.
  std::uint64_t publish(const Load& load) const {
    using Clock = std::chrono::steady_clock;
    const auto begin = Clock::now();
    const auto count = static_cast<std::uint64_t>(load.rate) * static_cast<unsigned>(load.seconds);
    const std::chrono::duration<double> step(1.0 / load.rate / load.sensors);
    for (std::uint64_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < publishers.size(); ++k) {
        const auto turn = static_cast<double>(i * publishers.size() + k);
        std::this_thread::sleep_until(begin +
                                      std::chrono::duration_cast<Clock::duration>(step * turn));
        publishers[k]->publish_frame(to_json(frame_of(i)));
      }
    }
    return count * publishers.size();
  }

  [[nodiscard]] double forwards_s() const {
    double sum_s = 0;
    for (const auto& forward : forwards) sum_s += processor_s(forward->id());
    return sum_s;
  }

  test::TempFolder folder;
  std::vector<std::unique_ptr<Publisher>> publishers;
  std::vector<std::unique_ptr<test::Program>> forwards;
};

bool measure(const Load& load) {
  test::Broker broker("nats-server");
  broker.start();
  Fleet fleet(broker, load.sensors);
  Hearer hearer(broker);
  const double broker_begin_s = processor_s(broker.id());
  const double begin_s = fleet.forwards_s();
  const std::uint64_t sent = fleet.publish(load);
  test::eventually([&] { return hearer.frames >= sent; });
  const double broker_s = processor_s(broker.id()) - broker_begin_s;
  const double forward_s = fleet.forwards_s() - begin_s;
  std::vector<double>& latencies = hearer.latencies_ms;
  std::sort(latencies.begin(), latencies.end());
  const auto quantile = [&](double part) {
    return latencies.empty() ? 0.0
                             : latencies[static_cast<std::size_t>(
                                   part * static_cast<double>(latencies.size() - 1))];
  };
  const double all_frames = static_cast<double>(sent);
  fmt::print("| {} | {} | {} | {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.0f} | {:.0f} |\n",
             load.sensors, load.rate, sent, hearer.frames.load(), hearer.wrong, quantile(0.5),
             quantile(0.99), quantile(1), forward_s * 1e6 / all_frames,
             broker_s * 1e6 / all_frames);
  std::fflush(stdout);
  return hearer.frames == sent && hearer.wrong == 0;
}

}  // namespace
}  // namespace splid

int main(int argc, char** argv) {
  if (splid::test::installed("nats-server").empty()) {
    std::fprintf(stderr, "fleet: nats-server is not installed (scripts/setup)\n");
    return 2;
  }
  std::vector<splid::Load> loads;
  for (int i = 1; i < argc; ++i) {
    splid::Load load;
    if (std::sscanf(argv[i], "%d:%d:%d", &load.sensors, &load.rate, &load.seconds) != 3) {
      std::fprintf(stderr, "usage: fleet [SENSORS:FRAMES_PER_S:SECONDS...]\n");
      return 2;
    }
    loads.push_back(load);
  }
  if (loads.empty()) loads = {{16, 20, 20}, {32, 20, 20}, {64, 20, 20}, {64, 200, 60}};
  fmt::print(
      "| sensors | frames/s of each | frames sent | frames stored | out of order or twice | "
      "latency: median, ms | 99 %, ms "
      "| largest, ms | forward, us of processor a frame | broker, us of processor a frame |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n");
  bool is_whole = true;
  for (const splid::Load& load : loads) is_whole = splid::measure(load) && is_whole;
  return is_whole ? 0 : 1;
}
