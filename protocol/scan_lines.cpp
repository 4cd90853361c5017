#include "protocol/scan_lines.hpp"

#include <bit>

namespace splid {
namespace {

constexpr std::int64_t most_markers = 4;
constexpr double most_percent = 100;

// The bits of the marker whose number a tag has; 0 where the tag is absent or has no such number.
int marker_bits(const RecordingHeader& header, const char* name) {
  const std::int64_t number = header.integer(name).value_or(0);
  return number < 1 || number > most_markers ? 0 : 1 << (number - 1);
}

}  // namespace

std::optional<ScanLines> scan_of(const RecordingHeader& header) {
  ScanLines scan;
  scan.start = marker_bits(header, "ImgHdr_LineStart");
  scan.stop = marker_bits(header, "ImgHdr_LineStop");
  scan.picture = marker_bits(header, "ImgHdr_Frame");
  scan.pixels = header.integer("ImgHdr_PixX").value_or(0);
  if (scan.start == 0 || scan.pixels < 1 || scan.pixels > most_dwells) return std::nullopt;
  if (scan.stop == 0) scan.stop = scan.start;
  if (scan.picture == scan.start || scan.picture == scan.stop) scan.picture = 0;
  scan.both_ways = header.integer("ImgHdr_BiDirect").value_or(0) != 0;
  const auto percent = static_cast<double>(header.integer("ImgHdr_SinCorrection").value_or(0));
  if (percent > 0 && percent <= most_percent) scan.sine_percent = percent;
  return scan;
}

std::int64_t marker_number(int bits) {
  const auto mask = static_cast<unsigned>(bits);
  return std::has_single_bit(mask) ? std::countr_zero(mask) + 1 : 0;
}

}  // namespace splid
