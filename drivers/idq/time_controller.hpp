#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "drivers/idq/dialogue.hpp"
#include "drivers/idq/options.hpp"

namespace splid::idq {

// The instrument or the data link program refused something, or answered what cannot be read.
class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A Time Controller that measures: it is set as the options say, and the data link program hands
// out the times of each input. The destructor ends the measurement.
//
// Sources of the facts: programs that use the instrument, on github.com (MSLNZ/pr-time-controller,
// and the maker's examples in several laboratories' repositories).
//
// Threads: one. Errors: NoAnswer and Refusal, and what `idle` throws.
class TimeController {
 public:
  struct Stream {
    std::string id;  // in the data link program
    std::unique_ptr<MessageSocket> socket;
  };
  // What the data link program has counted on an input.
  struct Count {
    std::int64_t acquisitions = 0;
    std::uint64_t times = 0;
  };

  // idle: called every 10 ms while an answer is waited for. options: outlives this object.
  TimeController(const Options& options, const std::function<void()>& idle);
  ~TimeController();
  TimeController(const TimeController&) = delete;
  TimeController& operator=(const TimeController&) = delete;

  // As the instrument calls itself.
  [[nodiscard]] const std::string& name() const { return name_; }
  // In the order of the options' inputs.
  std::vector<Stream>& streams() { return streams_; }

  // Asks for the count of an input; count() has it once it is there.
  void ask_count(std::size_t input);
  std::optional<Count> count();
  // Asks for what `question` means to the instrument; reply() has it once it is there.
  Dialogue& instrument() { return instrument_; }
  Dialogue& data_link() { return data_link_; }
  // The whole number that the instrument answered.
  std::int64_t number(const std::string& question, const std::string& reply) const;

 private:
  using Idle = std::function<void()>;

  void end_streams_of_before(const Idle& idle);
  void set_clock(const Idle& idle);
  void set_input(const InputOptions& input, const Idle& idle);
  void set_acquisition(const Idle& idle);
  void open_stream(std::int64_t input, const Idle& idle);
  void command(const std::string& text, const Idle& idle,
               std::chrono::milliseconds patience = Dialogue::usual_patience);
  nlohmann::json tell_data_link(const std::string& text, const Idle& idle);
  [[nodiscard]] nlohmann::json read_reply(const std::string& reply) const;

  const Options& options_;
  Dialogue instrument_;
  Dialogue data_link_;
  std::string name_;
  std::vector<Stream> streams_;
};

}  // namespace splid::idq
