#pragma once

#include <functional>
#include <memory>
#include <string>

#include "drivers/encoder/encoder_batch.hpp"
#include "drivers/encoder/encoder_options.hpp"
#include "drivers/source.hpp"

namespace splid {

// Where an encoder's counts come from.
//
// Threads: one, which may wait.
class EncoderSource {
 public:
  virtual ~EncoderSource() = default;
  // The next batch; false where there is none, or none yet. Returns at once.
  // Errors: Error(Fault::data) naming the file and the line.
  virtual bool next(EncoderBatch& batch) = 0;
  // Counts come as they are made: to be taken as they come, and worth waiting for. Others are there
  // whenever they are asked for, and may be without end.
  [[nodiscard]] virtual bool live() const = 0;
};

// A file of lines, read as it is asked for.
// Errors: Error(Fault::data) where it cannot be opened, or holds no counts.
std::unique_ptr<EncoderSource> open_encoder_file(const std::string& file);

// A bridge that sends such lines; the connection is made anew for ever, on a thread of its own.
// warn: any thread. Errors: as ClientSocket.
std::unique_ptr<EncoderSource> open_encoder_socket(const std::string& address,
                                                   std::function<void(const std::string&)> warn);

// What `options` names; else that of a simulated scene with a sample clock; else null.
// tags: of the source of the tags. Errors: as the above.
std::unique_ptr<EncoderSource> open_encoder(const EncoderOptions& options,
                                            const SourceOptions* tags,
                                            std::function<void(const std::string&)> warn);

}  // namespace splid
