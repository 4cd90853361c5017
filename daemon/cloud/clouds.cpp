#include "daemon/cloud/clouds.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <cstddef>
#include <utility>

#include "daemon/base/write_file.hpp"

namespace splid::cloud {

std::string name_of_frame(const std::string& name, std::uint64_t frame, double time_s) {
  std::string made;
  for (std::size_t i = 0; i < name.size();) {
    std::size_t end = i + 1;
    while (end < name.size() && std::isdigit(static_cast<unsigned char>(name[end])) != 0) ++end;
    const std::string digits = name.substr(i + 1, end - i - 1);
    const char kind = name[i] == '%' && end < name.size() ? name[end] : '\0';
    if (kind == 't' && digits.empty()) {
      made += std::to_string(std::llround(time_s * 1e6));
    } else if (kind == 'd' && digits.size() <= 2) {
      made += fmt::format("{:0{}}", frame, digits.empty() ? 1 : std::stoi(digits));
    } else {
      made += name[i++];
      continue;
    }
    i = end + 1;
  }
  return made;
}

Clouds::Clouds(FormatOptions options, bool overwrite)
    : options_(std::move(options)),
      overwrite_(overwrite),
      are_many_(name_of_frame(options_.file, 0, 0) != options_.file) {
  if (!are_many_) {
    open(options_.file);
    return;
  }
  (void)make_encoding(options_);
  check_folder_of(options_.file);
}

void Clouds::open(const std::string& name) {
  check_may_write(name, overwrite_);
  file_.emplace(name, make_encoding(options_));
}

void Clouds::add(const Point& point, std::uint64_t frame) {
  if (are_many_ && (!file_ || frame != frame_)) {
    finish();
    open(name_of_frame(options_.file, frame, point.time_s));
    frame_ = frame;
  }
  file_->add(point);
  ++points_;
}

void Clouds::finish() {
  if (!file_) return;
  file_->finish();
  file_.reset();
  ++files_;
}

}  // namespace splid::cloud
