#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include "drivers/encoder/encoder_source.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

class EncoderFile final : public EncoderSource {
 public:
  explicit EncoderFile(std::string file) : file_(std::move(file)), lines_(file_) {
    if (lines_.is_open()) return;
    throw Error(Fault::data, file_ + ": cannot open the encoder's counts: " + std::strerror(errno) +
                                 "; check its path");
  }

  bool next(EncoderBatch& batch) override {
    for (std::string line; std::getline(lines_, line);) {
      ++number_;
      // A recorder that was killed may have left half a line, whose last count is then wrong.
      if (lines_.eof()) return false;
      std::optional<EncoderBatch> parsed = parse_encoder_line(line);
      if (!parsed) {
        throw Error(Fault::data, file_ + ": line " + std::to_string(number_) + ": \"" +
                                     line.substr(0, 40) +
                                     "\" is not FIRST_INDEX,COUNT[,COUNT...] nor overrun");
      }
      if (parsed->counts.empty() && !parsed->overrun) continue;
      batch = std::move(*parsed);
      return true;
    }
    return false;
  }

  [[nodiscard]] bool live() const override { return false; }

 private:
  std::string file_;
  std::ifstream lines_;
  std::int64_t number_ = 0;
};

}  // namespace

std::unique_ptr<EncoderSource> open_encoder_file(const std::string& file) {
  return std::make_unique<EncoderFile>(file);
}

}  // namespace splid
