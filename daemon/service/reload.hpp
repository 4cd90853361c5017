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

// started: the configuration that the daemon was started with, which decided which sockets ask an
// allow_list.
//
// Live are scene, estimator, pulse, detector and frame.min_seen_fraction: what the estimation and
// the judgement of a frame take; and an allow_list, while the daemon was started with one and still
// has one. The rest decides how the stream is read, cut and sent.
ConfigChanges changes_between(const Config& before, const Config& after, const Config& started);

// The configuration that frames follow after a reload of `next`: `started` with what is live.
Config with_live(const Config& started, const Config& next);

}  // namespace splid
