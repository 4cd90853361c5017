#include "drivers/idq/measurement.hpp"

#include <algorithm>
#include <thread>
#include <utility>

namespace splid::idq {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds between_steps{2};
constexpr milliseconds between_counts{10};
constexpr milliseconds between_questions{40};

// What the data link program counted but did not send in this time does not come any more.
// Less than a sub-acquisition, so that the next one is not lost with it.
constexpr milliseconds longest_open{150};
// The longest sub-acquisition takes a second.
constexpr milliseconds longest_silence{2000};

}  // namespace

Measurement::Measurement(TimeController& controller, const Options& options, TagSink& sink,
                         const Report& report)
    : controller_(controller),
      options_(options),
      sink_(sink),
      report_(report),
      join_(options.inputs.size(), options.period_ps()),
      release_(options, sink),
      accounts_(options.inputs.size()),
      went_on_(steady_clock::now()) {}

void Measurement::run(const std::stop_token& stop) {
  report_({DeviceState::connected, "", controller_.name()});
  try {
    while (!stop.stop_requested()) {
      step(steady_clock::now());
      std::this_thread::sleep_for(between_steps);
    }
  } catch (const std::runtime_error&) {
    release_.flush();
    if (release_.has_begun()) put_clock_end(release_.reached_ps(), sink_);
    throw;
  }
}

void Measurement::step(Time now) {
  receive();
  watch_data_link(now);
  watch_instrument(now);
  hand_on(now);
}

void Measurement::receive() {
  for (std::size_t i = 0; i < options_.inputs.size(); ++i) {
    MessageSocket& socket = *controller_.streams().at(i).socket;
    while (const std::optional<std::string> message = socket.receive(milliseconds{0})) {
      if (join_.add(i, *message)) continue;
      throw MeasurementOver("what came on " + input_name(i) +
                            " were no times of a sub-acquisition");
    }
  }
}

// Asks for the inputs' counts in turn.
void Measurement::watch_data_link(Time now) {
  if (controller_.data_link().is_waiting()) {
    const std::optional<TimeController::Count> count = controller_.count();
    if (count) settle(*count, now);
  } else if (now >= next_count_) {
    next_count_ = now + between_counts;
    counted_ = (counted_ + 1) % accounts_.size();
    controller_.ask_count(counted_);
  }
}

void Measurement::settle(const TimeController::Count& count, Time now) {
  receive();  // what was counted may have come since
  std::optional<Time>& open_since = accounts_.at(counted_).open_since;
  switch (join_.settle(counted_, count.acquisitions, count.times)) {
    case Join::Account::settled:
      open_since.reset();
      break;
    case Join::Account::open:
      if (!open_since) open_since = now;
      if (now - *open_since < longest_open) break;
      open_since.reset();
      tell_lost(join_.give_up(counted_));
      break;
    case Join::Account::fell:
      throw MeasurementOver("the data link program counts anew");
  }
}

// Asks in turn how many times were lost on an input, and whether the measurement goes on.
void Measurement::watch_instrument(Time now) {
  Dialogue& instrument = controller_.instrument();
  if (instrument.is_waiting()) {
    const std::optional<std::string> reply = instrument.answer();
    if (!reply) return;
    if (asked_ < accounts_.size()) {
      heed_errors(controller_.number(question_, *reply));
    } else if (!reply->starts_with("PLAYING") && !reply->starts_with("Playing")) {
      throw MeasurementOver("its acquisition was stopped by somebody else");
    }
  } else if (now >= next_question_) {
    next_question_ = now + between_questions;
    asked_ = (asked_ + 1) % (accounts_.size() + 1);
    question_ = asked_ == accounts_.size()
                    ? "REC:STAGe?"
                    : "RAW" + std::to_string(options_.inputs.at(asked_).input) + ":ERRORS?";
    instrument.send(question_);
  }
}

void Measurement::tell_lost(std::int64_t count) {
  const std::string what =
      count == 1 ? "a sub-acquisition" : std::to_string(count) + " sub-acquisitions";
  tell(what + " of " + input_name(counted_) + " did not come whole");
}

void Measurement::heed_errors(std::int64_t errors) {
  if (errors > std::exchange(accounts_.at(asked_).errors, errors)) {
    join_.doubt();
    tell("it lost times of " + input_name(asked_) + ": more events than it can send");
  }
}

void Measurement::hand_on(Time now) {
  while (std::optional<SubAcquisition> part = join_.take()) {
    release_.add(*std::move(part), now);
    went_on_ = now;
  }
  if (now - went_on_ > longest_silence) {
    throw Refusal(controller_.name() + ": no sub-acquisition came for " +
                  std::to_string(longest_silence.count() / 1000) + " s");
  }
  release_.run(now);
  sink_.publish(0);
}

void Measurement::tell(const std::string& event) {
  report_({DeviceState::connected, controller_.name() + ": " + event, controller_.name()});
}

std::string Measurement::input_name(std::size_t input) const {
  return "input " + std::to_string(options_.inputs.at(input).input);
}

}  // namespace splid::idq
