#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

namespace splid {

// Says who was refused without letting them fill the log: the first few of a minute in a sentence
// each, how many more there were at the minute's end. That is at most six lines a minute, 1 MB a
// day.
//
// Threads: one.
class RefusalLog {
 public:
  static constexpr int sentences_a_minute = 5;
  static constexpr std::int64_t minute_ns = 60'000'000'000;

  // notice: takes a sentence.
  explicit RefusalLog(std::function<void(const std::string&)> notice)
      : notice_(std::move(notice)) {}

  // now_ns: of a clock that does not step back.
  void refused(const std::string& sentence, std::int64_t now_ns) {
    tick(now_ns);
    if (said_ == 0) begin_ns_ = now_ns;
    if (said_ == sentences_a_minute) {
      ++unsaid_;
      last_ = sentence;
      return;
    }
    ++said_;
    notice_(sentence);
  }

  // To be called once a second or so.
  void tick(std::int64_t now_ns) {
    if (said_ == 0 || now_ns - begin_ns_ < minute_ns) return;
    if (unsaid_ > 0) {
      notice_(std::to_string(unsaid_) + " more refusals within a minute, the last: " + last_);
    }
    said_ = 0;
    unsaid_ = 0;
  }

 private:
  std::function<void(const std::string&)> notice_;
  std::int64_t begin_ns_ = 0;  // of the minute, while said_ > 0
  int said_ = 0;
  std::uint64_t unsaid_ = 0;
  std::string last_;
};

}  // namespace splid
