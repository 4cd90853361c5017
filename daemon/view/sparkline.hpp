#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace splid::view {

// What characters a terminal can show.
enum class Characters { ascii, utf8 };

// The last minutes of one value, and a row of characters that shows them. Each column is the mean
// over one second of the messages' own time; a second without a value stays blank.
//
// Threads: one. Errors: none.
class Sparkline {
 public:
  // As wide as the widest terminals; what is older is forgotten.
  static constexpr std::int64_t kept_s = 500;

  // value: absent where the frame has none. A time more than a minute before the last time begins
  // anew, as another replay does.
  void add(double timestamp_s, const std::optional<double>& value);

  // The newest `columns` seconds, the last second at the right. Always `columns` characters wide.
  [[nodiscard]] std::string draw(std::size_t columns, Characters characters) const;

  struct Range {
    double low = 0, high = 0;
  };
  // Of the means that draw() shows; absent where it shows none.
  [[nodiscard]] std::optional<Range> range(std::size_t columns) const;

 private:
  struct Mean {
    double sum = 0;
    std::uint64_t count = 0;
    [[nodiscard]] double value() const { return sum / static_cast<double>(count); }
  };
  [[nodiscard]] std::int64_t first_of(std::size_t columns) const;

  std::map<std::int64_t, Mean> seconds_;  // by the second since 1970; those with a value alone
  std::int64_t last_ = 0;
};

}  // namespace splid::view
