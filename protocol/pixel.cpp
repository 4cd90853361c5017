#include "protocol/pixel.hpp"

#include <algorithm>
#include <map>
#include <string_view>

#include "protocol/shown_text.hpp"

namespace splid {
namespace {

constexpr std::size_t most_name_bytes = 32;
constexpr double most_delay_ps = 500'000;

// A name is part of a topic, of a column and of a label.
bool is_of_pixel_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("._+-").find(c) != std::string_view::npos;
}

bool is_pixel_name(const std::string& name) {
  return !name.empty() && name.size() <= most_name_bytes &&
         std::all_of(name.begin(), name.end(), is_of_pixel_name);
}

}  // namespace

void PixelOptions::describe(OptionVisitor& visitor) {
  visitor.text("name", name,
               "name of the pixel in messages: up to 32 letters, digits and . _ + - (default: "
               "number of its input)");
  visitor.require("input");
  visitor.integer("input", input, least_pixel_input, most_pixel_input,
                  "input of its photons, as the instrument counts them");
  visitor.number("azimuth_deg", azimuth_deg, {-360, 360},
                 "azimuth of its direction, positive to the right");
  visitor.number("elevation_deg", elevation_deg, {-90, 90},
                 "elevation of its direction, positive upwards");
  visitor.number("delay_ps", delay_ps, {-most_delay_ps, most_delay_ps},
                 "delay of its tags, such as by a longer cable, ps, subtracted from its times");
  visitor.number("dead_time_ns", dead_time_ns, {0, 1e6},
                 "dead time of its detector, ns (default: detector.dead_time_ns)");
  visitor.number("sigma_ps", sigma_ps, {1, 1e6},
                 "standard deviation of its detected pulse, ps (default: pulse.sigma_ps)");
}

namespace {

// Tags would no longer come in order.
std::optional<OptionFault> spread_fault(std::span<const PixelOptions> pixels) {
  double least_ps = 0;
  double most_ps = 0;
  for (const PixelOptions& pixel : pixels) {
    least_ps = std::min(least_ps, pixel.delay_ps);
    most_ps = std::max(most_ps, pixel.delay_ps);
  }
  if (most_ps - least_ps <= most_delay_ps) return std::nullopt;
  return OptionFault{"",
                     "have delay_ps that are more than 500000 ps apart, from each other or from "
                     "the syncs; tags would no longer come in order"};
}

}  // namespace

std::optional<OptionFault> pixels_fault(std::span<const PixelOptions> pixels) {
  if (pixels.size() > most_pixels) {
    return OptionFault{"", "has " + std::to_string(pixels.size()) + " pixels; " +
                               std::to_string(most_pixels) + " are the most"};
  }
  std::map<std::int64_t, std::size_t> inputs;
  std::map<std::string, std::size_t> names;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::string place = "/" + std::to_string(i);
    const std::string& name = pixels[i].name;
    if (!is_pixel_name(name)) {
      return OptionFault{place + "/name", "\"" + shown_text(name, most_quoted) +
                                              "\" is no pixel's name; it has 1 to 32 letters, "
                                              "digits and . _ + -"};
    }
    const auto [input, is_own] = inputs.emplace(pixels[i].input, i);
    if (!is_own) {
      return OptionFault{place + "/input",
                         std::to_string(pixels[i].input) + " is also the input of pixel " +
                             std::to_string(input->second) + ", \"" + pixels[input->second].name +
                             "\"; give each pixel an input of its own"};
    }
    const auto [same, is_new] = names.emplace(name, i);
    if (!is_new) {
      return OptionFault{place + "/name", "\"" + name + "\" is also the name of pixel " +
                                              std::to_string(same->second) +
                                              "; give each pixel a name of its own"};
    }
  }
  return spread_fault(pixels);
}

}  // namespace splid
