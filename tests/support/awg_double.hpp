#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/scpi_server.hpp"

namespace splid::test {

// What is wrong with a generator beyond what it says.
struct AwgFaults : ScpiFaults {
  bool short_answers = false;  // reads back half of what it was asked for
  bool wrong_sample = false;   // one of the samples that it keeps
};

// A waveform generator on a TCP port: takes the commands of a Keysight M8195A (marker mode) or
// M8190A (14 bits), refuses what they refuse, and plays back what it holds. Its limits are written
// here again, from the instruments' guides, so that a wrong one in the product shows.
class AwgDouble {
 public:
  enum class Model { m8195a, m8190a };
  enum class ReadBack { numbers, block };

  // rate_step_hz: rates are rounded to it, as a clock does.
  explicit AwgDouble(Model model = Model::m8195a, AwgFaults faults = {},
                     ReadBack read_back = ReadBack::numbers, double rate_step_hz = 0)
      : model_(model),
        faults_(std::move(faults)),
        read_back_(read_back),
        rate_step_hz_(rate_step_hz),
        scpi_(faults_) {
    const auto lock = scpi_.lock();
    add_commands();
  }

  [[nodiscard]] std::string address() const { return scpi_.address(); }
  [[nodiscard]] std::size_t errors() { return scpi_.errors(); }
  [[nodiscard]] std::vector<std::string> heard() { return scpi_.heard(); }

  // One loop of the memory, as it comes out; nothing where nothing is played.
  struct Played {
    double loop_ps = 0;
    double sample_ps = 0;
    std::vector<double> pulses_ps;  // where each goes beyond the middle of rest and pulse
    std::vector<double> markers_ps;
    std::int64_t pulse_samples = 0;  // of all together
  };
  // rest_v: the level that pulses rise or fall from.
  [[nodiscard]] Played played(double rest_v) {
    const auto lock = scpi_.lock();
    Played out;
    if (!playing_ || !outputs_["1"] || (model_ == Model::m8195a && !outputs_["3"])) return out;
    out.sample_ps = 1e12 / rate_hz_;
    out.loop_ps = out.sample_ps * static_cast<double>(samples_);
    bool marker_before = marker(samples_ - 1);
    bool pulse_before = is_pulse(samples_ - 1, rest_v);
    for (std::int64_t i = 0; i < samples_; ++i) {
      const double at_ps = static_cast<double>(i) * out.sample_ps;
      const bool is_marker = marker(i);
      const bool pulse = is_pulse(i, rest_v);
      if (is_marker && !marker_before) out.markers_ps.push_back(at_ps);
      if (pulse && !pulse_before) out.pulses_ps.push_back(at_ps);
      out.pulse_samples += pulse ? 1 : 0;
      marker_before = is_marker;
      pulse_before = pulse;
    }
    return out;
  }
  // Of the loudest level, V.
  [[nodiscard]] double farthest_v(double rest_v) {
    const auto lock = scpi_.lock();
    double farthest = rest_v;
    for (std::int64_t i = 0; i < samples_; ++i) {
      if (std::abs(volts(i) - rest_v) > std::abs(farthest - rest_v)) farthest = volts(i);
    }
    return farthest;
  }
  [[nodiscard]] bool playing() {
    const auto lock = scpi_.lock();
    return playing_;
  }
  [[nodiscard]] bool any_output_is_on() {
    const auto lock = scpi_.lock();
    return std::any_of(outputs_.begin(), outputs_.end(),
                       [](const auto& each) { return each.second; });
  }

 private:
  using Arguments = ScpiServer::Arguments;

  void fail(int code, const std::string& what) { scpi_.fail(code, what); }
  void out_of_range() { fail(-222, "Data out of range"); }
  void conflict() { fail(-221, "Settings conflict"); }

  // Sets a number from its range, while nothing is played.
  std::function<void(const Arguments&)> number(double& value, double least, double most) {
    return [this, &value, least, most](const Arguments& given) {
      char* end = nullptr;
      const double wanted = std::strtod(given[0].c_str(), &end);
      if (end == given[0].c_str() || *end != '\0') {
        fail(-104, "Data type error");
      } else if (!(wanted >= least && wanted <= most)) {
        out_of_range();
      } else if (playing_) {
        conflict();
      } else {
        value = wanted;
      }
    };
  }
  std::function<std::string(const Arguments&)> shown(const double& value) {
    return [&value](const Arguments&) {
      char text[40];
      std::snprintf(text, sizeof text, "%+.14E", value);
      return std::string(text);
    };
  }
  void setting(const std::string& name, double& value, double least, double most) {
    scpi_.commands[name] = number(value, least, most);
    scpi_.queries[name + "?"] = shown(value);
  }
  // A command that takes one of several words.
  void word(const std::string& name, const std::vector<std::string>& words) {
    scpi_.commands[name] = [this, name, words](const Arguments& given) {
      if (std::find(words.begin(), words.end(), given[0]) == words.end()) {
        fail(-224, "Illegal parameter value");
      } else {
        words_[name] = given[0];
      }
    };
  }

  void add_commands() {
    scpi_.queries["*IDN?"] = [this](const Arguments&) {
      return std::string("Keysight Technologies,") + (is_m8195a() ? "M8195A" : "M8190A") +
             ",DE00000001,4.0.0.0-1";
    };
    scpi_.commands[":ABOR"] = [this](const Arguments&) { playing_ = false; };
    word(":ROSC:SOUR", {"INT", "EXT", "AXI"});
    scpi_.commands[":ROSC:FREQ"] = [this](const Arguments& given) {
      if (words_[":ROSC:SOUR"] != "EXT") return conflict();
      if (given[0] != "1E7") out_of_range();
    };
    const double least_hz = is_m8195a() ? 53.76e9 : 125e6;
    const double most_hz = is_m8195a() ? 65e9 : 8e9;
    setting(":FREQ:RAST", asked_rate_hz_, least_hz, most_hz);
    const auto take = scpi_.commands[":FREQ:RAST"];
    scpi_.commands[":FREQ:RAST"] = [this, take](const Arguments& given) {
      take(given);
      rate_hz_ = rate_step_hz_ > 0 ? std::round(asked_rate_hz_ / rate_step_hz_) * rate_step_hz_
                                   : asked_rate_hz_;
    };
    scpi_.queries[":FREQ:RAST?"] = shown(rate_hz_);
    add_memory();
    add_play();
    is_m8195a() ? add_m8195a() : add_m8190a();
  }

  void add_m8195a() {
    word(":INST:DACM", {"SING", "DUAL", "FOUR", "MARK", "DCD", "DCM"});
    word(":TRAC1:MMOD", {"INT", "EXT"});
    word(":INST:MEM:EXT:RDIV", {"DIV1", "DIV2", "DIV4"});
    word(":FUNC:MODE", {"ARB", "STS", "STSC"});
    word(":INIT:CONT:STAT", {"ON", "OFF"});
    word(":INIT:GATE:STAT", {"ON", "OFF"});
    setting(":VOLT1", amplitude_v_, 0.075, 1);
    setting(":VOLT1:OFFS", offset_v_, -1, 3.3);
    setting(":VOLT3", marker_v_, 0.075, 1);
    setting(":VOLT3:OFFS", marker_offset_v_, -1, 3.3);
    scpi_.commands[":OUTP3"] = [this](const Arguments& given) { outputs_["3"] = given[0] == "ON"; };
    scpi_.commands[":INIT:IMM"] = [this](const Arguments&) {
      start(words_[":INST:DACM"] == "MARK" && words_[":FUNC:MODE"] == "ARB" &&
            words_[":INIT:CONT:STAT"] == "ON" && words_[":INIT:GATE:STAT"] == "OFF");
    };
  }

  void add_m8190a() {
    word(":TRAC1:DWID", {"WSP", "WPR"});
    word(":OUTP1:ROUT", {"DAC", "DC", "AC"});
    word(":FUNC1:MODE", {"ARB", "STS", "STSC"});
    word(":INIT:CONT1", {"ON", "OFF"});
    word(":INIT:GATE1", {"ON", "OFF"});
    setting(":VOLT1:AMPL", amplitude_v_, 0.15, 1);
    setting(":VOLT1:OFFS", offset_v_, -1, 3);
    setting(":MARK1:SAMP:VOLT:AMPL", marker_v_, 0, 2.25);
    setting(":MARK1:SAMP:VOLT:OFFS", marker_offset_v_, -0.5, 1.75);
    scpi_.commands[":INIT:IMM1"] = [this](const Arguments&) {
      start(words_[":TRAC1:DWID"] == "WPR" && words_[":OUTP1:ROUT"] == "DC" &&
            words_[":FUNC1:MODE"] == "ARB" && words_[":INIT:CONT1"] == "ON" &&
            words_[":INIT:GATE1"] == "OFF");
    };
  }

  void add_play() {
    scpi_.commands[":OUTP1"] = [this](const Arguments& given) { outputs_["1"] = given[0] == "ON"; };
    scpi_.commands[":TRAC1:SEL"] = [this](const Arguments& given) {
      if (given[0] != "1" || samples_ == 0) return out_of_range();
      selected_ = 1;
    };
    scpi_.queries[":TRAC1:SEL?"] = [this](const Arguments&) { return std::to_string(selected_); };
  }

  void add_memory() {
    scpi_.commands[":TRAC1:DEL:ALL"] = [this](const Arguments&) {
      if (playing_) return conflict();
      samples_ = 0;
      selected_ = 0;
      memory_.clear();
    };
    scpi_.commands[":TRAC1:DEF"] = [this](const Arguments& given) {
      const std::int64_t length = std::atoll(given[1].c_str());
      if (playing_ || samples_ != 0) return conflict();
      if (length < least() || length > most() || length % granule() != 0) return out_of_range();
      samples_ = length;
      memory_.assign(static_cast<std::size_t>(2 * length), '\0');
    };
    scpi_.queries[":TRAC1:CAT?"] = [this](const Arguments&) {
      return samples_ == 0 ? std::string("0,0") : "1," + std::to_string(samples_);
    };
    scpi_.commands[":TRAC1:DATA"] = [this](const Arguments& given) { load(given); };
    scpi_.queries[":TRAC1:DATA?"] = [this](const Arguments& given) { return read(given); };
  }

  void load(const Arguments& given) {
    const auto first = static_cast<std::size_t>(std::atoll(given[1].c_str()));
    const std::string& block = given[2];
    if (playing_ || given[0] != "1") return conflict();
    if (block.size() < 2 || block[0] != '#') return fail(-161, "Invalid block data");
    const std::string content = block.substr(2 + static_cast<std::size_t>(block[1] - '0'));
    if (content.size() % 2 != 0) return fail(-161, "Invalid block data");
    const auto granule_samples = static_cast<std::size_t>(granule());
    if (first % granule_samples != 0 || content.size() / 2 % granule_samples != 0) {
      return out_of_range();
    }
    if (2 * first + content.size() > memory_.size()) return fail(-223, "Too much data");
    std::copy(content.begin(), content.end(),
              memory_.begin() + static_cast<std::ptrdiff_t>(2 * first));
    if (faults_.wrong_sample) memory_[2 * first + 6] ^= 0x10;
  }

  std::string read(const Arguments& given) {
    const auto first = static_cast<std::size_t>(std::atoll(given[1].c_str()));
    auto count = static_cast<std::size_t>(std::atoll(given[2].c_str()));
    if (faults_.short_answers) count /= 2;
    const std::string bytes = memory_.substr(2 * first, 2 * count);
    if (read_back_ == ReadBack::block) {
      const std::string size = std::to_string(bytes.size());
      return "#" + std::to_string(size.size()) + size + bytes;
    }
    std::string numbers;
    for (std::size_t i = 0; i < bytes.size(); i += is_m8195a() ? 1 : 2) {
      const int value = is_m8195a() ? static_cast<std::int8_t>(bytes[i]) : word_at(2 * first + i);
      if (i != 0) numbers += ',';
      numbers += text_of(value);
    }
    return numbers;
  }

  // Each is made once: that takes most of the time of a test that is not optimised.
  static const std::string& text_of(int value) {
    static const std::vector<std::string> texts = [] {
      std::vector<std::string> all;
      for (int each = INT16_MIN; each <= INT16_MAX; ++each) all.push_back(std::to_string(each));
      return all;
    }();
    return texts[static_cast<std::size_t>(value - INT16_MIN)];
  }

  void start(bool is_set_up) {
    if (!is_set_up || selected_ == 0 || playing_) return conflict();
    playing_ = true;
  }

  [[nodiscard]] bool is_m8195a() const { return model_ == Model::m8195a; }
  bool is_extended() { return words_[":TRAC1:MMOD"] == "EXT"; }
  std::int64_t granule() { return is_m8195a() ? (is_extended() ? 256 : 128) : 48; }
  [[nodiscard]] std::int64_t least() const { return is_m8195a() ? 1'280 : 240; }
  std::int64_t most() { return is_m8195a() && !is_extended() ? 262'144 : 134'217'728; }

  [[nodiscard]] int word_at(std::size_t byte) const {
    return static_cast<std::int16_t>(static_cast<std::uint8_t>(memory_[byte]) |
                                     static_cast<std::uint8_t>(memory_[byte + 1]) << 8);
  }
  [[nodiscard]] bool marker(std::int64_t sample) const {
    const auto byte = static_cast<std::size_t>(2 * sample);
    return (is_m8195a() ? memory_[byte + 1] & 1 : word_at(byte) & 1) != 0;
  }
  [[nodiscard]] double volts(std::int64_t sample) const {
    const auto byte = static_cast<std::size_t>(2 * sample);
    const double part = is_m8195a() ? static_cast<std::int8_t>(memory_[byte]) / 127.0
                                    : (word_at(byte) >> 2) / 8191.0;
    return offset_v_ + part * amplitude_v_ / 2;
  }
  [[nodiscard]] bool is_pulse(std::int64_t sample, double rest_v) const {
    return std::abs(volts(sample) - rest_v) > amplitude_v_ / 2;
  }

  Model model_;
  AwgFaults faults_;
  ReadBack read_back_;
  double rate_step_hz_;
  std::map<std::string, std::string> words_;
  std::map<std::string, bool> outputs_;
  double asked_rate_hz_ = 0;
  double rate_hz_ = 0;
  double amplitude_v_ = 0;
  double offset_v_ = 0;
  double marker_v_ = 0;
  double marker_offset_v_ = 0;
  std::int64_t samples_ = 0;
  int selected_ = 0;
  std::string memory_;
  bool playing_ = false;
  ScpiServer scpi_;  // last: its thread ends before all else
};

}  // namespace splid::test
