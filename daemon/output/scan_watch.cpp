#include "daemon/output/scan_watch.hpp"

#include <algorithm>
#include <utility>

#include "daemon/stream/scan_check.hpp"

namespace splid {
namespace {

constexpr std::int64_t shown_for_ns = 5'000'000'000;
constexpr std::int64_t renewed_after_ns = 1'000'000'000;

}  // namespace

std::string ScanWatch::look(const FramerTotals& totals, std::int64_t now_ns) {
  std::string fault = fault_of(totals, now_ns);
  if (fault.empty() || said_.empty() || now_ns - said_ns_ >= renewed_after_ns) {
    said_ = std::move(fault);
    said_ns_ = now_ns;
  }
  return said_;
}

std::string ScanWatch::fault_of(const FramerTotals& totals, std::int64_t now_ns) {
  const bool is_scan = totals.lines > 0 || totals.outside > 0;
  if (frames_since_ns_ == 0 || totals.frames != frames_) {
    if (frames_since_ns_ != 0) longest_ns_ = std::max(longest_ns_, now_ns - frames_since_ns_);
    frames_since_ns_ = now_ns;
    frames_ = totals.frames;
  }
  if (totals.cut_lines != cut_lines_) cut_until_ns_ = now_ns + shown_for_ns;
  cut_lines_ = totals.cut_lines;
  if (!is_scan) return "";
  if (now_ns - frames_since_ns_ > std::max(shown_for_ns, 3 * longest_ns_)) {
    return totals.lines == 0 ? scan_fault(totals)
                             : "no line of the scan ends any more: look at the markers of frame.by "
                               "and their cables, and whether the scanner moves";
  }
  return now_ns < cut_until_ns_ ? scan_fault(totals) : "";
}

}  // namespace splid
