#include "drivers/awg/scpi_client.hpp"

#include <array>
#include <span>
#include <utility>

#include "protocol/error.hpp"

namespace splid::awg {
namespace {

constexpr std::size_t max_line_bytes = 4'096;
// The most errors that are read. Instruments' queues hold some tens.
constexpr int max_errors = 100;
// How long a look at the socket lasts; between two looks the stop token is asked.
constexpr std::chrono::milliseconds slice{50};

}  // namespace

ScpiClient::ScpiClient(const std::string& address, std::chrono::milliseconds timeout,
                       std::stop_token stop)
    : socket_(address), timeout_(timeout), stop_(std::move(stop)) {
  if (socket_.connect(stop_)) return;
  if (stop_.stop_requested()) throw_stopped();
  throw Error(Fault::device, "awg " + socket_.failure() +
                                 "; is the generator on, and is its SCPI socket at this port?");
}

void ScpiClient::command(const std::string& text) {
  begin(text);
  send(text + "\n");
  finish(text);
}

void ScpiClient::command(const std::string& text, std::string_view block) {
  begin(text);
  send(text + scpi_block_head(block.size()));
  send(block);
  send("\n");
  finish(text);
}

// Begins what has `timeout` to be over: sending a command, or a query and its whole answer.
void ScpiClient::begin(const std::string& doing) {
  doing_ = doing;
  since_ = std::chrono::steady_clock::now();
}

void ScpiClient::send(std::string_view bytes) {
  while (!bytes.empty()) {
    check_waiting();
    bytes.remove_prefix(socket_.write(bytes, slice));
  }
}

void ScpiClient::receive() {
  std::array<char, 16'384> room{};
  taken_ = 0;
  received_.clear();
  while (received_.empty()) {
    check_waiting();
    received_.assign(room.data(), socket_.read(std::as_writable_bytes(std::span(room)), slice));
  }
}

// Throws where there is nothing more to wait for.
void ScpiClient::check_waiting() {
  if (stop_.stop_requested()) throw_stopped();
  if (!socket_.is_open()) {
    throw Error(Fault::device, "awg " + socket_.failure() + ", at " + shown_scpi(doing_));
  }
  if (std::chrono::steady_clock::now() - since_ < timeout_) return;
  throw Error(Fault::device, "awg " + socket_.address() + ": " + shown_scpi(doing_) +
                                 ": not done after " + std::to_string(timeout_.count()) +
                                 " ms (awg.timeout_s); is another program using it?");
}

void ScpiClient::throw_stopped() const {
  const std::string where = doing_.empty() ? "" : ": " + shown_scpi(doing_);
  throw Error(Fault::usage, "awg " + socket_.address() + where + ": stopped; upload again");
}

void ScpiClient::finish(const std::string& text) {
  if (number(text + ", then *OPC?", "*OPC?") != 1) fail(text, "*OPC? was not answered by 1");
  check_errors(text);
}

void ScpiClient::check_errors(const std::string& text) {
  std::string found;
  begin(text + ", then :SYST:ERR?");
  for (int count = 0; count < max_errors; ++count) {
    send(":SYST:ERR?\n");
    const std::string line = read_line(":SYST:ERR?", max_line_bytes);
    const auto error = parse_scpi_error(line);
    if (!error) fail(":SYST:ERR?", "answered \"" + shown_scpi(line) + "\"");
    if (error->code == 0) {
      if (found.empty()) return;
      fail(text, found);
    }
    found +=
        (found.empty() ? "" : "; ") + std::to_string(error->code) + ", " + shown_scpi(error->text);
  }
  fail(text, "its error queue does not end: " + shown_scpi(found));
}

std::string ScpiClient::ask(const std::string& query) { return exchange(query, query); }

double ScpiClient::ask_number(const std::string& query) { return number(query, query); }

std::string ScpiClient::exchange(const std::string& doing, const std::string& query) {
  begin(doing);
  send(query + "\n");
  return read_line(query, max_line_bytes);
}

double ScpiClient::number(const std::string& doing, const std::string& query) {
  const std::string line = exchange(doing, query);
  const auto number = parse_scpi_number(line);
  if (!number) fail(query, "answered \"" + shown_scpi(line) + "\", which is no number");
  return *number;
}

ScpiClient::Data ScpiClient::ask_data(const std::string& query, std::size_t max_bytes) {
  begin(query);
  send(query + "\n");
  const char first = next_byte();
  --taken_;
  if (first == '#') return {true, read_block(query, max_bytes)};
  return {false, read_line(query, max_bytes)};
}

char ScpiClient::next_byte() {
  if (taken_ == received_.size()) receive();
  return received_[taken_++];
}

std::string ScpiClient::read_line(const std::string& query, std::size_t max_bytes) {
  std::string line;
  for (char byte = next_byte(); byte != '\n'; byte = next_byte()) {
    line += byte;
    if (line.size() > max_bytes)
      fail(query, "answered more than " + std::to_string(max_bytes) + " bytes");
  }
  return line;
}

std::string ScpiClient::read_block(const std::string& query, std::size_t max_bytes) {
  std::string head = {next_byte(), next_byte()};
  const int digits = head[1] - '0';
  for (int i = 0; i < digits && digits <= 9; ++i) head += next_byte();
  const auto parsed = parse_scpi_block_head(head);
  if (!parsed) fail(query, "answered a block that begins \"" + shown_scpi(head) + "\"");
  if (parsed->content_bytes > max_bytes) {
    fail(query, "answered a block of " + std::to_string(parsed->content_bytes) +
                    " bytes; at most " + std::to_string(max_bytes) + " were asked for");
  }
  std::string content;
  while (content.size() < parsed->content_bytes) content += next_byte();
  read_line(query, 2);  // the end of the message
  return content;
}

void ScpiClient::fail(const std::string& command, const std::string& what) const {
  throw Error(Fault::device, "awg " + socket_.address() + ": " + shown_scpi(command) + ": " + what);
}

}  // namespace splid::awg
