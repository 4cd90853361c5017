#include "drivers/tags16_stream.hpp"

#include <utility>

namespace splid {
namespace {

struct CounterText {
  const char* name;
  const char* help;
};

constexpr std::array<CounterText, 7> counter_texts = {{
    {"splid_tags16_bytes_total", "Bytes received of the stream of blocks."},
    {"splid_tags16_blocks_total", "Whole blocks received."},
    {"splid_tags16_blocks_lost_total", "Blocks missing by their sequence numbers."},
    {"splid_tags16_blocks_damaged_total", "Blocks that were cut off."},
    {"splid_tags16_headers_bad_total", "Headers with a version, count or end that cannot be."},
    {"splid_tags16_tags_outside_total", "Tags with a time outside their block."},
    {"splid_tags16_bytes_skipped_total", "Bytes that belong to no block."},
}};

// How many tags a sink is asked to make room for: 1 MiB, some milliseconds of the fastest tagger.
constexpr std::size_t block_tags = 65'536;

// What went wrong from one count to the next, empty where nothing did.
std::string describe_damage(const Tags16Counts& before, const Tags16Counts& now) {
  std::string text;
  const auto add = [&](std::uint64_t was, std::uint64_t is, const char* what) {
    if (is > was) text += (text.empty() ? "" : ", ") + std::to_string(is - was) + what;
  };
  add(before.lost_blocks, now.lost_blocks, " blocks missing by their numbers");
  add(before.damaged_blocks, now.damaged_blocks, " blocks cut off");
  add(before.bad_headers, now.bad_headers, " headers that cannot be");
  add(before.outside_tags, now.outside_tags, " tags outside their block");
  add(before.skipped_bytes, now.skipped_bytes, " bytes that belong to no block");
  return text.empty() ? text : "tags were lost: " + text;
}

}  // namespace

std::string Tags16News::since_last(const Tags16Counts& counts, Time now) {
  if (now < next_look_) return {};
  next_look_ = now + between_looks;
  Tags16Counts told = std::exchange(told_, counts);
  if (told.blocks == 0) {
    // What was cut off or skipped may be the block in whose middle the stream began. Numbers are
    // missing only after a first block.
    told = counts;
    told.lost_blocks = 0;
  }
  std::string news = describe_damage(told, counts);
  if (!news.empty()) next_look_ = now + between_news;
  return news;
}

bool Tags16Stream::feed(std::span<const std::byte> bytes, TagSink& sink) {
  bool full = false;
  while (full || !bytes.empty()) {
    const std::span<Tag> room = sink.claim(block_tags);
    if (room.empty()) return false;
    const Tags16Decoder::Progress progress = decoder_.decode(bytes, room);
    note(progress.bytes);  // before publish(), so that whoever sees the tags sees them counted
    sink.publish(progress.tags);
    bytes = bytes.subspan(progress.bytes);
    full = progress.tags == room.size();
  }
  return true;
}

void Tags16Stream::cut() {
  decoder_.cut();
  note(0);
}

void Tags16Stream::note(std::uint64_t bytes) {
  counters_.add(bytes, noted_, decoder_.counts());
  noted_ = decoder_.counts();
}

void Tags16Counters::add(std::uint64_t bytes, const Tags16Counts& before, const Tags16Counts& now) {
  const std::array<std::uint64_t, kinds> risen = {
      bytes,
      now.blocks - before.blocks,
      now.lost_blocks - before.lost_blocks,
      now.damaged_blocks - before.damaged_blocks,
      now.bad_headers - before.bad_headers,
      now.outside_tags - before.outside_tags,
      now.skipped_bytes - before.skipped_bytes,
  };
  for (std::size_t i = 0; i < kinds; ++i) {
    values_[i].fetch_add(risen[i], std::memory_order_relaxed);
  }
}

std::vector<SourceCounter> Tags16Counters::list() const {
  std::vector<SourceCounter> all;
  for (std::size_t i = 0; i < kinds; ++i) {
    all.push_back({counter_texts[i].name,
                   {},
                   counter_texts[i].help,
                   values_[i].load(std::memory_order_relaxed)});
  }
  return all;
}

}  // namespace splid
