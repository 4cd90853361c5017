#pragma once

#include <chrono>
#include <cstddef>
#include <stop_token>
#include <string>
#include <string_view>

#include "drivers/awg/scpi_reply.hpp"
#include "drivers/client_socket.hpp"

namespace splid::awg {

// Speaks SCPI with an instrument on a raw socket: lines go out, lines or blocks of definite length
// come back. A command counts as done only when the instrument has said so and its error queue is
// empty.
//
// Threads: one; a stop may be requested from any thread. Errors: Error(Fault::device) naming the
// address, the command, and the instrument's own words or the reason why no answer came;
// Error(Fault::usage) where a stop was requested. Timeouts: connecting takes at most a second; to
// send a command, to answer a query and to empty the error queue takes at most `timeout` each,
// however slowly bytes move; a stop ends each wait within 50 ms.
class ScpiClient {
 public:
  // Connects. address: "tcp:HOST:PORT".
  ScpiClient(const std::string& address, std::chrono::milliseconds timeout, std::stop_token stop);

  // Sends a line, waits until it is done (*OPC?) and reads the error queue until it is empty.
  void command(const std::string& text);
  // Does the same with a line that ends in a block.
  void command(const std::string& text, std::string_view block);

  // Sends a query and returns the answer, a line without its line feed.
  std::string ask(const std::string& query);
  double ask_number(const std::string& query);

  // What a data query answers: the content of a block, or a line.
  struct Data {
    bool is_block = false;
    std::string content;
  };
  Data ask_data(const std::string& query, std::size_t max_bytes);

  // Throws an error about a command or query and what the instrument answered to it.
  [[noreturn]] void fail(const std::string& command, const std::string& what) const;

 private:
  std::string exchange(const std::string& doing, const std::string& query);
  double number(const std::string& doing, const std::string& query);
  void begin(const std::string& doing);
  void send(std::string_view bytes);
  void receive();
  void check_waiting();
  [[noreturn]] void throw_stopped() const;
  void finish(const std::string& text);
  void check_errors(const std::string& text);
  char next_byte();
  std::string read_line(const std::string& query, std::size_t max_bytes);
  std::string read_block(const std::string& query, std::size_t max_bytes);

  ClientSocket socket_;
  std::chrono::milliseconds timeout_;
  std::stop_token stop_;
  std::string doing_;  // the command or query that waits for its answer, for errors
  std::chrono::steady_clock::time_point since_;  // when it was begun
  std::string received_;                         // what came and is kept until it is taken
  std::size_t taken_ = 0;                        // bytes of received_ that were taken
};

}  // namespace splid::awg
