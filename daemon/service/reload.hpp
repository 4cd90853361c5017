#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"

namespace splid {

// What differs between two configurations, as JSON pointers in alphabetical order.
struct ConfigChanges {
  std::vector<std::string> live;     // can take effect while frames flow
  std::vector<std::string> restart;  // take a restart
};

// Live are scene, estimator, pulse, detector and frame.min_seen_fraction: what the estimation and
// the judgement of a frame take; and the two allow_lists. The rest decides how the stream is read,
// cut and sent.
ConfigChanges changes_between(const Config& before, const Config& after);

}  // namespace splid
