#include "daemon/stream/scene_message.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>

namespace splid {
namespace {

// `ok` where a pixel is, else what most of them are.
FrameStatus status_of_all(const std::vector<SceneMessage::Pixel>& pixels) {
  std::array<std::size_t, frame_status_names.size()> counts{};
  for (const auto& pixel : pixels) ++counts.at(static_cast<std::size_t>(pixel.frame.status));
  if (counts.at(static_cast<std::size_t>(FrameStatus::ok)) > 0) return FrameStatus::ok;
  const auto most = std::max_element(counts.begin(), counts.end());
  return static_cast<FrameStatus>(most - counts.begin());
}

// The findings that half of the pixels with a target have, with the values of the surest.
std::vector<FrameMessage::Finding> findings_of_most(
    const std::vector<SceneMessage::Pixel>& pixels) {
  std::map<std::string, std::pair<std::size_t, FrameMessage::Finding>> found;
  std::size_t valid = 0;
  for (const auto& pixel : pixels) {
    if (!pixel.frame.valid()) continue;
    ++valid;
    for (const FrameMessage::Finding& finding : pixel.frame.findings) {
      auto& [count, surest] = found[finding.name];
      if (count++ == 0 || finding.gain_nats > surest.gain_nats) surest = finding;
    }
  }
  std::vector<FrameMessage::Finding> findings;
  for (const auto& [name, seen] : found) {
    if (2 * seen.first >= valid) findings.push_back(seen.second);
  }
  std::sort(findings.begin(), findings.end(),
            [](const auto& a, const auto& b) { return a.gain_nats > b.gain_nats; });
  return findings;
}

}  // namespace

SceneMaker::SceneMaker(const Config& config) : shared_(frame_context(config)) {
  for (const PixelOptions& pixel : config.pixels) {
    contexts_.push_back(shared_);
    contexts_.back().dead_time_ns = pixel.dead_time_ns.value_or(shared_.dead_time_ns);
    contexts_.back().azimuth_deg = pixel.azimuth_deg;
    contexts_.back().elevation_deg = pixel.elevation_deg;
    scene_.pixels.push_back({pixel.name, pixel.azimuth_deg, pixel.elevation_deg, {}});
  }
}

void SceneMaker::set_syncs_are_counted(bool are_counted) {
  shared_.syncs_are_counted = are_counted;
  for (FrameContext& context : contexts_) context.syncs_are_counted = are_counted;
}

SceneMessage& SceneMaker::make(const EstimationUnit& unit, double latency_ms) {
  for (std::size_t i = 0; i < scene_.pixels.size(); ++i) {
    const PixelEstimate& pixel = unit.pixels[i];
    scene_.pixels[i].frame =
        make_frame_message(*unit.frame.pixels[i], pixel.estimate, contexts_[i],
                           {unit.mid_unix_s, pixel.compute_ms, latency_ms, unit.effort});
    scene_.pixels[i].frame.pixel = scene_.pixels[i].name;
  }
  sum_up(unit, latency_ms);
  return scene_;
}

void SceneMaker::sum_up(const EstimationUnit& unit, double latency_ms) {
  double compute_ms = 0;
  for (const PixelEstimate& pixel : unit.pixels) compute_ms += pixel.compute_ms;
  FrameMessage& whole = scene_.whole;
  whole = make_frame_message(unit.frame, {}, shared_,
                             {unit.mid_unix_s, compute_ms, latency_ms, unit.effort});
  whole.targets.reset();
  whole.photons = unit.frame.photon_count();
  whole.status = status_of_all(scene_.pixels);
  whole.findings = findings_of_most(scene_.pixels);
}

}  // namespace splid
