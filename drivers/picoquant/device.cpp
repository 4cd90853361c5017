#include "drivers/picoquant/device.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "protocol/text.hpp"

namespace splid::picoquant {
namespace {

constexpr int most_devices = 8;
constexpr int mode_t2 = 2;
constexpr int longest_measurement_ms = 360'000'000;  // 100 h, all four libraries' limit
constexpr int no_overflow_compression = 0;
constexpr std::size_t warnings_bytes = 16'384;  // as the libraries ask for
constexpr std::size_t most_warning_chars = 160;
constexpr std::string_view timeharp_pico = "TimeHarp 260 P";

using Text = std::array<char, 256>;

// Lines become parts of a sentence.
std::string one_line(std::string_view text) {
  std::string line;
  while (!text.empty()) {
    const std::string_view part = trimmed(take_until(text, '\n'), " \t\r.");
    if (!part.empty()) line.append(line.empty() ? "" : "; ").append(part);
  }
  if (line.size() > most_warning_chars) line = line.substr(0, most_warning_chars) + "...";
  return line;
}

}  // namespace

Device::Device(Library& library, const Options& options, const std::string& serial)
    : library_(library),
      options_(options),
      records_(static_cast<std::size_t>(library.traits().read_records)) {
  find(serial);
  try {
    configure();
  } catch (const LibraryError&) {
    library_.try_call("CloseDevice", index_);
    throw;
  }
}

Device::~Device() {
  library_.try_call("StopMeas", index_);
  library_.try_call("CloseDevice", index_);
}

// The libraries know instruments by indices, and tell the serial number when one was opened.
void Device::find(const std::string& serial) {
  const std::string product = library_.traits().product;
  std::string others, busy;
  for (int index = 0; index < most_devices; ++index) {
    Text found{};
    const int code = library_.try_call("OpenDevice", index, found.data());
    if (code >= 0) {
      if (serial.empty() || serial == found.data()) {
        index_ = index;
        serial_ = found.data();
        return;
      }
      others.append(others.empty() ? "" : ", ").append(found.data());
      library_.try_call("CloseDevice", index);
    } else if (const LibraryError error = library_.error("OpenDevice", code);
               error.device_is_busy()) {
      busy = error.what();
    } else if (!error.device_is_gone()) {
      throw LibraryError(error);
    }
  }
  std::string what = "no " + product + (serial.empty() ? "" : " " + serial) + " is plugged in";
  if (!others.empty()) what += "; there is " + others + ": name it as /serial to read that one";
  if (!busy.empty()) what = "a " + product + " is in use (" + busy + "): end the other program";
  throw DeviceAbsent(what);
}

void Device::configure() {
  const FamilyTraits& traits = library_.traits();
  if (traits.has_reference) {
    library_.call("Initialize", index_, mode_t2, static_cast<int>(options_.reference));
  } else {
    library_.call("Initialize", index_, mode_t2);
  }
  if (traits.has_calibration) library_.call("Calibrate", index_);
  Text model{}, part{}, version{};
  library_.call("GetHardwareInfo", index_, model.data(), part.data(), version.data());
  model_ = model.data();
  name_ = model_ + " " + serial_;
  // PHLib has no such function: one input beside the sync.
  if (options_.family != Family::picoharp300) {
    library_.call("GetNumOfInputChannels", index_, &inputs_);
  }
  set_sync();
  for (const InputOptions& input : options_.inputs) {
    if (input.input > inputs_) {
      throw LibraryError("it has inputs 1 to " + std::to_string(inputs_) + ", and /inputs " +
                         "names " + std::to_string(input.input));
    }
    set_input(input);
  }
  enable_inputs();
  set_markers();
  // So that time goes on in the dark too: wraps come one by one, not gathered up.
  if (options_.family == Family::multiharp) {
    library_.call("SetOflCompression", index_, no_overflow_compression);
  }
  double resolution_ps = 0;
  library_.call("GetResolution", index_, &resolution_ps);
  resolution_s_ = resolution_ps * 1e-12;
}

void Device::set_sync() {
  const TriggerOptions& sync = options_.sync;
  library_.call("SetSyncDiv", index_, static_cast<int>(options_.sync_divider));
  const int offset = static_cast<int>(sync.offset_ps);
  if (options_.family == Family::picoharp300) {
    library_.call("SetInputCFD", index_, 0, level(sync), zero_cross(sync));
    library_.call("SetSyncOffset", index_, offset);
    return;
  }
  if (has_discriminators()) {
    library_.call("SetSyncCFD", index_, level(sync), zero_cross(sync));
  } else {
    library_.call("SetSyncEdgeTrg", index_, level(sync), static_cast<int>(sync.edge));
  }
  library_.call("SetSyncChannelOffset", index_, offset);
}

// The functions count inputs from 0, the panel counts them from 1. A PicoHarp's input 0 is the
// sync, so that its input 1 is number 1 to both.
void Device::set_input(const InputOptions& input) {
  const TriggerOptions& trigger = input.trigger;
  if (options_.family == Family::picoharp300) {
    library_.call("SetInputCFD", index_, static_cast<int>(input.input), level(trigger),
                  zero_cross(trigger));
    return;
  }
  const int channel = static_cast<int>(input.input) - 1;
  if (has_discriminators()) {
    library_.call("SetInputCFD", index_, channel, level(trigger), zero_cross(trigger));
  } else {
    library_.call("SetInputEdgeTrg", index_, channel, level(trigger),
                  static_cast<int>(trigger.edge));
  }
  library_.call("SetInputChannelOffset", index_, channel, static_cast<int>(trigger.offset_ps));
}

void Device::enable_inputs() {
  if (options_.family == Family::picoharp300) return;  // it cannot switch them off
  for (int channel = 0; channel < inputs_; ++channel) {
    const bool on =
        std::any_of(options_.inputs.begin(), options_.inputs.end(),
                    [&](const InputOptions& each) { return each.input == channel + 1; });
    library_.call("SetInputChannelEnable", index_, channel, on ? 1 : 0);
  }
}

void Device::set_markers() {
  std::array<int, 4> edges{1, 1, 1, 1}, enabled{};
  for (const MarkerOptions& marker : options_.markers) {
    const auto place = static_cast<std::size_t>(marker.marker - 1);
    edges.at(place) = static_cast<int>(marker.edge);
    enabled.at(place) = 1;
  }
  library_.call("SetMarkerEdges", index_, edges[0], edges[1], edges[2], edges[3]);
  library_.call("SetMarkerEnable", index_, enabled[0], enabled[1], enabled[2], enabled[3]);
}

bool Device::has_discriminators() const {
  const Trigger trigger = library_.traits().trigger;
  return trigger == Trigger::constant_fraction ||
         (trigger == Trigger::by_model && model_ == timeharp_pico);
}

// HHLib and PHLib take the size of a negative level, the other libraries its number.
int Device::level(const TriggerOptions& trigger) const {
  const auto level_mv = static_cast<int>(trigger.level_mv);
  return library_.traits().trigger == Trigger::constant_fraction ? -level_mv : level_mv;
}

// The zero crossing of a TimeHarp 260 P is told as a negative number.
int Device::zero_cross(const TriggerOptions& trigger) const {
  const auto zero_cross_mv = static_cast<int>(trigger.zero_cross_mv);
  return options_.family == Family::timeharp260 ? -zero_cross_mv : zero_cross_mv;
}

void Device::start() { library_.call("StartMeas", index_, longest_measurement_ms); }

void Device::stop() { library_.call("StopMeas", index_); }

std::span<const std::byte> Device::read() {
  int count = 0;
  unsigned int* room = records_.data();
  // MHLib takes no count: the room has to be for as many as there may be.
  if (options_.family == Family::multiharp) {
    library_.call("ReadFiFo", index_, room, &count);
  } else {
    library_.call("ReadFiFo", index_, room, library_.traits().read_records, &count);
  }
  const auto most = static_cast<int>(records_.size());
  return std::as_bytes(std::span(records_))
      .first(static_cast<std::size_t>(std::clamp(count, 0, most)) * sizeof records_[0]);
}

int Device::flags() {
  int flags = 0;
  library_.call("GetFlags", index_, &flags);
  return flags;
}

bool Device::has_ended() {
  int ended = 0;
  library_.call("CTCStatus", index_, &ended);
  return ended != 0;
}

std::string Device::warnings() {
  int rate = 0;
  if (options_.family == Family::picoharp300) {
    library_.call("GetCountRate", index_, 0, &rate);
    library_.call("GetCountRate", index_, 1, &rate);
  } else {
    library_.call("GetSyncRate", index_, &rate);
    for (const InputOptions& input : options_.inputs) {
      library_.call("GetCountRate", index_, static_cast<int>(input.input) - 1, &rate);
    }
  }
  int warnings = 0;
  library_.call("GetWarnings", index_, &warnings);
  if (warnings == 0) return {};
  std::string text(warnings_bytes, '\0');
  library_.call("GetWarningsText", index_, text.data(), warnings);
  return one_line(text.c_str());
}

}  // namespace splid::picoquant
