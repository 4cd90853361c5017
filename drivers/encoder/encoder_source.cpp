#include "drivers/encoder/encoder_source.hpp"

#include <utility>

#include "drivers/encoder/simulated_encoder.hpp"

namespace splid {

std::unique_ptr<EncoderSource> open_encoder(const EncoderOptions& options,
                                            const SourceOptions* tags,
                                            std::function<void(const std::string&)> warn) {
  if (!options.file.empty()) return open_encoder_file(options.file);
  if (!options.address.empty()) return open_encoder_socket(options.address, std::move(warn));
  const auto* scene = dynamic_cast<const SimulatorOptions*>(tags);
  if (scene == nullptr || scene->encoder_rate_hz <= 0) return nullptr;
  return std::make_unique<SimulatedEncoder>(*scene, options);
}

}  // namespace splid
