#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/idq/join.hpp"
#include "drivers/idq/release.hpp"
#include "drivers/idq/time_controller.hpp"
#include "drivers/source.hpp"

namespace splid::idq {

// The measurement is over, and the next one begins at time 0.
class MeasurementOver : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What a Time Controller measures, from messages to tags, until something goes wrong with it.
//
// Threads: one. Errors: run() throws MeasurementOver, NoAnswer and Refusal; the tags until then are
// in the sink, and the end of the clock too.
class Measurement {
 public:
  using Report = std::function<void(const DeviceReport&)>;

  // All of them outlive this object.
  Measurement(TimeController& controller, const Options& options, TagSink& sink,
              const Report& report);

  // Returns once a stop was requested.
  void run(const std::stop_token& stop);

 private:
  using Time = std::chrono::steady_clock::time_point;

  struct Account {
    std::optional<Time> open_since;
    std::int64_t errors = 0;  // that the instrument counts
  };

  void step(Time now);
  void receive();
  void watch_data_link(Time now);
  void settle(const TimeController::Count& count, Time now);
  void watch_instrument(Time now);
  void tell_lost(std::int64_t count);
  void heed_errors(std::int64_t errors);
  void hand_on(Time now);
  void tell(const std::string& event);
  [[nodiscard]] std::string input_name(std::size_t input) const;

  TimeController& controller_;
  const Options& options_;
  TagSink& sink_;
  const Report& report_;
  Join join_;
  Release release_;
  std::vector<Account> accounts_;
  std::size_t counted_ = 0;  // the input whose count was asked for last
  std::size_t asked_ = 0;    // of the instrument: an input's errors, or behind them its stage
  std::string question_;
  Time next_count_;
  Time next_question_;
  Time went_on_;  // when a sub-acquisition was last complete
};

}  // namespace splid::idq
