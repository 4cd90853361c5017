#include "protocol/qutag_decode.hpp"

#include <algorithm>
#include <string>

#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr std::size_t qutag_header_bytes = 40;
constexpr std::uint32_t most_channel = 63;

}  // namespace

std::optional<RecordingHeader> parse_qutag_header(std::span<const std::byte> prefix,
                                                  bool complete) {
  if (prefix.size() < qutag_header_bytes) {
    if (!complete) return std::nullopt;
    throw Error(Fault::data, "quTAG header, byte " + std::to_string(prefix.size()) +
                                 ": the file ends within its header of 40 bytes; it is cut");
  }
  RecordingHeader header;
  header.format = RecordingFormat::qutag;
  header.header_bytes = qutag_header_bytes;
  header.resolution_s = 1e-12;
  header.tags.push_back({"HW_Type", -1, PtuTagType::string, std::string("quTAG"), 0});
  return header;
}

// Design note: as of PTU records, every record writes a tag, and only a known channel keeps it.
RecordDecoder::Progress QutagDecoder::decode(std::span<const std::byte> records,
                                             std::span<Tag> out) {
  const std::size_t bytes_each = record_bytes();
  Progress progress;
  const std::byte* in = records.data();
  std::size_t left = records.size() / bytes_each;
  while (left > 0 && progress.tags < out.size()) {
    const std::size_t count = std::min(left, out.size() - progress.tags);
    for (std::size_t i = 0; i < count; ++i, in += bytes_each) {
      const std::uint64_t time_ps =
          little_endian_32(in) | static_cast<std::uint64_t>(little_endian_32(in + 4)) << 32U;
      // The low half of these 4 bytes is the time's highest.
      const std::uint32_t channel = little_endian_32(in + 6) >> 16U;
      reached_ps_ = static_cast<std::int64_t>(time_ps);
      write_tag(out[progress.tags], reached_ps_,
                {static_cast<std::int32_t>(channel), TagKind::photon, {}});
      const bool is_known = channel <= most_channel;
      progress.tags += is_known ? 1 : 0;
      unknown_records_ += is_known ? 0 : 1;
    }
    left -= count;
    progress.bytes += count * bytes_each;
  }
  return progress;
}

}  // namespace splid
