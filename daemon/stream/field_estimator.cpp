#include "daemon/stream/field_estimator.hpp"

#include <algorithm>
#include <string>

#include "daemon/stream/stream.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

Error refused(const char* key, const std::string& why) {
  return {Fault::usage, std::string("/scene/") + key + ": " + why};
}

const char* wanted_key(const SceneOptions& scene) { return scene.rigid ? "rigid" : "pool"; }

void check(const StreamOptions& options) {
  if (!options.scene.rigid && !options.scene.pool) return;
  const char* key = wanted_key(options.scene);
  if (options.pixels.size() < 2) {
    throw refused(key, "is true; it needs several /pixels");
  }
  if (options.estimator.method == Method::paper) {
    throw refused(key, "is true; /estimator/method \"paper\" estimates each pixel alone");
  }
  const PixelOptions& first = options.pixels.front();
  for (const PixelOptions& pixel : options.pixels) {
    if (pixel.sigma_ps == first.sigma_ps && pixel.dead_time_ns == first.dead_time_ns) continue;
    throw refused(key, "is true; all /pixels then need one sigma_ps and one dead_time_ns, and " +
                           pixel.name + " has others than " + first.name);
  }
  for (const PixelOptions& pixel : options.pixels) {
    if (!options.scene.pool || (pixel.azimuth_deg && pixel.elevation_deg)) continue;
    throw refused("pool", "is true; the pixel " + pixel.name +
                              " needs azimuth_deg and elevation_deg, to tell its neighbours");
  }
}

bool have_directions(const std::vector<PixelOptions>& pixels) {
  return std::all_of(pixels.begin(), pixels.end(), [](const PixelOptions& pixel) {
    return pixel.azimuth_deg && pixel.elevation_deg;
  });
}

std::vector<array::PixelDirection> directions_of(const std::vector<PixelOptions>& pixels) {
  std::vector<array::PixelDirection> directions(pixels.size());
  if (!have_directions(pixels)) return directions;
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    directions[k] = {*pixels[k].azimuth_deg, *pixels[k].elevation_deg};
  }
  return directions;
}

}  // namespace

bool FieldEstimator::is_wanted(const StreamOptions& options) {
  return options.scene.rigid || options.scene.pool || helps(options);
}

bool FieldEstimator::helps(const StreamOptions& options) {
  return options.estimator.tracked && options.pixels.size() > 1 && have_directions(options.pixels);
}

FieldEstimator::FieldEstimator(const StreamOptions& options, std::size_t max_photons)
    : views_(options.pixels.size()),
      estimates_(options.pixels.size()),
      bodies_(options.pixels.size()),
      pooled_(options.pixels.size()),
      seen_(options.pixels.size()) {
  check(options);
  const StreamOptions own = options_of_pixel(options, options.pixels.front());
  const std::vector<array::PixelDirection> directions = directions_of(options.pixels);
  if (options.scene.rigid) {
    rigid_.emplace(own.pattern, own.pulse, own.scene, own.estimator, own.frame.length_ms,
                   max_photons, directions, own.drift.reference, own.detector);
  }
  if (options.scene.pool) {
    pool_.emplace(own.pattern, own.pulse, own.scene, own.estimator, own.frame.length_ms, directions,
                  own.drift.reference);
  }
  if (helps(options)) helping_.emplace(directions, 1);
}

void FieldEstimator::estimate(EstimationUnit& unit) {
  if (!unit.wanted) return;
  if (helping_) tell_neighbours(unit);
  if (rigid_ || pool_) join(unit);
}

void FieldEstimator::tell_neighbours(EstimationUnit& unit) {
  for (std::size_t k = 0; k < seen_.size(); ++k) seen_[k] = unit.pixels[k].seen;
  for (std::size_t k = 0; k < seen_.size(); ++k) {
    unit.pixels[k].help = array::help_of(*helping_, k, seen_);
  }
}

void FieldEstimator::join(EstimationUnit& unit) {
  for (std::size_t k = 0; k < views_.size(); ++k) {
    views_[k] = unit.frame.pixels[k]->view();
    estimates_[k] = unit.pixels[k].estimate;
  }
  if (rigid_) rigid_->estimate({views_, estimates_, bodies_});
  if (pool_) pool_->estimate({views_, estimates_, pooled_});
  for (std::size_t k = 0; k < views_.size(); ++k) unit.pixels[k].estimate = estimates_[k];
}

}  // namespace splid
