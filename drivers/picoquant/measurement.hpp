#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>

#include "drivers/picoquant/device.hpp"
#include "drivers/source.hpp"
#include "protocol/ptu_decode.hpp"

namespace splid::picoquant {

// What an open instrument measures, from its records to tags, until something goes wrong with it.
// Where only the measurement is over, a new one begins, with a loss and a clock that begins anew.
//
// Threads: one. Errors: run() throws LibraryError; the tags until then are in the sink, and the end
// of the clock too.
class Measurement {
 public:
  using Report = std::function<void(const DeviceReport&)>;

  // All of them outlive this object.
  Measurement(Device& device, const FamilyTraits& traits, TagSink& sink, const Report& report);

  // Returns once a stop was requested.
  void run(const std::stop_token& stop);

 private:
  using Time = std::chrono::steady_clock::time_point;

  void begin();
  void begin_anew(const std::string& why);
  void step();
  const Flag* look_at_flags();
  bool decode(std::span<const std::byte> records);
  void number(std::span<Tag> tags);
  void watch(bool went_on);
  void report(DeviceState state, const std::string& reason);
  void tell(const std::string& event);

  Device& device_;
  const FamilyTraits& traits_;
  TagSink& sink_;
  const Report& report_;
  std::optional<PtuDecoder> decoder_;
  std::int64_t latest_ps_ = 0;  // that a record told of
  bool has_time_ = false;       // a record has come
  int flags_ = 0;
  bool drops_counts_ = false;  // since the last read
  std::string flag_words_;     // of what holds
  std::string warnings_;
  Time went_on_;     // when a record last came
  Time next_look_;   // at the warnings
  Time next_event_;  // when an event may be told again
};

}  // namespace splid::picoquant
