#include "daemon/base/time_left.hpp"

#include <algorithm>

namespace splid {

double TimeLeft::left_s(double part, double took_s) const {
  if (current_ >= expected_s_.size()) return 0;
  // The more of a part is done, the more its own time counts and the less the time expected of it.
  const double rest = 1 - std::clamp(part, 0.0, 1.0);
  double left_s = rest * (took_s + rest * factor() * expected_s_[current_]);
  for (std::size_t k = current_ + 1; k < expected_s_.size(); ++k) {
    left_s += factor() * expected_s_[k];
  }
  return left_s;
}

void TimeLeft::finish(double took_s) {
  if (current_ >= expected_s_.size()) return;
  const double expected_s = expected_s_[current_++];
  if (!(took_s > 0 && expected_s > 0)) return;
  done_took_s_ += took_s;
  done_expected_s_ += expected_s;
}

double TimeLeft::factor() const {
  // Counts as if this much work had already been done in just the time expected.
  const double before_s = 0.05 * all_expected_s_;
  const double expected_s = done_expected_s_ + before_s;
  return expected_s > 0 ? (done_took_s_ + before_s) / expected_s : 1;
}

}  // namespace splid
