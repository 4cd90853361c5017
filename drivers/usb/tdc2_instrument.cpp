#include "drivers/usb/tdc2_instrument.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/tag_writer.hpp"
#include "drivers/usb/usb_error.hpp"

namespace splid::usb {
namespace {

using std::chrono::milliseconds;

constexpr std::uint8_t command_endpoint = 0x01;
constexpr std::uint8_t reply_endpoint = 0x81;
constexpr std::uint8_t boot = 2;

// Most commands take 0.1 ms. To boot, and to load the table from the EEPROM, takes longer.
constexpr milliseconds patience = Tdc2Instrument::patience;
constexpr milliseconds short_patience{30};

constexpr std::uint16_t idle_config = tdc2_config::dummies;

constexpr milliseconds between_polls{50};
constexpr int most_unanswered = 4;
constexpr milliseconds between_beats{10};

// How late the instrument's records may come after it was asked to send what waits, and how far its
// clock may be from the host's.
constexpr milliseconds beat_margin{50};
constexpr milliseconds horizon_margin{1000};

constexpr std::uint32_t unreadable = 0xFFFFFFFF;
constexpr int unreadable_said = 20;     // polls: 1 s
constexpr int unreadable_ended = 40;    // 2 s
constexpr int unreadable_again = 1200;  // said every minute

// For how long records may make no sense.
constexpr milliseconds nonsense_patience{500};

// The parameters are in the instrument's RAM, after the table: a count, as many words, and a word
// that makes the sum of all of them zero.
constexpr std::uint32_t parameter_address = 4096;
constexpr std::uint32_t most_parameters = 126;

template <class Duration>
std::int64_t to_ps(Duration duration) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count() * 1000;
}

void put_tag(const Tag& tag, TagSink& sink) { put_tags({&tag, 1}, sink); }

void send(Device& device, const std::vector<std::byte>& command, milliseconds timeout) {
  device.write(command_endpoint, command, timeout);
}

// Sends a command and returns its answer: up to four bytes, little endian. Absent where no answer
// came in time.
std::optional<std::uint32_t> ask(Device& device, const std::vector<std::byte>& command,
                                 milliseconds timeout) {
  send(device, command, timeout);
  std::array<std::byte, 64> reply{};
  const std::size_t count = device.read(reply_endpoint, reply, timeout);
  if (count == 0) return std::nullopt;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(count, 4); ++i) {
    value |= std::to_integer<std::uint32_t>(reply.at(i)) << 8U * i;
  }
  return value;
}

std::uint32_t ask_surely(Device& device, const std::vector<std::byte>& command, const char* what) {
  const auto reply = ask(device, command, patience);
  if (!reply) {
    throw DeviceError(
        device.name() + ": no answer when asked " + what + "; switch it off and on again", 0);
  }
  return *reply;
}

}  // namespace

void Tdc2Instrument::prepare(Device& device) {
  // Throws away an answer that was left over by a program that was killed.
  std::array<std::byte, 64> stale{};
  device.read(reply_endpoint, stale, milliseconds{1});
  const auto command = [&](const std::vector<std::byte>& bytes) { send(device, bytes, patience); };
  command(tdc2_command(Tdc2Command::reset_transfer));
  command(tdc2_command(Tdc2Command::configure, {boot}));
  command(tdc2_command(Tdc2Command::stop_stream));
  load_table(device);
  const std::uint32_t parameters = read_parameters(device);
  for (int input = 1; input <= 4; ++input) {
    const double threshold_mv = settings_.thresholds_mv.at(input - 1);
    command(tdc2_command16(Tdc2Command::write_threshold, tdc2_threshold(input, threshold_mv)));
    command(tdc2_command16(Tdc2Command::write_threshold, tdc2_polarity(input, threshold_mv)));
  }
  constexpr std::uint16_t reset = idle_config | tdc2_config::counter_reset;
  command(tdc2_command16(Tdc2Command::write_config, reset | tdc2_config::select_parameters));
  command(tdc2_command32(Tdc2Command::write_parameters, parameters));
  command(tdc2_command32(Tdc2Command::write_parameters, 0));  // its self-test stays off
  command(tdc2_command16(Tdc2Command::write_config, reset));
  command(tdc2_command(Tdc2Command::push_table));
  command(tdc2_command16(Tdc2Command::write_config, reset | tdc2_config::fifo_reset));
}

void Tdc2Instrument::load_table(Device& device) {
  const auto power = tdc2_command(Tdc2Command::power_state);
  std::uint32_t state = ask_surely(device, power, "for its power state");
  if ((state & tdc2_power::booted) == 0) {
    throw DeviceError(device.name() + ": it did not boot; look at its power supply", 0);
  }
  if ((state & tdc2_power::table_loaded) != 0) return;
  const std::uint32_t refused =
      ask_surely(device, tdc2_command(Tdc2Command::load_table), "to load its table");
  state = ask_surely(device, power, "for its power state");
  if (refused != 0 || (state & tdc2_power::table_loaded) == 0) {
    throw DeviceError(device.name() +
                          ": its interpolation table does not load; write it to the instrument's "
                          "EEPROM again with its maker's program",
                      0);
  }
}

// The parameters of the converter (lower half) and of the output (upper half), as the maker stored
// them.
std::uint32_t Tdc2Instrument::read_parameters(Device& device) {
  const auto word = [&](std::uint32_t index) {
    const auto command = tdc2_command32(Tdc2Command::read_ram, parameter_address + 2 * index);
    return ask_surely(device, command, "for its parameters") >> 16U;
  };
  const std::uint32_t count = word(0);
  std::array<std::uint32_t, most_parameters + 1> words{};
  std::uint32_t sum = count;
  if (count >= 1 && count <= most_parameters) {
    for (std::uint32_t i = 0; i <= count; ++i) sum += words.at(i) = word(i + 1);
    if ((sum & 0xFFFFU) == 0) return words[0] | (count == 2 ? words[1] << 16U : 0);
  }
  throw DeviceError(
      device.name() +
          ": the parameters in its EEPROM are damaged; write its table again with its "
          "maker's program",
      0);
}

void Tdc2Instrument::start(Device& device) {
  constexpr std::uint16_t running = idle_config | tdc2_config::collect | tdc2_config::lamp;
  send(device, tdc2_command16(Tdc2Command::write_config, running), patience);
  if (ask_surely(device, tdc2_command(Tdc2Command::start_stream), "to start") != 0) {
    throw DeviceError(device.name() + ": it is busy and does not start; switch it off and on again",
                      0);
  }
  // Bits that are 1 at the start tell of no loss.
  const auto status = ask(device, tdc2_command(Tdc2Command::status_word), patience);
  was_readable_ = status && *status != unreadable;
  status_ = was_readable_ ? *status : 0;
  heard_ = fitted_ = Clock::now();
  next_poll_ = heard_ + between_polls;
}

void Tdc2Instrument::stop(Device& device) {
  send(device, tdc2_command16(Tdc2Command::write_config, idle_config), short_patience);
  send(device, tdc2_command(Tdc2Command::stop_stream), short_patience);
  send(device, tdc2_command16(Tdc2Command::write_config, idle_config | tdc2_config::fifo_reset),
       short_patience);
}

std::string Tdc2Instrument::tend(Device& device, TagSink& sink) {
  const auto now = Clock::now();
  if (now - heard_ >= between_beats && now >= next_beat_) {
    next_beat_ = now + between_beats;
    send(device, tdc2_command(Tdc2Command::flush), short_patience);
    beat(sink);
  }
  if (now < next_poll_) return {};
  next_poll_ = now + between_polls;
  watch_records(device);
  std::string told = poll_status(device, sink);
  const std::uint64_t strays = decoder_.strays() + cut_records_;
  const std::uint64_t more = strays - std::exchange(told_strays_, strays);
  if (more == 0) return told;
  return (told.empty() ? told : told + "; ") + std::to_string(more) + " of its records are invalid";
}

// Makes a heartbeat that is not later than any record that is still to come.
void Tdc2Instrument::beat(TagSink& sink) {
  const auto passed = Clock::now() - heard_ - beat_margin;
  if (!decoder_.reached_ps() || passed <= passed.zero()) return;
  put_tag(heartbeat_tag(*decoder_.reached_ps() + to_ps(passed)), sink);
}

std::string Tdc2Instrument::poll_status(Device& device, TagSink& sink) {
  if (loss_seen_by_status_) end_loss(sink);
  const auto reply = ask(device, tdc2_command(Tdc2Command::status_word), short_patience);
  if (!reply) {
    if (++unanswered_ < most_unanswered) return {};
    throw DeviceError(device.name() + ": it does not answer any more; it is opened anew", 0);
  }
  unanswered_ = 0;
  if (*reply == unreadable) return count_unreadable(device, sink);
  const bool was_said = std::exchange(unreadable_, 0) >= unreadable_said;
  was_readable_ = true;
  const std::uint32_t risen = *reply & ~status_ & settings_.loss_bits;
  status_ = *reply;
  if (risen == 0) return was_said ? "its status word can be read again" : "";
  begin_loss(sink);
  loss_seen_by_status_ = true;
  std::array<char, 80> text{};
  std::snprintf(text.data(), text.size(), "its status word 0x%08x says that tags were lost",
                unsigned{*reply});
  return text.data();
}

std::string Tdc2Instrument::count_unreadable(const Device& device, TagSink& sink) {
  ++unreadable_;
  if (unreadable_ < unreadable_said) return {};
  if (was_readable_ && unreadable_ >= unreadable_ended) {
    throw DeviceError(
        device.name() + ": its status word (0xffffffff) cannot be read any more; it is opened anew",
        0);
  }
  if (decoder_.reached_ps()) put_tag(Tag{*decoder_.reached_ps(), -1, TagKind::missed, {}}, sink);
  if (unreadable_ % unreadable_again != unreadable_said) return {};
  return "its status word (0xffffffff) cannot be read: whether it loses tags is not known; switch "
         "it off and on again";
}

void Tdc2Instrument::watch_records(const Device& device) const {
  if (!decoder_.is_adrift() || Clock::now() - fitted_ < nonsense_patience) return;
  throw DeviceError(
      device.name() +
          ": it sends invalid or incomplete records; splid opens it again; check its cable",
      0);
}

void Tdc2Instrument::decode(std::span<const std::byte> bytes, TagSink& sink) {
  const auto now = Clock::now();
  if (decoder_.reached_ps()) {
    decoder_.set_horizon(*decoder_.reached_ps() + to_ps(now - heard_ + horizon_margin));
  }
  heard_ = now;
  // A loss by failed transfers ends with the first record after it.
  bool ends_loss = loss_open_ && !loss_seen_by_status_;
  while (bytes.size() >= Tdc2Decoder::record_bytes) {
    const std::size_t most = ends_loss ? Tdc2Decoder::record_bytes : bytes.size();
    const auto done = decoder_.decode(bytes.first(most), decoded_);
    bytes = bytes.subspan(done.bytes);
    put_tags(std::span(decoded_).first(done.tags), sink);
    if (ends_loss && done.tags > 0) {
      end_loss(sink);
      ends_loss = false;
    }
  }
  if (!decoder_.is_adrift()) fitted_ = now;
  // A transfer begins with a whole record, so that a part of a record at its end is lost.
  if (!bytes.empty() && decoder_.reached_ps()) {
    ++cut_records_;
    put_tag(Tag{*decoder_.reached_ps(), 1, TagKind::missed, {}}, sink);
  }
}

void Tdc2Instrument::cut(TagSink& sink) { begin_loss(sink); }

void Tdc2Instrument::end(TagSink& sink) {
  if (decoder_.reached_ps()) put_clock_end(*decoder_.reached_ps(), sink);
}

void Tdc2Instrument::begin_loss(TagSink& sink) {
  if (loss_open_ || !decoder_.reached_ps()) return;
  loss_open_ = true;
  put_tag(Tag{*decoder_.reached_ps(), 0, TagKind::loss_begin, {}}, sink);
}

void Tdc2Instrument::end_loss(TagSink& sink) {
  if (!loss_open_) return;
  loss_open_ = loss_seen_by_status_ = false;
  put_tag(Tag{*decoder_.reached_ps(), -1, TagKind::loss_end, {}}, sink);
}

}  // namespace splid::usb
