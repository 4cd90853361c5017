#include "drivers/usb/ttm_instrument.hpp"

#include "drivers/tag_writer.hpp"
#include "drivers/usb/usb_error.hpp"

namespace splid::usb {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds longest_silence{250};
constexpr milliseconds no_record_patience{500};
constexpr milliseconds between_news{1000};

// Adds to text what came to pass more often than was told; empty: nothing.
void tell(std::uint64_t count, std::uint64_t told, const char* what, std::string& text) {
  if (count == told) return;
  text += (text.empty() ? "" : "; ") + std::string(what) + " (" + std::to_string(count - told) +
          " times)";
}

}  // namespace

std::string TtmInstrument::tend(Device& device, TagSink&) {
  if (heard_ && fitted_ && *heard_ - *fitted_ >= no_record_patience) {
    throw DeviceError(device.name() +
                          ": what it sends is no records of protocol 2; it is opened anew; look at "
                          "its cable and at its firmware, which must be version 2",
                      0);
  }
  const auto now = Clock::now();
  if (now < next_news_) return {};
  std::string text;
  const TtmFaults& faults = decoder_.faults();
  tell(faults.full, told_.full, "its memory was nearly full and it dropped photons", text);
  tell(faults.gaps, told_.gaps, "records are missing by their clock", text);
  tell(faults.broken, told_.broken, "its records were none that can be", text);
  if (text.empty()) return text;
  told_ = faults;
  next_news_ = now + between_news;
  return text;
}

void TtmInstrument::decode(std::span<const std::byte> bytes, TagSink& sink) {
  const auto now = Clock::now();
  if (heard_ && now - *heard_ > longest_silence) decoder_.doubt_count();
  heard_ = now;
  if (!fitted_) fitted_ = now;
  while (bytes.size() >= TtmDecoder::word_bytes) {
    const auto done = decoder_.decode(bytes, decoded_);
    put_tags(std::span(decoded_).first(done.tags), sink);
    bytes = bytes.subspan(done.bytes);
  }
  // A transfer begins with a whole word.
  if (!bytes.empty()) cut(sink);
  if (decoder_.records() != records_) {
    records_ = decoder_.records();
    fitted_ = now;
  }
}

void TtmInstrument::cut(TagSink& sink) {
  if (const auto begin = decoder_.cut()) put_tags({&*begin, 1}, sink);
}

void TtmInstrument::end(TagSink& sink) {
  if (decoder_.reached_ps()) put_clock_end(*decoder_.reached_ps(), sink);
}

}  // namespace splid::usb
