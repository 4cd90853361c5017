#include <array>
#include <optional>

#include "protocol/recording_format.hpp"
#include "tests/fuzz/decoded.hpp"

// A recording of another format than PTU, which the first byte chooses: its header, given whole and
// bit by bit, then its records, decoded at one go and in pieces. Pieces make no difference.

namespace splid::test::fuzz_recordings {
namespace {

constexpr std::string_view settings = "[SP_TAC_R,F,6.5536e-08] [SP_TAC_G,I,2]";

constexpr std::array formats = {RecordingFormat::pico_harp, RecordingFormat::hydra_harp,
                                RecordingFormat::qutag, RecordingFormat::becker_hickl};

std::optional<RecordingHeader> parse(RecordingFormat format, std::span<const std::byte> bytes,
                                     bool complete) {
  return parse_recording_header(format, bytes, complete, settings);
}

// As readers of files do: more of it until the header is there.
std::optional<RecordingHeader> parse_in_pieces(RecordingFormat format,
                                               std::span<const std::byte> bytes) {
  for (std::size_t size = 1; size < bytes.size(); size += 1 + size / 2) {
    if (auto header = parse(format, bytes.first(size), false)) return header;
  }
  return parse(format, bytes, true);
}

Decoded decode(const RecordingHeader& header, std::span<const std::byte> records,
               std::size_t piece) {
  const auto decoder = make_decoder(header);
  return decode_in_pieces(*decoder, records, piece);
}

void check(std::span<const std::byte> bytes) {
  if (bytes.empty()) return;
  const RecordingFormat format =
      formats.at(std::to_integer<std::size_t>(bytes.front()) % formats.size());
  bytes = bytes.subspan(1);
  std::optional<RecordingHeader> header;
  const bool good = accepts(Fault::data, [&] { header = parse(format, bytes, true); });
  std::optional<RecordingHeader> again;
  must(accepts(Fault::data, [&] { again = parse_in_pieces(format, bytes); }) == good,
       "a header is good or bad, however it comes");
  if (!good) return;
  must(again->header_bytes == header->header_bytes, "a header has one length");
  must(header->header_bytes <= bytes.size(), "the records start in the file");
  const auto records = bytes.subspan(header->header_bytes);
  const Decoded whole = decode(*header, records, records.size() + 4);
  must(decode(*header, records, 1 + records.size() % 5) == whole,
       "tags do not depend on the pieces");
}

}  // namespace
}  // namespace splid::test::fuzz_recordings

SPLID_FUZZ_TARGET(recordings) {
  splid::test::fuzz_recordings::check(std::as_bytes(std::span(data, size)));
  return 0;
}
