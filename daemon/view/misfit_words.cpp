#include "daemon/view/misfit_words.hpp"

#include <fmt/core.h>

#include <cmath>

namespace splid::view {
namespace {

void add(std::string& words, const std::string& misfit) {
  words += (words.empty() ? "" : ", ") + misfit;
}

// Two digits and more: small values of slow targets are said too.
std::string in_digits(double value) {
  return std::abs(value) < 10 ? fmt::format("{:.2g}", value) : fmt::format("{:.0f}", value);
}

template <class Light>
std::string words_of(const Light& light) {
  std::string words;
  if (light.pulse_misfit) {
    add(words, fmt::format("pulse {:.0f} % {}", 100 * std::abs(*light.pulse_misfit),
                           *light.pulse_misfit < 0 ? "narrower" : "wider"));
  }
  if (light.acceleration_misfit_mps2) {
    add(words, fmt::format("accelerates {} m/s2", in_digits(*light.acceleration_misfit_mps2)));
  }
  if (light.jerk_misfit_mps3) {
    add(words, fmt::format("acceleration changes {} m/s3", in_digits(*light.jerk_misfit_mps3)));
  }
  if (light.signal_gap) add(words, fmt::format("dark for {:.0f} %", 100 * *light.signal_gap));
  return words;
}

}  // namespace

std::string misfits_in_words(const FrameMessage& frame) {
  std::string words = words_of(frame);
  if (frame.shape_misfit)
    add(words, fmt::format("{:.0f} % off a gaussian", 100 * *frame.shape_misfit));
  if (frame.dead_time_misfit_ns) {
    add(words, fmt::format("blind for {:.0f} ns", *frame.dead_time_misfit_ns));
  }
  if (frame.afterpulse_misfit) {
    add(words, fmt::format("{:.1f} % afterpulses", 100 * *frame.afterpulse_misfit));
  }
  if (frame.flicker_misfit) {
    add(words, fmt::format("light varies by {:.0f} %", 100 * *frame.flicker_misfit));
  }
  return words;
}

std::string misfits_in_words(const FrameMessage::Target& target) { return words_of(target); }

}  // namespace splid::view
