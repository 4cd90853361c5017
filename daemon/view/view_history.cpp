#include "daemon/view/view_history.hpp"

#include <fmt/core.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace splid::view {
namespace {

// deviation: 0 where it is not known.
void widen(History::Reach& reach, const std::optional<double>& value, double deviation = 0) {
  if (!value || !std::isfinite(*value) || !std::isfinite(deviation)) return;
  const double low = *value - deviation;
  const double high = *value + deviation;
  reach.low = reach.count == 0 ? low : std::min(reach.low, low);
  reach.high = reach.count == 0 ? high : std::max(reach.high, high);
  reach.sum += *value;
  ++reach.count;
}

std::optional<double> photons_per_s(const FrameMessage& frame) {
  const double seen_s = frame.duration_ms / 1e3 * frame.seen_fraction.value_or(1);
  if (!frame.photons || !(seen_s > 0)) return std::nullopt;
  return static_cast<double>(*frame.photons) / seen_s;
}

std::optional<double> signal_per_s(const FrameMessage& frame) {
  if (!frame.signal_per_period || !frame.sync || !frame.sync->period_ps) return std::nullopt;
  if (!(*frame.sync->period_ps > 0)) return std::nullopt;
  return *frame.signal_per_period / (*frame.sync->period_ps * 1e-12);
}

void add_values(History::Bin& bin, const FrameMessage& frame, double ring_fill_ratio) {
  const auto at = [&](Series series) -> History::Reach& {
    return bin.series.at(static_cast<std::size_t>(series));
  };
  if (frame.valid()) {
    widen(at(Series::distance), frame.distance_m, frame.std_distance_m.value_or(0));
    widen(at(Series::velocity), frame.velocity_mps, frame.std_velocity_mps.value_or(0));
    widen(at(Series::signal), frame.signal_per_pulse, frame.std_signal_per_pulse.value_or(0));
    widen(at(Series::sbr), frame.sbr);
    widen(at(Series::signal_rate), signal_per_s(frame));
  }
  if (frame.reference) {
    widen(at(Series::reference_distance), frame.reference->distance_m);
    widen(at(Series::reference_velocity), frame.reference->velocity_mps);
  }
  if (frame.sync) {
    widen(at(Series::drift), frame.sync->drift_ppm);
    widen(at(Series::jitter), frame.sync->jitter_ps);
  }
  widen(at(Series::background), frame.background_per_s, frame.std_background_per_s.value_or(0));
  widen(at(Series::latency), frame.latency_ms);
  widen(at(Series::ring), ring_fill_ratio);
  widen(at(Series::count_rate), photons_per_s(frame));
}

void write(std::string& to, const History::Reach& reach) {
  auto out = std::back_inserter(to);
  const double mean = reach.sum / static_cast<double>(reach.count);
  if (reach.count == 0) {
    to += ",0";
  } else if (reach.low == reach.high) {
    fmt::format_to(out, ",[{:.10g}]", mean);
  } else {
    fmt::format_to(out, ",[{:.10g},{:.10g},{:.10g}]", reach.low, mean, reach.high);
  }
}

}  // namespace

History::Bin& History::bin_at(double timestamp_s) {
  const auto number = static_cast<std::int64_t>(std::floor(timestamp_s / width_s_));
  const double end_s =
      bins_.empty() ? timestamp_s : static_cast<double>(bins_.back().number) * width_s_;
  if (timestamp_s < end_s - 1) {
    bins_.clear();
    ++epoch_;
  }
  // A clock that was set back a little goes on in the last bin.
  if (bins_.empty() || number > bins_.back().number) bins_.push_back({number, 0, 0, 0, {}, {}});
  while (bins_.front().number <= bins_.back().number - most_bins) bins_.pop_front();
  return bins_.back();
}

void History::add(const FrameMessage& frame, double ring_fill_ratio) {
  constexpr double latest_s = 1e12;  // beyond any date, and within an integer
  if (!(std::abs(frame.timestamp_s) < latest_s)) return;
  Bin& bin = bin_at(frame.timestamp_s);
  bin.change = ++change_;
  ++bin.frames;
  if (frame.valid()) ++bin.valid;
  if (frame.status != FrameStatus::ok && (!frame.valid() || bin.worst == FrameStatus::not_run)) {
    bin.worst = frame.status;
  }
  add_values(bin, frame, ring_fill_ratio);
}

std::optional<double> History::best(Series series) const {
  std::optional<double> best;
  for (const Bin& bin : bins_) {
    const Reach& reach = bin.series.at(static_cast<std::size_t>(series));
    if (reach.count > 0) best = std::max(best.value_or(reach.high), reach.high);
  }
  return best;
}

std::string History::rows_after(std::uint64_t change) const {
  auto first = bins_.end();
  while (first != bins_.begin() && std::prev(first)->change > change) --first;
  std::string rows = "[";
  for (; first != bins_.end(); ++first) {
    const FrameStatus status =
        first->worst == FrameStatus::not_run ? FrameStatus::ok : first->worst;
    fmt::format_to(std::back_inserter(rows), "{}[{},{},{},{}", rows.size() > 1 ? "," : "",
                   first->number, first->frames, first->valid, static_cast<int>(status));
    for (const Reach& reach : first->series) write(rows, reach);
    rows += ']';
  }
  return rows + "]";
}

}  // namespace splid::view
