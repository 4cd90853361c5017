#include "daemon/output/metrics_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "daemon/base/write_file.hpp"

namespace splid {
namespace {

// The collector runs as another user, and the service's umask hides new files from it.
constexpr mode_t readable_by_all = 0644;

// errno of what failed; 0: nothing.
int write_and_sync(const std::string& path, const std::string& text) {
  const int how = O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW;
  const int file = ::open(path.c_str(), how, readable_by_all);
  if (file < 0) return errno;
  const bool done = ::fchmod(file, readable_by_all) == 0 && write_all(file, text);
  const int fault = done ? 0 : errno;
  // Some file systems say only now that they are full.
  return ::close(file) != 0 && fault == 0 ? errno : fault;
}

}  // namespace

MetricsFile::MetricsFile(std::string path, std::function<void(const std::string&)> notice)
    : path_(std::move(path)), temporary_(path_ + ".tmp"), notice_(std::move(notice)) {}

void MetricsFile::write(const std::string& text) {
  int fault = write_and_sync(temporary_, text);
  if (fault == 0 && std::rename(temporary_.c_str(), path_.c_str()) != 0) fault = errno;
  if (fault != 0) ::unlink(temporary_.c_str());
  const bool failed_before = std::exchange(failing_, fault != 0);
  if (failing_ == failed_before) return;
  notice_("metrics.file " + path_ +
          (fault == 0 ? ": is written again"
                      : ": cannot be written: " + std::generic_category().message(fault) +
                            "; tried again every second"));
}

}  // namespace splid
