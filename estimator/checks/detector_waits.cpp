#include "estimator/checks/detector_waits.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "estimator/checks/findings.hpp"
#include "estimator/model/chance.hpp"
#include "estimator/model/units.hpp"
#include "protocol/saturated.hpp"

namespace splid::checks {
namespace {

constexpr double leak = 0.01;              // detections in a dead time, of those without
constexpr double control_from_ps = 20e6;   // behind the longest wait that is counted
constexpr double longest_early_ns = 1000;  // after the dead time: afterpulses come by then
constexpr double late_windows = 4;         // beside the excess until so much later
constexpr double plateau = 1.5;            // light that changes fast is bunched so much more early
constexpr double long_wait_ns = 2000;
constexpr double fewest_returns = 30;
constexpr double pulses_after_dead_time = 8;  // pulse widths after the dead time, which cuts pulses
constexpr double waits_too_short = 0.9, waits_too_long = 1.05;  // of the configured dead time

// What zero or few counts say against `expected`: the log-likelihood of a rate `leak` of theirs.
double nats_of_dark(double counted, double expected) {
  return expected * (1 - leak) + counted * std::log(leak);
}

}  // namespace

std::size_t DetectorWaits::bin_of(std::int64_t wait_ps) {
  if (wait_ps < std::int64_t{1} << first_octave) return 0;
  const int octave = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(wait_ps))) - 1;
  if (octave >= first_octave + octaves) return bins - 1;
  const auto part = static_cast<std::size_t>(wait_ps >> (octave - per_octave_bits)) -
                    (std::size_t{1} << per_octave_bits);
  return 1 + (static_cast<std::size_t>(octave - first_octave) << per_octave_bits) + part;
}

double DetectorWaits::begin_ns(std::size_t bin) {
  if (bin == 0) return 0;
  constexpr std::size_t parts = std::size_t{1} << per_octave_bits;
  const double octave = std::ldexp(1, first_octave + static_cast<int>((bin - 1) / parts));
  return octave * (1 + static_cast<double>((bin - 1) % parts) / parts) * ns_per_ps;
}

void DetectorWaits::add(std::span<const std::int64_t> times_ps, double period_ps) {
  if (times_ps.size() < 2) return;
  const std::int64_t lag_ps = std::llround(std::ceil(control_from_ps / period_ps) * period_ps);
  seen_ns_ +=
      static_cast<double>(saturated_difference(times_ps.back(), times_ps.front())) * ns_per_ps;
  detections_ += static_cast<double>(times_ps.size() - 1);
  std::size_t next = 0;
  for (std::size_t i = 0; i + 1 < times_ps.size(); ++i) {
    const std::int64_t from_ps = saturated_sum(times_ps[i], lag_ps);
    while (next < times_ps.size() && times_ps[next] <= from_ps) ++next;
    if (next == times_ps.size()) return;
    const std::int64_t wait_ps = saturated_difference(times_ps[i + 1], times_ps[i]);
    const std::size_t bin = bin_of(wait_ps);
    const double wait_ns = static_cast<double>(wait_ps) * ns_per_ps;
    least_ns_[bin] = after_[bin] > 0 ? std::min(least_ns_[bin], wait_ns) : wait_ns;
    after_[bin] += 1;
    control_[bin_of(times_ps[next] - from_ps)] += 1;
  }
}

void DetectorWaits::add_return(std::int64_t wait_ps, double offset_ns, double share) {
  Returns& row = returns_[bin_of(wait_ps) / bins_a_row];
  row.count += 1, row.sum += offset_ns, row.squares += offset_ns * offset_ns;
  row.waits_ns += static_cast<double>(wait_ps) * ns_per_ps;
  share_sum_ += share, share_count_ += 1;
}

// The bins that are best taken as empty.
DetectorWaits::SeenDeadTime DetectorWaits::seen_dead_time() const {
  SeenDeadTime best;
  double nats = 0;
  for (std::size_t bin = 0; bin + 1 < bins; ++bin) {
    nats += nats_of_dark(after_[bin], control_[bin]);
    if (nats > best.gain_nats) best.gain_nats = nats, best.end = bin + 1;
  }
  if (best.end == 0) return best;
  std::size_t bin = best.end;
  while (bin + 1 < bins && after_[bin] == 0) ++bin;
  best.ns = after_[bin] > 0 ? least_ns_[bin] : begin_ns(bin);
  // Light that comes at an even rate has its first detection so late after the dead time.
  best.std_ns = (begin_ns(bin + 1) - begin_ns(bin)) / std::max(1.0, after_[bin]);
  return best;
}

void DetectorWaits::find_dead_time(FoundList& found, double detections_a_frame) const {
  const SeenDeadTime seen = seen_dead_time();
  const double per_ns = detections_ / seen_ns_;
  const double lost = per_ns * (seen.ns - dead_time_ns_);
  if (seen.gain_nats >= certain_nats && seen.ns > waits_too_long * dead_time_ns_) {
    if (lost * std::sqrt(detections_a_frame) < least_that_matters) return;
    return found.add({FindingName::dead_time, seen.ns, seen.std_ns, seen.gain_nats});
  }
  // Detections within the configured dead time.
  double counted = 0, expected = 0;
  for (std::size_t bin = 0; bin + 1 < bins; ++bin) {
    if (begin_ns(bin + 1) > waits_too_short * dead_time_ns_) break;
    counted += after_[bin], expected += control_[bin];
  }
  if (!(counted > 0) || -lost * std::sqrt(detections_a_frame) < least_that_matters) return;
  const double dark = std::max(leak * expected, leak);
  const double nats = counted * std::log(counted / dark) - counted + dark;
  if (counted < dark || nats < certain_nats) return;
  found.add({FindingName::dead_time, seen.ns, seen.std_ns, nats});
}

// The share of detections with an afterpulse that comes by early_ns after live_from_ns.
DetectorWaits::Share DetectorWaits::share_by(double live_from_ns, double early_ns) const {
  std::size_t bin = 0;
  while (bin + 1 < bins && begin_ns(bin) < live_from_ns) ++bin;
  const double from_ns = begin_ns(bin);
  double waiting_after = 0, waiting_control = 0;
  for (std::size_t k = bin; k < bins; ++k) {
    waiting_after += after_[k], waiting_control += control_[k];
  }
  Share early, late;
  for (; bin + 1 < bins && begin_ns(bin + 1) < from_ns + late_windows * early_ns; ++bin) {
    if (!(waiting_after > 0) || !(waiting_control > 0)) break;
    Share& part = begin_ns(bin) < from_ns + early_ns ? early : late;
    part.value += after_[bin] / waiting_after - control_[bin] / waiting_control;
    part.variance += after_[bin] / (waiting_after * waiting_after) +
                     control_[bin] / (waiting_control * waiting_control);
    waiting_after -= after_[bin], waiting_control -= control_[bin];
  }
  const double part = plateau / (late_windows - 1);
  return {early.value - part * std::max(0.0, late.value),
          early.variance + part * part * late.variance};
}

void DetectorWaits::find_afterpulses(FoundList& found, double detections_a_frame) const {
  const double live_from_ns = std::max(seen_dead_time().ns, dead_time_ns_);
  double nats = 0;
  Share share;
  for (const double early_ns : {62.5, 250.0, longest_early_ns}) {
    const Share one = share_by(live_from_ns, early_ns);
    if (!(one.value > 0) || one.value * one.value / 2 <= nats * one.variance) continue;
    nats = one.value * one.value / one.variance / 2;
    share = share_by(live_from_ns, std::min(late_windows * early_ns, longest_early_ns));
  }
  if (nats < certain_nats || share.value * std::sqrt(detections_a_frame) < least_that_matters)
    return;
  found.add({FindingName::afterpulsing, share.value, std::sqrt(share.variance), nats});
}

DetectorWaits::Lateness DetectorWaits::lateness(double pulse_ns) const {
  // A pulse in which the dead time ends shows its late part only.
  const double from_ns =
      std::max(seen_dead_time().ns, dead_time_ns_) + pulses_after_dead_time * pulse_ns;
  Lateness all;
  Returns slow;
  const auto row_ns = [](std::size_t row) {
    return begin_ns(std::min(row * bins_a_row, bins - 1));
  };
  const double share = share_count_ > 0 ? share_sum_ / share_count_ : 1;
  for (std::size_t row = 0; row < most_rows; ++row) {
    const Returns& one = returns_[row];
    all.returns += one.count, all.variance += one.squares;
    if (row_ns(row) < long_wait_ns) continue;
    slow.count += one.count, slow.sum += one.sum;
  }
  if (slow.count < fewest_returns) return all;
  all.variance /= all.returns;
  const double rest_ns = slow.sum / slow.count;
  for (std::size_t row = 0; row < most_rows && row_ns(row) < long_wait_ns; ++row) {
    const Returns& one = returns_[row];
    if (row_ns(row) < from_ns || one.count < fewest_returns) continue;
    all.rows[all.count++] = {one.waits_ns / one.count, one.count,
                             (one.sum / one.count - rest_ns) / share,
                             std::sqrt(all.variance * (1 / one.count + 1 / slow.count)) / share};
  }
  return all;
}

void DetectorWaits::find_walk(FoundList& found, double detections_a_frame, double pulse_ns) const {
  const Lateness all = lateness(pulse_ns);
  double squares = 0, moved_ns = 0;
  const Late* latest = nullptr;
  for (std::size_t k = 0; k < all.count; ++k) {
    const Late& row = all.rows[k];
    squares += row.by_ns * row.by_ns / (row.std_ns * row.std_ns);
    moved_ns += row.by_ns * row.count / all.returns;
    if (latest == nullptr || row.sure_ns() > latest->sure_ns()) latest = &row;
  }
  if (latest == nullptr) return;
  const double nats =
      (squares - sure_squares_of(static_cast<double>(all.count)) + sure_squares) / 2;
  const double returns_a_frame = detections_a_frame * all.returns / detections_;
  const double deviations = std::abs(moved_ns) * std::sqrt(returns_a_frame / all.variance);
  if (nats < certain_nats || deviations < least_that_matters) return;
  found.add(
      {FindingName::timing_walk, latest->by_ns / ns_per_ps, latest->std_ns / ns_per_ps, nats});
}

std::vector<NumberPair> DetectorWaits::walk(double pulse_ns) const {
  constexpr std::size_t most_entries = 16;
  Lateness all = lateness(pulse_ns);
  while (all.count > 0 && !(all.rows[all.count - 1].sure_ns() > 0)) --all.count;
  std::vector<NumberPair> table;
  for (std::size_t k = 0; k < std::min(all.count, most_entries); ++k) {
    const Late& row = all.rows[k];
    table.push_back({std::round(row.wait_ns * 10) / 10, std::round(row.by_ns / ns_per_ps)});
  }
  return table;
}

FoundList DetectorWaits::found(double detections_a_frame, double pulse_ns) const {
  FoundList found;
  if (!(detections_ > 0) || !(seen_ns_ > 0)) return found;
  find_dead_time(found, detections_a_frame);
  find_afterpulses(found, detections_a_frame);
  find_walk(found, detections_a_frame, pulse_ns);
  return found;
}

}  // namespace splid::checks
