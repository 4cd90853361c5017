#pragma once

#include <sys/socket.h>

#include <algorithm>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/tcp_peer.hpp"

namespace splid::test {

// What is wrong with an instrument; all empty: nothing. Commands are named by how they begin.
struct ScpiFaults {
  std::string silent_at;   // says nothing more from this command on
  std::string garbage_at;  // answers this query with `garbage`
  std::string garbage = "\x80#3\xff,?\n";
  std::string cut_at;    // closes the connection when this command has begun
  std::string error_at;  // puts error_code into the queue and does nothing
  int error_code = -241;
  std::string ignored;          // says nothing and does nothing
  bool endless_errors = false;  // the queue never gets empty
};

// The SCPI side of an instrument on a TCP port: takes lines and blocks apart however they come in
// parts, has an error queue, and hands each command to the function that stands for it.
//
// Threads: a thread of its own serves; what it calls and what others call excludes one another.
class ScpiServer {
 public:
  explicit ScpiServer(ScpiFaults faults)
      : faults_(std::move(faults)),
        peer_([this](const TcpPeer& peer, int socket) { serve(peer, socket); }) {
    const std::lock_guard lock(mutex_);
    queries["*OPC?"] = [](const Arguments&) { return std::string("1"); };
    queries[":SYST:ERR?"] = [this](const Arguments&) { return next_error(); };
    commands["*CLS"] = [this](const Arguments&) { errors_.clear(); };
  }

  [[nodiscard]] std::string address() const { return peer_.address(); }

  [[nodiscard]] std::size_t errors() {
    const std::lock_guard lock(mutex_);
    return errors_.size();
  }
  // All lines so far, blocks left out.
  [[nodiscard]] std::vector<std::string> heard() {
    const std::lock_guard lock(mutex_);
    return heard_;
  }

  // Puts an error into the queue.
  void fail(int code, const std::string& what) {
    errors_.push_back(std::to_string(code) + ",\"" + what + "\"");
  }
  // Held while a command is carried out.
  [[nodiscard]] std::lock_guard<std::mutex> lock() { return std::lock_guard(mutex_); }

  using Arguments = std::vector<std::string>;  // three at least
  // By name; to be filled while locked.
  std::map<std::string, std::function<void(const Arguments&)>> commands;
  std::map<std::string, std::function<std::string(const Arguments&)>> queries;

 private:
  void serve(const TcpPeer& peer, int socket) {
    std::string waiting;
    // Small pieces, so that lines and blocks come in parts.
    std::vector<char> room(1'000);
    while (peer.readable(socket)) {
      const ssize_t got = recv(socket, room.data(), room.size(), 0);
      if (got <= 0) return;
      waiting.append(room.data(), static_cast<std::size_t>(got));
      const std::lock_guard lock(mutex_);
      if (begins(waiting, faults_.cut_at)) return;
      while (const std::size_t size = message_bytes(waiting)) {
        const std::string answer = handle(waiting.substr(0, size - 1));
        waiting.erase(0, size);
        send(socket, answer.data(), answer.size(), MSG_NOSIGNAL);
      }
    }
  }

  static bool begins(const std::string& text, const std::string& how) {
    return !how.empty() && text.starts_with(how);
  }

  // The length of the first message, up to its line feed; a byte of a block that looks like a line
  // feed does not end it. 0: the message has not come whole yet.
  static std::size_t message_bytes(const std::string& text) {
    const std::size_t hash = text.find('#');
    std::size_t from = 0;
    if (hash < text.find('\n')) {
      if (hash + 2 > text.size()) return 0;
      const auto digits = static_cast<std::size_t>(text[hash + 1] - '0');
      if (hash + 2 + digits > text.size()) return 0;
      from = hash + 2 + digits + std::stoul(text.substr(hash + 2, digits));
      if (from > text.size()) return 0;
    }
    const std::size_t end = text.find('\n', from);
    return end == std::string::npos ? 0 : end + 1;
  }

  std::string handle(const std::string& message) {
    heard_.push_back(message.substr(0, message.find('#')));
    silent_ = silent_ || begins(message, faults_.silent_at);
    if (silent_ || begins(message, faults_.ignored)) return "";
    if (begins(message, faults_.garbage_at)) return faults_.garbage;
    if (begins(message, faults_.error_at)) {
      fail(faults_.error_code, "Hardware missing; nothing there");
      return "";
    }
    if (message.find('#') != std::string::npos) return one(message);
    std::string answer;
    for (std::size_t begin = 0; begin < message.size();) {
      const std::size_t end = std::min(message.find(";:", begin), message.size());
      answer += one(message.substr(begin, end - begin));
      begin = end + 1;
    }
    return answer;
  }

  std::string one(const std::string& command) {
    const std::size_t space = std::min(command.find(' '), command.size());
    const std::string header = command.substr(0, space);
    const auto query = queries.find(header);
    if (query != queries.end()) return query->second(arguments(command, space)) + "\n";
    const auto known = commands.find(header);
    if (known == commands.end()) {
      fail(-113, "Undefined header;" + header);
      return "";
    }
    known->second(arguments(command, space));
    return "";
  }

  // The arguments of a command, cut at the commas. An argument that begins with # is a block.
  static Arguments arguments(const std::string& command, std::size_t space) {
    Arguments all;
    for (std::size_t begin = space + 1; begin < command.size();) {
      const bool is_block = command[begin] == '#';
      const std::size_t end =
          is_block ? command.size() : std::min(command.find(',', begin), command.size());
      all.push_back(command.substr(begin, end - begin));
      begin = end + 1;
    }
    all.resize(std::max<std::size_t>(all.size(), 3));
    return all;
  }

  std::string next_error() {
    if (faults_.endless_errors) return "-350,\"Queue overflow\"";
    if (errors_.empty()) return "0,\"No error\"";
    const std::string first = errors_.front();
    errors_.pop_front();
    return first;
  }

  ScpiFaults faults_;
  std::mutex mutex_;
  std::deque<std::string> errors_;
  std::vector<std::string> heard_;
  bool silent_ = false;
  TcpPeer peer_;  // last: its thread ends before all else
};

}  // namespace splid::test
