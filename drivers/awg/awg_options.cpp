#include "drivers/awg/awg_options.hpp"

#include <array>
#include <cmath>
#include <vector>

#include "drivers/awg/awg_model.hpp"
#include "drivers/client_socket.hpp"
#include "protocol/json_writer.hpp"

namespace splid::awg {
namespace {

constexpr std::array<const char*, 2> reference_names = {"internal", "external_10_mhz"};
constexpr const char* default_port = ":5025";

std::string range_text(const char* what, double amplitude_v, double min_v, double max_v) {
  return std::string(what) + " is " + number_text(amplitude_v) + " V; it must be from " +
         number_text(min_v) + " to " + number_text(max_v);
}

}  // namespace

void Options::describe(OptionVisitor& visitor) {
  std::vector<const char*> names;
  for (const Model& known : models()) names.push_back(known.name);
  visitor.choice("model", model, names,
                 "the generator; _extended: the M8195A's extended memory instead of its internal");
  visitor.text("address", address, "HOST or HOST:PORT of its SCPI socket, port 5025 by default");
  visitor.number("pulse_width_ns", pulse_width_ns, {0.01, 1e6},
                 "width of a trigger pulse, ns; played as a whole number of samples");
  visitor.number("min_spacing_ns", min_spacing_ns, {0.01, 1e6},
                 "least time between two pulses that the laser allows, ns");
  visitor.number("pulse_v", pulse_v, {-5, 5}, "level of a pulse into 50 ohm, V");
  visitor.number("rest_v", rest_v, {-5, 5}, "level between pulses into 50 ohm, V");
  visitor.number("marker_width_ns", marker_width_ns, {0.01, 1e6},
                 "width of the marker pulse at each pattern's start, ns");
  visitor.number("marker_v", marker_v, {0.1, 5}, "level of that pulse into 50 ohm, from 0 V");
  choose(visitor, "reference", reference, reference_names, "clock that the samples follow");
  visitor.flag("read_back", read_back, "after an upload read the samples back and compare them");
  visitor.number("timeout_s", timeout_s, {0.05, 600}, "longest wait for a whole answer, s");
}

std::optional<OptionFault> Options::validate() const {
  if (!address.empty() && socket_address_fault(socket_address(address))) {
    return OptionFault{"/address", json_string(address) + " is not HOST or HOST:PORT"};
  }
  const Model& known = models()[model];
  const double amplitude_v = std::abs(pulse_v - rest_v);
  // A microvolt more is allowed, since a double does not hold all levels exactly.
  constexpr double slack_v = 1e-6;
  if (amplitude_v < known.min_amplitude_v - slack_v ||
      amplitude_v > known.max_amplitude_v + slack_v) {
    return OptionFault{"/pulse_v", range_text("the step from rest_v", amplitude_v,
                                              known.min_amplitude_v, known.max_amplitude_v)};
  }
  if (marker_v < known.min_marker_v - slack_v || marker_v > known.max_marker_v + slack_v) {
    return OptionFault{"/marker_v",
                       range_text("the marker", marker_v, known.min_marker_v, known.max_marker_v)};
  }
  return std::nullopt;
}

std::string socket_address(const std::string& address) {
  const bool has_port = address.find(':') != std::string::npos;
  return "tcp:" + address + (has_port ? "" : default_port);
}

}  // namespace splid::awg
