#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "protocol/pixel.hpp"

namespace splid {

// The pixels of a configuration, and the file that they were read from; empty: its own.
struct PixelList {
  std::string file;
  std::vector<PixelOptions> pixels;
};

// Reads `value`, which stands at /pixels in the configuration `file`: a list of pixels, or the name
// of a file with such a list as JSON, or as CSV with a line that names its columns as the keys of
// PixelOptions. A pixel without a name gets the number of its input.
// Errors: Error(Fault::usage) with the file, and the JSON pointer or the line.
PixelList read_pixel_list(const nlohmann::json& value, const std::string& file,
                          const ReadText& read);

// What does not fit in a configuration with pixels: the pixels themselves, and what they have in
// common with the instrument's inputs, the other channels and the pulse. The pointer is that of
// the configuration.
std::optional<OptionFault> pixel_list_fault(const Config& config);

}  // namespace splid
