#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "drivers/simulator/scene.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "drivers/tag_writer.hpp"
#include "protocol/pattern.hpp"
#include "tests/support/tags16_block.hpp"
#include "tests/support/vector_sink.hpp"

namespace splid::test {

// A simulated scene as records of tags16: photons on input 1, syncs on 8. Begins anew when asked
// for its time 0.
class SceneRecords {
 public:
  SceneRecords(Pattern pattern, simulator::Options options)
      : pattern_(std::move(pattern)), options_(std::move(options)) {}

  std::vector<Tags16Record> operator()(std::int64_t begin_ps, std::int64_t end_ps) {
    if (begin_ps == 0) {
      scene_ = std::make_shared<simulator::Scene>(pattern_, options_);
      early_.clear();
    }
    VectorSink sink(1024);  // a millisecond of [P]'s light has some 450
    TagWriter writer(sink);
    scene_->write_until(end_ps, writer);
    writer.publish();
    std::vector<Tags16Record> records = std::exchange(early_, {});
    for (const Tag& tag : sink.tags) {
      if (tag.time_ps < begin_ps) continue;  // of a time that was left out
      const Tags16Record record{tag.time_ps, tag.kind == TagKind::sync ? 8 : 1};
      (record.time_ps < end_ps ? records : early_).push_back(record);
    }
    return records;
  }

 private:
  Pattern pattern_;
  simulator::Options options_;
  std::shared_ptr<simulator::Scene> scene_;  // shared, so that std::function can hold this
  std::vector<Tags16Record> early_;
};

// Tags of a bright scene, over and over, as fast as they are asked for: blocks of 1 ms, encoded
// once, their times and numbers moved on from one round to the next.
class SceneLoop {
 public:
  SceneLoop(SceneRecords scene, int blocks, int rounds) : rounds_(rounds) {
    for (int i = 0; i < blocks; ++i) {
      const std::int64_t begin_ps = i * block_ps;
      const auto records = scene(begin_ps, begin_ps + block_ps);
      tags_ += records.size();
      blocks_.push_back(block_bytes({0, begin_ps, begin_ps + block_ps, records}));
    }
  }

  // Of all rounds.
  [[nodiscard]] std::size_t tags() const { return tags_ * static_cast<std::size_t>(rounds_); }

  // As a StreamFirmware::Supply.
  std::size_t operator()(std::span<std::byte> room) {
    std::size_t written = 0;
    while (written < room.size()) {
      if (at_ == current_.size() && !next_block()) break;
      const std::size_t count = std::min(room.size() - written, current_.size() - at_);
      std::memcpy(room.data() + written, current_.data() + at_, count);
      written += count;
      at_ += count;
    }
    return written;
  }

 private:
  static constexpr std::int64_t block_ps = 1'000'000'000;

  bool next_block() {
    const auto count = blocks_.size();
    if (number_ == count * static_cast<std::size_t>(rounds_)) return false;
    const auto& block = blocks_[number_ % count];
    current_ = block;
    const auto shift_ps = static_cast<std::int64_t>(number_ / count * count) * block_ps;
    const auto sequence = static_cast<std::uint32_t>(number_++);
    std::memcpy(&current_[12], &sequence, sizeof sequence);
    for (const std::size_t place : {16, 24}) shift(&current_[place], shift_ps);
    for (std::size_t i = 32; i < current_.size(); i += 16) shift(&current_[i + 8], shift_ps);
    at_ = 0;
    return true;
  }

  static void shift(std::byte* time, std::int64_t by_ps) {
    std::int64_t time_ps = 0;
    std::memcpy(&time_ps, time, sizeof time_ps);
    time_ps += by_ps;
    std::memcpy(time, &time_ps, sizeof time_ps);
  }

  std::vector<std::vector<std::byte>> blocks_;
  std::vector<std::byte> current_;
  std::size_t at_ = 0;
  std::size_t number_ = 0;  // of the next block
  std::size_t tags_ = 0;
  int rounds_;
};

// 20 million photons a second, with the syncs of [P]'s pattern.
inline simulator::Options bright_scene() {
  simulator::Options options;
  options.ambient_per_s = 20e6;
  options.pace = simulator::Speed::max;
  return options;
}

}  // namespace splid::test
