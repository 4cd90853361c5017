#include "daemon/recording/photon_hdf5_reader.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>
#include <utility>

#include "daemon/base/file_descriptor.hpp"
#include "daemon/base/start_process.hpp"
#include "protocol/error.hpp"

namespace splid::recording {
namespace {

using std::chrono::steady_clock;

// A block of 65,536 photons takes 20 ms. A library that is silent for so long hangs.
constexpr std::chrono::seconds most_silence{60};
constexpr int look_again_ms = 100;

// As large as the largest block of tags, so that a damaged head takes no memory.
constexpr std::uint32_t most_part_bytes = 1 << 23;

[[noreturn]] void cannot_start(const std::string& file, const std::string& why) {
  throw Error(Fault::device, file + ": no process can be started to read it: " + why);
}

}  // namespace

bool begins_as_hdf5(const std::string& file) {
  constexpr std::string_view mark = "\x89HDF\r\n\x1a\n";
  std::string start(mark.size(), '\0');
  std::ifstream(file, std::ios::binary).read(start.data(), std::ssize(start));
  return start == mark;
}

PhotonHdf5Reader::PhotonHdf5Reader(std::string file, Warn warn, std::stop_token stop)
    : file_(std::move(file)), warn_(std::move(warn)), stop_(std::move(stop)) {
  start();
  try {
    next_part();
  } catch (...) {
    end_process();
    throw;
  }
}

PhotonHdf5Reader::~PhotonHdf5Reader() { end_process(); }

void PhotonHdf5Reader::start() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) cannot_start(file_, std::strerror(errno));
  descriptor_ = ends[0];
  const FileDescriptor writes(ends[1]);
  ProcessStart start;
  start.program = "/proc/self/exe";
  // Two dashes, since the file's name may look like an option.
  start.arguments = {"splid", "read-photon-hdf5", "--", file_};
  start.output = writes.get();
  try {
    process_ = start_process(start);
  } catch (const std::system_error& error) {
    end_process();
    cannot_start(file_, error.what());
  }
}

bool PhotonHdf5Reader::read_all(std::span<std::byte> to) {
  auto heard = steady_clock::now();
  while (!to.empty()) {
    if (stop_.stop_requested()) return false;
    pollfd ready{descriptor_, POLLIN, 0};
    if (::poll(&ready, 1, look_again_ms) > 0) {
      const ssize_t got = ::read(descriptor_, to.data(), to.size());
      if (got == 0) say_how_it_ended();
      if (got < 0) continue;
      to = to.subspan(static_cast<std::size_t>(got));
      heard = steady_clock::now();
    } else if (steady_clock::now() - heard > most_silence) {
      throw Error(Fault::data, file_ + ": the HDF5 library has read for a minute after photon " +
                                   std::to_string(photons_) +
                                   " without a result: the file is damaged");
    }
  }
  return true;
}

void PhotonHdf5Reader::next_part() {
  PhotonHdf5PartHead head;
  while (!ended_ && taken_ == tags_.size()) {
    if (!read_all(std::as_writable_bytes(std::span(&head, 1)))) {
      ended_ = true;
      return;
    }
    if (head.bytes > most_part_bytes) say_how_it_ended();
    if (head.part == PhotonHdf5Part::tags) {
      tags_.resize(head.bytes / sizeof(Tag));
      taken_ = 0;
      ended_ = !read_all(std::as_writable_bytes(std::span(tags_)));
      if (ended_) taken_ = tags_.size();
      continue;
    }
    std::string text(head.bytes, '\0');
    if (!read_all(std::as_writable_bytes(std::span(text)))) {
      ended_ = true;
      return;
    }
    switch (head.part) {
      case PhotonHdf5Part::header:
        header_ = photon_hdf5_header_from_json(text);
        return;
      case PhotonHdf5Part::warning:
        warn_(text);
        break;
      case PhotonHdf5Part::error:
        throw Error(Fault::data, text);
      default:
        ended_ = true;
    }
  }
}

std::size_t PhotonHdf5Reader::read(std::span<Tag> out) {
  next_part();
  const std::size_t count = std::min(out.size(), tags_.size() - taken_);
  const auto some = std::span(tags_).subspan(taken_, count);
  std::copy(some.begin(), some.end(), out.begin());
  taken_ += count;
  photons_ += static_cast<std::uint64_t>(std::count_if(
      some.begin(), some.end(), [](const Tag& tag) { return tag.kind == TagKind::photon; }));
  if (count > 0) reached_ps_ = some.back().time_ps;
  return count;
}

void PhotonHdf5Reader::say_how_it_ended() {
  const int status = end_process();
  throw Error(
      Fault::data,
      file_ + ": the HDF5 library ended after photon " + std::to_string(photons_) +
          (WIFSIGNALED(status) ? std::string(", by ") + ::strsignal(WTERMSIG(status)) : "") +
          ": the file is damaged");
}

// Returns how the process ended: by itself, or by the signal that is sent to it here.
int PhotonHdf5Reader::end_process() {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
  if (process_ < 0) return 0;
  int status = 0;
  // A process whose end of the pipe is closed has ended, or is about to end.
  const auto until = steady_clock::now() + std::chrono::milliseconds{200};
  pid_t gone = 0;
  while ((gone = ::waitpid(process_, &status, WNOHANG)) == 0 && steady_clock::now() < until) {
    ::usleep(1000);
  }
  if (gone == 0) {
    ::kill(process_, SIGKILL);
    ::waitpid(process_, &status, 0);
  }
  process_ = -1;
  return status;
}

}  // namespace splid::recording
