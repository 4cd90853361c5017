#include "drivers/source.hpp"

#include <map>
#include <utility>

#include "drivers/encoder/encoder_source.hpp"

namespace splid {
namespace {

struct Driver {
  MakeSourceOptions make;
  std::vector<usb::Id> usb_ids;
};

// The table is static in a function, so that it exists before the first file registers its driver.
std::map<std::string, Driver>& drivers() {
  static std::map<std::string, Driver> table;
  return table;
}

}  // namespace

std::unique_ptr<EncoderSource> SourceOptions::own_encoder(const EncoderOptions&) const {
  return nullptr;
}

bool register_source(const std::string& name, MakeSourceOptions make,
                     std::vector<usb::Id> usb_ids) {
  drivers()[name] = {std::move(make), std::move(usb_ids)};
  return true;
}

std::unique_ptr<SourceOptions> make_source_options(const std::string& name) {
  const auto found = drivers().find(name);
  return found == drivers().end() ? nullptr : found->second.make();
}

std::vector<std::string> source_names() {
  std::vector<std::string> names;
  for (const auto& [name, driver] : drivers()) names.push_back(name);
  return names;
}

std::vector<usb::Id> usb_ids_of(const std::string& name) {
  const auto found = drivers().find(name);
  return found == drivers().end() ? std::vector<usb::Id>{} : found->second.usb_ids;
}

}  // namespace splid
