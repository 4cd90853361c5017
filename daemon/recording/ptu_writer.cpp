#include "daemon/recording/ptu_writer.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <utility>

#include "daemon/base/removed_file.hpp"
#include "protocol/error.hpp"
#include "protocol/record_decoder.hpp"
#include "protocol/saturated.hpp"

namespace splid::recording {
namespace {

// Bytes kept before they are written: so many that a system call costs little beside the copy of
// the bytes, and so few that the memory does not matter.
constexpr std::size_t block_bytes = 1 << 20;
constexpr std::size_t block_tags = block_bytes / 4;

// The time that a recording's first tag gets in the file. Later tags may be this much earlier than
// the first tag.
constexpr std::int64_t lead_ps = 1'000'000;

constexpr std::int64_t whole_ps_per_ms = 1'000'000'000;

}  // namespace

PtuWriter::PtuWriter(std::string file, PtuFacts facts, const DeviceClock& clock, bool overwrite)
    : file_(std::move(file)), facts_(std::move(facts)), clock_(clock) {
  pending_.reserve(2 * block_bytes);
  // A guess until the first tag comes.
  clock_.anchor(0);
  facts_.created_unix_s = clock_.unix_s(0);
  facts_.guid.clear();
  header_ = make_ptu_header(facts_);
  if (!make_at_once()) make(overwrite);
  written_bytes_ = pending_at_ = header_.size();
}

PtuWriter::~PtuWriter() {
  if (descriptor_ != -1) ::close(descriptor_);
}

// Makes a new file that has its header when it gets its name, so that a program which is killed
// meanwhile leaves no file that cannot be read. False where there is such a file, or where it
// cannot be made so: not every file system has files without a name.
bool PtuWriter::make_at_once() {
  struct stat status {};
  if (::lstat(file_.c_str(), &status) == 0) return false;
  const std::string folder = std::filesystem::path(file_).parent_path().string();
  descriptor_ =
      ::open(folder.empty() ? "." : folder.c_str(), O_WRONLY | O_CLOEXEC | O_TMPFILE, 0666);
  if (descriptor_ == -1) return false;
  try {
    begin_file(true);
  } catch (const Error&) {
    ::close(descriptor_);
    throw;
  }
  const std::string nameless = "/proc/self/fd/" + std::to_string(descriptor_);
  if (::linkat(AT_FDCWD, nameless.c_str(), AT_FDCWD, file_.c_str(), AT_SYMLINK_FOLLOW) == 0) {
    return true;
  }
  ::close(descriptor_);
  return false;
}

void PtuWriter::make(bool overwrite) {
  const bool is_new = open(overwrite);
  try {
    begin_file(is_new);
  } catch (const Error&) {
    ::close(descriptor_);
    // The file holds nothing that could be read, and a RotatingWriter that tries again would leave
    // another such file each time.
    if (is_new) ::unlink(file_.c_str());
    throw;
  }
}

// Returns whether the file is new.
bool PtuWriter::open(bool overwrite) {
  constexpr int how = O_WRONLY | O_CLOEXEC;
  descriptor_ = ::open(file_.c_str(), how | O_CREAT | O_EXCL, 0666);
  if (descriptor_ != -1) return true;
  if (errno == EEXIST && !overwrite) {
    throw Error(Fault::usage,
                file_ + ": the file exists; give another name, or --force to overwrite it");
  }
  if (errno == EEXIST) descriptor_ = open_existing(how);
  if (descriptor_ != -1) return false;
  throw Error(Fault::device, file_ + ": cannot be made: " + std::strerror(errno));
}

// Looks at the file's type before opening it, so that the caller never waits for the other end of
// a pipe and never writes over a disk.
int PtuWriter::open_existing(int how) const {
  struct stat status {};
  if (::stat(file_.c_str(), &status) == 0 && !S_ISREG(status.st_mode) && !S_ISCHR(status.st_mode)) {
    throw Error(Fault::usage, file_ +
                                  ": is no file but a folder, a disk, a pipe or a socket; a "
                                  "recording is written in place and takes a file");
  }
  return ::open(file_.c_str(), how | O_CREAT, 0666);
}

// A file that was there before stays unchanged until there is room for the header.
void PtuWriter::begin_file(bool is_new) {
  struct stat before {};
  const bool is_kept = !is_new && ::fstat(descriptor_, &before) == 0 && S_ISREG(before.st_mode);
  if (is_kept) {
    const int full = ::posix_fallocate(descriptor_, 0, static_cast<off_t>(header_.size()));
    if (full != 0 && full != EOPNOTSUPP && full != EINVAL) {
      if (::ftruncate(descriptor_, before.st_size) != 0) errno = full;
      throw Error(Fault::device, file_ + ": " + std::strerror(full) +
                                     "; it stays as it was; make room or give another place");
    }
  }
  std::uint64_t offset = 0;
  write_at(header_, offset);
  if (is_kept && ::ftruncate(descriptor_, static_cast<off_t>(header_.size())) != 0) {
    throw Error(Fault::device, file_ + ": cannot be cut: " + std::strerror(errno));
  }
}

void PtuWriter::write(std::span<const Tag> tags) {
  if (tags.empty()) return;
  if (!begun_) begin(tags.front().time_ps);
  while (!tags.empty()) {
    const auto count = std::min(tags.size(), block_tags);
    encoder_.encode(tags.first(count), pending_);
    tags = tags.subspan(count);
    if (pending_.size() >= block_bytes) write_pending();
  }
}

void PtuWriter::flush() {
  check_there();
  write_pending();
  std::vector<Loss> losses = encoder_.losses().losses(encoder_.now_ps());
  if (losses == facts_.losses) return;
  facts_.losses = std::move(losses);
  write_header();
}

void PtuWriter::close() {
  check_there();
  encoder_.flush(pending_);
  write_pending();
  facts_.losses = encoder_.losses().losses(encoder_.now_ps());
  if (begun_) {
    facts_.acquisition_ms =
        saturated_difference(encoder_.now_ps(), facts_.origin_ps) / whole_ps_per_ms;
  }
  write_header();
  if (::close(std::exchange(descriptor_, -1)) != 0) {
    throw Error(Fault::device, file_ + ": cannot be closed: " + std::strerror(errno));
  }
}

std::uint64_t PtuWriter::written_records() const {
  return (written_bytes_ - header_.size()) / ptu_record_bytes;
}

bool PtuWriter::removed() const { return descriptor_ != -1 && is_removed(descriptor_, file_); }

void PtuWriter::check_there() const {
  if (!removed()) return;
  throw Error(Fault::device,
              file_ + ": was removed while it was written; its " + std::to_string(encoder_.tags()) +
                  " tags are lost. Leave a recording where it is until it has ended");
}

std::uint64_t PtuWriter::give_up() {
  if (descriptor_ == -1) return 0;
  encoder_.flush(pending_);
  if (removed()) {
    facts_.losses = encoder_.losses().losses(encoder_.now_ps());
    ::close(std::exchange(descriptor_, -1));
    return encoder_.tags();
  }
  const std::uint64_t written = (written_bytes_ - pending_at_) / ptu_record_bytes;
  const std::uint64_t lost = ptu_tags(std::span(pending_).subspan(written * ptu_record_bytes));
  facts_.losses = encoder_.losses().losses(encoder_.now_ps());
  try {
    write_header();
  } catch (const Error&) {
    // The old header, which counts the records that were there then, stays valid.
  }
  ::close(std::exchange(descriptor_, -1));
  return lost;
}

void PtuWriter::begin(std::int64_t first_tag_ps) {
  begun_ = true;
  clock_.anchor(first_tag_ps);
  facts_.origin_ps = saturated_difference(first_tag_ps, lead_ps);
  facts_.created_unix_s = clock_.unix_s(facts_.origin_ps);
  encoder_ = PtuEncoder(facts_.origin_ps, facts_.inputs);
  write_header();
}

// The records are written first and their count afterwards: a program that is killed between the
// two leaves a count that is too small, never one that is too large.
// The inputs that they name are in the header before them.
void PtuWriter::write_pending() {
  if (pending_.empty()) return;
  if (facts_.inputs != encoder_.inputs()) {
    facts_.inputs = encoder_.inputs();
    write_header();
  }
  write_at(pending_, written_bytes_);
  pending_at_ = written_bytes_;
  pending_.clear();
  facts_.record_count = written_records();
  set_ptu_record_count(header_, facts_.record_count);
  write_header_part(ptu_record_count_at(header_.size()), header_.size());
}

// Design note: only the bytes that have changed are written. A killed program leaves them either
// all old or all new, since the kernel copies a page at once and looks for signals only between
// pages.
void PtuWriter::write_header() {
  facts_.record_count = written_records();
  const std::vector<std::byte> next = make_ptu_header(facts_);
  const auto [was, is] = std::mismatch(header_.begin(), header_.end(), next.begin(), next.end());
  const auto [was_last, is_last] = std::mismatch(header_.rbegin(), std::make_reverse_iterator(was),
                                                 next.rbegin(), std::make_reverse_iterator(is));
  const auto begin = static_cast<std::size_t>(is - next.begin());
  const auto end = static_cast<std::size_t>(is_last.base() - next.begin());
  header_ = next;
  write_header_part(begin, end);
}

void PtuWriter::write_header_part(std::size_t begin, std::size_t end) {
  std::uint64_t offset = begin;
  write_at(std::span(header_).subspan(begin, end - begin), offset);
}

std::string PtuWriter::what_is_there(std::uint64_t bytes) const {
  const std::string header = std::to_string(header_.size()) + " bytes";
  if (written_bytes_ == 0) return "within the recording's header of " + header + ", before any tag";
  return "after " + std::to_string(std::max(bytes, written_bytes_)) + " bytes; these can be read";
}

// offset: of the first byte to write; afterwards of the first byte that was not written, also where
// this throws.
void PtuWriter::write_at(std::span<const std::byte> bytes, std::uint64_t& offset) {
  while (!bytes.empty()) {
    const ssize_t count =
        ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      throw Error(Fault::device, file_ + ": " + std::strerror(errno) + " " + what_is_there(offset) +
                                     "; make room or give another place");
    }
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    offset += static_cast<std::uint64_t>(count);
  }
}

}  // namespace splid::recording
