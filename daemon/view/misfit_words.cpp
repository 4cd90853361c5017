#include "daemon/view/misfit_words.hpp"

#include <fmt/core.h>

#include <cmath>

namespace splid::view {
namespace {

template <class Light>
std::string words_of(const Light& light) {
  std::string words;
  const auto add = [&](const std::string& misfit) {
    words += (words.empty() ? "" : ", ") + misfit;
  };
  if (light.pulse_misfit) {
    add(fmt::format("pulse {:.0f} % {}", 100 * std::abs(*light.pulse_misfit),
                    *light.pulse_misfit < 0 ? "narrower" : "wider"));
  }
  if (light.acceleration_misfit_mps2) {
    add(fmt::format("accelerates {:.0f} m/s2", *light.acceleration_misfit_mps2));
  }
  if (light.jerk_misfit_mps3) {
    add(fmt::format("acceleration changes {:.0f} m/s3", *light.jerk_misfit_mps3));
  }
  if (light.signal_gap) add(fmt::format("dark for {:.0f} %", 100 * *light.signal_gap));
  return words;
}

}  // namespace

std::string misfits_in_words(const FrameMessage& frame) {
  std::string words = words_of(frame);
  const auto add = [&](const std::string& misfit) {
    words += (words.empty() ? "" : ", ") + misfit;
  };
  if (frame.shape_misfit) add(fmt::format("{:.0f} % off a gaussian", 100 * *frame.shape_misfit));
  if (frame.dead_time_misfit_ns) {
    add(fmt::format("blind for {:.0f} ns", *frame.dead_time_misfit_ns));
  }
  if (frame.afterpulse_misfit) {
    add(fmt::format("{:.1f} % afterpulses", 100 * *frame.afterpulse_misfit));
  }
  return words;
}

std::string misfits_in_words(const FrameMessage::Target& target) { return words_of(target); }

}  // namespace splid::view
