#pragma once

#include <functional>
#include <memory>
#include <string>

#include "drivers/encoder/encoder_options.hpp"
#include "protocol/encoder_batch.hpp"

namespace splid {

class SourceOptions;

// drivers/encoder/ gets the counts of an encoder on the target. Read this header first.

// Where the counts of an encoder on the target come from: a file, a bridge, or the simulated scene
// that also makes the tags. daemon/stream/encoder_join.hpp finds the tag of each count.
//
// Threads: one, which may wait.
class EncoderSource {
 public:
  virtual ~EncoderSource() = default;
  // Takes the next batch, and returns at once; false where there is no batch, or not yet.
  // Errors: Error(Fault::data) naming the file and the line.
  virtual bool next(EncoderBatch& batch) = 0;
  // A live source hands on counts as an encoder makes them: they are to be taken as they come, and
  // are worth waiting for. Counts of another source are there whenever they are asked for, and may
  // have no end.
  [[nodiscard]] virtual bool live() const = 0;
};

// The file that keeps the encoder counts of a recording.
inline std::string encoder_file_of(const std::string& recording) {
  return recording + ".encoder.csv";
}

// The counts of a file of lines (see EncoderBatch), which is read as counts are asked for.
// Errors: Error(Fault::data) where it cannot be opened, or holds no counts.
std::unique_ptr<EncoderSource> open_encoder_file(const std::string& file);

// The counts of a bridge that sends such lines. Whenever the connection is lost it is made anew, on
// a thread of this source's own, after 0.5 s, and after up to 8 s where it brought no counts. Of
// what is not taken, 360,000 batches with 4,194,304 counts wait; what comes then is dropped. warn:
// is called from that thread. Errors: as ClientSocket.
std::unique_ptr<EncoderSource> open_encoder_socket(const std::string& address,
                                                   std::function<void(const std::string&)> warn);

// Opens the file or the bridge that `options` names. Where it names neither, opens the encoder that
// belongs to the source of the tags; null where the source has no encoder.
// tags: may be null. Errors: as of the two functions above.
std::unique_ptr<EncoderSource> open_encoder(const EncoderOptions& options,
                                            const SourceOptions* tags,
                                            std::function<void(const std::string&)> warn);

}  // namespace splid
