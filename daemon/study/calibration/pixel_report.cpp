#include "daemon/study/calibration/pixel_report.hpp"

#include <fmt/core.h>

namespace splid::calibration {

std::string describe_pixels(const std::vector<PixelReport>& pixels) {
  if (pixels.empty()) return {};
  std::string text = "pixel       delay_ps      +-  sigma_ps  background/s\n";
  for (const PixelReport& pixel : pixels) {
    const std::string rate = fmt::format("{:>12.4g}\n", pixel.background_per_s);
    text += fmt::format("{:<9} ", pixel.name);
    text += pixel.has_pulses ? fmt::format("{:>9.1f} {:>7.1f} {:>9.4g}  ", pixel.delay_ps,
                                           pixel.std_delay_ps, pixel.width_ps) +
                                   rate
                             : fmt::format("{:>9} {:>7} {:>9}  ", "-", "-", "-") + rate;
  }
  return text +
         "the pattern is that of the first pixel; a delay_ps for `pixels` holds where all see the "
         "target at one distance\n";
}

}  // namespace splid::calibration
