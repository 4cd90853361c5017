#include "estimator/checks/finding_sums.hpp"

#include <algorithm>
#include <cmath>

namespace splid::checks {

FindingSums::FindingSums(const Findings& findings)
    : findings_(findings),
      by_pulse_(findings.map().by_pulse().size()),
      expected_(by_pulse_.size()),
      light_(by_pulse_.size()),
      by_phase_(findings.map().by_phase().size()),
      seen_phase_(by_phase_.size()) {}

void FindingSums::clear() {
  rows_ = {};
  for (auto* sums : {&by_pulse_, &expected_, &light_, &by_phase_, &seen_phase_}) {
    std::fill(sums->begin(), sums->end(), 0.0);
  }
  frames_ = length_ns_ = seen_ns_ = 0;
}

void FindingSums::add(const FoldedFrame& frame) {
  for (std::size_t row = 0; row < rows_with_directions; ++row)
    rows_[row].add(findings_.scores().rows[row]);
  for (std::size_t p = 0; p < by_pulse_.size(); ++p) {
    const PulseLight expected = findings_.expected_at(p);
    by_pulse_[p] += findings_.counted_at(p);
    expected_[p] += expected.light + expected.dark;
    light_[p] += expected.light;
  }
  for (std::size_t k = 0; k < by_phase_.size(); ++k) {
    const double seen = findings_.seen_at_phase(k);
    by_phase_[k] += seen > 0 ? findings_.map().by_phase()[k] : 0;
    seen_phase_[k] += seen;
  }
  frames_ += 1, length_ns_ += frame.length_ns, seen_ns_ += frame.seen_ns;
}

void FindingSums::say(FoundList& all, const FindingRow& row, double amount,
                      double gain_nats) const {
  if (2 * gain_nats < sure_squares) return;
  const FindingScale scale = {length_ns_ / frames_, seen_ns_ / frames_};
  all.add(row.found(row.value(amount, scale), gain_nats));
}

// A sum of chi squared has the tail that SquareSum has. Its measure of the size is the mean square
// beyond chance, in one direction's own units.
void FindingSums::add_sum(FoundList& all, std::size_t row) const {
  const RowScore& sum = rows_[row];
  const FindingRow& named = finding_table()[row];
  if (!(sum.information[0] > 0)) return;
  double amount = 0, squares = 0;
  for (std::size_t t = 0; t < sum.score.size(); ++t) {
    if (!(sum.information[t] > 0)) continue;
    amount += sum.score[t] / sum.information[t];
    squares += sum.score[t] * sum.score[t] / sum.information[t];
  }
  if (named.keeps_sign) {
    if (named.is_flat_light() && amount < 0) return;
    return say(all, named, amount, squares / 2);
  }
  const SquareSum chi = {sum.squares - sum.degrees, 2 * sum.degrees, 8 * sum.degrees, 0};
  const double more = std::max(0.0, sum.squares / sum.degrees - 1);
  say(all, named, std::sqrt(more * frames_ / sum.information[0]), chi.gain_nats());
}

FoundList FindingSums::found() const {
  FoundList all;
  if (frames_ == 0) return all;
  for (std::size_t row = 0; row < rows_with_directions; ++row) add_sum(all, row);
  SquareSum pulses, phases;
  for (std::size_t p = 0; p < by_pulse_.size(); ++p)
    pulses.add(by_pulse_[p], expected_[p], light_[p]);
  const std::span<const std::uint8_t> is_free = findings_.map().is_free();
  double photons = 0, bins = 0, seen = 0;
  for (std::size_t k = 0; k < by_phase_.size(); ++k) {
    if (is_free[k] != 0) photons += by_phase_[k], seen += seen_phase_[k], bins += 1;
  }
  for (std::size_t k = 0; k < by_phase_.size(); ++k) {
    if (is_free[k] != 0 && seen > 0) phases.add(by_phase_[k], photons * seen_phase_[k] / seen);
  }
  const double amount = std::sqrt(std::max(0.0, phases.excess) * bins) / frames_;
  say(all, finding_table()[phase_row], amount, phases.gain_nats());
  say(all, finding_table()[pulse_row], pulses.relative(), pulses.gain_nats());
  return all;
}

}  // namespace splid::checks
