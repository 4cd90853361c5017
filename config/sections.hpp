#pragma once

#include "config/config.hpp"
#include "protocol/options.hpp"

namespace splid {

inline constexpr const char* config_schema_name = "splid.config";
inline constexpr int config_major_version = 1;
inline constexpr int config_minor_version = 0;

// All sections of a configuration file in its order, `source` included: the driver named by
// source_driver, or whichever the visitor chooses, is made where it is not there yet.
void describe_sections(Config& config, OptionVisitor& visitor);

// Those but `source`, whose keys depend on the driver.
void describe_common_sections(Config& config, OptionVisitor& visitor);

inline constexpr const char* source_doc =
    "where the tags come from; the keys are those of the driver";

}  // namespace splid
