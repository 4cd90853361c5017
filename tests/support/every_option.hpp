#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/options.hpp"

namespace splid::test {

// A member of every kind that a configuration knows.
struct EveryOption {
  enum class Colour { red, green };
  struct Target {
    double distance_m = 1;
    friend bool operator==(const Target&, const Target&) = default;
  };

  double length_ms = 50;
  std::optional<double> start_s;
  std::int64_t count = 4;
  bool live = true;
  std::string name = "default";
  std::string recording;
  Colour colour = Colour::red;
  std::vector<double> times_s = {1, 2.5};
  std::vector<NumberPair> table = {{1, -2}};
  std::string sync = "sync";
  std::vector<std::string> photon = {"1"};
  Target target;
  std::vector<Target> targets;

  friend bool operator==(const EveryOption&, const EveryOption&) = default;

  void describe(OptionVisitor& visitor) {
    static constexpr std::array<const char*, 2> colours = {"red", "green"};
    visitor.number("length_ms", length_ms, {0.5, 60000}, "a length, ms");
    visitor.number("start_s", start_s, {0, 10}, "a start, s");
    visitor.integer("count", count, -3, 8, "a count");
    visitor.flag("live", live, "a flag");
    visitor.text("name", name, "a name");
    visitor.path("recording", recording, "a file");
    choose(visitor, "colour", colour, colours, "a choice");
    visitor.numbers("times_s", times_s, {0, 9}, "some times, s");
    visitor.pairs("table", table, {Bounds{0, 9}, Bounds{-3, 3}}, "a table");
    visitor.channel("sync", sync, "a channel");
    visitor.channels("photon", photon, "some channels");
    visitor.object(
        "target", [&](OptionVisitor& v) { describe_target(v, target); }, "an object");
    visitor.objects(
        "targets", [&](std::size_t size) { targets.resize(size); },
        [&](OptionVisitor& v, std::size_t i) { describe_target(v, targets.at(i)); }, targets.size(),
        "some objects");
  }

 private:
  static void describe_target(OptionVisitor& visitor, Target& target) {
    visitor.require("distance_m");
    visitor.number("distance_m", target.distance_m, {0, 100}, "a distance, m");
  }
};

}  // namespace splid::test
