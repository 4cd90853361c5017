#include "daemon/recording/encoder_log.hpp"

#include <cerrno>
#include <cstring>
#include <utility>

#include "protocol/error.hpp"

namespace splid::recording {

EncoderLog::EncoderLog(const std::string& recording, std::unique_ptr<EncoderSource> source,
                       const ChannelMap& channels)
    : file_(encoder_file_of(recording)),
      out_(file_, std::ios::binary | std::ios::trunc),
      source_(std::move(source)),
      channels_(channels) {
  out_ << "# encoder of " << recording.substr(recording.rfind('/') + 1)
       << ": index of the first count, counts\n";
  flush();
}

// An encoder that is not live would give batches for ever, so it is read only as far as the markers
// ask for.
void EncoderLog::write(std::span<const Tag> tags) {
  for (const Tag& tag : tags) markers_ += (channels_.roles(tag) & role_marker) != 0 ? 1 : 0;
  while ((source_->live() || counts_ < markers_) && source_->next(batch_)) {
    out_ << to_encoder_line(batch_);
    counts_ += static_cast<std::int64_t>(batch_.counts.size());
  }
}

void EncoderLog::flush() {
  out_.flush();
  if (out_) return;
  throw Error(Fault::device, file_ + ": cannot be written: " + std::strerror(errno));
}

}  // namespace splid::recording
