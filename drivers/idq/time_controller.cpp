#include "drivers/idq/time_controller.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <string_view>
#include <utility>

#include "protocol/json_value.hpp"

namespace splid::idq {
namespace {

using std::chrono::milliseconds;

// It may calibrate itself when its clock or its resolution changes.
constexpr milliseconds patience_of_clock{10'000};
constexpr milliseconds patience_of_end{100};

constexpr std::size_t most_name = 60;

// tcp:HOST:PORT without tcp:.
std::string place_of(const std::string& address) { return address.substr(address.find(':') + 1); }

std::string host_of(const std::string& address) {
  const std::string place = place_of(address);
  return place.substr(0, place.rfind(':'));
}

// One line of what an instrument calls itself.
std::string first_line(const std::string& text) {
  std::string line = text.substr(0, std::min(text.find_first_of("\r\n"), most_name));
  for (char& letter : line) {
    const bool is_plain = letter >= ' ' && letter <= '~';
    if (!is_plain) letter = ' ';
  }
  return line.substr(0, line.find_last_not_of(' ') + 1);
}

std::string block(const char* name, std::int64_t number) { return name + std::to_string(number); }

std::string volts(std::int64_t mv) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3fV", static_cast<double>(mv) * 1e-3);
  return text;
}

}  // namespace

TimeController::TimeController(const Options& options, const Idle& idle)
    : options_(options),
      instrument_(options.open_socket(SocketKind::request, place_of(options.address)),
                  "the Time Controller at " + place_of(options.address)),
      data_link_(options.open_socket(SocketKind::request, place_of(options.data_link)),
                 "the data link program at " + place_of(options.data_link)) {
  name_ = first_line(instrument_.ask("*IDN?", idle));
  if (name_.empty()) name_ = "Time Controller";
  end_streams_of_before(idle);
  (void)instrument_.ask("REC:STOP", idle);  // refused where nothing plays
  set_clock(idle);
  for (const InputOptions& input : options.inputs) set_input(input, idle);
  set_acquisition(idle);
  for (const InputOptions& input : options.inputs) open_stream(input.input, idle);
  command("REC:PLAY", idle);
}

TimeController::~TimeController() {
  const Idle none = [] {};
  try {
    if (instrument_.finish(patience_of_end)) {
      (void)instrument_.ask("REC:STOP", none, patience_of_end);
      for (const InputOptions& input : options_.inputs) {
        (void)instrument_.ask(block("RAW", input.input) + ":SEND OFF", none, patience_of_end);
      }
    }
    if (!data_link_.finish(patience_of_end)) return;
    for (const Stream& stream : streams_) {
      (void)data_link_.ask("stop --id " + stream.id, none, patience_of_end);
    }
  } catch (const NoAnswer&) {
    // Whoever measures with it next ends what goes on.
  }
}

// Of a bridge that was killed. Those of other instruments are left alone.
void TimeController::end_streams_of_before(const Idle& idle) {
  const nlohmann::json list = tell_data_link("list", idle);
  if (!list.is_array()) return;
  const std::string beginning = host_of(options_.address) + ":";
  for (const nlohmann::json& each : list) {
    if (!each.is_string() || !each.get<std::string>().starts_with(beginning)) continue;
    (void)tell_data_link("stop --id " + each.get<std::string>(), idle);
  }
}

void TimeController::set_clock(const Idle& idle) {
  const bool is_internal = options_.reference == Reference::internal;
  command(is_internal ? "DEVI:SYNC INTERNAL" : "DEVI:SYNC EXTERNAL", idle, patience_of_clock);
  command("DEVI:RES HIRES", idle, patience_of_clock);
}

// The input goes through a delay and a combiner, which lets all of it pass, to the times.
void TimeController::set_input(const InputOptions& input, const Idle& idle) {
  const std::string in = block("INPU", input.input);
  const std::string delay = block("DELA", input.input);
  const std::string combiner = block("TSCO", input.input + 4);
  const std::string raw = block("RAW", input.input);
  const auto set = [&](std::string text, const std::string& value) {
    command(text += value, idle);
  };
  set(in, ":COUP DC");
  set(in, input.edge == Edge::rising ? ":EDGE RISING" : ":EDGE FALLING");
  set(in + ":THRE ", volts(input.level_mv));
  set(in, ":SELE UNSHAPED");
  set(in, ":ENAB ON");
  set(delay + ":LINK ", in);
  set(delay + ":VALU ", std::to_string(input.delay_ps));
  set(combiner + ":FIR:LINK ", delay);
  set(combiner, ":OPIN ONLYFIR");
  set(combiner, ":OPOU ONLYFIR");
  set(combiner, ":WIND:ENAB OFF");
  set(raw + ":STOP:LINK ", combiner);
  set(raw, ":REF:LINK NONE");
}

void TimeController::set_acquisition(const Idle& idle) {
  command("REC:TRIG:ARM:MODE MANUal", idle);
  command("REC:ENABle ON", idle);
  command("REC:NUM INF", idle);
  command("REC:PWID " + std::to_string(options_.width_ps()) + ";PPER " +
              std::to_string(options_.period_ps()),
          idle);
}

void TimeController::open_stream(std::int64_t input, const Idle& idle) {
  command(block("RAW", input) + ":ERRORS:CLEAR", idle);
  const std::string port = std::to_string(options_.stream_port + input);
  Stream stream;
  stream.socket = options_.open_socket(SocketKind::pair, host_of(options_.data_link) + ":" + port);
  const std::string question = "start-stream --address " + host_of(options_.address) +
                               " --channel " + std::to_string(input) + " --stream-port " + port;
  const nlohmann::json reply = tell_data_link(question, idle);
  const auto id = reply.is_object() ? reply.find("id") : reply.end();
  if (id == reply.end() || !id->is_string()) {
    throw Refusal(data_link_.whose() + " names no id (" + question + ")");
  }
  stream.id = id->get<std::string>();
  streams_.push_back(std::move(stream));
  command(block("RAW", input) + ":SEND ON", idle);
}

void TimeController::command(const std::string& text, const Idle& idle, milliseconds patience) {
  const std::string reply = instrument_.ask(text, idle, patience);
  const auto has = [&reply](const char* words) { return reply.find(words) != std::string::npos; };
  if (has("SCPI_ERR_INVALID_CMD")) {
    throw Refusal(name_ + " does not know " + text +
                  ": its firmware is of a version that splid does not know");
  }
  if (has("SCPI_ERR") || has("failed") || has("No connection")) {
    throw Refusal(name_ + " refuses " + text + ": " + first_line(reply));
  }
}

nlohmann::json TimeController::tell_data_link(const std::string& text, const Idle& idle) {
  return read_reply(data_link_.ask(text, idle));
}

nlohmann::json TimeController::read_reply(const std::string& reply) const {
  if (reply.find_first_not_of(" \r\n") == std::string::npos) return nullptr;
  nlohmann::json value = json_value_if_any(reply);
  if (value.is_discarded()) throw Refusal(data_link_.whose() + " sends an answer that is not JSON");
  const auto error = value.is_object() ? value.find("error") : value.end();
  if (error == value.end() || error->is_null()) return value;
  const auto words = error->is_object() ? error->find("description") : error->end();
  const bool is_told = words != error->end() && words->is_string();
  throw Refusal(data_link_.whose() + " refuses: " +
                (is_told ? first_line(words->get<std::string>()) : "it gives no reason"));
}

void TimeController::ask_count(std::size_t input) {
  data_link_.send("status --id " + streams_.at(input).id);
}

std::optional<TimeController::Count> TimeController::count() {
  const std::optional<std::string> reply = data_link_.answer();
  if (!reply) return std::nullopt;
  const nlohmann::json value = read_reply(*reply);
  const auto number = [&](const char* key) {
    const auto member = value.is_object() ? value.find(key) : value.end();
    if (member == value.end() || !member->is_number_integer() || *member < 0) {
      throw Refusal(data_link_.whose() + " sends no " + key);
    }
    return member->get<std::int64_t>();
  };
  return Count{number("acquisitions_count"),
               static_cast<std::uint64_t>(number("timestamps_count"))};
}

std::int64_t TimeController::number(const std::string& question, const std::string& reply) const {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(reply.data(), reply.data() + reply.size(), value);
  if (error != std::errc{}) {
    throw Refusal(name_ + " answers " + question + " with no number: " + first_line(reply));
  }
  return value;
}

}  // namespace splid::idq
