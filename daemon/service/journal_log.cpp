#include "daemon/service/journal_log.hpp"

#include <spdlog/details/log_msg.h>
#include <sys/stat.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <array>
#include <cstdlib>

namespace splid {
namespace {

// In the order of spdlog's levels: trace, debug, info, warning, error, critical, off.
constexpr std::array<const char*, 7> prefixes = {SD_DEBUG, SD_DEBUG, SD_INFO, SD_WARNING,
                                                 SD_ERR,   SD_CRIT,  SD_INFO};

// Calls put(line) for each, without its line feed.
template <class Put>
void each_line(std::string_view text, const Put& put) {
  for (;;) {
    const std::size_t end = text.find('\n');
    put(text.substr(0, end));
    if (end == std::string_view::npos) return;
    text.remove_prefix(end + 1);
    if (text.empty()) return;
  }
}

class JournalFormatter final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override {
    const auto append = [&out](std::string_view text) {
      out.append(text.data(), text.data() + text.size());
    };
    const auto level = spdlog::level::to_string_view(message.level);
    const std::string_view prefix = prefixes.at(static_cast<std::size_t>(message.level));
    std::string head = std::string(level.data(), level.size()) + ": ";
    each_line({message.payload.data(), message.payload.size()}, [&](std::string_view line) {
      append(prefix);
      append(head);
      append(line);
      append("\n");
      head.clear();
    });
  }
  [[nodiscard]] std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JournalFormatter>();
  }
};

}  // namespace

bool stderr_is_journal() {
  const char* named = std::getenv("JOURNAL_STREAM");
  struct stat found {};
  if (named == nullptr || ::fstat(STDERR_FILENO, &found) != 0) return false;
  return named == std::to_string(found.st_dev) + ":" + std::to_string(found.st_ino);
}

std::unique_ptr<spdlog::formatter> journal_formatter() {
  return std::make_unique<JournalFormatter>();
}

std::string error_lines(std::string_view text, bool for_journal) {
  if (!for_journal) return std::string(text);
  std::string lines;
  each_line(text, [&](std::string_view line) { lines.append(SD_ERR).append(line).append("\n"); });
  return lines;
}

}  // namespace splid
