#pragma once

#include "config/config.hpp"
#include "protocol/options.hpp"

namespace splid {

inline constexpr const char* config_schema_name = "splid.config";
inline constexpr int config_major_version = 1;
inline constexpr int config_minor_version = 0;

// Shows a visitor all sections of a configuration file in their order, `source` included. Where the
// source's options are not there yet, they are made for the driver that source_driver names or that
// the visitor chooses.
void describe_sections(Config& config, OptionVisitor& visitor);

// Shows a visitor all sections except `source`, whose keys depend on the driver.
void describe_common_sections(Config& config, OptionVisitor& visitor);

inline constexpr const char* source_doc =
    "where the tags come from; the keys are those of the driver";

}  // namespace splid
