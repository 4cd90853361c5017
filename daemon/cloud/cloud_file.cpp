#include "daemon/cloud/cloud_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "protocol/error.hpp"

namespace splid::cloud {
namespace {

constexpr std::size_t waiting_bytes = std::size_t{1} << 20;
constexpr std::size_t most_point_bytes = 512;

}  // namespace

File::File(std::string file, std::unique_ptr<Encoding> encoding)
    : file_(std::move(file)), part_(file_ + ".part"), encoding_(std::move(encoding)) {
  waiting_.reserve(waiting_bytes + most_point_bytes);
  descriptor_ = ::open(part_.c_str(), O_WRONLY | O_CLOEXEC | O_CREAT | O_TRUNC, 0666);
  if (descriptor_ == -1) fail();
  waiting_ += encoding_->head(summary_);
}

File::~File() {
  if (descriptor_ == -1) return;
  ::close(descriptor_);
  ::unlink(part_.c_str());
}

void File::add(const Point& point) {
  summary_.add(point);
  encoding_->append(point, summary_, waiting_);
  if (waiting_.size() >= waiting_bytes) flush();
}

void File::finish() {
  flush();
  write_at(encoding_->head(summary_), 0);
  if (::close(std::exchange(descriptor_, -1)) != 0 ||
      std::rename(part_.c_str(), file_.c_str()) != 0) {
    const int why = errno;
    ::unlink(part_.c_str());
    errno = why;
    fail();
  }
}

void File::flush() {
  write_at(waiting_, end_);
  end_ += waiting_.size();
  waiting_.clear();
}

void File::write_at(const std::string& bytes, std::uint64_t offset) const {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = ::pwrite(descriptor_, bytes.data() + done, bytes.size() - done,
                                   static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail();
    done += static_cast<std::size_t>(count);
  }
}

void File::fail() const {
  throw Error(Fault::device, file_ + ": cannot be written: " + std::strerror(errno) +
                                 "; make room, or name another file");
}

}  // namespace splid::cloud
