#include "daemon/recording/recorder.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "protocol/error.hpp"
#include "protocol/saturated.hpp"

namespace splid {
namespace {

// Bytes kept before they are written: large enough that a call costs little beside its copy, small
// enough that memory does not count.
constexpr std::size_t block_bytes = 1 << 20;
constexpr std::size_t block_tags = block_bytes / 4;

// Time of a recording's first tag in it. Tags may still come that much earlier.
constexpr std::int64_t lead_ps = 1'000'000;

constexpr std::uint64_t ptu_record_bytes = 4;

constexpr std::int64_t ps_per_ms = 1'000'000'000;

}  // namespace

Recorder::Recorder(std::string file, PtuFacts facts, const DeviceClock& clock, bool overwrite)
    : file_(std::move(file)), facts_(std::move(facts)), clock_(clock) {
  pending_.reserve(2 * block_bytes);
  facts_.created_unix_s = clock_.unix_s(0);
  facts_.guid.clear();
  const std::vector<std::byte> header = make_ptu_header(facts_);
  open(overwrite);
  try {
    write_at(header, written_bytes_);
  } catch (const Error&) {
    // Nothing that could be read: a recorder that tries again would leave one each time.
    ::close(descriptor_);
    ::unlink(file_.c_str());
    throw;
  }
  header_bytes_ = pending_at_ = written_bytes_;
}

Recorder::~Recorder() {
  if (descriptor_ != -1) ::close(descriptor_);
}

void Recorder::open(bool overwrite) {
  const int how = O_WRONLY | O_CREAT | O_CLOEXEC | (overwrite ? O_TRUNC : O_EXCL);
  descriptor_ = ::open(file_.c_str(), how, 0666);
  if (descriptor_ != -1) return;
  if (errno == EEXIST) {
    throw Error(Fault::usage,
                file_ + ": the file exists; give another name, or --force to overwrite it");
  }
  throw Error(Fault::device, file_ + ": cannot be made: " + std::strerror(errno));
}

void Recorder::write(std::span<const Tag> tags) {
  if (tags.empty()) return;
  if (!begun_) begin(tags.front().time_ps);
  while (!tags.empty()) {
    const auto count = std::min(tags.size(), block_tags);
    encoder_.encode(tags.first(count), pending_);
    tags = tags.subspan(count);
    if (pending_.size() >= block_bytes) write_pending();
  }
}

void Recorder::flush() {
  write_pending();
  const std::vector<Loss> losses = encoder_.losses().losses(encoder_.now_ps());
  if (losses == facts_.losses) return;
  facts_.losses = losses;
  write_header();
}

void Recorder::close() {
  encoder_.flush(pending_);
  write_pending();
  facts_.losses = encoder_.losses().losses(encoder_.now_ps());
  facts_.record_count = encoder_.records();
  if (begun_) {
    facts_.acquisition_ms = saturated_difference(encoder_.now_ps(), facts_.origin_ps) / ps_per_ms;
  }
  write_header();
  if (::close(std::exchange(descriptor_, -1)) != 0) {
    throw Error(Fault::device, file_ + ": cannot be closed: " + std::strerror(errno));
  }
}

std::uint64_t Recorder::written_records() const {
  return (written_bytes_ - header_bytes_) / ptu_record_bytes;
}

std::uint64_t Recorder::give_up() {
  if (descriptor_ == -1) return 0;
  encoder_.flush(pending_);
  const std::uint64_t written = (written_bytes_ - pending_at_) / ptu_record_bytes;
  const std::uint64_t lost = ptu_tags(std::span(pending_).subspan(written * ptu_record_bytes));
  facts_.losses = encoder_.losses().losses(encoder_.now_ps());
  facts_.record_count = written_records();
  try {
    write_header();
  } catch (const Error&) {
    // The one before says to read to the end of the file.
  }
  ::close(std::exchange(descriptor_, -1));
  return lost;
}

void Recorder::begin(std::int64_t first_tag_ps) {
  begun_ = true;
  clock_.anchor(first_tag_ps);
  facts_.origin_ps = saturated_difference(first_tag_ps, lead_ps);
  facts_.created_unix_s = clock_.unix_s(facts_.origin_ps);
  encoder_ = PtuEncoder(facts_.origin_ps);
  write_header();
}

void Recorder::write_pending() {
  if (pending_.empty()) return;
  write_at(pending_, written_bytes_);
  pending_at_ = written_bytes_;
  pending_.clear();
}

void Recorder::write_header() {
  std::uint64_t offset = 0;
  write_at(make_ptu_header(facts_), offset);
}

// offset: of the first byte; afterwards of the first that was not written, also where it throws.
void Recorder::write_at(std::span<const std::byte> bytes, std::uint64_t& offset) {
  while (!bytes.empty()) {
    const ssize_t count =
        ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      throw Error(Fault::device, file_ + ": " + std::strerror(errno) + " after " +
                                     std::to_string(offset) +
                                     " bytes; these can be read; make room or give another place");
    }
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    offset += static_cast<std::uint64_t>(count);
  }
}

}  // namespace splid
