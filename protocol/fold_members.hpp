#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/fold_json.hpp"
#include "protocol/frame_members.hpp"
#include "protocol/json_writer.hpp"

// The members of the `fold` message, each named once: the JSON and the manual's table are visitors
// of describe(), as of a frame's (protocol/frame_members.hpp).

namespace splid {

inline std::string json_counts(const std::vector<std::uint64_t>& counts) {
  std::string json = "[";
  for (const std::uint64_t count : counts) {
    if (json.size() > 1) json += ',';
    json += std::to_string(count);
  }
  return json + "]";
}

// Four digits are finer than any picture.
inline double four_digits(double value) {
  if (value == 0) return 0;
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - 3);
  return unit < 1 ? std::round(value / unit) / std::round(1 / unit)
                  : std::round(value / unit) * unit;
}

inline double two_decimals(double value) { return std::round(value * 100) / 100; }

template <class Round>
std::string json_rounded(std::vector<double> values, const Round& round) {
  for (double& value : values) value = round(value);
  return json_numbers(values);
}

template <class Visitor>
void describe_stack(const PhotonFold::Stack& stack, Visitor& see) {
  see.number({"first_ns", "ns", "start of the first of 200 bins, relative to the pulse"},
             stack.first_ns);
  see.number({"bin_ns", "ns", "width of a bin; the bins reach from -10 to 10 pulse widths"},
             stack.bin_ns);
  see.json({"counts", "", "photons in each bin"}, json_counts(stack.counts));
  see.json({"expected", "", "photons that the estimate expects in each bin"},
           json_rounded(stack.expected, four_digits));
}

template <class Visitor>
void describe_period(const PhotonFold::Period& period, Visitor& see) {
  see.number({"bin_ns", "ns", "width of each of 1,024 bins, from the start of the pattern"},
             period.bin_ns);
  see.flag({"moved_back", "",
            "true: photons are shifted to their estimated emission times; false without a target"},
           period.moved_back);
  see.json({"counts", "", "photons in each bin"}, json_counts(period.counts));
}

template <class Visitor>
void describe_plane(const PhotonFold::Plane& plane, Visitor& see) {
  see.number(
      {"delay_step_ns", "ns", "step of the delay; cell i is i - 31.5 steps from the estimate"},
      plane.delay_step_ns);
  see.number({"velocity_step_mps", "m/s", "step of the velocity"}, plane.velocity_step_mps);
  see.json(
      {"gain_nats", "nats",
       "log-likelihood ratios against no target, from at most 8,192 photons: a row for each of "
       "64 velocities; the delay rises along a row"},
      json_rounded(plane.gain_nats, two_decimals));
}

template <class Visitor>
void describe(const FoldMessage& message, Visitor& see) {
  see.text_if_any({"pixel", "", "with several pixels: the pixel with the greatest significance"},
                  message.pixel);
  see.choice({"status", "", "status of the frame"}, message.status);
  see.count({"photons", "", "photons in the frame"}, message.photons);
  see.count(
      {"folded", "",
       "photons in the pictures; if the frame has more than 262,144 photons, every n-th photon"},
      message.folded);
  see.part({"stack", "", "with a target: photons around all pulses, superposed"},
           message.fold.stack,
           [](const auto& stack, auto& inner) { describe_stack(stack, inner); });
  see.part({"period", "", "with syncs: photons folded on the pattern period"}, message.fold.period,
           [](const auto& period, auto& inner) { describe_period(period, inner); });
  see.part(
      {"plane", "",
       "with a target: the likelihood in 64 x 64 cells of delay and velocity around the estimate"},
      message.fold.plane, [](const auto& plane, auto& inner) { describe_plane(plane, inner); });
}

}  // namespace splid
