#include "drivers/simulator/scanner.hpp"

#include <algorithm>
#include <cmath>

namespace splid::simulator {
namespace {

std::int64_t ps_of(double ms) { return std::llround(ms * 1e9); }

}  // namespace

Scanner::Scanner(const ScannerOptions& options, std::int64_t columns, std::int64_t rows)
    : columns_(columns),
      rows_(rows),
      dwell_ps_(std::max<std::int64_t>(1, ps_of(options.dwell_ms))),
      line_ps_(columns * dwell_ps_ + ps_of(options.return_ms)),
      start_ps_(ps_of(options.start_ms)),
      both_ways_(options.both_ways),
      start_bits_(static_cast<int>(options.line_start_marker)),
      stop_bits_(static_cast<int>(options.line_stop_marker)),
      frame_bits_(static_cast<int>(options.frame_marker)),
      marker_{start_ps_, line_start_bits(0)} {
  while (marker_.time_ps < 0) take_marker();
}

int Scanner::line_start_bits(std::int64_t line) const {
  return line % rows_ == 0 ? start_bits_ | frame_bits_ : start_bits_;
}

std::optional<std::size_t> Scanner::pixel_at(std::int64_t time_ps) const {
  const std::int64_t since_ps = time_ps - start_ps_;
  if (since_ps < 0) return std::nullopt;
  const std::int64_t dwell = since_ps % line_ps_ / dwell_ps_;
  if (dwell >= columns_) return std::nullopt;
  const std::int64_t row = since_ps / line_ps_ % rows_;
  return static_cast<std::size_t>(row * columns_ + turned(row, dwell));
}

std::int64_t Scanner::turned(std::int64_t row, std::int64_t column) const {
  return both_ways_ && row % 2 == 1 ? columns_ - 1 - column : column;
}

std::int64_t Scanner::first_middle_ps(std::size_t pixel) const {
  const std::int64_t row = static_cast<std::int64_t>(pixel) / columns_;
  const std::int64_t column = static_cast<std::int64_t>(pixel) % columns_;
  const std::int64_t middle_ps =
      start_ps_ + row * line_ps_ + turned(row, column) * dwell_ps_ + dwell_ps_ / 2;
  if (middle_ps >= 0) return middle_ps;
  const std::int64_t late_ps = middle_ps % picture_ps();
  return late_ps == 0 ? 0 : late_ps + picture_ps();
}

ScanLines Scanner::lines() const {
  return {start_bits_, stop_bits_, columns_, frame_bits_, rows_, both_ways_, 0};
}

void Scanner::take_marker() {
  if (marker_.bits == stop_bits_) {
    ++line_;
    marker_ = {start_ps_ + line_ * line_ps_, line_start_bits(line_)};
  } else {
    marker_ = {start_ps_ + line_ * line_ps_ + columns_ * dwell_ps_, stop_bits_};
  }
}

}  // namespace splid::simulator
