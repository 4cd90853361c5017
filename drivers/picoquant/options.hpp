#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/picoquant/family.hpp"
#include "drivers/source.hpp"

namespace splid::picoquant {

enum class Edge : std::uint8_t { falling, rising };
enum class Reference : std::uint8_t { internal, external_10_mhz };

// Of the sync input and of each input.
struct TriggerOptions {
  std::int64_t level_mv = -50;
  Edge edge = Edge::falling;
  std::int64_t zero_cross_mv = 10;  // of constant fraction discriminators
  std::int64_t offset_ps = 0;       // added to the times
  void describe(OptionVisitor& visitor);
};

struct InputOptions {
  std::int64_t input = 1;  // as on the panel
  TriggerOptions trigger;
};

struct MarkerOptions {
  std::int64_t marker = 1;
  Edge edge = Edge::rising;
};

// An instrument of PicoQuant's and how its inputs are set. JSON: the configuration of
// `splid bridge picoquant`.
//
// Design note: it is no driver of `source`. The maker's library runs in a process of its own, so
// that what goes wrong in there costs that process and not the daemon.
struct Options : SourceOptions {
  Family family = Family::multiharp;
  std::string library;  // file; empty: found by name
  std::string serial;   // empty: the first found
  Reference reference = Reference::internal;
  TriggerOptions sync;
  std::int64_t sync_divider = 1;
  std::vector<InputOptions> inputs = {InputOptions{}};
  std::vector<MarkerOptions> markers;

  void describe(OptionVisitor& visitor) override;
  [[nodiscard]] std::optional<OptionFault> validate() const override;
  [[nodiscard]] std::unique_ptr<TagSource> open(const SourceContext& context) const override;
};

}  // namespace splid::picoquant
