#include "drivers/encoder/encoder_source.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "drivers/source.hpp"
#include "protocol/error.hpp"
#include "protocol/shown_text.hpp"
#include "protocol/text.hpp"

namespace splid {
namespace {

class EncoderFile final : public EncoderSource {
 public:
  explicit EncoderFile(std::string file) : file_(std::move(file)), lines_(checked(file_)) {
    if (!lines_.is_open()) {
      refuse(std::string("cannot open the encoder's counts: ") + std::strerror(errno));
    }
    // The first batch is read before anything begins: without counts no frame has a reference.
    if (!read(first_)) refuse("holds no counts");
    has_first_ = true;
  }

  bool next(EncoderBatch& batch) override {
    if (!std::exchange(has_first_, false)) return read(batch);
    batch = std::move(first_);
    return true;
  }

  [[nodiscard]] bool live() const override { return false; }

 private:
  bool read(EncoderBatch& batch) {
    for (std::string line; std::getline(lines_, line);) {
      ++number_;
      // A recorder that was killed may have left half a line, whose last count is then wrong.
      if (lines_.eof()) return false;
      if (number_ == 1) line = without_byte_order_mark(line);
      std::optional<EncoderBatch> parsed = parse_encoder_line(line);
      if (!parsed) {
        throw Error(Fault::data, file_ + ": line " + std::to_string(number_) + ": \"" +
                                     shown_text(line, 40) +
                                     "\" is not FIRST_INDEX,COUNT[,COUNT...] nor overrun");
      }
      if (parsed->counts.empty() && !parsed->overrun) continue;
      batch = std::move(*parsed);
      return true;
    }
    return false;
  }

  // Before the file is opened: a pipe would wait for its other end.
  [[nodiscard]] const std::string& checked(const std::string& file) const {
    std::error_code ignored;
    const bool is_other =
        std::filesystem::exists(file, ignored) && !std::filesystem::is_regular_file(file, ignored);
    if (is_other) refuse("is no file but a folder, a device, a pipe or a socket");
    return file;
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(Fault::data, file_ + ": " + what +
                                 "; the encoder's counts are whole lines of "
                                 "FIRST_INDEX,COUNT[,COUNT...]: check --encoder or /encoder/file");
  }

  std::string file_;
  std::ifstream lines_;
  std::int64_t number_ = 0;
  EncoderBatch first_;  // read ahead
  bool has_first_ = false;
};

}  // namespace

std::unique_ptr<EncoderSource> open_encoder_file(const std::string& file) {
  return std::make_unique<EncoderFile>(file);
}

std::unique_ptr<EncoderSource> open_encoder(const EncoderOptions& options,
                                            const SourceOptions* tags,
                                            std::function<void(const std::string&)> warn) {
  if (!options.file.empty()) return open_encoder_file(options.file);
  if (!options.address.empty()) return open_encoder_socket(options.address, std::move(warn));
  return tags == nullptr ? nullptr : tags->own_encoder(options);
}

}  // namespace splid
