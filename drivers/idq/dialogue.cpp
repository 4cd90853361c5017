#include "drivers/idq/dialogue.hpp"

#include <utility>

namespace splid::idq {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

Dialogue::Dialogue(std::unique_ptr<MessageSocket> socket, std::string whose)
    : socket_(std::move(socket)), whose_(std::move(whose)) {}

void Dialogue::send(const std::string& question, milliseconds patience) {
  socket_->send(question);
  question_ = question;
  due_ = steady_clock::now() + patience;
}

std::optional<std::string> Dialogue::answer() { return answer(milliseconds{0}); }

std::optional<std::string> Dialogue::answer(milliseconds wait) {
  std::optional<std::string> message = socket_->receive(wait);
  if (message) {
    question_.clear();
  } else if (steady_clock::now() > due_) {
    throw NoAnswer(whose_ + " does not answer (" + question_ + ")");
  }
  return message;
}

bool Dialogue::finish(milliseconds patience) {
  if (is_waiting() && !socket_->receive(patience)) return false;
  question_.clear();
  return true;
}

std::string Dialogue::ask(const std::string& question, const std::function<void()>& idle,
                          milliseconds patience) {
  constexpr milliseconds between_signs{10};
  send(question, patience);
  while (true) {
    if (std::optional<std::string> message = answer(between_signs)) return *std::move(message);
    idle();
  }
}

}  // namespace splid::idq
