#include "drivers/simulator/simulated_encoder.hpp"

#include <cmath>
#include <utility>

namespace splid::simulator {
namespace {

constexpr std::int64_t batch_counts = 100;

}  // namespace

Encoder::Encoder(const Options& scene, EncoderOptions options)
    : motion_(scene.target, scene.tagger_rate()),
      options_(std::move(options)),
      time_(scene.encoder_start()),
      gap_ps_(ps_per_s / scene.encoder_rate_hz) {}

bool Encoder::next(EncoderBatch& batch) {
  batch.first_index = index_;
  batch.overrun = false;
  batch.counts.clear();
  for (std::int64_t i = 0; i < batch_counts; ++i) {
    const double distance_m = motion_.at(time_.seconds()).distance_m;
    batch.counts.push_back(std::llround((distance_m - options_.offset_m) / options_.m_per_count));
    time_.advance_far(gap_ps_);
  }
  index_ += batch_counts;
  return true;
}

}  // namespace splid::simulator
