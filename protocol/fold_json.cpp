#include "protocol/fold_json.hpp"

#include <cmath>
#include <string>

#include "protocol/json_writer.hpp"

namespace splid {
namespace {

std::string json_counts(const std::vector<std::uint64_t>& counts) {
  std::string json = "[";
  for (const std::uint64_t count : counts) {
    if (json.size() > 1) json += ',';
    json += std::to_string(count);
  }
  return json + "]";
}

// Four digits are finer than any picture.
double four_digits(double value) {
  if (value == 0) return 0;
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - 3);
  return unit < 1 ? std::round(value / unit) / std::round(1 / unit)
                  : std::round(value / unit) * unit;
}

double two_decimals(double value) { return std::round(value * 100) / 100; }

template <class Round>
std::string json_rounded(std::vector<double> values, const Round& round) {
  for (double& value : values) value = round(value);
  return json_numbers(values);
}

}  // namespace

std::string to_json(const FoldMessage& message) {
  JsonWriter json = message_head("splid.fold", message.timestamp_s, message.sequence);
  if (!message.pixel.empty()) json.text("pixel", message.pixel);
  json.text("status", to_string(message.status))
      .integer("photons", message.photons)
      .integer("folded", message.folded);
  if (const auto& stack = message.fold.stack) {
    JsonWriter members;
    members.number("first_ns", stack->first_ns)
        .number("bin_ns", stack->bin_ns)
        .raw("counts", json_counts(stack->counts))
        .raw("expected", json_rounded(stack->expected, four_digits));
    json.object("stack", members);
  }
  if (const auto& period = message.fold.period) {
    JsonWriter members;
    members.number("bin_ns", period->bin_ns)
        .flag("moved_back", period->moved_back)
        .raw("counts", json_counts(period->counts));
    json.object("period", members);
  }
  if (const auto& plane = message.fold.plane) {
    JsonWriter members;
    members.number("delay_step_ns", plane->delay_step_ns)
        .number("velocity_step_mps", plane->velocity_step_mps)
        .raw("gain_nats", json_rounded(plane->gain_nats, two_decimals));
    json.object("plane", members);
  }
  return json.finish();
}

}  // namespace splid
