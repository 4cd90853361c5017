#include "drivers/picoquant/options.hpp"

#include <array>
#include <string>

#include "drivers/picoquant/source.hpp"
#include "drivers/repeated_option.hpp"
#include "drivers/usb/bridged_devices.hpp"

namespace splid::picoquant {
namespace {

constexpr std::array<const char*, 2> edge_names = {"falling", "rising"};
constexpr std::array<const char*, 2> reference_names = {"internal", "external_10_mhz"};
// Of the udev rules that come with the libraries. A TimeHarp 260 is a card.
constexpr const char* bridge_command = "splid bridge picoquant";
const bool picoquant_registered =
    usb::register_bridged_devices({{{0x0e0d, 0x0003}, "PicoHarp 300", bridge_command},
                                   {{0x0e0d, 0x0004}, "HydraHarp 400", bridge_command},
                                   {{0x0e0d, 0x0009}, "HydraHarp 400", bridge_command},
                                   {{0x0e0d, 0x0013}, "MultiHarp", bridge_command}});

constexpr std::int64_t most_inputs = 64;
constexpr std::int64_t most_markers = 4;
constexpr std::int64_t most_level_mv = 1200;
constexpr std::int64_t most_zero_cross_mv = 40;
constexpr std::int64_t most_offset_ps = 99'999;
constexpr std::int64_t most_divider = 16;

std::optional<OptionFault> trigger_fault(const FamilyTraits& traits, const TriggerOptions& trigger,
                                         const std::string& place) {
  if (traits.trigger != Trigger::constant_fraction) return std::nullopt;
  const std::string product = traits.product;
  if (trigger.edge == Edge::rising) {
    return OptionFault{place + "/edge", "\"rising\": a " + product + " takes falling edges alone"};
  }
  if (trigger.level_mv > 0 || trigger.level_mv < traits.lowest_level_mv) {
    return OptionFault{place + "/level_mv", std::to_string(trigger.level_mv) + ": a " + product +
                                                " takes " + std::to_string(traits.lowest_level_mv) +
                                                " to 0 mV"};
  }
  if (trigger.zero_cross_mv <= traits.highest_zero_cross_mv) return std::nullopt;
  return OptionFault{place + "/zero_cross_mv",
                     std::to_string(trigger.zero_cross_mv) + ": a " + product + " takes 0 to " +
                         std::to_string(traits.highest_zero_cross_mv) + " mV"};
}

// A PicoHarp 300 has one input beside the sync.
std::optional<OptionFault> picoharp_fault(const Options& options) {
  for (std::size_t i = 0; i < options.inputs.size(); ++i) {
    const std::string place = "/inputs/" + std::to_string(i);
    const InputOptions& input = options.inputs[i];
    if (input.input != 1) {
      return OptionFault{place + "/input", std::to_string(input.input) +
                                               ": a PicoHarp 300 has input 1 and the sync (0)"};
    }
    if (input.trigger.offset_ps != 0) {
      return OptionFault{place + "/offset_ps",
                         "a PicoHarp 300 delays its sync alone: give sync the opposite offset"};
    }
  }
  return std::nullopt;
}

}  // namespace

void TriggerOptions::describe(OptionVisitor& visitor) {
  visitor.integer("level_mv", level_mv, -most_level_mv, most_level_mv,
                  "threshold at the connector, mV; negative for negative pulses");
  choose(visitor, "edge", edge, edge_names, "the edge that counts");
  visitor.integer("zero_cross_mv", zero_cross_mv, 0, most_zero_cross_mv,
                  "zero crossing of a constant fraction discriminator, mV");
  visitor.integer("offset_ps", offset_ps, -most_offset_ps, most_offset_ps,
                  "added to the times, ps, as a cable would");
}

void Options::describe(OptionVisitor& visitor) {
  visitor.require("instrument");
  choose(visitor, "instrument", family, family_names, "which of PicoQuant's libraries reads it");
  visitor.path("library", library, "file of that library; empty: found by its name");
  visitor.text("serial", serial, "serial number of the instrument; empty: the first found");
  choose(visitor, "reference", reference, reference_names, "the instrument's clock");
  visitor.object(
      "sync",
      [this](OptionVisitor& members) {
        sync.describe(members);
        members.integer("divider", sync_divider, 1, most_divider,
                        "of so many syncs the instrument sends one");
      },
      "the sync input");
  visitor.objects(
      "inputs", [this](std::size_t count) { inputs.resize(count); },
      [this](OptionVisitor& member, std::size_t i) {
        member.require("input");
        member.integer("input", inputs.at(i).input, 1, most_inputs, "number on the panel");
        inputs.at(i).trigger.describe(member);
      },
      inputs.size(), "the inputs that are on");
  visitor.objects(
      "markers", [this](std::size_t count) { markers.resize(count); },
      [this](OptionVisitor& member, std::size_t i) {
        member.require("marker");
        member.integer("marker", markers.at(i).marker, 1, most_markers, "number of the marker");
        choose(member, "edge", markers.at(i).edge, edge_names, "the edge that counts");
      },
      markers.size(), "the marker inputs that are on");
}

std::optional<OptionFault> Options::validate() const {
  const FamilyTraits& traits = traits_of(family);
  if (reference != Reference::internal && !traits.has_reference) {
    return OptionFault{"/reference", std::string("\"external_10_mhz\": a ") + traits.product +
                                         " has its own clock alone"};
  }
  if (sync_divider > traits.max_divider) {
    return OptionFault{"/sync/divider", std::to_string(sync_divider) + ": a " + traits.product +
                                            " divides by " + std::to_string(traits.max_divider) +
                                            " at most"};
  }
  if (auto fault = trigger_fault(traits, sync, "/sync")) return fault;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    auto fault = trigger_fault(traits, inputs[i].trigger, "/inputs/" + std::to_string(i));
    if (fault) return fault;
  }
  if (auto fault = repeated_option(inputs, &InputOptions::input, "inputs", "input")) return fault;
  if (auto fault = repeated_option(markers, &MarkerOptions::marker, "markers", "marker"))
    return fault;
  return family == Family::picoharp300 ? picoharp_fault(*this) : std::nullopt;
}

std::unique_ptr<TagSource> Options::open(const SourceContext& context) const {
  return std::make_unique<Source>(*this, context);
}

}  // namespace splid::picoquant
