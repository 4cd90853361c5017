#include "drivers/awg/waveform_samples.hpp"

#include <algorithm>
#include <vector>

namespace splid::awg {
namespace {

constexpr std::uint8_t is_pulse = 1;
constexpr std::uint8_t is_marker = 2;

// Sets `bit` in `length` flags from sample `begin` on, as far as there are flags for them. The
// first flag is that of sample `first`.
void mark(std::vector<std::uint8_t>& flags, std::int64_t first, std::int64_t begin,
          std::int64_t length, std::uint8_t bit) {
  const auto size = static_cast<std::int64_t>(flags.size());
  const std::int64_t end = std::min(begin + length - first, size);
  for (std::int64_t i = std::max<std::int64_t>(begin - first, 0); i < end; ++i) {
    flags[static_cast<std::size_t>(i)] |= bit;
  }
}

// The flags of each sample. The loop begins one period early, for a pulse that runs over into the
// first period.
std::vector<std::uint8_t> flags_of(const WaveformPlan& plan, std::int64_t first,
                                   std::int64_t count) {
  std::vector<std::uint8_t> flags(static_cast<std::size_t>(count));
  const std::int64_t period = plan.samples_per_period;
  const std::vector<std::int64_t>& starts = plan.pulse_starts;
  for (std::int64_t begin = (first / period - 1) * period; begin < first + count; begin += period) {
    mark(flags, first, begin, plan.marker_samples, is_marker);
    auto start = std::lower_bound(starts.begin(), starts.end(), first - begin - plan.pulse_samples);
    for (; start != starts.end() && begin + *start < first + count; ++start) {
      mark(flags, first, begin + *start, plan.pulse_samples, is_pulse);
    }
  }
  return flags;
}

void put_byte_pair(std::string& bytes, bool up, bool marker) {
  constexpr char full = 127;
  bytes += up ? full : static_cast<char>(-full);
  bytes += marker ? '\1' : '\0';
}

void put_word(std::string& bytes, bool up, bool marker) {
  constexpr int full = 8'191;
  const auto word = static_cast<std::uint16_t>((up ? full : -full) * 4 + (marker ? 1 : 0));
  bytes += static_cast<char>(word & 0xFFU);
  bytes += static_cast<char>(word >> 8U);
}

}  // namespace

std::string waveform_samples(const WaveformPlan& plan, const Model& model, bool pulse_is_up,
                             std::int64_t first, std::int64_t count) {
  const auto put = model.format == SampleFormat::byte_pair ? put_byte_pair : put_word;
  std::string bytes;
  bytes.reserve(static_cast<std::size_t>(count * sample_bytes));
  for (const std::uint8_t flags : flags_of(plan, first, count)) {
    put(bytes, ((flags & is_pulse) != 0) == pulse_is_up, (flags & is_marker) != 0);
  }
  return bytes;
}

}  // namespace splid::awg
