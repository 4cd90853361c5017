#include "drivers/replay/recording_reader.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "protocol/error.hpp"
#include "protocol/file_kind.hpp"

namespace splid {
namespace {

constexpr std::size_t buffer_bytes = 1 << 20;

// The first bytes of a file that is no recording, enough to tell what it is.
constexpr std::size_t kind_bytes = 4096;

// Design note: headers in the wild have a few KB; splid's own hold a pattern of some 100 KB at most
// and 64 KiB of losses. A header that has no end after 64 MiB is taken for none.
constexpr std::size_t max_header_bytes = 64 << 20;

}  // namespace

RecordingReader::RecordingReader(std::string file, Warn warn, double period_ps)
    : file_(std::move(file)), warn_(std::move(warn)), period_ps_(period_ps), buffer_(buffer_bytes) {
  descriptor_ = ::open(file_.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) {
    throw Error(Fault::data, file_ + ": cannot open the recording: " + std::strerror(errno) +
                                 "; check its path");
  }
  try {
    read_header();
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
  if (header_.record_count == 0) {
    warn_(file_ + ": the record count is 0, as a recorder leaves it that was stopped; reading up " +
          "to the end of the file");
  }
}

RecordingReader::~RecordingReader() { ::close(descriptor_); }

void RecordingReader::read_header() {
  for (;;) {
    if (end_ == buffer_.size()) buffer_.resize(2 * buffer_.size());
    const std::size_t got = read_bytes(buffer_.size() - end_);
    end_ += got;
    const bool complete = got == 0 || end_ >= max_header_bytes;
    std::optional<PtuHeader> header;
    try {
      header = parse_ptu_header(std::span(buffer_).first(end_), complete);
    } catch (const Error& error) {
      throw Error(error.fault(), file_ + ": " + what_else_it_is().value_or(error.what()));
    }
    if (!header) continue;
    header_ = std::move(*header);
    begin_ = header_.header_bytes;
    make_decoder();
    return;
  }
}

void RecordingReader::make_decoder() {
  if (!is_t3(header_.record_type)) {
    t2_.emplace(header_.record_type, header_.resolution_s, header_.origin_ps);
    return;
  }
  const double period_ps = period_ps_ > 0 ? period_ps_ : header_.sync_period_s * 1e12;
  t3_.emplace(header_.record_type, period_ps, header_.resolution_s);
}

PtuDecoder::Progress RecordingReader::decode(std::span<const std::byte> records,
                                             std::span<Tag> out) {
  return t3_ ? t3_->decode(records, out) : t2_->decode(records, out);
}

std::uint64_t RecordingReader::overflow_records() const {
  return t3_ ? t3_->overflow_records() : t2_->overflow_records();
}

std::uint64_t RecordingReader::unknown_records() const {
  return t3_ ? t3_->unknown_records() : t2_->unknown_records();
}

std::uint64_t RecordingReader::saturated_photons() const {
  return t3_ ? t3_->saturated_photons() : 0;
}

std::int64_t RecordingReader::reached_ps() const {
  return t3_ ? t3_->reached_ps() : t2_->reached_ps();
}

std::optional<std::string> RecordingReader::what_else_it_is() const {
  std::string start(std::min(end_, kind_bytes), '\0');
  std::memcpy(start.data(), buffer_.data(), start.size());
  const auto kind = kind_of_file(start, file_);
  if (!kind || *kind == recording_file_kind) return std::nullopt;
  return misplaced_file(start, file_, "a PTU recording");
}

std::size_t RecordingReader::read_bytes(std::size_t max_bytes) {
  for (;;) {
    const ssize_t got = ::read(descriptor_, buffer_.data() + end_, max_bytes);
    if (got >= 0) {
      file_bytes_ += static_cast<std::uint64_t>(got);
      return static_cast<std::size_t>(got);
    }
    if (errno == EINTR) continue;
    throw Error(Fault::data, file_ + ", byte " + std::to_string(file_bytes_) + ": cannot read: " +
                                 std::strerror(errno) + "; check the file and its disk");
  }
}

std::size_t RecordingReader::read(std::span<Tag> out) {
  for (;;) {
    std::uint64_t bytes = end_ - begin_;
    if (header_.record_count != 0) {
      const std::uint64_t left = header_.record_count - records_;
      bytes = std::min(bytes, left < bytes ? left * PtuDecoder::record_bytes : bytes);
    }
    const auto records = std::span(buffer_).subspan(begin_, static_cast<std::size_t>(bytes));
    const PtuDecoder::Progress progress = decode(records, out);
    begin_ += progress.bytes;
    records_ += progress.bytes / PtuDecoder::record_bytes;
    if (progress.tags > 0) return progress.tags;
    if (ended_ || !refill()) return 0;
  }
}

// False at the end of the records.
bool RecordingReader::refill() {
  if (header_.record_count != 0 && records_ == header_.record_count) {
    ended_ = true;
    warn_of_rest();
    return false;
  }
  std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
            buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
  end_ -= begin_;
  begin_ = 0;
  const std::size_t got = read_bytes(buffer_.size() - end_);
  end_ += got;
  if (got > 0) return true;
  ended_ = true;
  end_of_file();
  return false;
}

std::uint64_t RecordingReader::end_of_records() const {
  return header_.header_bytes + records_ * PtuDecoder::record_bytes;
}

void RecordingReader::end_of_file() {
  if (end_ > begin_) {
    warn_(file_ + ", byte " + std::to_string(end_of_records()) + ": the last record is cut, " +
          std::to_string(end_ - begin_) + " of 4 bytes; left out");
  }
  if (header_.record_count > records_) {
    warn_(file_ + ": the header counts " + std::to_string(header_.record_count) +
          " records, the file holds " + std::to_string(records_) + "; read up to its end, byte " +
          std::to_string(file_bytes_));
  }
}

void RecordingReader::warn_of_rest() {
  if (begin_ == end_) {
    begin_ = end_ = 0;
    end_ = read_bytes(1);
  }
  if (begin_ == end_) return;
  warn_(file_ + ", byte " + std::to_string(end_of_records()) + ": more follows the " +
        std::to_string(header_.record_count) + " records that the header counts; left out");
}

}  // namespace splid
