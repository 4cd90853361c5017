#include "protocol/ptu_header.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>

#include "protocol/error.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/ptu_losses.hpp"
#include "protocol/shown_text.hpp"
#include "protocol/text.hpp"

namespace splid {
namespace {

constexpr std::size_t preamble_bytes = 16;  // magic and version
constexpr std::size_t tag_name_bytes = 32;
constexpr std::size_t entry_bytes = 48;  // name, index, type, 8 bytes of value or length

// Design note: vendors' headers are 4 to 100 KB. In a header that is longer than this some length
// is wrong, and the whole recording would be read into memory in search of the header's end.
constexpr std::size_t max_header_bytes = 64U << 20U;

constexpr double days_to_unix_epoch = 25'569;  // from 1899-12-30
constexpr double seconds_a_day = 86'400;

[[noreturn]] void fail(std::size_t offset, const std::string& what) {
  throw Error(Fault::data, "PTU header, byte " + std::to_string(offset) + ": " + what);
}

std::string hex(std::uint64_t value) {
  std::array<char, 24> text{};
  std::snprintf(text.data(), text.size(), "0x%08llX", static_cast<unsigned long long>(value));
  return text.data();
}

std::uint64_t little_endian(std::span<const std::byte> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) {
    value = (value << 8U) | std::to_integer<std::uint64_t>(bytes[i]);
  }
  return value;
}

std::string characters(std::span<const std::byte> bytes) {
  std::string text(bytes.size(), '\0');
  std::transform(bytes.begin(), bytes.end(), text.begin(),
                 [](std::byte b) { return static_cast<char>(b); });
  return text;
}

std::string until_nul(std::string text) {
  text.resize(std::min(text.size(), text.find('\0')));
  return text;
}

bool has_payload(PtuTagType type) {
  return type == PtuTagType::string || type == PtuTagType::wide_string ||
         type == PtuTagType::real_array || type == PtuTagType::blob;
}

bool is_known(PtuTagType type) {
  switch (type) {
    case PtuTagType::empty:
    case PtuTagType::boolean:
    case PtuTagType::integer:
    case PtuTagType::bit_set:
    case PtuTagType::color:
    case PtuTagType::real:
    case PtuTagType::date_time:
    case PtuTagType::real_array:
    case PtuTagType::string:
    case PtuTagType::wide_string:
    case PtuTagType::blob:
      return true;
  }
  return false;
}

// Reads the entries of a header, one after the other. An entry is absent where the bytes end before
// the entry does.
class Entries {
 public:
  explicit Entries(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::optional<PtuTag> next() {
    if (bytes_.size() - offset_ < entry_bytes) return std::nullopt;
    PtuTag tag = fixed_part();
    const auto length = little_endian(bytes_.subspan(offset_ + 40, 8));
    std::size_t payload = 0;
    if (has_payload(tag.type)) {
      if (length > max_header_bytes) {
        fail(offset_ + 40, tag.name + " claims a length of " + std::to_string(length) +
                               " bytes, more than a header may have (" +
                               std::to_string(max_header_bytes) + "); the file is damaged");
      }
      payload = static_cast<std::size_t>(length);
      if (bytes_.size() - offset_ - entry_bytes < payload) return std::nullopt;
    }
    set_value(tag, length, payload);
    offset_ += entry_bytes + payload;
    return tag;
  }

  [[nodiscard]] std::size_t offset() const { return offset_; }

 private:
  [[nodiscard]] PtuTag fixed_part() const {
    PtuTag tag;
    tag.offset = offset_;
    tag.name = until_nul(characters(bytes_.subspan(offset_, tag_name_bytes)));
    tag.index = static_cast<std::int32_t>(little_endian(bytes_.subspan(offset_ + 32, 4)));
    tag.type = static_cast<PtuTagType>(little_endian(bytes_.subspan(offset_ + 36, 4)));
    if (tag.name.empty()) fail(offset_, "a tag without a name; the file is damaged");
    if (!is_known(tag.type)) {
      fail(offset_ + 36, tag.name + " has the unknown type " +
                             hex(static_cast<std::uint32_t>(tag.type)) + "; the file is damaged");
    }
    return tag;
  }

  void set_value(PtuTag& tag, std::uint64_t word, std::size_t payload) const {
    if (has_payload(tag.type)) {
      std::string text = characters(bytes_.subspan(offset_ + entry_bytes, payload));
      tag.value = tag.type == PtuTagType::string ? until_nul(std::move(text)) : std::move(text);
    } else if (tag.type == PtuTagType::real || tag.type == PtuTagType::date_time) {
      tag.value = std::bit_cast<double>(word);
    } else {
      tag.value = static_cast<std::int64_t>(word);
    }
  }

  std::span<const std::byte> bytes_;
  std::size_t offset_ = preamble_bytes;
};

template <class Value>
const Value& required(const RecordingHeader& header, std::string_view name) {
  const PtuTag* tag = header.find(name);
  const Value* value = tag == nullptr ? nullptr : std::get_if<Value>(&tag->value);
  if (tag == nullptr) fail(header.header_bytes, "tag " + std::string(name) + " is missing");
  if (value == nullptr) fail(tag->offset, std::string(name) + " is of the wrong type");
  return *value;
}

std::size_t offset_of(const RecordingHeader& header, std::string_view name) {
  return header.find(name)->offset;
}

RecordType record_type(const RecordingHeader& header) {
  constexpr std::string_view name = "TTResultFormat_TTTRRecType";
  const auto value = static_cast<std::uint64_t>(required<std::int64_t>(header, name));
  switch (value) {
    case 0x00010203:
    case 0x00010204:
    case 0x00010205:
    case 0x00010206:
    case 0x00010207:
    case 0x01010204:
    case 0x00010303:
    case 0x00010304:
    case 0x00010305:
    case 0x00010306:
    case 0x00010307:
    case 0x01010304:
      return static_cast<RecordType>(value);
    default:
      break;
  }
  fail(offset_of(header, name), "unknown record type " + hex(value));
}

void check_mode(const RecordingHeader& header) {
  constexpr std::string_view name = "Measurement_Mode";
  const auto mode = header.integer(name);
  const std::int64_t expected = header.is_t3 ? 3 : 2;
  if (!mode || *mode == expected) return;
  const std::string found =
      "Measurement_Mode is " + std::to_string(*mode) + (*mode == 3 ? " (T3)" : "");
  if (*mode != 2 && *mode != 3) {
    fail(offset_of(header, name),
         found + "; only T2 (2) and T3 (3) keep each photon. Record again in T2 mode");
  }
  fail(offset_of(header, name),
       found + ", and the record type " + hex(static_cast<std::uint32_t>(header.record_type)) +
           " is of mode " + std::to_string(expected) + "; one of the two is wrong");
}

// name: of a time in seconds.
double time_within(const RecordingHeader& header, std::string_view name, double least_s,
                   double most_s) {
  const auto value = required<double>(header, name);
  if (value >= least_s && value <= most_s) return value;
  fail(offset_of(header, name), std::string(name) + " is " + number_text(value) +
                                    " s; it must be from " + number_text(least_s) + " to " +
                                    number_text(most_s) + " s");
}

// In T2 one clock counts everything; in T3 it counts syncs, and a second one the time since each.
void read_resolution(RecordingHeader& header) {
  constexpr std::string_view clock = "MeasDesc_GlobalResolution";
  if (header.is_t3) {
    header.time_steps = t3_time_steps(header.record_type);
    header.sync_period_s = time_within(header, clock, 1e-12, 1);
    header.resolution_s = time_within(header, "MeasDesc_Resolution", 1e-15, 1e-3);
  } else {
    header.resolution_s = time_within(header, clock, 1e-15, 1e-3);
  }
}

std::uint64_t record_count(const RecordingHeader& header) {
  constexpr std::string_view name = "TTResult_NumberOfRecords";
  if (header.find(name) == nullptr) return 0;
  return told_record_count(required<std::int64_t>(header, name));
}

void check_bits(const RecordingHeader& header) {
  const auto bits = header.integer("TTResultFormat_BitsPerRecord");
  if (!bits || *bits == 32) return;
  fail(offset_of(header, "TTResultFormat_BitsPerRecord"),
       "TTResultFormat_BitsPerRecord is " + std::to_string(*bits) + "; records have 32");
}

// Reads splid's own tags. Where a tag is absent the default stays.
void read_own_facts(RecordingHeader& header) {
  header.pattern_json = header.text("Splid_Pattern").value_or("");
  header.config_json = header.text("Splid_Config").value_or("");
  if (const auto text = header.text("Splid_Origin_ps")) {
    const auto origin_ps = whole_number(*text);
    if (!origin_ps) {
      fail(offset_of(header, "Splid_Origin_ps"),
           "Splid_Origin_ps is not a whole number: " + shown_text(*text, most_quoted));
    }
    header.origin_ps = *origin_ps;
  }
  if (const auto text = header.text("Splid_Inputs")) {
    const auto inputs = PtuInputs::from_text(*text, 0);
    if (!inputs) {
      fail(offset_of(header, "Splid_Inputs"),
           "Splid_Inputs is not a list of channel:input, each once: " + text->substr(0, 80));
    }
    header.inputs = *inputs;
  }
  if (const auto text = header.text("Splid_Losses")) {
    auto losses = losses_from_text(*text);
    if (!losses) {
      fail(offset_of(header, "Splid_Losses"),
           "Splid_Losses is not a list of begin:end:count, begin <= end: " +
               shown_text(*text, most_quoted));
    }
    header.losses = std::move(*losses);
  }
}

void read_facts(RecordingHeader& header) {
  header.record_type = record_type(header);
  header.is_t3 = is_t3(header.record_type);
  check_mode(header);
  check_bits(header);
  read_resolution(header);
  header.record_count = record_count(header);
  if (const auto days = header.real("File_CreatingTime"); days && std::isfinite(*days)) {
    header.created_unix_s = (*days - days_to_unix_epoch) * seconds_a_day;
  }
  read_own_facts(header);
}

void check_magic(std::span<const std::byte> prefix) {
  const std::string start = characters(prefix.first(std::min(prefix.size(), ptu_magic.size())));
  if (start != ptu_magic.substr(0, start.size())) {
    fail(0, "not a PTU recording: it does not start with PQTTTR");
  }
}

}  // namespace

const PtuTag* RecordingHeader::find(std::string_view name, std::int32_t index) const {
  const auto found = std::find_if(tags.begin(), tags.end(), [&](const PtuTag& tag) {
    return tag.name == name && tag.index == index;
  });
  return found == tags.end() ? nullptr : &*found;
}

std::optional<std::int64_t> RecordingHeader::integer(std::string_view name) const {
  const PtuTag* tag = find(name);
  const auto* value = tag == nullptr ? nullptr : std::get_if<std::int64_t>(&tag->value);
  return value == nullptr ? std::nullopt : std::optional(*value);
}

std::optional<double> RecordingHeader::real(std::string_view name) const {
  const PtuTag* tag = find(name);
  const auto* value = tag == nullptr ? nullptr : std::get_if<double>(&tag->value);
  return value == nullptr ? std::nullopt : std::optional(*value);
}

std::optional<std::string> RecordingHeader::text(std::string_view name) const {
  const PtuTag* tag = find(name);
  if (tag == nullptr || tag->type != PtuTagType::string) return std::nullopt;
  return std::get<std::string>(tag->value);
}

std::optional<RecordingHeader> parse_ptu_header(std::span<const std::byte> prefix, bool complete) {
  check_magic(prefix);
  if (prefix.size() >= preamble_bytes) {
    Entries entries(prefix);
    RecordingHeader header;
    while (auto tag = entries.next()) {
      if (tag->name == ptu_end_name) {
        header.header_bytes = entries.offset();
        read_facts(header);
        return header;
      }
      header.tags.push_back(std::move(*tag));
    }
    if (entries.offset() > max_header_bytes) {
      fail(entries.offset(), "no Header_End in the first 64 MiB; the file is damaged");
    }
  }
  if (complete) fail(prefix.size(), "the file ends within its header; it is cut or no recording");
  return std::nullopt;
}

}  // namespace splid
