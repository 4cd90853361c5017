#include "daemon/recording/frame_table.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "daemon/base/removed_file.hpp"
#include "daemon/base/write_file.hpp"
#include "protocol/error.hpp"
#include "protocol/frame_columns.hpp"
#include "protocol/json_writer.hpp"

namespace splid::recording {
namespace {

constexpr std::uint64_t growth_bytes = 4 << 20;

std::string little_endian(std::uint64_t value) {
  std::string bytes;
  for (unsigned i = 0; i < 8; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFFU);
  return bytes;
}

}  // namespace

// The table takes its name once its head is whole, so that no reader finds less.
FrameTable::FrameTable(std::string file, TableFacts facts, bool overwrite)
    : file_(std::move(file)),
      format_(table_format_of(file_, "the table")),
      facts_(std::move(facts)),
      head_(format_ == TableFormat::hdf5 ? make_hdf5_head(facts_) : make_csv_head()) {
  check_place(overwrite);
  const std::string part = file_ + ".part";
  descriptor_ = ::open(part.c_str(), O_WRONLY | O_CLOEXEC | O_CREAT | O_TRUNC, 0666);
  if (descriptor_ == -1) {
    throw Error(Fault::device, file_ + ": cannot be made: " + std::strerror(errno));
  }
  try {
    write_at(head_.bytes, 0);
    write_facts("");
    if (std::rename(part.c_str(), file_.c_str()) != 0) {
      throw Error(Fault::device, file_ + ": cannot be made: " + std::strerror(errno));
    }
  } catch (const Error&) {
    ::close(descriptor_);
    ::unlink(part.c_str());
    throw;
  }
  end_ = head_.bytes.size();
  reserve(0);
}

FrameTable::~FrameTable() {
  if (::ftruncate(descriptor_, static_cast<off_t>(end_)) != 0) {
    // The zeros behind the last row then stay; readers pass over them.
  }
  ::close(descriptor_);
}

// Design note: an HDF5 reader looks at the file's size first and then at how much of it the head
// says is in use, and refuses a file that is too short for that. If the file grew with each flush,
// a reader that comes meanwhile would now and then be refused. So it grows in large steps ahead of
// the head; these are holes, which take no room on the disk.
void FrameTable::reserve(std::uint64_t bytes) {
  if (format_ == TableFormat::csv || end_ + bytes <= reserved_) return;
  const std::uint64_t size = end_ + bytes + growth_bytes;
  if (::ftruncate(descriptor_, static_cast<off_t>(size)) == 0) reserved_ = size;
}

void FrameTable::check_place(bool overwrite) const {
  struct stat status {};
  if (::stat(file_.c_str(), &status) != 0) return;
  if (!S_ISREG(status.st_mode)) {
    throw Error(Fault::usage, file_ +
                                  ": is no file but a folder, a device, a pipe or a socket; a "
                                  "table is written in place and takes a file");
  }
  if (overwrite) return;
  throw Error(Fault::usage,
              file_ + ": the file exists; give another name, or --force to overwrite it");
}

void FrameTable::add(const FrameMessage& frame) {
  if (format_ == TableFormat::hdf5) {
    append_frame_row(frame, pending_);
  } else {
    pending_ += frame_csv_row(frame);
  }
  ++pending_rows_;
}

void FrameTable::add_rows(std::string_view rows) {
  pending_ += rows;
  pending_rows_ += rows.size() / frame_row_bytes();
}

// The rows are written first, and then the numbers that say that they are there.
void FrameTable::flush() {
  if (is_removed(descriptor_, file_)) {
    throw Error(Fault::device, file_ + ": was removed while it was written; its frames are lost");
  }
  if (pending_.empty()) return;
  reserve(pending_.size());
  try {
    write_at(pending_, end_);
  } catch (const Error&) {
    // A line of text that is cut off would be read as a frame.
    if (format_ == TableFormat::csv && ::ftruncate(descriptor_, static_cast<off_t>(end_)) != 0) {
      errno = 0;
    }
    throw;
  }
  if (format_ == TableFormat::hdf5) say_rows(rows_ + pending_rows_);
  end_ += pending_.size();
  rows_ += std::exchange(pending_rows_, 0);
  pending_.clear();
}

void FrameTable::say_rows(std::uint64_t rows) const {
  const auto write_field = [&](const TableHead::Field& field) {
    write_at(little_endian(field.value(rows)), field.at);
  };
  if (rows_ == 0) {
    write_field(head_.fields.front());
    const TableHead::Piece piece = head_.of_rows(rows);
    write_at(piece.bytes, piece.at);
  } else {
    for (const TableHead::Field& field : head_.fields) write_field(field);
  }
}

std::uint64_t FrameTable::give_up() {
  pending_.clear();
  const std::uint64_t written = is_removed(descriptor_, file_) ? std::exchange(rows_, 0) : 0;
  return written + std::exchange(pending_rows_, 0);
}

void FrameTable::write_checksum(const std::string& sha256) {
  if (format_ == TableFormat::csv) {
    write_facts(sha256);
  } else {
    write_at(sha256.substr(0, TableHead::checksum_bytes), head_.checksum_at);
  }
}

// Writes the file of facts beside a table of text; a table in HDF5 holds the facts itself.
void FrameTable::write_facts(const std::string& sha256) const {
  if (format_ != TableFormat::csv) return;
  JsonWriter json;
  json.text("schema", "splid.table").text("program", facts_.program);
  json.text("recording", facts_.recording).text("recording_sha256", sha256);
  json.raw("configuration", facts_.config_json).raw("pattern", facts_.pattern_json);
  write_file(facts_file_of(file_), json.finish() + "\n");
}

void FrameTable::write_at(const std::string& bytes, std::uint64_t offset) const {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = ::pwrite(descriptor_, bytes.data() + done, bytes.size() - done,
                                   static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      throw Error(Fault::device, file_ + ": " + std::strerror(errno) + " after " +
                                     std::to_string(rows_) +
                                     " frames; these can be read. Make room or give another place");
    }
    done += static_cast<std::size_t>(count);
  }
}

}  // namespace splid::recording
