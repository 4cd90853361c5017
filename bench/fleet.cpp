// Many sensors into one JetStream of this machine: each is a publisher of frames with a `splid
// forward` of its own, beside one nats-server and one subscriber. Prints a row of
// docs/evidence/data/fleet.csv for each argument.
//
//   build/release/bench/fleet [SENSORS:FRAMES_PER_S:SECONDS[:AT_ONCE]...]
//
// By default 16, 32 and 64 sensors at 20 frames/s for 20 s, and 64 at 200 frames/s for 60 s: ten
// times as fast. A sensor sends AT_ONCE frames in each of its turns, by default 1. The subscriber
// lets the stream forget what it has heard, and sensors wait while it is 100,000 frames behind.
// Exit code 1 where a frame is missing, comes twice or out of order; 2 for a wrong argument.

#include <fmt/core.h>
#include <nats/nats.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/base/clock.hpp"
#include "daemon/output/publisher.hpp"
#include "protocol/frame_json.hpp"
#include "tests/support/broker.hpp"

namespace splid {
namespace {

using namespace std::chrono_literals;

struct Load {
  int sensors = 0;
  int rate = 0;  // frames a second of each
  int seconds = 0;
  std::uint64_t at_once = 1;  // frames in each turn of a sensor
};

constexpr std::uint64_t most_on_the_way = 100'000;  // frames of all sensors
constexpr std::uint64_t most_kept = 1'000'000;      // a day would fill the disk

// Frames with all that one of [P]'s set-up has. Only time and sequence change, so that the text is
// made once: a sensor's own processor makes it where a fleet is real.
class FrameTexts {
 public:
  FrameTexts() {
    FrameMessage frame;
    frame.timestamp_s = 0.25;
    frame.sequence = 987654321;
    frame.status = FrameStatus::ok;
    frame.mode = Mode::interleaved;
    frame.start_ps = 50'000'000'000;
    frame.duration_ms = 49.99806;
    frame.distance_m = 123.456789, frame.std_distance_m = 0.00123456;
    frame.velocity_mps = 12.3456789, frame.std_velocity_mps = 0.0123456;
    frame.signal_per_pulse = 0.00134567, frame.std_signal_per_pulse = 2.34567e-5;
    frame.background_per_s = 174567.89, frame.std_background_per_s = 1876.54;
    frame.signal_per_period = 0.0538268, frame.background_per_period = 0.65986;
    frame.sbr = 0.0815, frame.delay_ns = 823.456789, frame.significance = 4321.987;
    frame.range_odds_nats = 2345.678;
    const std::string text = to_json(frame);
    const std::size_t time = text.find("0.25"), sequence = text.find("987654321");
    head_ = text.substr(0, time);
    between_ = text.substr(time + 4, sequence - time - 4);
    tail_ = text.substr(sequence + 9);
  }
  [[nodiscard]] std::string text(std::uint64_t sequence) const {
    return fmt::format("{}{:.6f}{}{}{}", head_, host_clock().unix_s(), between_, sequence, tail_);
  }

 private:
  std::string head_, between_, tail_;
};

// Hears all frames, and knows which should come next.
class Hearer {
 public:
  explicit Hearer(const test::Broker& broker) {
    jsSubOptions options;
    jsSubOptions_Init(&options);
    options.Ordered = true;
    options.Config.HeadersOnly = true;
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

  // The stream keeps what is on the way, and more.
  void forget_heard() {
    if (frames < forgot_at_ + most_kept) return;
    forgot_at_ = frames;
    jsOptions options;
    jsOptions_Init(&options);
    options.Stream.Purge.Keep = 2 * most_on_the_way;
    js_PurgeStream(context_, "SPLID", &options, nullptr);
  }

  std::atomic<std::uint64_t> frames = 0;
  std::uint64_t wrong = 0;  // not the one after the last one of its sensor
  std::vector<double> latencies_ms;

 private:
  static void hear(natsConnection* /*connection*/, natsSubscription* /*subscription*/,
                   natsMsg* message, void* self) {
    static_cast<Hearer*>(self)->take(message);
    natsMsg_Destroy(message);
  }
  // Of a message's id, DEVICE/frame/SEQUENCE/TIMESTAMP, which says all that is to be known.
  void take(natsMsg* message) {
    const double now_s = host_clock().unix_s();
    const char* id = nullptr;
    natsMsgHeader_Get(message, "Nats-Msg-Id", &id);
    int device = 0;
    std::uint64_t sequence = 0;
    double sent_s = 0;
    if (id == nullptr ||
        std::sscanf(id, "sensor-%d/frame/%" SCNu64 "/%lf", &device, &sequence, &sent_s) != 3) {
      ++wrong;
      return;
    }
    latencies_ms.push_back((now_s - sent_s) * 1e3);
    if (sequence != next_[device]++) ++wrong;
    ++frames;
  }

  natsConnection* connection_ = nullptr;
  jsCtx* context_ = nullptr;
  natsSubscription* subscription_ = nullptr;
  std::map<int, std::uint64_t> next_;
  std::uint64_t forgot_at_ = 0;
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

// To a terminal or a log, every 10 s.
void tell_progress(std::uint64_t heard, std::uint64_t all) {
  static auto next = std::chrono::steady_clock::now() + 10s;
  if (std::chrono::steady_clock::now() < next) return;
  next += 10s;
  fmt::print(stderr, "{} of {} frames heard\n", heard, all);
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

  // The sensors take turns, evenly in time. How many frames all of them sent.
  std::uint64_t publish(const Load& load, Hearer& hearer) const {
    using Clock = std::chrono::steady_clock;
    const auto begin = Clock::now();
    const auto count = static_cast<std::uint64_t>(load.rate) * static_cast<unsigned>(load.seconds);
    const std::chrono::duration<double> step(1.0 / load.rate / load.sensors);
    const FrameTexts texts;
    std::uint64_t sent = 0;
    for (std::uint64_t first = 0; first < count; first += load.at_once) {
      const std::uint64_t end = std::min(first + load.at_once, count);
      for (const auto& publisher : publishers) {
        std::this_thread::sleep_until(
            begin + std::chrono::duration_cast<Clock::duration>(step * static_cast<double>(sent)));
        if (!test::eventually([&] { return sent <= hearer.frames + most_on_the_way; })) return sent;
        for (std::uint64_t i = first; i < end; ++i) publisher->publish_frame(texts.text(i));
        sent += end - first;
      }
      hearer.forget_heard();
      tell_progress(hearer.frames, count * publishers.size());
    }
    return sent;
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
  const std::uint64_t sent = fleet.publish(load, hearer);
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
    if (std::sscanf(argv[i], "%d:%d:%d:%" SCNu64, &load.sensors, &load.rate, &load.seconds,
                    &load.at_once) < 3 ||
        load.sensors < 1 || load.rate < 1 || load.seconds < 1 || load.at_once < 1) {
      std::fprintf(stderr, "usage: fleet [SENSORS:FRAMES_PER_S:SECONDS[:AT_ONCE]...]\n");
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
