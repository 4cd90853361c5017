#include "protocol/pico_quant_header.hpp"

#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/error.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/record_decoder.hpp"
#include "protocol/text.hpp"

namespace splid {
namespace {

// The text that both instruments' headers begin with: identity, version, program, time, comment.
constexpr std::size_t identity_at = 0, identity_bytes = 16;
constexpr std::size_t version_at = 16, version_bytes = 6;
constexpr std::size_t creator_at = 22, creator_bytes = 18;
constexpr std::size_t file_time_at = 52, file_time_bytes = 18;
constexpr std::size_t comment_at = 72, comment_bytes = 256;
constexpr std::size_t bits_at = 332;

// What only the PicoHarp's header has, and its length without what images add.
struct PicoHarp {
  static constexpr std::size_t mode_at = 348;
  static constexpr std::size_t acquisition_at = 364;
  static constexpr std::size_t sync_divider_at = 564;
  static constexpr std::size_t resolution_at = 584;  // float, ns
  static constexpr std::size_t sync_rate_at = 704;
  static constexpr std::size_t records_at = 720;  // 32 bits
  static constexpr std::size_t image_at = 724;
  static constexpr std::size_t bytes = 728;
};

// The HydraHarp's, up to its inputs; each input adds 20 bytes.
struct HydraHarp {
  static constexpr std::size_t mode_at = 340;
  static constexpr std::size_t resolution_at = 352;  // double, ps
  static constexpr std::size_t acquisition_at = 364;
  static constexpr std::size_t inputs_at = 664;
  static constexpr std::size_t sync_divider_at = 680;
  static constexpr std::size_t bytes = 696;
  static constexpr std::size_t bytes_an_input = 20;
  static constexpr std::int64_t most_inputs = 64;
};

constexpr std::int64_t most_image_words = 1 << 20;

[[noreturn]] void refuse_header(std::size_t offset, const std::string& what) {
  throw Error(Fault::data, "PicoQuant header, byte " + std::to_string(offset) + ": " + what);
}

// The fields of a header by their places, all of which are within the bytes.
class Fields {
 public:
  explicit Fields(std::span<const std::byte> bytes) : bytes_(bytes) {}

  [[nodiscard]] std::int64_t integer(std::size_t at) const {
    return static_cast<std::int32_t>(little_endian_32(bytes_.data() + at));
  }
  [[nodiscard]] std::uint64_t integer_64(std::size_t at) const {
    return little_endian_32(bytes_.data() + at) |
           static_cast<std::uint64_t>(little_endian_32(bytes_.data() + at + 4)) << 32U;
  }
  // The shortest decimal number that the 32 bits stand for: 0.004 ns was written, which is
  // 0.0040000002 where the bits are only widened.
  [[nodiscard]] double real_32(std::size_t at) const {
    std::array<char, 32> digits{};
    const auto narrow = std::bit_cast<float>(little_endian_32(bytes_.data() + at));
    const char* end = std::to_chars(digits.data(), digits.data() + digits.size(), narrow).ptr;
    double value = 0;
    std::from_chars(digits.data(), end, value);
    return value;
  }
  [[nodiscard]] double real_64(std::size_t at) const {
    return std::bit_cast<double>(integer_64(at));
  }
  // Up to its first NUL, without blanks at its ends.
  [[nodiscard]] std::string text(std::size_t at, std::size_t length) const {
    std::string text;
    for (std::size_t i = at; i < at + length && bytes_[i] != std::byte{0}; ++i) {
      text += static_cast<char>(bytes_[i]);
    }
    return std::string(trimmed(text));
  }

 private:
  std::span<const std::byte> bytes_;
};

// Whether the first `needed` bytes are there; where they are not and no more come, an error.
bool is_there(std::span<const std::byte> prefix, std::size_t needed, bool complete) {
  if (prefix.size() >= needed) return true;
  if (complete)
    refuse_header(prefix.size(), "the file ends within its header; it is cut or no recording");
  return false;
}

double checked(double value, std::size_t at, const char* what, double least, double most) {
  if (value >= least && value <= most) return value;
  refuse_header(at, std::string(what) + " is " + number_text(value) + " s; it must be from " +
                        number_text(least) + " to " + number_text(most) + " s");
}

// Whether the records are of mode T3.
bool read_mode(const Fields& fields, std::size_t mode_at) {
  const std::int64_t mode = fields.integer(mode_at);
  if (mode != 2 && mode != 3) {
    refuse_header(mode_at,
                  "the measurement mode is " + std::to_string(mode) +
                      "; only T2 (2) and T3 (3) keep each photon. Record again in T2 mode");
  }
  if (fields.integer(bits_at) != 32) {
    refuse_header(bits_at,
                  "records of " + std::to_string(fields.integer(bits_at)) + " bits; they have 32");
  }
  return mode == 3;
}

void add_text(RecordingHeader& header, const char* name, std::string value, std::size_t at) {
  header.tags.push_back({name, -1, PtuTagType::string, std::move(value), at});
}

void add_integer(RecordingHeader& header, const char* name, std::int64_t value, std::size_t at) {
  header.tags.push_back({name, -1, PtuTagType::integer, value, at});
}

void read_texts(const Fields& fields, RecordingHeader& header) {
  add_text(header, "HW_Type", fields.text(identity_at, identity_bytes), identity_at);
  add_text(header, "CreatorSW_Name", fields.text(creator_at, creator_bytes), creator_at);
  add_text(header, "FileTime", fields.text(file_time_at, file_time_bytes), file_time_at);
  add_text(header, "File_Comment", fields.text(comment_at, comment_bytes), comment_at);
}

// A step of a record's times. at: the place of a number of ps or ns that it was made of.
double checked_resolution(double resolution_s, std::size_t at) {
  return checked(resolution_s, at, "the resolution", 1e-15, 1e-3);
}

// T3: the time between syncs. rate_at: of the syncs, per second.
void read_t3(const Fields& fields, std::size_t rate_at, RecordingHeader& header) {
  const std::int64_t rate_hz = fields.integer(rate_at);
  if (rate_hz < 1) {
    refuse_header(rate_at,
                  "a sync rate of " + std::to_string(rate_hz) +
                      " Hz, by which T3 records are counted; the file is damaged, or the sync was "
                      "not connected");
  }
  header.is_t3 = true;
  header.time_steps = t3_time_steps(header.record_type);
  header.sync_period_s = 1.0 / static_cast<double>(rate_hz);
}

// T2: PicoHarps have one clock, and their headers the steps of histograms, which are of no use
// here. Source: PicoQuant's demonstrations of reading .pt2, which have 4 ps as a constant.
void read_pico_harp_t2(double histogram_ns, RecordingHeader& header) {
  header.record_type = RecordType::pico_harp;
  header.resolution_s = 4e-12;
  if (!(histogram_ns > 0) || histogram_ns == 0.004) return;
  header.warning = "the header has a resolution of " + number_text(histogram_ns) +
                   " ns; in T2 mode the times of every PicoHarp 300 have steps of 0.004 ns, which "
                   "are taken";
}

// The length of a header of `bytes` and what images add.
std::size_t with_image(const Fields& fields, std::size_t image_at, std::size_t bytes) {
  const std::int64_t words = fields.integer(image_at);
  if (words < 0 || words > most_image_words) {
    refuse_header(image_at,
                  "an image header of " + std::to_string(words) + " numbers; the file is damaged");
  }
  return bytes + 4 * static_cast<std::size_t>(words);
}

}  // namespace

std::optional<RecordingHeader> parse_pico_harp_header(std::span<const std::byte> prefix,
                                                      bool complete) {
  if (!is_there(prefix, PicoHarp::bytes, complete)) return std::nullopt;
  const Fields fields(prefix);
  const std::string version = fields.text(version_at, version_bytes);
  if (version != "2.0") {
    refuse_header(version_at, "format version " + version + " of a PicoHarp; splid reads 2.0");
  }
  RecordingHeader header;
  header.format = RecordingFormat::pico_harp;
  read_texts(fields, header);
  add_integer(header, "HWSync_Divider", fields.integer(PicoHarp::sync_divider_at),
              PicoHarp::sync_divider_at);
  add_integer(header, "MeasDesc_AcquisitionTime", fields.integer(PicoHarp::acquisition_at),
              PicoHarp::acquisition_at);
  const double resolution_ns = fields.real_32(PicoHarp::resolution_at);
  if (read_mode(fields, PicoHarp::mode_at)) {
    header.record_type = RecordType::pico_harp_t3;
    read_t3(fields, PicoHarp::sync_rate_at, header);
    header.resolution_s = checked_resolution(resolution_ns * 1e-9, PicoHarp::resolution_at);
  } else {
    read_pico_harp_t2(resolution_ns, header);
  }
  header.record_count = told_record_count(fields.integer(PicoHarp::records_at));
  header.header_bytes = with_image(fields, PicoHarp::image_at, PicoHarp::bytes);
  if (!is_there(prefix, header.header_bytes, complete)) return std::nullopt;
  return header;
}

std::optional<RecordingHeader> parse_hydra_harp_header(std::span<const std::byte> prefix,
                                                       bool complete) {
  if (!is_there(prefix, HydraHarp::bytes, complete)) return std::nullopt;
  const Fields fields(prefix);
  const std::string version = fields.text(version_at, version_bytes);
  if (version != "1.0" && version != "2.0") {
    refuse_header(version_at,
                  "format version " + version + " of a HydraHarp; splid reads 1.0 and 2.0");
  }
  const std::int64_t inputs = fields.integer(HydraHarp::inputs_at);
  if (inputs < 0 || inputs > HydraHarp::most_inputs) {
    refuse_header(HydraHarp::inputs_at, std::to_string(inputs) + " inputs; the file is damaged");
  }
  // Behind the inputs: sync rate, two numbers on the stop, the image's length, the record count.
  const std::size_t rate_at =
      HydraHarp::bytes + HydraHarp::bytes_an_input * static_cast<std::size_t>(inputs);
  const std::size_t image_at = rate_at + 12;
  const std::size_t records_at = rate_at + 16;
  const std::size_t bytes = rate_at + 24;
  if (!is_there(prefix, bytes, complete)) return std::nullopt;
  RecordingHeader header;
  header.format = RecordingFormat::hydra_harp;
  read_texts(fields, header);
  add_integer(header, "HWSync_Divider", fields.integer(HydraHarp::sync_divider_at),
              HydraHarp::sync_divider_at);
  add_integer(header, "MeasDesc_AcquisitionTime", fields.integer(HydraHarp::acquisition_at),
              HydraHarp::acquisition_at);
  const bool first_version = version == "1.0";
  if (read_mode(fields, HydraHarp::mode_at)) {
    header.record_type =
        first_version ? RecordType::hydra_harp_v1_t3 : RecordType::hydra_harp_v2_t3;
    read_t3(fields, rate_at, header);
  } else {
    header.record_type = first_version ? RecordType::hydra_harp_v1 : RecordType::hydra_harp_v2;
  }
  header.resolution_s = checked_resolution(fields.real_64(HydraHarp::resolution_at) * 1e-12,
                                           HydraHarp::resolution_at);
  header.record_count = told_record_count(static_cast<std::int64_t>(fields.integer_64(records_at)));
  header.header_bytes = with_image(fields, image_at, bytes);
  if (!is_there(prefix, header.header_bytes, complete)) return std::nullopt;
  return header;
}

}  // namespace splid
