#include "drivers/replay/recording_reader.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "protocol/error.hpp"
#include "protocol/file_kind.hpp"
#include "protocol/recording_format.hpp"
#include "protocol/saturated.hpp"

namespace splid {
namespace {

constexpr std::size_t reader_buffer_bytes = 1 << 20;

// The first bytes of a file that is no recording, enough to tell what it is.
constexpr std::size_t kind_bytes = 4096;

// A settings file has some 20 kB.
constexpr std::size_t most_settings_bytes = 1 << 20;

// Design note: headers in the wild have a few KB; splid's own hold a pattern of some 100 KB at most
// and 64 KiB of losses. A header that has no end after 64 MiB is taken for none.
constexpr std::size_t max_header_bytes = 64 << 20;

std::string in_capitals(std::string_view text) {
  std::string all(text);
  std::transform(all.begin(), all.end(), all.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return all;
}

}  // namespace

void require_seekable(const std::string& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return;
  if (!S_ISFIFO(status.st_mode) && !S_ISSOCK(status.st_mode) && !S_ISCHR(status.st_mode)) return;
  throw Error(Fault::data, file +
                               ": is a pipe or a device, which can be read only once, and splid "
                               "reads a file from its beginning more than once; write it to a file "
                               "first, and name that file");
}

RecordingReader::RecordingReader(std::string file, Warn warn, double period_ps)
    : file_(std::move(file)),
      warn_(std::move(warn)),
      period_ps_(period_ps),
      buffer_(reader_buffer_bytes) {
  require_seekable(file_);
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
  if (header_.record_count == 0 && counts_records(header_.format)) {
    warn_(
        file_ +
        ": the header's record count is 0, as a recorder leaves it that was stopped, or negative; "
        "reading up to the end of the file");
  }
  if (!header_.warning.empty()) warn_(file_ + ": " + header_.warning);
}

RecordingReader::~RecordingReader() { ::close(descriptor_); }

void RecordingReader::read_header() {
  for (;;) {
    if (end_ == buffer_.size()) buffer_.resize(2 * buffer_.size());
    const std::size_t got = read_bytes(buffer_.size() - end_);
    end_ += got;
    const bool complete = got == 0 || end_ >= max_header_bytes;
    std::optional<RecordingHeader> header = header_of(std::span(buffer_).first(end_), complete);
    if (!header) continue;
    header_ = std::move(*header);
    put_losses_between_syncs();
    begin_ = header_.header_bytes;
    decoder_ = make_decoder(header_, period_ps_);
    return;
  }
}

// Design note: the losses of a T3 recording are in its period in whole picoseconds. Where the
// pattern's calibrated period is 20 ppm longer, they would be 12 ms off after ten minutes.
void RecordingReader::put_losses_between_syncs() {
  if (!header_.is_t3) return;
  const double header_ps = header_.sync_period_s * 1e12;
  const double whole_ps = std::max(std::round(header_ps), 1.0);
  const double longer = ((period_ps_ > 0 ? period_ps_ : header_ps) - whole_ps) / whole_ps;
  const auto scaled = [longer](std::int64_t time_ps) {
    const double more_ps = std::clamp(static_cast<double>(time_ps) * longer, -9e18, 9e18);
    return saturated_sum(time_ps, std::llround(more_ps));
  };
  for (Loss& loss : header_.losses) {
    loss.begin_ps = scaled(loss.begin_ps);
    loss.end_ps = scaled(loss.end_ps);
  }
}

std::optional<RecordingHeader> RecordingReader::header_of(std::span<const std::byte> prefix,
                                                          bool complete) {
  const std::string_view start(reinterpret_cast<const char*>(prefix.data()),
                               std::min(prefix.size(), kind_bytes));
  const std::optional<RecordingFormat> format = format_of(start, file_);
  if (!format) {
    // A mark has at most 10 bytes.
    if (!complete && prefix.size() < kind_bytes) return std::nullopt;
    throw Error(Fault::data, file_ + ": " + what_else_it_is());
  }
  try {
    return parse_recording_header(*format, prefix, complete, settings_beside(*format));
  } catch (const Error& error) {
    throw Error(error.fault(), file_ + ": " + error.what());
  }
}

// Empty where the format has no settings beside it, or none are there.
std::string RecordingReader::settings_beside(RecordingFormat format) const {
  const std::string_view ending = settings_ending(format);
  if (ending.empty()) return {};
  const std::filesystem::path file = file_;
  std::ifstream in(std::filesystem::path(file).replace_extension(ending), std::ios::binary);
  if (!in) in.open(std::filesystem::path(file).replace_extension(in_capitals(ending)));
  std::string text(most_settings_bytes, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

std::string RecordingReader::what_else_it_is() const {
  std::string start(std::min(end_, kind_bytes), '\0');
  std::memcpy(start.data(), buffer_.data(), start.size());
  const std::string what = misplaced_file(start, file_, "a recording");
  return what.empty() ? "is not a recording in a known format; " + std::string(recordings_in_words)
                      : what;
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
      bytes = std::min(bytes, left < bytes ? left * decoder_->record_bytes() : bytes);
    }
    const auto records = std::span(buffer_).subspan(begin_, static_cast<std::size_t>(bytes));
    const RecordDecoder::Progress progress = decoder_->decode(records, out);
    begin_ += progress.bytes;
    records_ += progress.bytes / decoder_->record_bytes();
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
  return header_.header_bytes + records_ * decoder_->record_bytes();
}

void RecordingReader::end_of_file() {
  if (end_ > begin_) {
    warn_(file_ + ", byte " + std::to_string(end_of_records()) + ": the last record is cut, " +
          std::to_string(end_ - begin_) + " of " + std::to_string(decoder_->record_bytes()) +
          " bytes; left out");
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
