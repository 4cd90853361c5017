#include "daemon/base/text.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include "drivers/awg/upload.hpp"
#include "estimator/model/units.hpp"

namespace splid {
namespace {

constexpr double ps_in_a_ns = 1000;

double closest_spacing_ps(const PatternSegment& segment) {
  const std::vector<double>& times = segment.pulse_times_ps;
  double closest = times.front() + segment.period_ps - times.back();
  for (std::size_t i = 1; i < times.size(); ++i) {
    closest = std::min(closest, times[i] - times[i - 1]);
  }
  return closest;
}

}  // namespace

std::string grouped(std::uint64_t number) {
  std::string digits = std::to_string(number);
  for (auto place = static_cast<int>(digits.size()) - 3; place > 0; place -= 3) {
    digits.insert(static_cast<std::size_t>(place), 1, ',');
  }
  return digits;
}

std::string clock_time(double unix_s) {
  const auto ms = static_cast<std::int64_t>(std::llround(unix_s * 1e3));
  std::int64_t left_ms = ms % 1000;
  if (left_ms < 0) left_ms += 1000;
  const auto seconds = static_cast<std::time_t>((ms - left_ms) / 1000);
  std::tm local{};
  ::localtime_r(&seconds, &local);
  return fmt::format("{:02}:{:02}:{:02}.{:03}", local.tm_hour, local.tm_min, local.tm_sec, left_ms);
}

void add_sentence(std::string& text, const std::string& sentence) {
  if (sentence.empty()) return;
  text += (text.empty() ? "" : "; ") + sentence;
}

std::string in_words(const FrameMessage::Finding& finding) {
  std::string name = finding.name;
  std::replace(name.begin(), name.end(), '_', ' ');
  return fmt::format("{} {:.3g} +- {:.2g}{}{}", name, finding.value, finding.std,
                     finding.unit.empty() ? "" : " ", finding.unit);
}

std::string with_advice(const FrameMessage::Finding& finding) {
  return in_words(finding) + ": " + finding.advice;
}

std::string in_words(const std::vector<FrameMessage::Finding>& findings) {
  std::string words;
  for (const auto& finding : findings) words += (words.empty() ? "" : ", ") + in_words(finding);
  return words;
}

std::string describe_pattern(const Pattern& pattern) {
  double closest_ps = std::numeric_limits<double>::infinity();
  for (const PatternSegment& segment : pattern.segments) {
    closest_ps = std::min(closest_ps, closest_spacing_ps(segment));
  }
  return fmt::format(
      "{}, {} pulses in {:.10g} ns, unambiguous to {:.6g} m, closest pulses {:.6g} ns apart",
      to_string(pattern.mode), grouped(pulses_per_period(pattern)),
      pattern_period_ps(pattern) / ps_in_a_ns,
      speed_of_light_mps / 2 * pattern.unambiguous_delay_ps * 1e-12, closest_ps / ps_in_a_ns);
}

std::string in_words(const awg::Uploaded& uploaded) {
  return uploaded.instrument + ": plays " + describe_pattern(uploaded.played) +
         "; its error queue is empty";
}

}  // namespace splid
