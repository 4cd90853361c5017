#include "drivers/usb/ttm_decode.hpp"

#include <cstring>

namespace splid::usb {
namespace {

constexpr unsigned padding_word = 0x7FFF;
constexpr unsigned valid_bit = 0x8000;
constexpr unsigned flag_bit = 0x80;

constexpr unsigned what_more_count = 122, what_dropping = 123, what_laser = 124, what_pixel = 125,
                   what_line = 127;

constexpr std::uint32_t count_mask = (1U << 27U) - 1;
// 4,096 and what the instrument takes to notice.
constexpr std::uint32_t most_between_records = 4352;

// 53 days, half of the time that 64 bits of ps hold.
constexpr std::int64_t last_period = (std::int64_t{1} << 62U) / 12'500 * 3;

// A period is 12500/3 ps.
std::int64_t periods_to_ps(std::int64_t periods) {
  return periods / 3 * 12'500 + (periods % 3 * 12'500 + 1) / 3;
}

unsigned word_at(const std::byte* bytes) {
  return std::to_integer<unsigned>(bytes[0]) | std::to_integer<unsigned>(bytes[1]) << 8U;
}

// How many bytes from here on are padding, in whole groups of four words. Most of an idle
// instrument's stream is.
std::size_t padding_bytes(std::span<const std::byte> bytes) {
  constexpr std::uint64_t four_words = 0x7FFF'7FFF'7FFF'7FFFU;
  std::size_t used = 0;
  for (std::uint64_t words = 0; used + sizeof words <= bytes.size(); used += sizeof words) {
    std::memcpy(&words, bytes.data() + used, sizeof words);
    if (words != four_words) break;
  }
  return used;
}

}  // namespace

TtmDecoder::Progress TtmDecoder::decode(std::span<const std::byte> bytes, std::span<Tag> out) {
  std::size_t used = 0;
  Tag* tag = out.data();
  const Tag* const full = tag + out.size();
  while (bytes.size() - used >= word_bytes && full - tag >= std::ptrdiff_t{most_tags_a_word}) {
    const unsigned word = word_at(bytes.data() + used);
    if (word == padding_word) {
      const std::size_t more = padding_bytes(bytes.subspan(used));
      used += more == 0 ? word_bytes : more;
      continue;
    }
    used += word_bytes;
    tag = take(word, tag);
  }
  return {used, static_cast<std::size_t>(tag - out.data())};
}

std::optional<Tag> TtmDecoder::cut() {
  expected_ = lost;
  Tag begin;
  return begin_loss(&begin) == &begin ? std::nullopt : std::optional(begin);
}

void TtmDecoder::begin_record() {
  expected_ = 0;
  next_input_ = 0;
  hit_count_ = 0;
}

Tag* TtmDecoder::take(unsigned word, Tag* out) {
  const unsigned what = (word >> 8U) & 0x7FU;
  const bool ends = what == what_line && (word & valid_bit) != 0;
  if (expected_ == lost) {
    if (ends) begin_record();
    return out;
  }
  if (!take_part(what, word)) return break_off(out);
  return ends ? finish(out) : out;
}

// False where the word cannot follow those before it.
bool TtmDecoder::take_part(unsigned what, unsigned word) {
  const bool is_valid = (word & valid_bit) != 0;
  const auto data = static_cast<std::uint8_t>(word);
  if (expected_ == 0 && what < static_cast<unsigned>(inputs)) {
    if (static_cast<int>(what) < next_input_) return false;
    next_input_ = static_cast<int>(what) + 1;
    if (is_valid) hits_[hit_count_++] = {static_cast<std::uint8_t>(what), data};
    return true;
  }
  if (expected_ == 0 && what == what_more_count) return true;
  if (what == what_dropping && expected_ == 0 && is_valid) {
    is_dropping_ = (data & flag_bit) != 0;
    count_ = (data & 0x3FU) << 21U;
    expected_ = what_laser;
    return true;
  }
  if (what != expected_) return false;
  ++expected_;
  if (what == what_laser) {
    laser_ = is_valid ? std::optional(data) : std::nullopt;
    return true;
  }
  levels_.at(what - what_pixel) = (data & flag_bit) != 0;
  count_ |= (data & 0x7FU) << 7U * (what - what_pixel);
  return is_valid;
}

Tag* TtmDecoder::break_off(Tag* out) {
  ++faults_.broken;
  expected_ = lost;
  return begin_loss(out);
}

Tag* TtmDecoder::finish(Tag* out) {
  const bool is_first = records_++ == 0;
  out = go_to(count_, out);
  if (is_dropping_ && !was_dropping_) ++faults_.full;
  was_dropping_ = is_dropping_;
  if (is_first) before_ = levels_;
  const Tag* const events = out;
  for (const Hit& hit : std::span(hits_).first(hit_count_)) {
    *out++ = photon_tag(*reached_ps_ - fine_.at(hit.input).before_edge_ps(hit.code), hit.input);
  }
  if (laser_) *out++ = sync_tag(*reached_ps_ - fine_laser_.before_edge_ps(*laser_));
  const int markers = risen_markers();
  if (markers != 0) *out++ = marker_tag(*reached_ps_, markers);
  if (out == events) *out++ = heartbeat_tag(*reached_ps_);
  begin_record();
  return out;
}

// The time of the record, and the loss that begins or ends with it.
Tag* TtmDecoder::go_to(std::uint32_t count, Tag* out) {
  const std::uint32_t step = (count - latest_count_) & count_mask;
  const bool is_first = !reached_ps_;
  const bool is_gap = !is_first && step > most_between_records;
  const bool goes_on =
      !is_first && step != 0 && step <= count_mask / 2 && !(is_gap && doubts_count_);
  doubts_count_ = false;
  if (is_gap) {
    ++faults_.gaps;
    out = begin_loss(out);
  }
  if (is_dropping_) out = begin_loss(out);
  since_origin_ = goes_on ? since_origin_ + step : count;
  const bool is_worn = goes_on && since_origin_ > last_period;
  if (is_worn) since_origin_ = count;
  if ((!goes_on && !is_first) || is_worn) {
    out = begin_loss(out);
    *out++ = {*reached_ps_, -1, TagKind::loss_end, {}};
    *out++ = {*reached_ps_, 0, TagKind::clock_break, {}};
    loss_open_ = false;
  }
  latest_count_ = count;
  reached_ps_ = periods_to_ps(since_origin_);
  if (is_dropping_) {
    out = begin_loss(out);
  } else if (loss_open_) {
    // Photons of this record are up to a period before it.
    *out++ = {periods_to_ps(since_origin_ - 1), -1, TagKind::loss_end, {}};
    loss_open_ = false;
  }
  return out;
}

Tag* TtmDecoder::begin_loss(Tag* out) {
  if (loss_open_ || !reached_ps_) return out;
  loss_open_ = true;
  *out++ = {*reached_ps_, 0, TagKind::loss_begin, {}};
  return out;
}

int TtmDecoder::risen_markers() {
  const auto [pixel_rose, frame, line_level] = levels_;
  const int markers =
      (pixel_rose ? 1 : 0) | (line_level && !before_[2] ? 2 : 0) | (frame && !before_[1] ? 4 : 0);
  before_ = levels_;
  return markers;
}

}  // namespace splid::usb
