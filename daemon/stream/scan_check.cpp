#include "daemon/stream/scan_check.hpp"

#include "daemon/base/log.hpp"
#include "daemon/base/text.hpp"
#include "protocol/error.hpp"

namespace splid {

std::string scan_fault(const FramerTotals& totals, bool is_over) {
  if (totals.lines == 0 && totals.outside == 0) return "";
  if (totals.lines == 0) {
    return "no line of the scan has begun: the marker that frame.by begins a line with, or a "
           "frame, does not come; splid check on a recording counts the markers that come";
  }
  const std::uint64_t open = is_over ? 1 : 0;
  if (totals.cut_lines <= open && totals.frames > 0) return "";
  if (totals.frames == 0 && totals.cut_lines == 0) return "";
  return grouped(totals.cut_lines) + " of " + grouped(totals.lines) +
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
  const std::string fault = scan_fault(totals, true);
  if (fault.empty()) return;
  if (totals.frames == 0) throw Error(Fault::data, fault);
  log_warning(fault);
}

}  // namespace splid
