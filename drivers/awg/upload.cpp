#include "drivers/awg/upload.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <span>
#include <utility>
#include <vector>

#include "drivers/awg/awg_model.hpp"
#include "drivers/awg/scpi_client.hpp"
#include "drivers/awg/waveform_samples.hpp"
#include "protocol/error.hpp"

namespace splid::awg {
namespace {

using Values = std::vector<std::pair<const char*, std::string>>;

// How many samples are sent or read at a time: 63 KiB. That is 42 times 768, which is a whole
// number of every model's granules (48, 128, 256).
constexpr std::int64_t slice_samples = 32'256;

// How much longer the stop of an upload takes where the generator does not answer.
constexpr double longest_undo_s = 2;

std::string exact(double number) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.15g", number);
  return text.data();
}

ScpiClient connect(const Options& options, const std::stop_token& stop) {
  if (options.address.empty()) {
    throw Error(Fault::usage, "awg/address: is missing; give the generator's HOST or HOST:PORT");
  }
  const std::chrono::milliseconds timeout(std::llround(options.timeout_s * 1e3));
  return {socket_address(options.address), timeout, stop};
}

// Fills in the words in braces of a model's commands.
Values values_of(const Options& options, const WaveformPlan& plan) {
  const bool is_external = options.reference == ReferenceClock::external_10_mhz;
  return {{"{rate}", exact(plan.rate_hz)},
          {"{reference}", is_external ? "EXT;:ROSC:FREQ 1E7" : "INT"},
          {"{amplitude}", exact(std::abs(options.pulse_v - options.rest_v))},
          {"{offset}", exact((options.pulse_v + options.rest_v) / 2)},
          {"{marker}", exact(options.marker_v)},
          {"{half_marker}", exact(options.marker_v / 2)},
          {"{samples}", std::to_string(plan.samples())}};
}

std::string filled_in(std::string command, const Values& values) {
  for (const auto& [word, value] : values) {
    const std::size_t place = command.find(word);
    if (place != std::string::npos) command.replace(place, std::string(word).size(), value);
  }
  return command;
}

std::string last_field(const std::string& text) {
  return text.substr(text.find_last_of(" ,") + 1);  // npos + 1 is 0
}

// Whether a setting came back as it was sent. Design note: levels come in steps of some 0.1 mV and
// are shown rounded, rates within some Hz of 6e10; a setting that was not taken is off by far more.
bool is_taken(double sent, double answered) {
  return std::abs(sent - answered) <= 0.005 + 1e-6 * std::abs(sent);
}

void check_setting(ScpiClient& client, const std::string& command, const char* query) {
  const std::string answer = client.ask(query);
  const auto sent = parse_scpi_number(last_field(command));
  const auto answered = parse_scpi_number(last_field(answer));
  if (sent && answered && is_taken(*sent, *answered)) return;
  client.fail(query, "answered \"" + shown_scpi(answer) + "\" after " + command);
}

void run(ScpiClient& client, std::span<const Step> steps, const Values& values) {
  for (const Step& step : steps) {
    const std::string command = filled_in(step.command, values);
    client.command(command);
    if (step.check != nullptr) check_setting(client, command, step.check);
  }
}

// Makes sure that the instrument is of the configured model, and clears its error queue.
std::string identify(ScpiClient& client, const Model& model) {
  const std::string line = client.ask("*IDN?");
  const auto identity = parse_scpi_identity(line);
  if (!identity || identity->model.find(model.identity) == std::string::npos) {
    client.fail("*IDN?", "answered \"" + shown_scpi(line) + "\"; awg.model is " + model.name +
                             ", which says " + model.identity);
  }
  client.command("*CLS");
  return shown_scpi(identity->maker) + " " + shown_scpi(identity->model) + " " +
         shown_scpi(identity->serial) + ", firmware " + shown_scpi(identity->firmware);
}

std::string place_of(std::int64_t first) { return ":TRAC1:DATA 1," + std::to_string(first) + ","; }

// The samples of an answer that is a line of numbers, each a byte of a pair or a whole word.
std::vector<std::int64_t> numbers_of(const std::string& bytes, SampleFormat format) {
  std::vector<std::int64_t> numbers;
  const auto byte_at = [&](std::size_t i) { return static_cast<std::int8_t>(bytes[i]); };
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    if (format == SampleFormat::byte_pair) {
      numbers.push_back(byte_at(i));
      numbers.push_back(byte_at(i + 1));
    } else {
      numbers.push_back(byte_at(i + 1) * 256 + static_cast<std::uint8_t>(bytes[i]));
    }
  }
  return numbers;
}

// After something went wrong, ends play and switches the outputs off. It does so over a connection
// of its own, since answers to earlier queries may still come in the other. It cannot be stopped,
// since a laser may be firing. Returns whether it went well, in words for the end of a sentence.
std::string switched_off(const Options& options, const Model& model) {
  try {
    Options hasty = options;
    hasty.timeout_s = std::min(options.timeout_s, longest_undo_s);
    ScpiClient client = connect(hasty, {});
    client.command("*CLS");
    run(client, model.undo, {});
    return "its outputs were switched off";
  } catch (const std::exception& error) {
    return std::string("whether its outputs are off is not known (") + error.what() +
           "): look at it; splid upload --stop switches them off";
  }
}

class Upload {
 public:
  Upload(ScpiClient& client, const Options& options, const WaveformPlan& plan,
         const UploadProgress& progress)
      : client_(client),
        options_(options),
        model_(models()[options.model]),
        plan_(plan),
        progress_(progress) {}

  // Returns the rate that the generator has, which its clock may have rounded.
  double run_all() {
    const Values values = values_of(options_, plan_);
    run(client_, model_.stop, values);
    run(client_, model_.mode, values);
    run(client_, model_.prepare, values);
    const double rate_hz = check_rate();
    in_slices("sending", [this](std::int64_t first, std::int64_t count) { send(first, count); });
    if (options_.read_back) {
      in_slices("comparing",
                [this](std::int64_t first, std::int64_t count) { compare(first, count); });
    }
    run(client_, model_.play, values);
    return rate_hz;
  }

 private:
  double check_rate() {
    const double rate_hz = client_.ask_number(":FREQ:RAST?");
    if (is_taken(plan_.rate_hz, rate_hz)) return rate_hz;
    client_.fail(":FREQ:RAST?",
                 "answered " + exact(rate_hz) + " Sa/s; " + exact(plan_.rate_hz) + " were set");
  }

  template <class Do>
  void in_slices(const char* what, const Do& act) {
    for (std::int64_t first = 0; first < plan_.samples(); first += slice_samples) {
      progress_(what, static_cast<double>(first) / static_cast<double>(plan_.samples()));
      act(first, std::min(slice_samples, plan_.samples() - first));
    }
    progress_(what, 1);
  }

  [[nodiscard]] std::string samples(std::int64_t first, std::int64_t count) const {
    return waveform_samples(plan_, model_, options_.pulse_v > options_.rest_v, first, count);
  }

  void send(std::int64_t first, std::int64_t count) {
    client_.command(place_of(first), samples(first, count));
  }

  void compare(std::int64_t first, std::int64_t count) {
    const std::string query =
        ":TRAC1:DATA? 1," + std::to_string(first) + "," + std::to_string(count);
    // As numbers each byte takes up to five characters.
    const auto max_bytes = static_cast<std::size_t>(count * sample_bytes * 5);
    const ScpiClient::Data data = client_.ask_data(query, max_bytes);
    const std::string expected = samples(first, count);
    if (data.is_block) {
      compare(query, expected, data.content);
      return;
    }
    const auto numbers = parse_scpi_integers(data.content);
    if (!numbers) {
      client_.fail(query, "answered \"" + shown_scpi(data.content) + "\", which are no samples");
    }
    compare(query, numbers_of(expected, model_.format), *numbers);
  }

  template <class Content>
  void compare(const std::string& query, const Content& expected, const Content& answered) {
    if (expected == answered) return;
    if (expected.size() != answered.size()) {
      client_.fail(query, "answered " + std::to_string(answered.size()) + " values; it was sent " +
                              std::to_string(expected.size()));
    }
    const auto place = std::mismatch(expected.begin(), expected.end(), answered.begin()).first;
    client_.fail(query, "value " + std::to_string(place - expected.begin()) +
                            " of the answer is not the one sent");
  }

  ScpiClient& client_;
  const Options& options_;
  const Model& model_;
  const WaveformPlan& plan_;
  const UploadProgress& progress_;
};

}  // namespace

Uploaded upload(const Options& options, const Pattern& pattern, const UploadProgress& progress,
                const std::stop_token& stop) {
  const Model& model = models()[options.model];
  const WaveformPlan plan = plan_waveform(pattern, model, options);
  progress("connecting", 0);
  Uploaded uploaded;
  bool is_known = false;  // whether it is the configured model, to which commands may be sent
  try {
    ScpiClient client = connect(options, stop);
    uploaded.instrument = identify(client, model);
    is_known = true;
    const double rate_hz = Upload(client, options, plan, progress).run_all();
    uploaded.played = played_pattern(pattern, plan, rate_hz);
    return uploaded;
  } catch (const Error& error) {
    if (!is_known) throw;
    throw Error(error.fault(), error.what() + ("; " + switched_off(options, model)));
  } catch (...) {
    if (is_known) switched_off(options, model);
    throw;
  }
}

std::string switch_off(const Options& options, const std::stop_token& stop) {
  const Model& model = models()[options.model];
  ScpiClient client = connect(options, stop);
  std::string instrument = identify(client, model);
  run(client, model.stop, {});
  return instrument;
}

}  // namespace splid::awg
