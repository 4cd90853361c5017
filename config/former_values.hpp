#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace splid {

// Values that earlier versions of splid knew, such as an effort that was found to gain nothing. In
// `document`, a configuration, each becomes the value that is taken for it. Returns a sentence for
// each that names `file`, the key and both values.
std::vector<std::string> replace_former_values(nlohmann::json& document, const std::string& file);

}  // namespace splid
