#include "daemon/batch/measure_part.hpp"

#include <fmt/core.h>
#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "daemon/base/sha256.hpp"
#include "daemon/recording/recording_facts.hpp"
#include "daemon/stream/open_source.hpp"
#include "daemon/study/replay_frames.hpp"
#include "drivers/replay/recording_reader.hpp"
#include "protocol/error.hpp"
#include "protocol/frame_columns.hpp"

namespace splid::batch {
namespace {

std::string file_of_part(const Part& part) {
  return fmt::format("part-{}-{}.json", part.begin, part.end);
}

// Takes the frames of a part in their order, and writes each slice when it is whole.
class SliceWriter {
 public:
  SliceWriter(const Folder& folder, const Recording& recording, const std::string& key,
              Slicing slicing, std::size_t pixels)
      : folder_(folder), recording_(recording), key_(key), slicing_(slicing), pixels_(pixels) {}

  void take(FrameMessage message) {
    const std::uint64_t number = message.sequence / slicing_.frames;
    if (number != number_) finish();
    number_ = number;
    // How long a frame took differs from run to run, and the bits of a batch must not.
    message.compute_ms.reset();
    message.latency_ms.reset();
    append_frame_row(message, rows_);
    ++taken_;
    if (taken_ % pixels_ == 0 && frames() == slicing_.frames) finish();
  }

  // The slice is whole, or the last of its recording.
  void finish() {
    if (taken_ > 0) folder_.write_slice(recording_, key_, {number_, frames()}, rows_);
    rows_.clear();
    taken_ = 0;
  }

 private:
  [[nodiscard]] std::uint64_t frames() const { return taken_ / pixels_; }

  const Folder& folder_;
  const Recording& recording_;
  const std::string& key_;
  Slicing slicing_;
  std::uint64_t number_ = 0;
  std::uint64_t pixels_;     // each has a row of each frame
  std::uint64_t taken_ = 0;  // rows
  std::string rows_;
};

}  // namespace

Meter::Meter(Config config, std::int64_t jobs, Slicing slicing)
    : config_(std::move(config)),
      encoder_(config_.encoder),
      pipeline_(config_.pipeline),
      jobs_(config_.estimator.tracked ? pipeline_.estimation_threads : jobs),
      slicing_(config_.estimator.tracked ? Slicing::whole() : slicing) {
  const recording::TableFacts facts = recording::table_facts(config_, "");
  facts_ = {facts.program, facts.config_json, facts.pattern_json, slicing_.frames};
}

bool Meter::is_measured(const Recording& recording, const Part& part, const Folder& folder) const {
  if (part.bytes() == 0) return true;
  const std::string key = Folder::key_of(facts_, recording);
  return folder.finished(recording, key).has_value() ||
         folder.read(recording, file_of_part(part), key).has_value();
}

// The configuration as a replay of that recording would have it.
void Meter::read_next(const Recording& recording) {
  config_.encoder = encoder_;
  config_.pipeline = pipeline_;
  read_from(recording.file, "", 0, config_);
}

bool Meter::measure(const Recording& recording, const Part& part, const Folder& folder,
                    const Reach& reach, const std::stop_token& stop) {
  if (is_measured(recording, part, folder)) return true;
  const std::string key = Folder::key_of(facts_, recording);
  read_next(recording);
  const recording::TableFacts facts = recording::table_facts(config_, recording.file);
  folder.write(recording, facts_of_table,
               {{"key", key},
                {"program", facts.program},
                {"configuration", facts.config_json},
                {"pattern", facts.pattern_json},
                {"recording", facts.recording}});
  std::string checksum;
  std::jthread summing;
  const bool is_first = part.begin == 0;
  if (is_first && !folder.read(recording, checksum_of_recording, key)) {
    summing = std::jthread([&checksum, &recording](const std::stop_token& enough) {
      pthread_setname_np(pthread_self(), "checksum");
      checksum = sha256_of_file(recording.file, enough).value_or("");
    });
  }
  if (!measure_slices(recording, part, folder, key, reach, stop)) return false;
  if (summing.joinable()) {
    const std::stop_callback pass_on(stop, [&summing] { summing.request_stop(); });
    summing.join();
    if (checksum.empty()) {
      if (stop.stop_requested()) return false;
      throw Error(Fault::data, recording.file + ": cannot be read to its end; check its disk");
    }
    folder.write(recording, checksum_of_recording, {{"key", key}, {"sha256", checksum}});
  }
  folder.write(recording, file_of_part(part), {{"key", key}});
  return true;
}

bool Meter::measure_slices(const Recording& recording, const Part& part, const Folder& folder,
                           const std::string& key, const Reach& reach,
                           const std::stop_token& stop) {
  std::set<std::uint64_t> measured;
  for (const SliceHead& slice : folder.slices(recording, key)) {
    if (slice.frames == slicing_.frames) measured.insert(slice.number);
  }
  const RecordingReader reader(recording.file, [](const std::string&) {});
  SliceChoice choice(slicing_, recording.bytes, part, std::move(measured),
                     reader.decoder().record_bytes());
  const std::size_t pixels = std::max<std::size_t>(1, config_.pixels.size());
  SliceWriter writer(folder, recording, key, slicing_, pixels);
  std::uint64_t frames = 0;
  std::atomic<std::uint64_t> wanted{0};  // frames; final once the part is passed
  std::uint64_t taken = 0;               // rows
  bool stopped = false;
  config_.pipeline.estimation_threads = jobs_;
  const auto take = [&](const FrameMessage& message) {
    // The last frame after a stop is cut short.
    if (!stopped) writer.take(message);
    ++taken;
  };
  const auto go_on = [&] {
    stopped = stop.stop_requested();
    reach(choice.position());
    // A stop cuts the frames short that are still on their way.
    return !stopped && !(choice.passed() && taken == wanted * pixels);
  };
  const auto wants = [&](const Frame& frame) {
    frames = frame.sequence + 1;
    const bool is_wanted = choice.wants(frame);
    wanted += is_wanted ? 1 : 0;
    return is_wanted;
  };
  recording::warn_of_other_pattern(config_, recording.file);
  measure_frames(config_, open_source(config_), take, go_on, wants);
  if (stopped) return false;
  writer.finish();
  if (!choice.passed()) {
    folder.write(recording, end_of_recording, {{"key", key}, {"frames", std::to_string(frames)}});
  }
  return true;
}

}  // namespace splid::batch
