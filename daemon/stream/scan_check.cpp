#include "daemon/stream/scan_check.hpp"

#include "daemon/base/log.hpp"
#include "daemon/base/text.hpp"
#include "protocol/error.hpp"

namespace splid {

std::string scan_fault(const FramerTotals& totals) {
  if (totals.lines == 0 && totals.outside == 0) return "";
  if (totals.lines == 0) {
    return "no line of the scan has begun: the marker that frame.by begins a line with, or a "
           "frame, does not come; splid check on a recording counts the markers that come";
  }
  // A stream may end in the middle of a line; but not of each.
  const std::uint64_t cut = totals.cut_lines + (totals.frames == 0 ? totals.open_lines : 0);
  if (cut == 0) return "";
  return grouped(cut) + " of " + grouped(totals.lines) +
         " lines of the scan have no end and made no frames (" + grouped(totals.outside) +
         " tags are in no frame): look at the markers of frame.by and their cables; a line's tags "
         "must fit pipeline.ring_capacity_tags";
}

void check_scan(const FramerTotals& totals) {
  if (totals.half_picture_lines > 0) {
    log_warning(
        "picture 0 of the scan began before the first tag: it has {} lines, fewer than "
        "scan.lines, so that its line numbers and elevations are not known; leave it out",
        grouped(totals.half_picture_lines));
  }
  const std::string fault = scan_fault(totals);
  if (fault.empty()) return;
  if (totals.frames == 0) throw Error(Fault::data, fault);
  log_warning(fault);
}

}  // namespace splid
