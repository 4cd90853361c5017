#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "drivers/message_socket.hpp"

namespace splid::idq {

// A question was not answered in time.
class NoAnswer : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Asks one question after another over one connection.
//
// Threads: one. Errors: NoAnswer.
class Dialogue {
 public:
  static constexpr std::chrono::milliseconds usual_patience{1000};

  // whose: who answers, in words that begin a sentence.
  Dialogue(std::unique_ptr<MessageSocket> socket, std::string whose);

  [[nodiscard]] const std::string& whose() const { return whose_; }
  [[nodiscard]] bool is_waiting() const { return !question_.empty(); }
  // Only where no answer is waited for.
  void send(const std::string& question, std::chrono::milliseconds patience = usual_patience);
  // The answer; absent while there is none.
  std::optional<std::string> answer();
  // Waits for an answer that is due, and forgets it. False where it does not come in time.
  bool finish(std::chrono::milliseconds patience);
  // Waits for the answer. idle: called every 10 ms.
  std::string ask(const std::string& question, const std::function<void()>& idle,
                  std::chrono::milliseconds patience = usual_patience);

 private:
  std::optional<std::string> answer(std::chrono::milliseconds wait);

  std::unique_ptr<MessageSocket> socket_;
  std::string whose_;
  std::string question_;  // that waits for its answer
  std::chrono::steady_clock::time_point due_;
};

}  // namespace splid::idq
